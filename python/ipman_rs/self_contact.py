"""A body's contact with itself: which vertices are inside another part of it, and what that and near misses cost.

A vertex is inside another part where the body's winding number is above 0.99, at least 0.5 of it from opposite surface,
and the way to the nearest opposite point leads out there. Opposite is what is farther than `geodesic` metres from the
vertex along the edges of the template's rest shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs.arrays import Bodies
from ipman_rs.checks import not_negative, positive
from ipman_rs.template import BodyTemplate

if TYPE_CHECKING:
    from ipman_rs._core import Collision


@dataclass(frozen=True, eq=False)
class SelfPenetration:
    """What is inside another part of the same body.

    depth: (..., V) m to the nearest opposite surface, 0 for vertices outside, NaN in a body that is not finite.
    inside: (..., V).
    num_inside: (...,) vertices.
    deepest: (...,) m, the largest depth.
    """

    depth: NDArray[Any]
    inside: NDArray[np.bool_]
    num_inside: NDArray[np.int64]
    deepest: NDArray[Any]


def self_penetration(vertices: ArrayLike, template: BodyTemplate, geodesic: float = 0.3) -> SelfPenetration:
    """The vertices of each body that are inside another part of it, and how deep. vertices (..., V, 3) m.

    Args:
        geodesic: surface nearer than this to a vertex, in metres along the template, is not another part.

    Raises:
        ValueError: wrong shapes, or a negative or infinite geodesic.
        TypeError: an argument of the wrong kind, or masked vertices.
    """
    bodies = Bodies(vertices, template)
    rows = collision(bodies.template, not_negative("geodesic", geodesic)).depths(bodies.vertices)
    depth = bodies.unfold(rows, template.num_vertices)
    inside = depth > 0
    return SelfPenetration(depth, inside, inside.sum(axis=-1), depth.max(axis=-1))


def self_contact_distance(
    vertices: ArrayLike, template: BodyTemplate, near: float = 0.02, geodesic: float = 0.3
) -> NDArray[Any]:
    """The distance (..., V) m of each vertex to the nearest opposite surface of the same body; vertices (..., V, 3) m.

    Negative where the vertex is inside another part, infinite where no opposite surface is nearer than `near`, NaN in a
    body that is not finite. `isfinite` of it is what SMPLify-XMC calls the vertices in contact.

    Args:
        near: m, from where on surfaces do not touch.
        geodesic: as in `self_penetration`.

    Raises:
        ValueError: wrong shapes, or a negative or infinite distance.
        TypeError: an argument of the wrong kind, or masked vertices.
    """
    bodies = Bodies(vertices, template)
    tables = collision(bodies.template, not_negative("geodesic", geodesic))
    return bodies.unfold(tables.distances(bodies.vertices, not_negative("near", near)), template.num_vertices)


def self_contact_loss(
    vertices: ArrayLike,
    template: BodyTemplate,
    push_width: float = 0.04,
    pull_width: float = 0.005,
    pull_weight: float = 0.005,
    near: float = 0.02,
    geodesic: float = 0.3,
) -> tuple[NDArray[Any], NDArray[Any]]:
    """(push, pull), each (...,): ½ Σ tanh²(d / push_width) over the vertices inside another part, and
    ½ pull_weight Σ tanh²(d / pull_width) over those outside that are nearer than `near` to opposite surface.

    d is the distance to the nearest opposite point; the sums are over vertices, as SMPLify-XMC has them.

    Args:
        vertices: (..., V, 3) m.
        push_width, pull_width, near: m.
        geodesic: as in `self_penetration`.

    Raises:
        ValueError: wrong shapes, or an option out of its range.
        TypeError: an argument of the wrong kind, or masked vertices.
    """
    bodies = Bodies(vertices, template)
    options = checked(push_width, pull_width, pull_weight, near)
    rows, _ = collision(bodies.template, not_negative("geodesic", geodesic)).self_contact(bodies.vertices, options)
    both = bodies.unfold(rows, 2)
    return both[..., 0][()], both[..., 1][()]


def checked(push_width: float, pull_width: float, pull_weight: float, near: float) -> list[float]:
    """The options as the core takes them."""
    return [
        positive("push_width", push_width),
        positive("pull_width", pull_width),
        not_negative("pull_weight", pull_weight),
        not_negative("near", near),
    ]


def collision(template: BodyTemplate, geodesic: float) -> Collision:
    """The template's tables, made when they are first asked for: a second of work for 12,000 vertices."""
    from ipman_rs import _core

    tables = template._collisions
    if geodesic not in tables:
        tables[geodesic] = _core.Collision(template._core, template.vertices, geodesic)
    return tables[geodesic]
