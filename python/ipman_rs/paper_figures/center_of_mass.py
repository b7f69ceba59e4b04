"""The formulations of the centre of mass on one body, with the centre of pressure and that of binary contact (the
paper's supplement, Fig. S.3)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import ipman_rs as ip
from ipman_rs import view
from ipman_rs.quantities import Method
from ipman_rs.view import cells, colors
from ipman_rs.view.picture import camera_around

from .files import PaperFigure
from .style import SERIES, WORDS, new_figure, show_pixels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ipman_rs.study.camera import ViewCamera
    from ipman_rs.view import Study

Array = NDArray[np.floating]

TITLES: dict[Method, str] = {
    "pcom": "pCoM (Eq. 1)",
    "exact": "exact, of the solid",
    "vertex_mean": "mean of the vertices",
    "sample_mean": "mean of the samples",
    "face_area": "faces by area",
}
CELL = (600, 760)  # pixels
MAP = (600, 600)
COLORS = dict(zip(TITLES, (colors.COM, SERIES[0], SERIES[1], SERIES[3], SERIES[5]), strict=True))
MARKS = dict(zip(TITLES, "oD^vs", strict=True))
BINARY = "#d32f2f"
_EDGE = {"markeredgecolor": "white", "markeredgewidth": 1.0, "zorder": 5}


def center_of_mass(
    vertices: Any, template: ip.BodyTemplate, ground: ip.Ground, name: str, preset: str = "paper-r"
) -> PaperFigure:
    """One body (V, 3) m with its centres of mass, from the side and from above, and on the ground its two centres of
    pressure. The threshold of binary contact is the preset's. ValueError where a vertex is not finite."""
    body = np.asarray(vertices, dtype=np.float64)
    if not np.isfinite(body).all():
        raise ValueError(f"{name}: expected a body of finite vertices")
    study = view.study(name, body, template, ground, preset)
    points: dict[Method, Array] = {method: np.asarray(ip.center_of_mass(body, template, method)) for method in TITLES}
    pressure = np.asarray(study.numbers["center_of_pressure"][0])
    binary = ip.binary_center_of_pressure(body, template, ground, study.preset.threshold)
    about = {key: _about(point, points["exact"], pressure, binary, ground) for key, point in points.items()}
    numbers = {
        "body": name,
        "preset": study.preset.name,
        "threshold_m": study.preset.threshold,
        "centers_of_mass": about,
        "center_of_pressure": pressure,
        "binary_center_of_pressure": binary,
        "between_centers_of_pressure_m": _apart(pressure, binary, ground),
        "margin_m": study.numbers["margin"][0],
    }
    table = [
        {"formulation": key, "x_m": point[0], "y_m": point[1], "z_m": point[2], **_distances(about[key])}
        for key, point in points.items()
    ]
    head = ["centre of mass", "height cm", "from exact mm", "from CoP mm", "from binary CoP mm"]
    lines = [
        [key, f"{100 * each['height_m']:.1f}", f"{1e3 * each['to_exact_m']:.0f}", *_millimetres(each)]
        for key, each in about.items()
    ]
    return PaperFigure("com", _draw(study, points, binary, numbers), numbers, table=table, summary_table=(head, lines))


def _millimetres(about: dict[str, Any]) -> list[str]:
    distances = (about[f"to_{kind}center_of_pressure_on_ground_m"] for kind in ("", "binary_"))
    return ["–" if value != value else f"{1e3 * value:.0f}" for value in distances]


def _about(point: Array, exact: Array, pressure: Array, binary: Array, ground: ip.Ground) -> dict[str, Any]:
    return {
        "position": point,
        "height_m": float(ground.signed_height(point)),
        "to_exact_m": float(np.linalg.norm(point - exact)),
        "to_center_of_pressure_on_ground_m": _apart(point, pressure, ground),
        "to_binary_center_of_pressure_on_ground_m": _apart(point, binary, ground),
    }


def _distances(about: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in about.items() if key != "position"}


def _apart(first: Array, second: Array, ground: ip.Ground) -> float:
    """Metres between two points on the ground."""
    return float(np.linalg.norm(ground.project(first) - ground.project(second)))


def _draw(study: Study, points: dict[Method, Array], binary: Array, numbers: dict[str, Any]) -> Figure:
    figure = new_figure(9.4, 6.2)
    places = figure.subplot_mosaic([["body", "ground"], ["body", "near"]], width_ratios=(1, 1.1))
    camera = camera_around([study.vertices[0]], study, 62.0, 6.0, cells.box_of(CELL))
    show_pixels(places["body"], _body_under(study, camera))
    places["body"].set_title(
        study.name, loc="left", size=WORDS + 2, weight="bold", color=colors.INK, parse_math=False
    )  # fmt: skip
    _mark_body(places["body"], camera, study, points, binary)
    _mark_ground(places["ground"], study, points, binary)
    places["ground"].set_title("on the ground, from above", loc="left", size=WORDS + 1, color=colors.INK)
    _mark_ground(places["near"], study, points, binary)
    _enlarge(places["near"], study, points)
    _write_key(figure, numbers)
    return figure


def _body_under(study: Study, camera: ViewCamera) -> NDArray[np.uint8]:
    """The body on its floor, pale enough that the marks inside it show."""
    pixels = cells.scene_cell(
        study, camera, CELL, lambda height: np.full((len(height), 3), colors.rgb("#e3e0dc")), False
    )
    return (0.45 * 255 + 0.55 * pixels).astype(np.uint8)


def _mark_body(axes: Axes, camera: ViewCamera, study: Study, points: dict[Method, Array], binary: Array) -> None:
    scale = 2  # of the picture's pixels to the cell's
    com = points["pcom"]
    line = scale * camera.pixels(np.stack([com, study.ground.project(com)]))[0]
    axes.plot(*line.T, color=colors.COM, linewidth=1.2, zorder=3)
    for key, point in points.items():
        at = scale * camera.pixels(point[None])[0][0]
        axes.plot(*at, MARKS[key], color=COLORS[key], markersize=6.5, **_EDGE)
    for point, color, mark in _pressures(study, binary):
        if np.isfinite(point).all():
            at = scale * camera.pixels(study.ground.project(point)[None])[0][0]
            _mark_pressure(axes, at, color, mark)


def _mark_pressure(axes: Axes, at: Array, color: str, mark: str) -> None:
    edge = _EDGE if mark == "o" else {"markeredgewidth": 2.0, "zorder": 5}
    axes.plot(*at, mark, color=color, markersize=8 if mark == "o" else 6, **edge)


def _pressures(study: Study, binary: Array) -> tuple[tuple[Array, str, str], ...]:
    return (study.numbers["center_of_pressure"][0], colors.COP, "o"), (binary, BINARY, "x")


def _mark_ground(axes: Axes, study: Study, points: dict[Method, Array], binary: Array) -> None:
    """All centres on the ground from above, over the base of support and the samples that touch."""
    polygon = study.polygons[0]
    if len(polygon):
        outline = _on_ground(study, polygon)
        axes.fill(*outline.T, facecolor=colors.SUPPORT, alpha=0.3, linewidth=0)
        axes.plot(*np.vstack([outline, outline[:1]]).T, color=colors.SUPPORT_EDGE, linewidth=1.2)
    samples = ip.sample_surface(study.vertices[0], study.template)
    near = np.abs(study.ground.signed_height(samples)) < study.preset.threshold
    axes.scatter(*_on_ground(study, samples[near]).T, color="#8a8f99", s=0.6, linewidths=0, alpha=0.6, rasterized=True)
    for point, color, mark in _pressures(study, binary):
        if np.isfinite(point).all():
            _mark_pressure(axes, _on_ground(study, point), color, mark)
    for key, point in points.items():
        axes.plot(*_on_ground(study, point), MARKS[key], color=COLORS[key], markersize=8, **_EDGE)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_ylabel("cm", size=WORDS, color=colors.INK)
    axes.tick_params(labelsize=WORDS - 1, colors=colors.MUTED)
    axes.grid(color=colors.GRID, alpha=0.5, linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(0.08)


def _on_ground(study: Study, where: Array) -> Array:
    """Coordinates (..., 2) in the ground's own axes, cm."""
    e1, e2 = study.ground.axes()
    return 100 * np.stack([where @ e1, where @ e2], axis=-1)


def _enlarge(axes: Axes, study: Study, points: dict[Method, Array]) -> None:
    """The axes around the centres of mass alone."""
    at = np.array([_on_ground(study, point) for point in points.values()])
    middle, half = (at.min(axis=0) + at.max(axis=0)) / 2, max(0.75 * float(np.ptp(at, axis=0).max()), 1.0)
    axes.set_aspect("equal", adjustable="box")
    axes.set(xlim=middle[0] + half * np.array([-1, 1]), ylim=middle[1] + half * np.array([-1, 1]))
    axes.set_title("the same, around the centres of mass", loc="left", size=WORDS + 1, color=colors.INK)
    axes.set_xlabel("cm", size=WORDS, color=colors.INK)


def _write_key(figure: Figure, numbers: dict[str, Any]) -> None:
    """What each mark is, with its height and its distances, under the pictures."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = []
    for key, about in numbers["centers_of_mass"].items():
        words = f"{TITLES[key]}: {100 * about['height_m']:.1f} cm up, {1e3 * about['to_exact_m']:.0f} mm from exact"
        distance = about["to_center_of_pressure_on_ground_m"]
        words += f", {1e3 * distance:.0f} mm from CoP" if np.isfinite(distance) else ""
        handles.append(Line2D([], [], color=COLORS[key], marker=MARKS[key], linestyle="", markersize=7, label=words))
    mm = f"{100 * numbers['threshold_m']:g} cm"
    apart = numbers["between_centers_of_pressure_m"]
    words = f"CoP of binary contact, |h| < {mm}"
    words += f": {1e3 * apart:.0f} mm from CoP" if np.isfinite(apart) else ": no contact"
    handles += [
        Line2D([], [], color=colors.COP, marker="o", linestyle="", markersize=7, label="CoP (Eq. 3)"),
        Line2D([], [], color=BINARY, marker="x", linestyle="", markersize=7, label=words),
        Patch(facecolor=colors.SUPPORT, edgecolor=colors.SUPPORT_EDGE, alpha=0.6, label="base of support"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=WORDS - 1, frameon=False)
