"""Small pictures without text, for the cells of a figure: pixels (height, width, 3) uint8."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..study.camera import ViewCamera
from . import colors
from .fitted import in_front
from .floor import draw_map
from .picture import Box, Paint, draw_body, draw_markers, draw_scene, new_page, pressure_scale_top

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..study.study import Study

_MARGIN = 0.06  # of a cell, around the body
_SHARP = 2  # pixels of the result to one of the cell


def box_of(size: tuple[int, int]) -> Box:
    """The part of a cell that a body fills, for `view.picture.camera_on`."""
    width, height = size
    return _MARGIN * width, _MARGIN * height, (1 - _MARGIN) * width, (1 - _MARGIN) * height


def scene_cell(
    study: Study, camera: ViewCamera, size: tuple[int, int], paint: Paint | None = None, markers: bool = True
) -> np.ndarray:
    """The first frame's body on its floor. `paint`: as in `draw_body`; `markers`: CoM, its plumb line, and CoP."""
    figure, axes = new_page(*size)
    draw_scene(axes, camera, study, 0, size, paint)
    if markers:
        draw_markers(axes, camera, study, 0)
    return _pixels(figure)


def floor_map(study: Study, size: tuple[int, int]) -> np.ndarray:
    """The first frame's ground from above: pressure, base of support, CoM and CoP."""
    figure, _ = new_page(*size)
    draw_map(figure.add_axes((0.0, 0.0, 1.0, 1.0)), study, 0, measured=False)
    return _pixels(figure)


def photo_cell(study: Study, box: Box, size: tuple[int, int], body: bool = True) -> np.ndarray:
    """A box (left, top, right, bottom) of pixels of a fitted body's photo, or of white paper with the detected points,
    with the body or without."""
    fitted = study.fitted
    assert fitted is not None
    left, top, right, bottom = box
    scale = size[0] / (right - left)
    figure, axes = new_page(*size)
    if fitted.photo is not None:
        width, height = fitted.size
        extent = ((0 - left) * scale, (width - left) * scale, (height - top) * scale, (0 - top) * scale)
        axes.imshow(fitted.photo, extent=extent, zorder=0, interpolation="antialiased", aspect="auto")
    elif not body:
        seen = fitted.seen[fitted.seen[:, 2] > 0]
        axes.plot(*((seen[:, :2] - (left, top)) * scale).T, "o", color=colors.COP, markersize=9)
    vertices = np.asarray(study.vertices[0], dtype=np.float64)
    fx, fy = np.broadcast_to(fitted.camera.focal, 2) * scale
    cx, cy = fitted.camera.center
    camera = replace(fitted.camera, focal=(fx, fy), center=((cx - left) * scale, (cy - top) * scale))
    if body and in_front(camera, vertices):
        draw_body(
            axes, camera, study, vertices, pressure_scale_top(study), size, 0.8 if fitted.photo is not None else 1.0
        )
    axes.set(xlim=(0, size[0]), ylim=(size[1], 0))
    return _pixels(figure)


def _pixels(figure: Figure) -> np.ndarray:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure.set_dpi(100 * _SHARP)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()
