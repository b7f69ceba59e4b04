"""A filmstrip: one body at several times side by side, seen across the direction of its fall."""

from __future__ import annotations

from pathlib import Path
from typing import IO, TYPE_CHECKING

import numpy as np

from ..study.camera import ViewCamera, front_of, look_at
from . import colors
from .geometry import floor_lines, grid_step
from .picture import draw_body, new_page, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..study.study import Study

# Pixels of one picture of the strip, and the part of it (left, top, right, bottom) that the body fills.
WIDTH, HEIGHT = 420, 760
_BOX = (25.0, 150.0, 395.0, 690.0)
# A body that moves less than this far sideways is seen from its front right, m.
_STILL = 0.05


def draw_filmstrip(study: Study, path: Path | IO[bytes]) -> None:
    """Write a PNG with all frames of a study from left to right, each with its centre of mass and its label."""
    count = study.num_frames
    figure, page = new_page(WIDTH * count, HEIGHT)
    bodies = np.asarray(study.vertices, dtype=np.float64)
    camera = _camera(study, bodies)
    for frame in range(count):
        axes = figure.add_axes((frame / count, 0.0, 1.0 / count, 1.0))
        axes.axis("off")
        _draw_floor(axes, camera, study, bodies)
        draw_body(axes, camera, study, bodies[frame], 1.0, (WIDTH, HEIGHT))
        _draw_centre(axes, camera, study, frame)
        axes.text(WIDTH / 2, HEIGHT - 34, study.label(frame), size=17, color=colors.INK, ha="center", parse_math=False)
        axes.set(xlim=(0, WIDTH), ylim=(HEIGHT, 0))
    page.set_zorder(1)
    page.patch.set_alpha(0.0)
    page.text(40, 60, study.name, size=24, color=colors.INK, va="center", weight="bold", parse_math=False)
    moved = np.linalg.norm(study.numbers["center_of_mass_exact"] - study.numbers["center_of_mass_exact"][0], axis=-1)
    label = f"centre of mass moved {1e3 * moved[-1]:.0f} mm in {study.label(count - 1)}"
    page.text(40, 104, label, size=15, color=colors.MUTED, va="center", parse_math=False)
    save(figure, path)


def _camera(study: Study, bodies: np.ndarray) -> ViewCamera:
    points = np.concatenate([bodies.reshape(-1, 3), study.ground.project(bodies.reshape(-1, 3))])
    up = np.asarray(study.ground.normal, dtype=np.float64)
    centers = study.numbers["center_of_mass_exact"]
    return look_at(points, up, _BOX, turn_across(centers[-1] - centers[0], up))


def turn_across(motion: np.ndarray, up: np.ndarray, otherwise: float = 35.0) -> float:
    """Degrees around the up axis from the body's front to where a motion runs across the picture; of the two the one
    nearer to `otherwise`, which is that of a body that hardly moves."""
    level = motion - (motion @ up) * up
    if not np.linalg.norm(level) > _STILL:
        return otherwise
    front = front_of(up)
    across = np.cross(up, level)
    turn = np.degrees(np.arctan2(across @ np.cross(up, front), across @ front))
    choices = [(turn + half - otherwise + 180.0) % 360.0 - 180.0 for half in (0.0, 180.0)]
    return float(otherwise + min(choices, key=abs))


def _draw_floor(axes: Axes, camera: ViewCamera, study: Study, bodies: np.ndarray) -> None:
    from matplotlib.collections import LineCollection

    low, high = bodies.min(axis=(0, 1)), bodies.max(axis=(0, 1))
    center = study.ground.project((low + high) / 2)
    radius = 0.75 * float(np.linalg.norm(high - low))
    e1, e2 = (np.asarray(axis, dtype=np.float64) for axis in study.ground.axes())
    lines, strength = floor_lines(center, e1, e2, radius, grid_step(radius))
    rgba = np.concatenate([np.broadcast_to(colors.rgb(colors.GRID), (len(lines), 3)), strength[:, None]], axis=1)
    axes.add_collection(LineCollection(list(camera.pixels(lines)[0]), colors=rgba, linewidths=1.0, zorder=1))


def _draw_centre(axes: Axes, camera: ViewCamera, study: Study, frame: int) -> None:
    centre = study.numbers["center_of_mass_exact"][frame]
    (head, foot), _ = camera.pixels(np.stack([centre, study.ground.project(centre)]))
    axes.plot(*np.stack([head, foot]).T, color=colors.COM, linewidth=2.0, zorder=5)
    axes.plot(*head, "o", color=colors.COM, markersize=13, markeredgecolor="white", markeredgewidth=2.0, zorder=6)
