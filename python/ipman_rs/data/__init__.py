"""Data sets of people with ground, cameras, forces or pressure, all read into one common form.

data = ipman_rs.data.open("human36m", "h36m_valid_protocol2.npz")    # only headers are read
frames = data[1000:1064]                                             # Frames: pose, betas, transl, joints, cameras ...
for frames in ipman_rs.data.pieces(data, 64): ...
"""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from .check import Finding, is_complete
from .frames import Cameras, DataSet, Frames, PressureMaps, pieces

__all__ = [
    "DATASETS",
    "Cameras",
    "DataSet",
    "Finding",
    "Frames",
    "PressureMaps",
    "check_download",
    "is_complete",
    "module",
    "open",
    "pieces",
]

DATASETS = {  # name -> module with NAME, open(path, split=None, **options) and check(path)
    "3dpw": "threedpw",
    "amass": "amass",
    "bedlam": "bedlam",
    "coco": "coco",
    "force-plates": "force_plates",
    "human36m": "human36m",
    "lsp": "lsp",
    "moyo": "moyo",
    "mpi-inf-3dhp": "mpi_inf_3dhp",
    "mpii": "mpii",
    "opensim": "opensim",
    "rendered": "rendered",
    "rich": "rich",
    "rich-ipman": "rich_ipman",
}


def module(name: str) -> ModuleType:
    """The module of a data set, whose docstring says which files it reads; ValueError for an unknown name."""
    if name not in DATASETS:
        raise ValueError(f"name: expected one of {', '.join(DATASETS)}, got {name!r}")
    return import_module(f".{DATASETS[name]}", __name__)


def open(name: str, path: str | os.PathLike[str], **options: Any) -> DataSet:
    """The data set of that name (see DATASETS) in the file or folder `path`; its module says which options it has.

    Raises ValueError naming the file, what was expected and what was found, also where units or axes cannot be right.
    """
    return module(name).open(path, **options)


def check_download(name: str, path: str | os.PathLike[str]) -> list[Finding]:
    """What is there, missing or wrong in a download, a file or a folder, of the data set of that name.

    A file that cannot be opened, or an extra that is not installed, is a finding. ValueError for an unknown name.
    """
    checked = module(name)
    try:
        return list(checked.check(Path(path)))
    except (ValueError, OSError, ImportError) as error:
        return [Finding("wrong", str(error))]
