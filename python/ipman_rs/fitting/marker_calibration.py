"""Calibration of marker places: each marker is moved on the body to its mean place over fits of one person."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import torch
from torch import Tensor

import ipman_rs.torch as ipt

from ..body.sites import Inner, Point
from ..data.markers.anatomy import RADIUS
from .landmarks import Landmarks

FARTHEST = 5  # spreads: a marker that would have to move more was mixed up
STEPS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))


def calibrate_sites(
    body: ipt.BodyModel,
    sites: Mapping[str, Point],
    bodies: tuple[Tensor, Tensor, Tensor],
    points: Tensor,
    confidence: Tensor,
) -> dict[str, Point]:
    """The sites shifted, on the skin's own axes, by what remained on average over fits of one person.

    `bodies`: full pose (T, J, 3), betas (T, b) and transl (T, 3) of the fits; `points` (T, M, 3) m and `confidence`
    (T, M) as observed, in the order of the sites. Joints stay, as do markers that were never seen, and shifts end at
    five spreads of the place. Few fits, or fits of a single pose, move the markers into the errors of pose and shape.
    """
    shifted = {f"{name} {axis}": _moved(site, by) for name, site in sites.items() for axis, by in enumerate(STEPS)}
    with torch.no_grad():
        at = Landmarks(body, shifted, shifted)(*bodies).unflatten(1, (len(sites), 4))  # (T, M, 4, 3)
    start, turned = at[:, :, 0], (at[:, :, 1:] - at[:, :, :1]).mT  # columns: the resting mesh's axes, posed
    result = {}
    for column, (name, site) in enumerate(sites.items()):
        weight = confidence[:, column, None]
        if isinstance(site, str) or not (weight > 0).any():
            result[name] = site
            continue
        rest = torch.linalg.solve(turned[:, column], points[:, column] - start[:, column])
        move = (rest * weight).sum(0) / weight.sum()
        farthest = FARTHEST * site.spread
        move = move * (farthest / move.norm().clamp(min=farthest))
        result[name] = _moved(site, move.tolist(), RADIUS)
    return result


def certainty(site: Point) -> float:
    """A marker's weight relative to one whose place on the body is known to within its radius: 1 / σ², at most 1."""
    return 1.0 if isinstance(site, str) else min(1.0, (RADIUS / site.spread) ** 2)


def _moved(site: Point, by: Sequence[float], spread: float | None = None) -> Point:
    """The site moved by these metres along the axes of the resting mesh; a joint stays."""
    if isinstance(site, str):
        return site
    if isinstance(site, Inner):
        x, y, z = (old + more for old, more in zip(site.place, by, strict=True))
        return replace(site, place=(x, y, z), spread=spread or site.spread)
    x, y, z = (old + more for old, more in zip(site.shift, by, strict=True))
    return replace(site, shift=(x, y, z), spread=spread or site.spread)
