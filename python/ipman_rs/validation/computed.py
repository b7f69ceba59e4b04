"""Masses, centres of mass and centres of pressure that the engine computes for bodies over time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import ipman_rs as ip

from ..analysis import PIECE
from ..body.sequence import PosedSequence, pieces
from ..body.soles import sole_vertices
from ..data.c3d_plates import LOADED
from ..data.force_plates import ForcePlates

Array = NDArray[np.float64]

METHODS = ("exact", "pcom", "sample_mean", "face_area", "vertex_mean")
GAMMAS = (5, 10, 20, 50, 100, 200)  # 1/m; the paper's is 10
ALPHA, GAMMA = 100.0, 10.0
SOLE = 0.03  # m: thickness of the soles of people who may wear shoes


@dataclass(frozen=True, eq=False)
class Computed:
    """Of T bodies: volume × 985 kg/m³, centres of mass by method and centres of pressure by γ.

    `soles`: the vertices of both soles, which are of the left one where `left`. `forward`: level unit vectors, the way
    that the pelvis faces. `shares`: how much of the pressure, at γ = 10, is on the first plate's side
    where two carry a load; NaN elsewhere.
    """

    mass: Array  # (T,) kg
    part_masses: Array  # (T, P) kg
    part_centers: Array  # (T, P, 3) m
    lowest: Array  # (T,) m, of the lowest vertex
    com: Mapping[str, Array]  # (T, 3) m
    cop: Mapping[int, Array]  # (T, 3) m
    soles: Array  # (T, n, 3) m
    left: NDArray[np.bool_]  # (n,)
    forward: Array  # (T, 3)
    shares: Array  # (T,)


def computed(
    bodies: PosedSequence | NDArray[np.floating],
    template: ip.BodyTemplate,
    plates: ForcePlates | None = None,
    progress: Callable[[int], None] = lambda _done: None,
) -> Computed:
    """The engine's figures of bodies, y up, vertices (T, V, 3) m; `plates` at the same times.

    Each body's ground for the pressure lies under its lowest vertex: people wear shoes, fitted bodies do not, and the
    formula depends on heights only. `progress(done)` is called with the number of finished bodies.
    """
    rows: list[Computed] = []
    done = 0
    for vertices in pieces(bodies, PIECE):
        part = slice(done, done + len(vertices))
        rows.append(
            _piece(vertices, template, None if plates is None else (plate_loads(plates)[part], plates.points[part]))
        )
        done += len(vertices)
        progress(done)
    return Computed(
        np.concatenate([row.mass for row in rows]),
        np.concatenate([row.part_masses for row in rows]),
        np.concatenate([row.part_centers for row in rows]),
        np.concatenate([row.lowest for row in rows]),
        {method: np.concatenate([row.com[method] for row in rows]) for method in METHODS},
        {gamma: np.concatenate([row.cop[gamma] for row in rows]) for gamma in GAMMAS},
        np.concatenate([row.soles for row in rows]),
        rows[0].left,
        np.concatenate([row.forward for row in rows]),
        np.concatenate([row.shares for row in rows]),
    )


def _piece(vertices: NDArray[np.floating], template: ip.BodyTemplate, plates: tuple[Array, Array] | None) -> Computed:
    ground = ip.Ground.under(vertices)
    com = {method: np.asarray(ip.center_of_mass(vertices, template, method), float) for method in METHODS}
    cop = {
        gamma: np.asarray(ip.center_of_pressure(vertices, template, ground, ALPHA, gamma), float) for gamma in GAMMAS
    }
    solid = ip.mass_properties(vertices, template)
    assert solid.parts is not None
    mass, masses, centers = (np.asarray(v, float) for v in (solid.mass, solid.parts.mass, solid.parts.center))
    shares = np.full(len(vertices), np.nan)
    if plates is not None:
        rho = np.asarray(ip.pressure(vertices, template, ground, ALPHA, GAMMA), float)
        shares = first_shares(np.asarray(ip.sample_surface(vertices, template), float), rho, *plates)
    sole = sole_vertices(template, SOLE)
    left = np.isin(sole, _of_part(template, "left_lower_leg"))
    soles, forward = np.asarray(vertices[:, sole], float), facing_directions(vertices, template)
    return Computed(mass, masses, centers, ground.height, com, cop, soles, left, forward, shares)


def facing_directions(vertices: NDArray[np.floating], template: ip.BodyTemplate) -> Array:
    """The level unit vectors (T, 3) along which the pelvis of bodies (T, V, 3), y up, faces.

    The pelvis is the lower half of the trunk, turned as a whole from the resting pose, which faces z. Square to its
    left, which stays level in people who bend or lie on their back; of those who lie on a side, where its front points.
    """
    trunk = _of_part(template, "torso")
    rest = np.asarray(template.vertices, float)[trunk]
    low = rest[:, 1] <= np.median(rest[:, 1])
    rest, now = rest[low], np.asarray(vertices[:, trunk[low]], float)
    spread = np.einsum("tni,nj->tij", now - now.mean(axis=1, keepdims=True), rest - rest.mean(axis=0))
    first, _, last = np.linalg.svd(np.nan_to_num(spread))
    first[:, :, 2] *= np.sign(np.linalg.det(first @ last))[:, None]
    turned = first @ last
    left, front = (turned[:, :, axis] * [1.0, 0.0, 1.0] for axis in (0, 2))
    level = np.linalg.norm(left, axis=1, keepdims=True)
    way = np.where(level > 0.5, np.cross(left, [0.0, 1.0, 0.0]), front)
    length = np.linalg.norm(way, axis=1, keepdims=True)
    return np.where(length > 0, way / np.where(length > 0, length, 1.0), [0.0, 0.0, 1.0]).astype(np.float64)


def _of_part(template: ip.BodyTemplate, name: str) -> NDArray[np.int64]:
    """The vertices of a part."""
    return np.unique(template.faces[template.face_parts == template.part_names.index(name)])


def plate_loads(plates: ForcePlates) -> Array:
    """(T, P) N upwards; 0 for plates that carry no more than `LOADED`, of whose centres nothing is known."""
    return np.where(plates.loads > LOADED, plates.loads, 0.0)


def first_shares(points: Array, pressure: Array, loads: Array, centers: Array) -> Array:
    """The part (T,) of the pressure (T, S) at points (T, S, 3) nearer to the first of two loaded plates' centres.

    loads (T, P) and centers (T, P, 3) m of the plates; NaN where not exactly two carry a load.
    """
    shares = np.full(len(points), np.nan)
    for row in np.flatnonzero((loads > 0).sum(axis=1) == 2):
        first, second = (centers[row, plate, [0, 2]] for plate in np.flatnonzero(loads[row] > 0))
        across = (points[row][:, [0, 2]] - (first + second) / 2) @ (second - first)
        shares[row] = pressure[row, across < 0].sum() / pressure[row].sum()
    return shares
