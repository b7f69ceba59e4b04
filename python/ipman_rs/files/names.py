"""Names of files and folders."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path

Paths = str | os.PathLike[str] | Sequence[str | os.PathLike[str]]


def path_list(paths: Paths) -> list[Path]:
    """One path, or several, as a list."""
    return [Path(paths)] if isinstance(paths, (str, os.PathLike)) else [Path(path) for path in paths]


def safe_names(names: Sequence[str]) -> list[str]:
    """File names from any text: letters, digits, dot, dash and underscore, never hidden, never a path, never twice."""
    taken: set[str] = set()
    result = []
    for name in names:
        base = re.sub(r"[^\w.-]+", "_", name, flags=re.ASCII).strip("._-")[:80] or "body"
        candidate, number = base, 2
        while candidate.lower() in taken:
            candidate, number = f"{base}_{number}", number + 1
        taken.add(candidate.lower())
        result.append(candidate)
    return result
