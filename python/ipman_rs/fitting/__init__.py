"""Fitting bodies to photos, keypoints and markers, with intuitive physics: IPMAN-O, IPMAN-O* and faster ones."""

from __future__ import annotations

import warnings
from importlib import import_module
from types import ModuleType

_MOVED = {
    "detected": "ipman_rs.fitting.detection_problem",
    "keypoints": "ipman_rs.data.keypoints",
    "markers": "ipman_rs.data.markers",
}


def __getattr__(name: str) -> ModuleType:
    """Modules that were here before."""
    if name not in _MOVED:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warnings.warn(f"{__name__}.{name} is now {_MOVED[name]}", DeprecationWarning, stacklevel=2)
    return import_module(_MOVED[name])
