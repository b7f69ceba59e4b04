"""Colours that vary over a plane: cloth, floors and walls."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.floating]

CELLS = 64  # of the lattice of noise, which repeats after that many


@dataclass(frozen=True)
class Texture:
    """`kind` on a plane of coordinates (N, 2) m, in cells of `cell` m that are turned by `angle`.

    first, second: colours (3,) in linear light, float32; `grain` is the strength of noise over them.
    """

    kind: str
    first: Array
    second: Array
    cell: float
    angle: float
    grain: float
    lattice: Array  # (CELLS, CELLS), -1 to 1

    def __call__(self, plane: Array) -> Array:
        """Colours (N, 3)."""
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        u = (cosine * plane[:, 0] + sine * plane[:, 1]) / self.cell
        v = (cosine * plane[:, 1] - sine * plane[:, 0]) / self.cell
        share = KINDS[self.kind](self, u, v)[:, None]
        colors = self.first + share * (self.second - self.first)
        noise = self.noise(3 * u, 3 * v) + self.noise(0.4 * u, 0.4 * v)
        return (colors * (1 + self.grain * noise[:, None])).clip(0, 1)

    def noise(self, u: Array, v: Array) -> Array:
        """Smooth noise (N,), -1 to 1, of one cell's size."""
        column, row = np.floor(u), np.floor(v)
        right, down = u - column, v - row
        column, row = column.astype(np.int32), row.astype(np.int32)
        columns = [(column + j) % CELLS for j in (0, 1)]
        rows = [CELLS * ((row + i) % CELLS) for i in (0, 1)]
        corners = [[self.lattice.ravel().take(below + beside) for beside in columns] for below in rows]
        top, bottom = (left + right * (other - left) for left, other in corners)
        return top + down * (bottom - top)


def _plain(_: Texture, u: Array, __: Array) -> Array:
    return np.zeros_like(u)


def _stripes(_: Texture, __: Array, v: Array) -> Array:
    return (v % 1 < 0.5).astype(np.float32)


def _lines(_: Texture, __: Array, v: Array) -> Array:
    return (v % 1 < 0.12).astype(np.float32)


def _checks(_: Texture, u: Array, v: Array) -> Array:
    return ((u % 1 < 0.5) ^ (v % 1 < 0.5)).astype(np.float32)


def _tiles(_: Texture, u: Array, v: Array) -> Array:
    return ((u % 1 < 0.06) | (v % 1 < 0.06)).astype(np.float32)


def _planks(pattern: Texture, u: Array, v: Array) -> Array:
    row = np.floor(v)
    board = np.floor(u / 6 + 0.37 * row)
    tone = pattern.lattice[row.astype(int) % CELLS, board.astype(int) % CELLS]
    return np.where(v % 1 < 0.06, np.float32(1), 0.2 + 0.2 * tone)


def _dots(_: Texture, u: Array, v: Array) -> Array:
    return ((u % 1 - 0.5) ** 2 + (v % 1 - 0.5) ** 2 < 0.06).astype(np.float32)


def _clouds(pattern: Texture, u: Array, v: Array) -> Array:
    return 0.5 + 0.3 * pattern.noise(u, v) + 0.2 * pattern.noise(2.3 * u, 2.3 * v)


KINDS: dict[str, Callable[[Texture, Array, Array], Array]] = {
    "plain": _plain, "stripes": _stripes, "lines": _lines, "checks": _checks, "tiles": _tiles, "planks": _planks,
    "dots": _dots, "clouds": _clouds,
}  # fmt: skip
CLOTH = ("plain", "plain", "plain", "stripes", "lines", "checks", "dots", "clouds")
FLOOR = ("plain", "tiles", "planks", "checks", "clouds")
WALL = ("plain", "plain", "stripes", "tiles", "clouds")


def draw_texture(
    draw: np.random.Generator, kinds: tuple[str, ...], first: Array, cell: tuple[float, float], contrast: float
) -> Texture:
    """One of the kinds; the second colour is up to `contrast` away from the first."""
    second = (first + contrast * draw.uniform(-1, 1) + 0.3 * contrast * draw.uniform(-1, 1, 3)).clip(0.01, 0.95)
    lattice = draw.uniform(-1, 1, (CELLS, CELLS)).astype(np.float32)
    kind = kinds[draw.integers(len(kinds))]
    size, angle, grain = draw.uniform(*cell), draw.uniform(0, np.pi), draw.uniform(0.02, 0.12)
    return Texture(kind, float32(first), float32(second), float(size), float(angle), float(grain), lattice)


def float32(values: ArrayLike) -> Array:
    """As float32, which is precise enough for colours and twice as fast."""
    return np.asarray(values, np.float32)


def linear_color(hue: float, saturation: float, value: float) -> Array:
    """A colour (3,) in linear light, from hue, saturation and value between 0 and 1."""
    from colorsys import hsv_to_rgb

    return np.array(hsv_to_rgb(hue, saturation, value)) ** 2.2
