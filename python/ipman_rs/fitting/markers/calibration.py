"""Where the markers of one person really are: moved on the body to where its fits see them on average."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

import ipman_rs.torch as ipt

from ..landmarks import Landmarks, Site

FARTHEST = 0.05  # m: a marker that would have to move more was mixed up


def calibrated(
    body: ipt.BodyModel,
    sites: Mapping[str, Site | str],
    bodies: tuple[Tensor, Tensor, Tensor],
    points: Tensor,
    confidence: Tensor,
) -> dict[str, Site | str]:
    """The sites shifted, on the skin's own axes, by what remained on average over fits of one person.

    `bodies`: full pose (T, J, 3), betas (T, b) and transl (T, 3) of the fits; `points` (T, M, 3) m and `confidence`
    (T, M) as observed, in the order of the sites. Joints stay, as do markers that were never seen, and shifts end at
    5 cm. Few fits, or fits of a single pose, move the markers into the errors of pose and shape.
    """
    shifted = {f"{name} {axis}": _moved(site, axis) for name, site in sites.items() for axis in range(4)}
    with torch.no_grad():
        at = Landmarks(body, shifted, shifted)(*bodies).unflatten(1, (len(sites), 4))  # (T, M, 4, 3)
    start, turned = at[:, :, 0], (at[:, :, 1:] - at[:, :, :1]).mT  # columns: the resting mesh's axes, posed
    result = {}
    for column, (name, site) in enumerate(sites.items()):
        weight = confidence[:, column, None]
        if not isinstance(site, Site) or not (weight > 0).any():
            result[name] = site
            continue
        rest = torch.linalg.solve(turned[:, column], points[:, column] - start[:, column])
        move = (rest * weight).sum(0) / weight.sum()
        move = move * (FARTHEST / move.norm().clamp(min=FARTHEST))
        x, y, z = (torch.tensor(site.shift, dtype=move.dtype) + move.cpu()).tolist()
        result[name] = Site(site.vertex, (x, y, z))
    return result


def _moved(site: Site | str, axis: int) -> Site | str:
    """The site, for axis 1 to 3 moved by a metre along x, y or z of the resting mesh."""
    if isinstance(site, str) or axis == 0:
        return site
    x, y, z = (value + (axis == index) for index, value in enumerate(site.shift, 1))
    return Site(site.vertex, (x, y, z))
