"""Contact set, the nearest edge of its hull on the ground, and the signed margin (paper, section 3.2; Eq. 10).

The edge is a discrete choice, found by gift wrapping without a graph; the margin to it is plain differentiable algebra.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import torch
from torch import Tensor

from ..folding import fold, unfold
from ..ground import Ground
from .mass import center_of_mass, safe_norm
from .posed import Posed
from .topology import widest

RELEASED_MINIMUM = 10
"""The released code takes this many contacts or fewer for none."""

# Angles of gift wrapping closer than this are one direction; points closer than this part of the extent are one point.
SAME_ANGLE = 1e-12
SAME_POINT = 1e-13


def contact_mask(height: Tensor, threshold: float, contact: str) -> Tensor:
    """Which samples touch: heights (B, S) -> bool (B, S), |h| < τ ("paper") or h < τ and more than ten ("released")."""
    if contact == "paper":
        return height.abs() < threshold
    mask = height < threshold
    return mask & (mask.sum(dim=-1, keepdim=True) > RELEASED_MINIMUM)


def on_ground(points: Tensor, ground: Ground) -> Tensor:
    """Coordinates of points (B, N, 3) in the ground plane: (B, N, 2)."""
    return torch.stack([(points * axis.to(points)[..., None, :]).sum(dim=-1) for axis in ground.axes()], dim=-1)


def support_margin(
    body: Posed,
    ground: Ground,
    threshold: float = 0.1,
    method: str = "pcom",
    contact: str = "paper",
) -> Tensor:
    """Metres from the CoM to the hull's boundary, positive inside, −inf without contact: (B,)."""
    samples = body.samples
    mask = contact_mask(ground.signed_height(samples), threshold, contact)
    points = on_ground(samples, ground)
    target = on_ground(center_of_mass(body, method)[:, None], ground)[:, 0]

    edge = torch.ops.ipman_rs.nearest_edge(points.detach(), mask, target.detach())
    start, end = points.gather(-2, edge[..., None].expand(-1, -1, 2)).unbind(dim=-2)
    return torch.where(mask.any(dim=-1), signed_distance(start, end, target), -math.inf)


def signed_distance(start: Tensor, end: Tensor, target: Tensor) -> Tensor:
    """Distance (B,) of target to the segment start -> end (B, 2), positive on its left (the hull's inside)."""
    along, to_target = end - start, target - start
    length = safe_norm(along)
    divisor = torch.where(length > 0, length, 1)
    left = cross(along, to_target) / divisor
    fraction = ((along * to_target).sum(dim=-1) / divisor**2).clamp(0, 1)
    beyond = -safe_norm(to_target - fraction[..., None] * along)
    beside = (left > 0) | ((length > 0) & (fraction > 0) & (fraction < 1))
    return torch.where(beside, left, beyond)


def cross(a: Tensor, b: Tensor) -> Tensor:
    """z of the cross product of plane vectors (..., 2)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


class _Nearest(NamedTuple):
    """The best edge so far of each body: its end indices (B, 2) and whether, and how, it lies nearest."""

    edge: Tensor
    inside: Tensor
    distance: Tensor

    def improved_by(self, start: Tensor, end: Tensor, points: Tensor, target: Tensor) -> _Nearest:
        """The better of this and the edge start -> end (B,).

        Inside the hull every edge has the target strictly on its left, and the nearest line decides. Otherwise only the
        edges that see it from outside count, by the distance to the segment: a hull of no area is never "inside".
        """
        a, b = _at(points, start), _at(points, end)
        along, to_target = b - a, target - a
        squared = (along * along).sum(dim=-1)
        divisor = torch.where(squared > 0, squared, 1)
        left = cross(along, to_target) / divisor.sqrt()
        fraction = ((along * to_target).sum(dim=-1) / divisor).clamp(0, 1)
        distance = (to_target - fraction[..., None] * along).square().sum(dim=-1).sqrt()

        inside = left > 0
        better = torch.where(self.inside, ~inside | (left < self.distance), ~inside & (distance < self.distance))
        return _Nearest(
            edge=torch.where(better[:, None], torch.stack([start, end], dim=-1), self.edge),
            inside=self.inside & inside,
            distance=torch.where(better, torch.where(inside, left, distance), self.distance),
        )


def nearest_edge(points: Tensor, mask: Tensor, target: Tensor) -> Tensor:
    """Indices (B, 2) of the hull edge nearest to target (B, 2), counter-clockwise; points (B, S, 2), mask bool (B, S).

    Equal indices where the hull is a single point, 0 where no point is masked in.
    """
    batch = len(points)
    most = int(mask.sum(dim=-1).max()) if batch else 0
    if most == 0:
        return torch.zeros(batch, 2, dtype=torch.int64, device=points.device)
    chosen = torch.argsort((~mask).to(torch.uint8), dim=-1, stable=True)[:, :most]
    chosen = torch.where(mask.gather(-1, chosen), chosen, chosen[:, :1])  # pad with copies of the first contact
    dtype = widest(points.device)
    nearest = _wrap(points.gather(-2, chosen[..., None].expand(-1, -1, 2)).to(dtype), target.to(dtype))
    return chosen.gather(-1, nearest)


def _wrap(points: Tensor, target: Tensor) -> Tensor:
    """Gift wrapping: from the lowest, leftmost point always to the point with the smallest left turn."""
    lowest = points[..., 1] == points[..., 1].amin(dim=-1, keepdim=True)
    first = torch.where(lowest, points[..., 0], math.inf).argmin(dim=-1)
    extent = (points.amax(dim=-2) - points.amin(dim=-2)).amax(dim=-1)
    same = SAME_POINT * extent

    start = first
    heading = torch.zeros_like(target)
    heading[:, 0] = 1
    turned = torch.zeros_like(extent)
    done = torch.zeros_like(extent, dtype=torch.bool)
    best = _Nearest(
        edge=torch.stack([first, first], dim=-1),
        inside=torch.ones_like(done),
        distance=torch.full_like(extent, math.inf),
    )
    for _ in range(points.shape[1] + 1):
        end, angle = _next(points, start, heading, same)
        end = torch.where(done, start, end)
        better = best.improved_by(start, end, points, target)
        best = _Nearest(*(torch.where(_like(done, new), old, new) for old, new in zip(best, better, strict=True)))
        turned = turned + torch.where(done, 0, angle)
        heading = torch.where(done[:, None], heading, _at(points, end) - _at(points, start))
        closed = (_at(points, end) - _at(points, first)).norm(dim=-1) <= same
        done = done | closed | (turned > 2 * math.pi + 1e-6)
        start = end
        if bool(done.all()):
            break
    return best.edge


def _next(points: Tensor, start: Tensor, heading: Tensor, same: Tensor) -> tuple[Tensor, Tensor]:
    """The point with the smallest left turn from heading seen from start, the farthest of equals, and the turn."""
    offset = points - _at(points, start)[:, None]
    distance = offset.norm(dim=-1)
    other = distance > same[:, None]
    forward = (offset * heading[:, None]).sum(dim=-1)
    sideways = cross(heading[:, None], offset).clamp(min=0).abs()  # abs: −0 would turn half a circle into minus one
    angle = torch.where(other, torch.atan2(sideways, forward), math.inf)
    smallest = angle.amin(dim=-1, keepdim=True)
    reach = torch.where(other & (angle <= smallest + SAME_ANGLE), distance, -1)
    alone = ~other.any(dim=-1)
    return torch.where(alone, start, reach.argmax(dim=-1)), torch.where(alone, 0, smallest[:, 0])


def _at(points: Tensor, index: Tensor) -> Tensor:
    """points[b, index[b]]: (B, S, 2), (B,) -> (B, 2)."""
    return points.gather(-2, index[:, None, None].expand(-1, -1, 2))[:, 0]


def _like(mask: Tensor, other: Tensor) -> Tensor:
    return mask.reshape(mask.shape + (1,) * (other.ndim - 1))


_library = torch.library.Library("ipman_rs", "FRAGMENT")
_library.define(
    "nearest_edge(Tensor points, Tensor mask, Tensor target) -> Tensor", tags=(torch.Tag.pt2_compliant_tag,)
)
_library.impl("nearest_edge", nearest_edge, "CompositeExplicitAutograd")


@torch.library.register_fake("ipman_rs::nearest_edge", lib=_library)
def _(points: Tensor, mask: Tensor, target: Tensor) -> Tensor:
    return points.new_empty(points.shape[0], 2, dtype=torch.int64)


def _batched(info: Any, in_dims: tuple[int | None, ...], *args: Any) -> tuple[Tensor, int]:
    edge = torch.ops.ipman_rs.nearest_edge(*fold(info.batch_size, in_dims, args))
    return unfold(info.batch_size, edge), 0


torch.library.register_vmap("ipman_rs::nearest_edge", _batched, lib=_library)
