"""Pictures of a fitted body: over its photo, from the side, and before and after the physics terms."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import IO, TYPE_CHECKING

import numpy as np

from ipman_rs.files import atomic_write
from ipman_rs.study import Fitted

from ..study.camera import ViewCamera
from . import colors
from .picture import camera_around, draw_body, draw_picture, new_page, pressure_scale_top, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..study.study import Study

LONGEST = 1200  # pixels of the longer edge of the overlay
_STRIP = 64  # pixels of its legend
_NARROWEST = 760  # room for the legend


def draw_fitted(study: Study, folder: Path) -> Iterator[str]:
    """Write the pictures that only fitted bodies have; yields their names."""
    fitted = study.fitted
    if fitted is None or not fitted.pictured:
        return
    draw_overlay(study, folder / "overlay.png")
    yield "overlay.png"
    bodies = [study.vertices[0]] if fitted.before is None else [fitted.before.vertices[0], study.vertices[0]]
    bodies = [np.asarray(body, dtype=np.float64) for body in bodies]
    camera = camera_around(bodies, study, turn=90.0, tilt=4.0)
    after = study if fitted.before is None else replace(study, name="After the physics terms")
    draw_picture(after, 0, folder / "side.png", camera)
    yield "side.png"
    if fitted.before is not None:
        write_side_by_side(fitted.before, folder / "side.png", camera, folder / "before_after.png")
        yield "before_after.png"


def draw_overlay(study: Study, path: Path | IO[bytes]) -> None:
    """The body in the photo, or on white, with the points that were detected and those that were fitted."""
    fitted = study.fitted
    assert fitted is not None
    scale = LONGEST / max(fitted.size)
    width, height = (max(round(side * scale), 1) for side in fitted.size)
    page_width = max(width, _NARROWEST)
    strip = _STRIP if len(fitted.seen) else 0  # the key to points, where there are some
    figure, page = new_page(page_width, height + strip)
    left, whole = (page_width - width) / 2, height + strip
    axes = figure.add_axes((left / page_width, strip / whole, width / page_width, height / whole))
    axes.set(xticks=[], yticks=[])
    for side in axes.spines.values():
        side.set_color(colors.GRID)
    extent = (0, width, height, 0)
    if fitted.photo is not None:
        axes.imshow(fitted.photo, extent=extent, zorder=0, interpolation="bilinear", aspect="auto")
    body = np.asarray(study.vertices[0], dtype=np.float64)
    fx, fy = np.broadcast_to(fitted.camera.focal, 2) * scale
    cx, cy = np.asarray(fitted.camera.center) * scale
    camera = replace(fitted.camera, focal=(fx, fy), center=(cx, cy))
    if in_front(camera, body):
        opacity = 0.72 if fitted.photo is not None else 1.0
        draw_body(axes, camera, study, body, pressure_scale_top(study), (width, height), opacity)
    _draw_points(axes, fitted, scale)
    axes.set(xlim=(0, width), ylim=(height, 0))
    if strip:
        _write_strip(page, fitted, height, page_width)
    save(figure, path)


def in_front(camera: ViewCamera, body: np.ndarray) -> bool:
    depth = (camera.eye - body) @ camera.axes[2]
    return bool(np.isfinite(body).all() and (depth > 1e-3).all())


def _draw_points(axes: Axes, fitted: Fitted, scale: float) -> None:
    """Detected points as rings, the surer the stronger, each with a line to its fitted point."""
    for (x, y, confidence), (u, v) in zip(fitted.seen, fitted.projected, strict=True):
        if confidence <= 0:
            continue
        ends = np.array([[x, y], [u, v]]) * scale
        axes.plot(*ends.T, color="white", linewidth=3.2, alpha=0.8, zorder=4)
        axes.plot(*ends.T, color=colors.INK, linewidth=1.4, zorder=4.1)
        ring = {"markerfacecolor": "none", "markeredgecolor": colors.COP, "markeredgewidth": 2.4}
        axes.plot(*ends[0], "o", markersize=9, alpha=0.25 + 0.75 * float(confidence), zorder=4.2, **ring)
        axes.plot(*ends[1], "o", markersize=4.5, color=colors.COM, zorder=4.3)


def _write_strip(page: Axes, fitted: Fitted, top: int, width: int) -> None:
    y = top + _STRIP / 2
    page.plot(30, y, "o", markersize=9, markerfacecolor="none", markeredgecolor=colors.COP, markeredgewidth=2.4)
    page.text(44, y, "detected", size=13, color=colors.INK, va="center")
    page.plot(150, y, "o", markersize=5, color=colors.COM)
    page.text(162, y, "fitted", size=13, color=colors.INK, va="center")
    error = fitted.record.get("reprojection", {})
    if error:
        text = f"median {error['median_px']:.1f} px, {error['median_percent']:.1f} % of the person's height"
        page.text(width - 24, y, text, size=13, color=colors.MUTED, va="center", ha="right")


def write_side_by_side(before: Study, after: Path, camera: ViewCamera, path: Path) -> None:
    """The picture `after` with another body, seen by the same camera, on its left."""
    from matplotlib.image import imread, imsave

    stream = BytesIO()
    draw_picture(before, 0, stream, camera)
    stream.seek(0)
    with atomic_write(path) as file:
        imsave(file, np.hstack([imread(stream), imread(after)]))
