"""Estimated beside measured pressure of one frame on a mat (the paper's Fig. 6), with CoPs and CoM.

The estimated map is that of the biomechanics protocol (`ipman_rs.evaluation.moyo`): the pressure of the samples over
the mat, scaled to run from 0 to 1, summed in each cell, scaled again. The numbers also have the protocol's own choice,
the best α and γ of its grid for this very frame, which flatters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import ipman_rs as ip
from ipman_rs import view
from ipman_rs.body import BodyModel
from ipman_rs.data.frames import DataSet, PressureMaps
from ipman_rs.evaluation import moyo, pressure_map
from ipman_rs.evaluation.tables.models import Models
from ipman_rs.view import cells, colors
from ipman_rs.view.picture import camera_around

from .files import PaperFigure
from .posed_bodies import posed_bodies
from .style import WORDS, new_figure, show_pixels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap

Array = NDArray[np.floating]

CELL = (460, 560)  # pixels
AROUND, NEAR = 0.08, 0.03  # m that are shown around what presses, and around a centre
PRESSED, FAINT = 0.1, 0.02  # of the largest: what presses, and what is left white


@dataclass(frozen=True, eq=False)
class MatBody:
    """One body (V, 3) m on a mat: what the mat measured there, `measured.values` (H, W), with its centre of pressure
    (3,) m, and the measured centre of mass (3,), NaN without one."""

    name: str
    vertices: Array
    model: BodyModel
    ground: ip.Ground
    measured: PressureMaps
    center: Array
    mass: Array


def of_data_set(name: str, data: DataSet, frame: str | int | None = None, models: Models | None = None) -> MatBody:
    """A frame of a data set with a mat: of that name, of that number, or the one that the mat carries most.

    ValueError, naming the data set, without such a frame or without pressure maps; and as `posed_bodies`.
    """
    row = _row(name, data, frame)
    some = data[slice(row, row + 1)]
    if some.pressure is None or some.center_of_pressure is None:
        raise ValueError(f"{name}: has no pressure maps of a mat; expected a data set such as moyo")
    measured = some.pressure
    if not np.nan_to_num(measured.values).max() > 0:
        raise ValueError(f"{name}: the mat measured nothing in frame {some.names[0]}; choose another")
    posed = next(posed_bodies(name, data, models or Models(), np.array([row])), None)
    if posed is None:
        raise ValueError(f"{name}: frame {some.names[0]} has no finite body")
    ground = ip.Ground(np.reshape(posed.ground.normal, (-1, 3))[0], np.ravel(posed.ground.height)[0])
    mass = np.full(3, np.nan) if some.center_of_mass is None else some.center_of_mass[0]
    map_ = PressureMaps(measured.values[0], measured.origin, measured.e1, measured.e2, measured.cell)
    vertices = np.asarray(posed.vertices[0], np.float64)
    return MatBody(str(some.names[0]), vertices, posed.model, ground, map_, some.center_of_pressure[0], mass)


def _row(name: str, data: DataSet, frame: str | int | None) -> int:
    if frame is None:
        return _heaviest(name, data)
    if isinstance(frame, int):
        if not 0 <= frame < len(data):
            raise ValueError(f"{name}: has {len(data)} frames, from 0; there is no frame {frame}")
        return frame
    for start in range(0, len(data), 4096):
        rows = np.flatnonzero(data[slice(start, start + 4096)].names == frame)
        if len(rows):
            return start + int(rows[0])
    raise ValueError(f"{name}: no frame is called {frame!r}; its first is {str(data[slice(0, 1)].names[0])!r}")


def _heaviest(name: str, data: DataSet) -> int:
    """The first frame whose map has the largest sum."""
    best, heaviest = 0, -np.inf
    for start in range(0, len(data), 1024):
        maps = data[slice(start, min(start + 1024, len(data)))].pressure
        if maps is None:
            raise ValueError(f"{name}: has no pressure maps of a mat; expected a data set such as moyo")
        sums = np.nan_to_num(maps.values).sum(axis=(1, 2))
        if sums.max() > heaviest:
            best, heaviest = start + int(sums.argmax()), float(sums.max())
    return best


def pressure(pressed: MatBody, preset: str = "paper-r") -> PaperFigure:
    """The body with its pressure, its map on the mat's cells, and the measured map."""
    constants = ip.presets.get(preset)
    template = pressed.model.template
    study = view.study(pressed.name, pressed.vertices, template, pressed.ground, preset)
    samples = np.asarray(ip.sample_surface(pressed.vertices, template))
    mat = pressed.measured
    scores = moyo(
        samples[None], pressed.ground, PressureMaps(mat.values[None], mat.origin, mat.e1, mat.e2, mat.cell),
        pressed.center[None], constants.alpha, constants.gamma,
    )  # fmt: skip
    maps = {"estimated": _estimated(pressed, samples, constants), "measured": _scaled(mat.values)}
    mass = np.asarray(ip.center_of_mass(pressed.vertices, template))
    center = np.asarray(
        ip.center_of_pressure(pressed.vertices, template, pressed.ground, constants.alpha, constants.gamma)
    )
    numbers: dict[str, Any] = {
        "frame": pressed.name,
        "preset": preset,
        "alpha_per_m": constants.alpha,
        "gamma_per_m": constants.gamma,
        "iou": scores.fixed.iou[0],
        "cop_error_m": scores.fixed.cop_error[0],
        "best_of_the_grid": {
            "iou": scores.best_iou.iou[0],
            "alpha_per_m": scores.best_iou.alpha[0],
            "gamma_per_m": scores.best_iou.gamma[0],
            "cop_error_m": scores.best_cop_error.cop_error[0],
        },
        "com_error_m": float(np.linalg.norm(mass - pressed.mass)),
        "center_of_mass": {"estimated": mass, "measured": pressed.mass},
        "center_of_pressure": {"estimated": center, "measured": pressed.center},
        "margin_m": study.numbers["margin"][0],
    }
    rows, columns = _shown(maps, mat, (mass, center, pressed.mass, pressed.center))
    figure = new_figure(7.6, 4.0)
    wide = float(np.clip(np.ptp(columns) / np.ptp(rows), 0.35, 1.0))
    body, left, right = figure.subplots(1, 3, width_ratios=(CELL[0] / CELL[1], wide, wide))
    camera = camera_around([pressed.vertices], study, 40.0, 14.0, cells.box_of(CELL))
    show_pixels(body, cells.scene_cell(study, camera, CELL))
    for axes, key, points in (
        (left, "estimated", (mass, center)),
        (right, "measured", (pressed.mass, pressed.center)),
    ):
        _draw_map(axes, mat, maps[key], points)
        axes.set(xlim=100 * columns, ylim=100 * rows[::-1])
    words = f"IoU {numbers['iou']:.2f}, CoP {1e3 * numbers['cop_error_m']:.0f} mm off"
    left.set_title("estimated", size=WORDS, color=colors.INK)
    right.set_title("measured", size=WORDS, color=colors.INK)
    figure.get_layout_engine().set(h_pad=0.08)  # type: ignore[union-attr]
    figure.suptitle(f"{pressed.name}\n{words}", size=WORDS, color=colors.INK, parse_math=False)
    _write_key(figure, (left, right))
    best = numbers["best_of_the_grid"]
    summary = (
        f"{pressed.name}: IoU {numbers['iou']:.3f}, CoP {1e3 * numbers['cop_error_m']:.0f} mm off; the best of the "
        f"paper's grid {best['iou']:.3f}, {1e3 * best['cop_error_m']:.0f} mm"
    )
    return PaperFigure("pressure", figure, numbers, maps, summary=[summary])


def _estimated(pressed: MatBody, samples: Array, preset: Any) -> Array:
    """The protocol's map (H, W) of the body's samples, from 0 to 1."""
    rho = np.asarray(ip.pressure(pressed.vertices, pressed.model.template, pressed.ground, preset.alpha, preset.gamma))
    counts = np.asarray(pressure_map(samples, np.ones(len(rho)), pressed.measured))
    on = _on_mat(samples, pressed.measured)
    if not on.any():
        return np.zeros_like(counts)
    least, most = rho[on].min(), rho[on].max()
    sums = np.asarray(pressure_map(samples, rho, pressed.measured))
    return _scaled((sums - least * counts) / max(most - least, 1e-300))


def _on_mat(samples: Array, mat: PressureMaps) -> NDArray[np.bool_]:
    offset = (samples - mat.origin) / mat.cell
    height, width = mat.values.shape
    i, j = offset @ mat.e1, offset @ mat.e2
    return (i >= 0) & (i < height) & (j >= 0) & (j < width)


def _scaled(values: Array) -> Array:
    span = values.max() - values.min()
    return (values - values.min()) / (span if span else 1.0)


def _shown(maps: dict[str, Array], mat: PressureMaps, points: tuple[Array, ...]) -> tuple[Array, Array]:
    """The first and the last m along the rows and the columns that are drawn: around what presses on the mat by either
    map, and around these points, which may lie beside it."""
    both = np.maximum(maps["estimated"], maps["measured"])
    known = [point - mat.origin for point in points if np.isfinite(point).all()]
    limits = []
    for axis, count, along in ((1, both.shape[0], mat.e1), (0, both.shape[1], mat.e2)):
        pressed = np.flatnonzero(both.max(axis=axis) > PRESSED) * mat.cell
        ends = np.array([pressed[0] - AROUND, pressed[-1] + mat.cell + AROUND]).clip(0, count * mat.cell)
        places = [float(offset @ along) for offset in known]
        limits.append(np.array([min(ends[0], min(places) - NEAR), max(ends[1], max(places) + NEAR)]))
    return limits[0], limits[1]


def _draw_map(axes: Axes, mat: PressureMaps, values: Array, points: tuple[Array, Array]) -> None:
    """A map as it lies on the floor, in cm along the mat, the columns to the right, the rows down."""
    cm = 100 * mat.cell
    height, width = mat.values.shape
    shown = np.where(values > FAINT, values, np.nan)
    axes.imshow(shown, cmap=_heat(), vmin=0, vmax=1, extent=(0, width * cm, height * cm, 0), interpolation="nearest")
    axes.plot(*_edge(width * cm, height * cm), color=colors.GRID, linewidth=1.0)
    if not np.isfinite(shown).any():
        words: dict[str, Any] = {"transform": axes.transAxes, "ha": "center", "va": "center", "color": colors.MUTED}
        axes.text(0.5, 0.5, "nothing on\nthe mat", size=WORDS, **words)
    for point, color in zip(points, (colors.COM, colors.COP), strict=True):
        if np.isfinite(point).all():
            offset = point - mat.origin
            at = 100 * float(offset @ mat.e2), 100 * float(offset @ mat.e1)
            axes.plot(*at, "o", color=color, markersize=8, markeredgecolor="white", markeredgewidth=1.2, zorder=5)
    axes.set_aspect("equal")
    axes.set_facecolor("white")
    axes.tick_params(labelsize=WORDS - 2, colors=colors.MUTED)
    axes.set_xlabel("cm", size=WORDS - 1, color=colors.INK)
    for side in axes.spines.values():
        side.set_color(colors.GRID)


def _edge(width: float, height: float) -> tuple[list[float], list[float]]:
    """The outline of the mat."""
    return [0, width, width, 0, 0], [0, 0, height, height, 0]


def _heat() -> Colormap:
    from matplotlib.colors import ListedColormap

    return ListedColormap(colors.heat_table())


def _write_key(figure: Any, axes: tuple[Axes, Axes]) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.lines import Line2D

    bar = figure.colorbar(ScalarMappable(cmap=_heat()), ax=axes, fraction=0.035, pad=0.02, shrink=0.85)
    bar.set_label(f"pressure, of the largest (under {100 * FAINT:g} %: white)", size=WORDS - 1)
    bar.ax.tick_params(labelsize=WORDS - 2)
    handles = [
        Line2D([], [], color=color, marker="o", linestyle="", markersize=7, label=word)
        for color, word in ((colors.COM, "centre of mass"), (colors.COP, "centre of pressure"))
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=WORDS - 1, frameon=False)
