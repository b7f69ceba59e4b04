"""The picture of a person on a floor: rays are cast into the scene by Embree, without GPU or display."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, reduce

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body.normals import vertex_normals

from .cameras import ImageCamera, dot
from .clothing import Clothes
from .environment import Environment
from .textures import float32

Array = NDArray[np.floating]

SAMPLES = 2  # rays a pixel along each side
OFF = 4e-3  # m that a ray starts off the surface, not to meet it again
CONTACT, SPREAD = 0.08, 0.6  # m and 1: the body darkens the floor that is about this close below it, and beside it
UP = float32([0, 1, 0])
SUN = 0.03  # radius of the sun's disc, 1 m away: how soft shadows are


@dataclass(frozen=True)
class Picture:
    """colors (S, S, 3) in linear light; covered (S, S): the share of each pixel that the person takes."""

    colors: Array
    covered: Array


class Solid:
    """A mesh that rays meet; vertices (V, 3) m, faces (F, 3). ImportError that says what to install."""

    def __init__(self, vertices: Array, faces: NDArray[np.integer]):
        try:
            from embreex.mesh_construction import TriangleMesh
            from embreex.rtcore_scene import EmbreeScene
        except ImportError as error:
            raise ImportError("rendering needs embreex: pip install 'ipman_rs[render]'") from error
        self.vertices, self.faces = vertices, faces
        self.normals = vertex_normals(vertices, faces)
        self.scene = EmbreeScene()
        self.mesh = TriangleMesh(self.scene, vertices.astype(np.float32), faces.astype(np.int32))

    def met(self, starts: Array, ways: Array) -> tuple[NDArray[np.integer], Array, Array]:
        """The face (N,) that each ray meets first, -1 for none; the point's weights (N, 3); the distance (N,) m."""
        starts = np.broadcast_to(starts, ways.shape)
        hits = self.scene.run(float32(starts), float32(ways), query="INTERSECT", output=True)
        u, v = hits["u"].astype(float), hits["v"].astype(float)
        distance = np.where(hits["primID"] >= 0, hits["tfar"].astype(float), np.inf)
        return hits["primID"], np.stack([1 - u - v, u, v], axis=1), distance

    def hides(self, starts: Array, ways: Array) -> NDArray[np.bool_]:
        """Which rays (N,) meet it."""
        return self.scene.run(float32(starts), float32(ways), query="OCCLUDED") >= 0


def render(
    solid: Solid, resting: Array, clothes: Clothes, body: str, around: Environment, camera: ImageCamera
) -> Picture:
    """The person `solid`, whose vertices lie at `resting` (V, 3) on the mean `body` in its zero pose."""
    grid = float32((np.arange(SAMPLES * camera.size) + 0.5) / SAMPLES)
    rays, scatter = camera.rays(np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)), scatter_pattern(len(grid))
    face, weights = first_hits(solid, camera, grid, rays)
    person, rest = np.flatnonzero(face >= 0), np.flatnonzero(face < 0)
    colors = np.empty_like(rays)
    colors[person] = skin(solid, face[person], weights[person], scatter[person], resting, clothes, body, around)
    colors[rest] = background(solid, float32(camera.eye), rays.take(rest, 0), scatter.take(rest, 0), around)
    return Picture(pixel_means(colors, camera.size), pixel_means(float32(face >= 0), camera.size)[..., 0])


def first_hits(solid: Solid, camera: ImageCamera, grid: Array, rays: Array) -> tuple[NDArray[np.integer], Array]:
    """As `Solid.met`, asked only of the rays near the person in the image; `grid`: the pixels of a row's rays."""
    flat = camera.project(solid.vertices)[:, :2]
    x, y = ((grid > low - 1) & (grid < high + 1) for low, high in zip(flat.min(axis=0), flat.max(axis=0), strict=True))
    near = (y[:, None] & x).ravel()
    face, weights = np.full(len(rays), -1), np.zeros((len(rays), 3))
    face[near], weights[near], _ = solid.met(camera.eye, rays[near])
    return face, weights


def skin(
    solid: Solid,
    face: NDArray[np.integer],
    weights: Array,
    scatter: Array,
    resting: Array,
    clothes: Clothes,
    body: str,
    around: Environment,
) -> Array:
    """Colours (N, 3) of points of the person."""
    corners = solid.faces[face]
    points, normals, places = (
        interpolate(values, corners, weights) for values in (solid.vertices, solid.normals, resting)
    )
    normals /= np.sqrt(dot(normals, normals))[:, None]
    lit = float32(~solid.hides(points + OFF * normals, around.light.towards + SUN * scatter))
    return clothes(places, body) * around.light.on(normals, lit, np.ones(len(points)))


def background(solid: Solid, eye: Array, rays: Array, scatter: Array, around: Environment) -> Array:
    """Colours (N, 3) of what rays (N, 3) see beside the person."""
    with np.errstate(divide="ignore"):
        distance = np.where(rays[:, 1] < 0, -eye[1] / rays[:, 1], np.inf)
    on_floor = distance < around.to_wall(eye, rays)
    floor, rest = np.flatnonzero(on_floor), np.flatnonzero(~on_floor)
    colors = np.empty_like(rays)
    colors[rest] = around.behind(eye, rays.take(rest, 0))
    if not len(floor):
        return colors
    distance, scatter = distance.take(floor), scatter.take(floor, 0)
    points = eye + distance[:, None] * rays.take(floor, 0)
    points[:, 1] = 0.0
    lit = 1 - shadow(solid, points, around.light.towards + SUN * scatter)
    open_ = 1 - contact_shadow(solid, points, scatter)
    colors[floor] = around.on_floor(points, distance, lit, open_)
    return colors


def shadow(solid: Solid, points: Array, towards: Array) -> Array:
    """1 for points (N, 3) of the floor that the person keeps the sun from, else 0."""
    mean = towards.mean(axis=0)
    feet = solid.vertices - solid.vertices[:, 1:2] / mean[1] * mean
    near = near_rectangle(points, feet, 0.1 * np.ptp(solid.vertices[:, 1]))
    shadow = np.zeros(len(points), np.float32)
    shadow[near] = solid.hides(points.take(near, 0) + OFF * UP, towards.take(near, 0))
    return shadow


def contact_shadow(solid: Solid, points: Array, scatter: Array) -> Array:
    """0 to 1, how much the person darkens points (N, 3) of the floor by being close above them."""
    ways = UP + SPREAD * (1 - UP) * scatter
    near = near_rectangle(points, solid.vertices, 3 * CONTACT)
    close = np.zeros(len(points), np.float32)
    close[near] = 0.8 * np.exp(-solid.met(points.take(near, 0), ways.take(near, 0))[2] / CONTACT)
    return close


def near_rectangle(points: Array, others: Array, distance: float) -> NDArray[np.integer]:
    """Which of points (N, 3) are in the rectangle of the floor around the others, wider by that distance."""
    low, high = others.min(axis=0) - distance, others.max(axis=0) + distance
    x, _, z = points.T
    return np.flatnonzero((x > low[0]) & (x < high[0]) & (z > low[2]) & (z < high[2]))


@cache
def scatter_pattern(width: int) -> Array:
    """Points (width², 3) of the unit ball, one for every ray of an image: a 4 x 4 pattern of well-spread ones. So the
    four rays of a pixel see four places of the sun, and its neighbours' see others."""
    draw = np.random.default_rng(1)
    spread = draw.standard_normal((4, 4, 3))
    spread *= (np.cbrt((np.arange(16) + 0.5) / 16) / np.linalg.norm(spread, axis=-1).ravel()).reshape(4, 4, 1)
    return np.tile(spread, (-(-width // 4), -(-width // 4), 1))[:width, :width].reshape(-1, 3).astype(np.float32)


def interpolate(values: Array, corners: NDArray[np.integer], weights: Array) -> Array:
    """Values (V, C) of vertices -> (N, C) inside faces with these corners (N, 3), by weights (N, 3)."""
    first, second, third = (weights[:, k : k + 1] * values[corners[:, k]] for k in range(3))
    return first + second + third


def pixel_means(values: Array, size: int) -> Array:
    """Means (size, size, C) over the rays (N, C) of each pixel."""
    rays = values.reshape(size, SAMPLES, size, SAMPLES, -1)
    return reduce(np.add, (rays[:, i, :, j] for i in range(SAMPLES) for j in range(SAMPLES))) / SAMPLES**2
