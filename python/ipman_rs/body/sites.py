"""Points of a body that a caller defines: on its skin, inside it, or by the name of a joint."""

from __future__ import annotations

import dataclasses

FEWEST_POINTS = 6  # seen in an image or marked on the skin, without which a body is a guess


@dataclasses.dataclass(frozen=True)
class Site:
    """A point at a vertex of the skin, moved by `shift`, m in the frame of the resting mesh (`body.v_template`).

    `spread`: m, how well its place is known, the standard deviation over people.
    """

    vertex: int
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    spread: float = 0.01


@dataclasses.dataclass(frozen=True)
class Inner:
    """A point inside the body that moves with one joint: `place` (3,) m in the frame of the resting mesh, of the mean
    shape, and what each of the body's betas adds to it, `by_betas` (b, 3) m; `spread` as of a `Site`."""

    joint: str
    place: tuple[float, float, float]
    by_betas: tuple[tuple[float, float, float], ...]
    spread: float = 0.01


Point = Site | Inner | str  # a str: the name of a joint, or of a point of the skin
