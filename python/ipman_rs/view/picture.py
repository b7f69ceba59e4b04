"""The perspective picture: the body with its pressure map on a floor, CoM over its plumb line, CoP, base of support."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING

import numpy as np

from ipman_rs.files import atomic_write

from ..body.normals import vertex_normals
from ..study.camera import ViewCamera, look_at
from . import colors
from .geometry import floor_lines, grid_step, pressure_at
from .raster import faces_viewer, rasterize, shrink

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..study.study import Study

Paint = Callable[[np.ndarray], np.ndarray]
Box = tuple[float, float, float, float]

# Pixels of the whole picture and of the box (left, top, right, bottom) that the body fills.
WIDTH, HEIGHT = 1200, 1400
_BOX: Box = (90.0, 160.0, 1110.0, 1215.0)
_SAMPLES = 2
# Top of the pressure scale: 1 is a touching point; deeper ones saturate at 3 (2 cm below the floor by the paper).
_TOP = 3.0


def draw_picture(study: Study, frame: int, path: Path | IO[bytes], camera: ViewCamera | None = None) -> None:
    """Write the perspective PNG of one frame, seen from its front right if `camera` does not say otherwise."""
    figure, axes = new_page(WIDTH, HEIGHT)
    body = np.asarray(study.vertices[frame], dtype=np.float64)
    top = pressure_scale_top(study)
    if np.isfinite(body).all():
        camera = camera or camera_around([body], study)
        draw_scene(axes, camera, study, frame, (WIDTH, HEIGHT))
        draw_markers(axes, camera, study, frame)
    else:
        axes.text(WIDTH / 2, HEIGHT / 2, "this body has no finite position", ha="center", color=colors.MUTED, size=15)
    _write_title(axes, study, frame)
    write_legend(figure, study, top)
    save(figure, path)


def draw_scene(
    axes: Axes, camera: ViewCamera, study: Study, frame: int, size: tuple[int, int], paint: Paint | None = None
) -> None:
    """One frame's floor, base of support and body on axes of `size` pixels. `paint`: as in `draw_body`."""
    body = np.asarray(study.vertices[frame], dtype=np.float64)
    _draw_floor(axes, camera, study, body, study.ground.project(body), size)
    _draw_support(axes, camera, study.polygons[frame])
    draw_body(axes, camera, study, body, pressure_scale_top(study), size, paint=paint)


def camera_around(
    bodies: Sequence[np.ndarray], study: Study, turn: float = 35.0, tilt: float = 16.0, box: Box = _BOX
) -> ViewCamera:
    """A camera that sees these bodies (V, 3) and their shadows in a box of pixels; turn and tilt as in `look_at`."""
    points = np.concatenate([part for body in bodies for part in (body, study.ground.project(body))])
    return look_at(points, np.asarray(study.ground.normal, dtype=np.float64), box, turn, tilt)


def save(figure: Figure, path: Path | IO[bytes]) -> None:
    """Write a PNG; characters of a name that the font lacks become boxes without a word."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from", category=UserWarning)
        if not isinstance(path, Path):
            figure.savefig(path, dpi=100, format="png")
            return
        with atomic_write(path) as file:
            figure.savefig(file, dpi=100, format="png")


def pressure_scale_top(study: Study) -> float:
    """Top of the pressure scale: 1 where nothing is below the ground, else the deepest point's, 3 at most."""
    lowest = study.numbers["lowest"]
    deepest = np.nanmin(lowest) if np.isfinite(lowest).any() else 0.0
    return float(np.clip(pressure_at(np.asarray(deepest), study.preset.alpha, study.preset.gamma), 1.0, _TOP))


def new_page(width: int, height: int) -> tuple[Figure, Axes]:
    """A white figure and axes over all of it in pixels, y downwards."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width / 100, height / 100), facecolor="white")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0, width), ylim=(height, 0))
    axes.axis("off")
    return figure, axes


def _draw_floor(
    axes: Axes, camera: ViewCamera, study: Study, body: np.ndarray, shadow: np.ndarray, size: tuple[int, int]
) -> None:
    from matplotlib.collections import LineCollection

    ground = study.ground
    center = ground.project((body.min(axis=0) + body.max(axis=0)) / 2)
    radius = 1.35 * np.linalg.norm(shadow - center, axis=-1).max() + 0.25 * np.ptp(body, axis=0).max()
    e1, e2 = (np.asarray(axis, dtype=np.float64) for axis in ground.axes())
    lines, strength = floor_lines(center, e1, e2, radius, grid_step(radius))
    rgba = np.concatenate([np.broadcast_to(colors.rgb(colors.GRID), (len(lines), 3)), strength[:, None]], axis=1)
    axes.add_collection(LineCollection(list(camera.pixels(lines)[0]), colors=rgba, linewidths=1.1, zorder=1))
    width, height = size
    darkness = _shadow(camera, study, body, shadow, size)
    ink = np.zeros((*darkness.shape, 4))
    ink[..., :3] = colors.rgb("#3a3f4a")
    ink[..., 3] = darkness
    axes.imshow(ink, extent=(0, width, height, 0), zorder=1.5, interpolation="bilinear")
    axes.set(xlim=(0, width), ylim=(height, 0))


def _shadow(
    camera: ViewCamera, study: Study, body: np.ndarray, shadow: np.ndarray, size: tuple[int, int]
) -> np.ndarray:
    """Darkness of the floor's pixels at half size: the lower the skin above them, the darker."""
    from scipy.ndimage import gaussian_filter

    pixels, _ = camera.pixels(shadow)
    height = np.maximum(study.ground.signed_height(body), 0.0)
    faces = study.template.faces
    corners, heights = pixels[faces] / 2, height[faces]
    image, covered = rasterize(corners, -heights, heights[..., None], size[0] // 2, size[1] // 2)
    near = np.where(covered, 0.34 * np.exp(-image[..., 0] / 0.06), 0.0)
    far = np.where(covered, 0.22 * np.exp(-image[..., 0] / 0.8), 0.0)
    return gaussian_filter(near, 3.0) + gaussian_filter(far, 11.0)


def _draw_support(axes: Axes, camera: ViewCamera, polygon: np.ndarray) -> None:
    if len(polygon) == 0:
        return
    points, _ = camera.pixels(polygon)
    axes.fill(*points.T, facecolor=colors.SUPPORT, alpha=0.55, linewidth=0, zorder=2)
    axes.plot(*np.vstack([points, points[:1]]).T, color=colors.SUPPORT_EDGE, linewidth=2.5, zorder=2.1)


def draw_body(
    axes: Axes,
    camera: ViewCamera,
    study: Study,
    body: np.ndarray,
    top: float,
    size: tuple[int, int],
    opacity: float = 1.0,
    paint: Paint | None = None,
) -> None:
    """The skin on a picture of `size` pixels: with its pressure, or `paint`, colours (N, 3) of heights (N,) above the
    ground."""
    faces = study.template.faces
    pixels, distance = camera.pixels(body)
    normals = vertex_normals(body, faces)
    if study.template.watertight:
        faces = faces[faces_viewer(pixels[faces])]
    values = np.concatenate([normals, study.ground.signed_height(body)[:, None]], axis=-1)
    # Only the box around the body is drawn, in whole picture pixels.
    low = np.clip(np.floor(pixels.min(axis=0)), 0, size).astype(int)
    high = np.clip(np.ceil(pixels.max(axis=0)), 0, size).astype(int)
    if (high <= low).any():
        return
    width, height = (high - low) * _SAMPLES
    image, covered = rasterize((pixels - low)[faces] * _SAMPLES, 1.0 / distance[faces], values[faces], width, height)
    seen = image[covered]
    # Colours are evaluated at every pixel, not blended between vertices: exact on large triangles too.
    if paint is None:
        albedo = colors.heat(pressure_at(seen[:, 3], study.preset.alpha, study.preset.gamma), top)
    else:
        albedo = paint(seen[:, 3])
    rgba = np.zeros((*covered.shape, 4), dtype=np.float32)
    rgba[covered, :3] = _light(albedo, seen[:, :3] @ camera.axes.T)
    rgba[covered, 3] = 1.0
    small = shrink(rgba, _SAMPLES)
    small[..., :3] /= np.maximum(small[..., 3:], 1e-6)
    small[..., 3] *= opacity
    place = (low[0], high[0], high[1], low[1])
    axes.imshow(np.clip(small, 0.0, 1.0), extent=place, zorder=3, interpolation="nearest")


def _light(albedo: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Colours (N, 3) under a soft sky, a key light from the upper left and a rim, normals in camera axes."""
    normals = normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-9)
    normals = np.where(normals[:, 2:] < 0, -normals, normals)
    key = np.array([-0.45, 0.62, 0.64])
    diffuse = np.clip(normals @ key, 0.0, 1.0)
    sky = 0.5 + 0.5 * normals[:, 1]
    rim = (1.0 - np.clip(normals[:, 2], 0.0, 1.0)) ** 3
    half = np.array([-0.25, 0.34, 0.91])
    gloss = np.clip(normals @ half, 0.0, 1.0) ** 40
    strength = 0.46 + 0.28 * sky + 0.46 * diffuse
    linear = albedo**2.2 * (strength**1.4)[:, None] + 0.05 * gloss[:, None]
    return np.clip(linear, 0.0, 1.0) ** (1 / 2.2) * (1.0 - 0.25 * rim)[:, None]


def draw_markers(axes: Axes, camera: ViewCamera, study: Study, frame: int) -> None:
    """CoM with its plumb line, CoP and the outline of the support again, faintly, over the body."""
    com, cop = study.numbers["center_of_mass"][frame], study.numbers["center_of_pressure"][frame]
    polygon = study.polygons[frame]
    if len(polygon):
        points, _ = camera.pixels(np.vstack([polygon, polygon[:1]]))
        axes.plot(*points.T, color=colors.SUPPORT_EDGE, linewidth=1.4, alpha=0.55, zorder=4)
    if np.isfinite(com).all():
        foot = study.ground.project(com)
        (head, below), _ = camera.pixels(np.stack([com, foot]))
        axes.plot(*np.stack([head, below]).T, linewidth=5, alpha=0.7, zorder=5, color="white", solid_capstyle="round")
        axes.plot(*np.stack([head, below]).T, color=colors.COM, linewidth=2.2, zorder=5.1)
        if np.isfinite(cop).all():
            (at,), _ = camera.pixels(study.ground.project(cop)[None])
            axes.plot(*np.stack([below, at]).T, color=colors.INK, linewidth=1.6, linestyle=(0, (3, 2)), zorder=5.2)
        _dot(axes, below, colors.COM, 9)
        _dot(axes, head, colors.COM, 19)
    if np.isfinite(cop).all():
        (at,), _ = camera.pixels(study.ground.project(cop)[None])
        _dot(axes, at, colors.COP, 15)


def _dot(axes: Axes, at: np.ndarray, color: str, size: float) -> None:
    axes.plot(*at, "o", color=color, markersize=size, markeredgecolor="white", markeredgewidth=2.2, zorder=6)


def _write_title(axes: Axes, study: Study, frame: int) -> None:
    title, line = frame_caption(study, frame)
    axes.text(60, 70, title, size=25, color=colors.INK, va="center", weight="bold", parse_math=False)
    axes.text(60, 116, line, size=15, color=colors.MUTED, va="center", parse_math=False)


def frame_caption(study: Study, frame: int) -> tuple[str, str]:
    """Title of a frame and one line of its measured quantities."""
    value = {key: column[frame] for key, column in study.numbers.items()}
    title = study.name if study.num_frames == 1 else f"{study.name} · {study.label(frame)}"
    if not np.isfinite(value["mass"]):
        return title, "not measurable"
    parts = [f"CoM–CoP {value['com_cop_distance'] * 1000:.0f} mm"]
    if value["has_contact"]:
        parts += [f"margin {signed(value['margin'])} mm", f"support {value['area'] * 1e4:.0f} cm²"]
        parts += ["CoM over its support" if value["bose"] else "CoM outside its support"]
    else:
        parts += ["no contact with the ground"]
    return title, "   ·   ".join(parts)


def signed(metres: float) -> str:
    """Millimetres with a sign, as print has it."""
    return f"{metres * 1000:+.0f}".replace("-", "−")


def write_legend(figure: Figure, study: Study, top: float) -> None:
    """The markers' names and the pressure scale on a white strip along the bottom of a page ``WIDTH`` pixels wide."""
    from matplotlib.patches import Rectangle

    height, y = 124.0, 58.0
    axes = figure.add_axes((0.0, 0.0, 1.0, height / 100 / figure.get_figheight()))
    axes.set(xticks=[], yticks=[], facecolor="white")
    for side in axes.spines.values():
        side.set_visible(False)

    method = "pCoM" if study.com_method == "pcom" else "exact"
    for x, color, text in ((75, colors.COM, f"centre of mass ({method})"), (368, colors.COP, "centre of pressure")):
        axes.plot(x, y, "o", color=color, markersize=14, markeredgecolor="white", markeredgewidth=2)
        axes.text(x + 22, y, text, size=14.5, color=colors.INK, va="center")
    edge = {"facecolor": colors.SUPPORT, "alpha": 0.9, "edgecolor": colors.SUPPORT_EDGE, "linewidth": 1.5}
    axes.add_patch(Rectangle((612, y - 10), 30, 20, **edge))
    axes.text(654, y, "base of support", size=14.5, color=colors.INK, va="center")
    left, right = 870.0, 1130.0
    axes.imshow(colors.heat_table()[None], extent=(left, right, y + 8, y - 8), aspect="auto")
    axes.text(left, y - 24, "pressure (relative)", size=13, color=colors.INK, va="center")
    ticks = np.arange(0, np.floor(top) + 1) if top > 1 else np.array([0.0, 0.5, 1.0])
    for tick in ticks:
        x = left + (right - left) * tick / top
        more = "≥ " if top >= _TOP and tick == top else ""
        axes.text(x, y + 26, f"{more}{tick:g}", size=12, color=colors.MUTED, ha="center", va="center")
    axes.set(xlim=(0, WIDTH), ylim=(height, 0))


def fix_layout(picture: Figure, dpi: float) -> None:
    """Lay a figure out for a picture of that dpi, and freeze the layout: matplotlib's solver differs in the last digit
    between calls, and an SVG names its clips after all digits."""
    if picture.get_layout_engine() is None:
        return
    picture.set_dpi(dpi)
    picture.draw_without_rendering()
    picture.set_layout_engine("none")
    for axes in picture.axes:
        left, bottom, width, height = (round(float(edge), 9) for edge in axes.get_position(original=True).bounds)
        axes.set_position((left, bottom, width, height), which="original")
