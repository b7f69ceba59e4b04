"""The surroundings of a person: the floor y = 0, walls or the sky, and the light. Colours are linear light, float32."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .cameras import dot, rotate
from .textures import FLOOR, WALL, Texture, draw_texture, float32, linear_color

Array = NDArray[np.floating]

KINDS = ("room", "room", "outdoors", "studio")
SKIRTING = (0.05, 0.12)  # m
INDOORS = 0.35  # of the sun that reaches walls
HAZE = 25.0  # m, where the floor outdoors has faded into the horizon


@dataclass(frozen=True)
class Light:
    """The sun, or a lamp far off, and the light of the surroundings from above and from below."""

    towards: Array  # (3,) unit vector
    sun: Array  # (3,)
    above: Array  # (3,)
    below: Array  # (3,)

    def on(self, normals: Array, lit: Array, open_: Array) -> Array:
        """The light (N, 3) on surfaces with these normals (N, 3); `lit` (N,) by the sun, `open_` (N,) to the rest."""
        share = (0.5 + 0.5 * normals[:, 1:2]) * open_[:, None]
        facing = dot(normals, self.towards).clip(0, None) * lit
        return self.below + share * (self.above - self.below) + facing[:, None] * self.sun


@dataclass(frozen=True)
class Environment:
    """A room is a box of half sides `reach` m around the world's origin, turned by the rotation `walls_turn`."""

    kind: str
    floor: Texture
    wall: Texture
    skirting: float  # m
    skirting_color: Array
    horizon: Array
    zenith: Array
    reach: Array  # (2,) m
    walls_turn: Array  # (3, 3)
    light: Light

    def to_wall(self, eye: Array, rays: Array) -> Array:
        """Metres (N,) along rays (N, 3) to the wall that ends them; infinite where there are no walls."""
        return np.minimum(*self.away(eye, rays)) if self.kind == "room" else np.full(len(rays), np.inf, rays.dtype)

    def behind(self, eye: Array, rays: Array) -> Array:
        """Colours (N, 3) of what is seen along rays that meet neither the body nor the floor."""
        if self.kind == "room":
            return self.walls(eye, rays)
        rise = rays[:, 1:2].clip(0, 1)
        if self.kind == "studio":
            return self.horizon + rise * (self.zenith - self.horizon)
        sky = self.horizon + np.sqrt(rise) * (self.zenith - self.horizon)
        u, v = (rays[:, axis] / (rays[:, 1] + 0.15) for axis in (0, 2))
        cloud = (self.wall.noise(1.5 * u, 1.5 * v) + 0.5 * self.wall.noise(4 * u, 4 * v)).clip(0, 1)[:, None]
        return sky + 0.6 * cloud * rise * (0.9 - sky)

    def away(self, eye: Array, rays: Array) -> Array:
        """Metres (2, N) along the rays to the box's far sides, so that a camera outside looks through the near ones."""
        start, way = rotate(eye[None], self.walls_turn)[0, ::2, None], rotate(rays, self.walls_turn).T[::2]
        with np.errstate(divide="ignore", invalid="ignore"):
            return (np.copysign(self.reach[:, None], way) - start) / way

    def walls(self, eye: Array, rays: Array) -> Array:
        away = self.away(eye, rays)
        side, distance = away[1] < away[0], np.minimum(*away)
        way = rotate(rays, self.walls_turn)
        point = rotate(eye[None], self.walls_turn) + distance[:, None] * way
        colors = self.wall(np.stack([np.where(side, point[:, 0], point[:, 2]), point[:, 1]], axis=1))
        colors[point[:, 1] < self.skirting] = self.skirting_color
        inwards = -np.sign(np.stack([np.where(side, 0, way[:, 0]), 0 * distance, np.where(side, way[:, 2], 0)], 1))
        everywhere = np.ones_like(distance)
        return colors * self.light.on(rotate(inwards, self.walls_turn.T), INDOORS * everywhere, everywhere)

    def on_floor(self, points: Array, distance: Array, lit: Array, open_: Array) -> Array:
        """Colours (N, 3) of the floor at points (N, 3), `distance` (N,) m from the eye."""
        normals = np.broadcast_to(float32([0, 1, 0]), points.shape)
        colors = self.floor(points[:, [0, 2]]) * self.light.on(normals, lit, open_)
        if self.kind == "room":
            return colors
        fade = (distance / HAZE).clip(0, 1)[:, None] ** (1 if self.kind == "studio" else 2)
        return colors + fade * (self.horizon - colors)


def draw_environment(draw: np.random.Generator) -> Environment:
    kind = KINDS[draw.integers(len(KINDS))]
    light = draw_light(draw)
    floor = draw_texture(draw, FLOOR, _muted(draw), (0.15, 0.8), 0.3)
    wall = draw_texture(draw, WALL, _muted(draw), (0.2, 1.2), 0.3)
    horizon = linear_color(draw.uniform(0.5, 0.65), draw.uniform(0, 0.3), draw.uniform(0.6, 1.0))
    zenith = linear_color(draw.uniform(0.52, 0.65), draw.uniform(0.1, 0.7), draw.uniform(0.5, 1.0))
    if kind == "studio":
        horizon, zenith = floor.first * (light.above + 0.5 * light.sun), floor.first * light.above
    angle = draw.uniform(0, np.pi)
    cosine, sine = np.cos(angle), np.sin(angle)
    return Environment(
        kind,
        floor,
        wall,
        skirting=draw.uniform(*SKIRTING) * draw.integers(2),
        skirting_color=_muted(draw) * light.above,
        horizon=float32(horizon),
        zenith=float32(zenith),
        reach=float32(draw.uniform(2.2, 5.0, 2)),
        walls_turn=float32([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]),
        light=light,
    )


def draw_light(draw: np.random.Generator) -> Light:
    height, heading = np.radians(draw.uniform(25, 80)), draw.uniform(0, 2 * np.pi)
    towards = np.array([np.cos(height) * np.cos(heading), np.sin(height), np.cos(height) * np.sin(heading)])
    warm = draw.uniform(-0.15, 0.15)
    tint = np.array([1 + warm, 1.0, 1 - warm])
    sun = draw.uniform(0.25, 1.0)
    ambient = draw.uniform(0.35, 0.7)
    cool = np.array([1 - 0.5 * warm, 1.0, 1 + 0.5 * warm])
    below = ambient * draw.uniform(0.3, 0.7) * cool
    return Light(*map(float32, (towards, sun * tint, ambient * cool, below)))


def _muted(draw: np.random.Generator) -> Array:
    return linear_color(draw.random(), 0.5 * draw.random() ** 2, draw.uniform(0.3, 0.95))
