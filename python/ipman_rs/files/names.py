"""Names of files and folders."""

from __future__ import annotations

import re
from collections.abc import Sequence


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
