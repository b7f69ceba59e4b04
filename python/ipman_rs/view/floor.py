"""The floor view: the ground from above, with the pressure of the contact samples, the hull, CoM and CoP."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from . import colors
from .geometry import grid_step, nearest_on_outline, pressure_at
from .picture import WIDTH, frame_caption, new_page, pressure_scale_top, save, signed, write_legend
from .raster import faces_viewer, rasterize

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..study.study import Study

HEIGHT = 1200
# The map's square on the page, as fractions of it.
_MAP = (0.05, 0.11, 0.90, 0.76)


def draw_floor_view(study: Study, frame: int, path: Path) -> None:
    """Write the PNG of one frame's ground seen from above."""
    figure, page = new_page(WIDTH, HEIGHT)
    title, line = frame_caption(study, frame)
    page.text(60, 60, title, size=23, color=colors.INK, va="center", weight="bold", parse_math=False)
    page.text(60, 104, f"seen from above   ·   {line}", size=14, color=colors.MUTED, va="center", parse_math=False)
    body = np.asarray(study.vertices[frame], dtype=np.float64)
    if np.isfinite(body).all():
        axes = figure.add_axes(_MAP)
        draw_map(axes, study, frame)
    write_legend(figure, study, pressure_scale_top(study))
    save(figure, path)


def draw_map(axes: Axes, study: Study, frame: int, measured: bool = True) -> None:
    """One frame's ground seen from above, filling the axes; `measured`: with margin and CoM–CoP distance."""
    body = np.asarray(study.vertices[frame], dtype=np.float64)
    _frame_map(axes, study, body, frame)
    _draw_silhouette(axes, study, body)
    _draw_contacts(axes, study, body)
    _draw_marks(axes, study, frame, measured)
    _draw_scale_bar(axes)


def _on_floor(study: Study, points: np.ndarray) -> np.ndarray:
    """Coordinates (..., 2) in the ground's own axes, metres."""
    e1, e2 = study.ground.axes()
    return np.stack([points @ e1, points @ e2], axis=-1)


def _frame_map(axes: Axes, study: Study, body: np.ndarray, frame: int) -> None:
    """Limits around the support, CoM and CoP; the body's silhouette may leave the map."""
    marks = [study.polygons[frame], study.numbers["center_of_mass"][frame], study.numbers["center_of_pressure"][frame]]
    shown = _on_floor(study, np.vstack([np.atleast_2d(mark) for mark in marks]))
    shown = shown[np.isfinite(shown).all(axis=-1)]
    everything = _on_floor(study, body)
    middle = (shown.min(axis=0) + shown.max(axis=0)) / 2 if len(shown) else everything.mean(axis=0)
    page = axes.get_window_extent()
    ratio = page.width / page.height
    half = 0.62 * np.ptp(shown, axis=0).max() / min(ratio, 1.0) if len(shown) else 0.0
    half = max(half, 0.30 * np.ptp(everything, axis=0).max(), 0.03)
    axes.set(xlim=middle[0] + half * ratio * np.array([-1, 1]), ylim=middle[1] + half * np.array([-1, 1]))
    axes.set_aspect("equal")
    step = grid_step(half)
    for line, limits in ((axes.axvline, axes.get_xlim()), (axes.axhline, axes.get_ylim())):
        for at in np.arange(np.ceil(limits[0] / step), np.floor(limits[1] / step) + 1) * step:
            line(at, color=colors.GRID, linewidth=0.9, alpha=0.7, zorder=0)
    axes.set(xticks=[], yticks=[])
    for side in axes.spines.values():
        side.set_color(colors.GRID)


def _draw_silhouette(axes: Axes, study: Study, body: np.ndarray) -> None:
    """The body's outline on the ground, in a pale grey that leaves the map its colours."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    size = np.array([1000, 1000 * (high - low) / (right - left)]).astype(int)
    pixels = (_on_floor(study, body) - (left, high)) / (right - left, low - high) * size
    corners = pixels[study.template.faces]
    if study.template.watertight:
        corners = corners[faces_viewer(corners)]
    flat = np.zeros(corners.shape[:2])
    _, covered = rasterize(corners, flat, flat[..., None], *size)
    veil = np.zeros((*covered.shape, 4))
    veil[..., :3] = colors.rgb("#9aa1ad")
    veil[..., 3] = 0.20 * covered
    axes.imshow(veil, extent=(left, right, low, high), zorder=1, interpolation="bilinear")


def _draw_contacts(axes: Axes, study: Study, body: np.ndarray) -> None:
    import ipman_rs as ip

    samples = ip.sample_surface(body, study.template)
    points, height = _on_floor(study, samples), study.ground.signed_height(samples)
    reach = study.preset.threshold
    contact = height < reach if study.preset.contact == "released" else np.abs(height) < reach
    rho = pressure_at(height, study.preset.alpha, study.preset.gamma)
    order = np.flatnonzero(contact)[np.argsort(rho[contact])]
    tint = colors.heat(rho[order], pressure_scale_top(study))
    # Dots of 6 mm, so that neighbouring samples of a sole join to a surface.
    (left, right), box = axes.get_xlim(), axes.get_window_extent()
    size = 0.006 / (right - left) * box.width * 72 / 100
    axes.scatter(*points[order].T, c=tint, s=np.clip(size, 2.5, 12) ** 2, linewidths=0, zorder=3)


def _draw_marks(axes: Axes, study: Study, frame: int, measured: bool) -> None:
    polygon, value = study.polygons[frame], study.numbers
    if len(polygon):
        outline = _on_floor(study, polygon)
        axes.fill(*outline.T, facecolor=colors.SUPPORT, alpha=0.35, linewidth=0, zorder=2)
        axes.plot(*np.vstack([outline, outline[:1]]).T, color=colors.SUPPORT_EDGE, linewidth=2.6, zorder=4)
    com, cop = (study.ground.project(value[key][frame]) for key in ("center_of_mass", "center_of_pressure"))
    com_at, cop_at = _on_floor(study, com), _on_floor(study, cop)
    if measured and np.isfinite(com).all() and len(polygon):
        near = _on_floor(study, nearest_on_outline(com, polygon))
        text = f"margin {signed(value['margin'][frame])} mm"
        _measure(axes, com_at, near, colors.SUPPORT_EDGE, text, beyond=bool(value["inside"][frame]))
    if measured and np.isfinite(com).all() and np.isfinite(cop).all():
        _measure(axes, cop_at, com_at, colors.INK, f"{value['com_cop_distance'][frame] * 1000:.0f} mm")
    for at, color in ((com_at, colors.COM), (cop_at, colors.COP)):
        axes.plot(*at, "o", color=color, markersize=17, markeredgecolor="white", markeredgewidth=2.2, zorder=7)


def _measure(axes: Axes, start: np.ndarray, end: np.ndarray, color: str, text: str, beyond: bool = False) -> None:
    """A dashed line with its length beside its middle, or beyond its end."""
    axes.plot(*np.stack([start, end]).T, color=color, linewidth=2, linestyle=(0, (4, 2)), zorder=5)
    along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    low, high = axes.get_ylim()
    across = np.array([-along[1], along[0]]) * np.array([0.09, 0.04]) * (high - low)
    x, y = end + along * np.array([0.10, 0.04]) * (high - low) if beyond else (start + end) / 2 + across
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.5}
    axes.text(x, y, text, size=12.5, color=colors.INK, ha="center", va="center", bbox=box, zorder=6)


def _draw_scale_bar(axes: Axes) -> None:
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    length = grid_step((right - left) / 2)
    x, y = left + 0.04 * (right - left), low + 0.05 * (high - low)
    axes.plot((x, x + length), (y, y), color=colors.INK, linewidth=4, solid_capstyle="butt", zorder=8)
    text = f"{length * 100:g} cm" if length < 1 else f"{length:g} m"
    axes.text(x + length / 2, y + 0.018 * (high - low), text, size=13, color=colors.INK, ha="center", zorder=8)
