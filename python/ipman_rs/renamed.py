"""Old names of packages and modules, which still work and warn."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def old_names(module: str, names: Mapping[str, str]) -> Callable[[str], Any]:
    """The `__getattr__` of a module in which names were changed, {old: new}; an old one gives a DeprecationWarning."""

    def __getattr__(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        warnings.warn(f"{module}.{name} is now {module}.{names[name]}", DeprecationWarning, stacklevel=2)
        return getattr(sys.modules[module], names[name])

    return __getattr__


def old_module(name: str, new: str) -> None:
    """Called by the module `name`: from now on the module `new` stands for it, with a DeprecationWarning."""
    warnings.warn(f"{name} is now {new}", DeprecationWarning, stacklevel=3)
    sys.modules[name] = import_module(new)
