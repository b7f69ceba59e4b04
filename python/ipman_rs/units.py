"""Bodies are in metres: the warning for those that do not look so."""

from __future__ import annotations

import math
import warnings


class UnitsWarning(UserWarning):
    """A body is too large or too small for metres."""


METRES_PER_UNIT = {"millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254, "kilometres": 1e3}
TYPICAL_SIZE = 1.7


def warn_odd_size(size: float, what: str) -> None:
    """Warns if `size`, the longest side of a body's bounding box, is not that of a person in metres."""
    if 0.2 <= size <= 10.0 or not math.isfinite(size) or size == 0.0:
        return

    def misfit(unit: str) -> float:
        return abs(math.log(size * METRES_PER_UNIT[unit] / TYPICAL_SIZE))

    unit = min(METRES_PER_UNIT, key=misfit)
    warnings.warn(
        f"{what} is {size:.4g} m across; is it in {unit}? Multiply the vertices by {METRES_PER_UNIT[unit]:g}",
        UnitsWarning,
        stacklevel=3,
    )
