"""Pictures of a comparison: pressure on the floor, what happens over time, and the fitted bodies with their markers."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import ipman_rs as ip

from ..body.sequence import PosedSequence
from ..view import colors
from .comparison import Comparison
from .computed import ALPHA, GAMMA, carried, sole_vertices, under
from .zero_moment_point import GRAVITY

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Bodies = PosedSequence | NDArray[np.floating]  # (T, V, 3) m

CELL = 0.01  # m, of the map
MARGIN = 0.12  # m around the feet
OURS, REFERENCE = "#1f77b4", "#9aa1ad"


def moments(one: Comparison) -> dict[str, int]:
    """The frames that are worth a picture: the middle of each phase's longest run, or where the body is lowest."""
    found = {}
    for phase, mask in one.phases.items():
        known = mask & np.isfinite(one.zmp[:, 0])
        rows = np.flatnonzero(known if known.any() else mask)
        if len(rows):
            runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
            longest = max(runs, key=len)
            lowest = rows[int(one.com[rows, 1].argmin())]
            found[phase] = int(lowest if one.kind == "movement in place" else longest[len(longest) // 2])
    return found or {"all": len(one.times) // 2}


def pressure_map(one: Comparison, bodies: Bodies, template: ip.BodyTemplate) -> bytes:
    """A PNG of the engine's pressure on the floor, seen from above, with the plates and all centres."""
    chosen = moments(one)
    limits = [_limits(one, np.asarray(bodies[frame], float), template, frame) for frame in chosen.values()]
    tallest = max((high - low)[1] / (high - low)[0] for low, high in limits)
    figure, axes = _canvas(1, len(chosen), (1 + 4.2 * len(chosen), 1.5 + 4.2 * min(tallest, 1.6)))
    for axis, (phase, frame), box in zip(axes[0], chosen.items(), limits, strict=True):
        _draw_map(axis, one, np.asarray(bodies[frame], float), template, frame, box)
        title = "" if phase == "all" else f"{phase}, "
        axis.set_title(f"{one.name}, {title}{one.times[frame]:.2f} s", fontsize=10)
    axes[0][0].set_ylabel("z, m")
    if one.plates is not None:
        axes[0][0].plot([], [], "^", color="black", ms=6, mfc="white", label="CoP of a plate, with its load")
    told = {name: mark for axis in axes[0] for mark, name in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(list(told.values()), list(told), loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    return _png(figure)


def _limits(one: Comparison, vertices: Array, template: ip.BodyTemplate, frame: int) -> tuple[Array, Array]:
    """Corners of the map: around the soles and all centres."""
    centers = np.array([place[frame, [0, 2]] for _, place, _ in _places(one)])
    around = np.concatenate([vertices[sole_vertices(template)][:, [0, 2]], centers[np.isfinite(centers).all(axis=1)]])
    return around.min(axis=0) - MARGIN, around.max(axis=0) + MARGIN


def _draw_map(
    axis: Axes, one: Comparison, vertices: Array, template: ip.BodyTemplate, frame: int, limits: tuple[Array, Array]
) -> None:
    from scipy.ndimage import gaussian_filter

    low, high = limits
    rho = np.asarray(ip.pressure(vertices, template, under(vertices), ALPHA, GAMMA), float)
    points = np.asarray(ip.sample_surface(vertices, template), float)[:, [0, 2]]
    edges = [np.arange(low[k], high[k] + CELL, CELL) for k in range(2)]
    density, *_ = np.histogram2d(*points.T, bins=edges, weights=rho)
    density = gaussian_filter(density, 1.0)
    box = (edges[0][0], edges[0][-1], edges[1][-1], edges[1][0])
    axis.imshow(colors.heat(density.T / density.max(), 1.0), extent=box, interpolation="bilinear")
    if one.plates is not None:
        _draw_plates(axis, one, frame)
    for name, place, (mark, color, size) in _places(one):
        if np.isfinite(place[frame]).all():
            axis.plot(*place[frame, [0, 2]], mark, color=color, ms=size, mec="white", label=name, zorder=5)
    axis.set(xlim=(low[0], high[0]), ylim=(high[1], low[1]), xlabel="x, m", aspect="equal")


def _places(one: Comparison) -> list[tuple[str, Array, tuple[str, str, float]]]:
    found = [
        ("CoM on the floor", one.com, ("o", colors.COM, 11)),
        ("the paper's CoP, γ = 10", one.computed.cop[10], ("o", colors.COP, 9)),
    ]
    if one.measured is not None:
        found.append(("measured CoP", one.measured, ("^", "black", 10)))
        found.append(("ZMP of the parts", one.zmp, ("D", OURS, 6)))
    if one.reference is not None:
        found.append(("reference CoM", one.reference, ("s", REFERENCE, 6)))
    return found  # type: ignore[return-value]


def _draw_plates(axis: Axes, one: Comparison, frame: int) -> None:
    """Each plate's outline, as far as it is known, its centre of pressure and its load."""
    plates = one.plates
    assert plates is not None
    for outline in () if plates.corners is None else plates.corners[:, :, [0, 2]]:
        axis.plot(*np.vstack([outline, outline[:1]]).T, color=colors.INK, lw=1, ls="--", zorder=2)
    for plate in np.flatnonzero(carried(plates)[frame] > 0):
        place, told = plates.points[frame, plate, [0, 2]], f"{plates.loads[frame, plate]:.0f} N"
        axis.plot(*place, "^", color="black", ms=6, mfc="white", zorder=4)
        box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 1}
        axis.annotate(told, (place[0], place[1]), (9, -14), textcoords="offset points", fontsize=8, bbox=box, zorder=6)


def over_time(one: Comparison) -> bytes:
    """A PNG of the CoM's height, the centres along both axes of the floor, and the load, over time."""
    rows = 4 if one.plates is not None else 3
    figure, grid = _canvas(rows, 1, (9, 2.1 * rows), sharex=True)
    axes = [row[0] for row in grid]
    axes[0].plot(one.times, one.com[:, 1], color=OURS, lw=1.3, label="fitted body, whole volume")
    if one.reference is not None:
        axes[0].plot(one.times, one.reference[:, 1], color=REFERENCE, lw=2.5, zorder=1, label="reference")
    axes[0].set_ylabel("CoM height, m")
    axes[0].legend(frameon=False, fontsize=7, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1))
    for axis, column, name in ((axes[1], 0, "x"), (axes[2], 2, "z")):
        _draw_centers(axis, one, column)
        axis.set_ylabel(f"{name} on the floor, mm")
    axes[1].legend(frameon=False, fontsize=7, ncols=5, loc="lower center", bbox_to_anchor=(0.5, 1))
    if one.plates is not None:
        _draw_loads(axes[3], one)
    axes[-1].set(xlabel="s", xlim=_span(one))
    return _png(figure)


def _span(one: Comparison) -> tuple[float, float]:
    """The times of which there are measurements, and a little more."""
    known = one.complete if one.reference is None else one.complete | np.isfinite(one.reference[:, 0])
    times = one.times[known] if known.any() else one.times
    return max(one.times[0], times[0] - 0.3), min(one.times[-1], times[-1] + 0.3)


def _draw_centers(axis: Axes, one: Comparison, column: int) -> None:
    shown = [
        ("CoM", one.com, {"color": colors.COM, "lw": 1.2}),
        ("the paper's CoP, γ = 10", one.computed.cop[10], {"color": colors.COP, "lw": 1.2}),
    ]
    if one.measured is not None:
        measured = np.where(one.complete[:, None], one.measured, np.nan)
        shown.insert(0, ("measured CoP", measured, {"color": "black", "lw": 2}))
        shown.append(("ZMP of the parts", one.zmp, {"color": OURS, "lw": 1.2}))
    if one.reference is not None:
        shown.append(("reference CoM", one.reference, {"color": REFERENCE, "lw": 2, "zorder": 1}))
    for name, places, look in shown:
        axis.plot(one.times, 1e3 * places[:, column], label=name, **look)
    low, high = _span(one)
    inside = (one.times >= low) & (one.times <= high)
    known = [1e3 * places[inside, column] for name, places, _ in shown if not name.startswith("ZMP")]
    low, high = min(np.nanmin(v) for v in known), max(np.nanmax(v) for v in known)
    room = 0.15 * (high - low) + 5
    axis.set_ylim(low - room, high + room)


def _draw_loads(axis: Axes, one: Comparison) -> None:
    assert one.plates is not None
    for plate in range(one.plates.forces.shape[1]):
        if carried(one.plates)[:, plate].any():
            axis.plot(
                one.times, one.plates.forces[:, plate, 1], lw=1, color=f"C{1 + plate}", label=f"plate {plate + 1}"
            )
    axis.plot(one.times, one.force[:, 1], color="black", lw=1.6, label="all plates")
    asked = one.weight * (GRAVITY + one.acceleration[:, 1])
    axis.plot(one.times, asked, color=OURS, lw=1.2, label="m (g + acceleration of the fitted CoM)")
    axis.set_ylabel("upward force, N")
    axis.set_ylim(bottom=-30)
    axis.legend(frameon=False, fontsize=7, ncols=5, loc="lower center", bbox_to_anchor=(0.5, 1))


def people(one: Comparison, bodies: Bodies, faces: NDArray[np.int64], markers: Array) -> bytes:
    """A PNG of three fitted bodies with their markers (T, M, 3), seen along z and one along x."""
    usable = np.flatnonzero(one.complete) if one.complete.any() else np.arange(len(one.times))
    spread = usable[np.linspace(0, len(usable) - 1, 5).round().astype(int)[[1, 2, 3]]]
    frames = (
        [*spread, spread[1]]
        if one.kind != "movement in place"
        else [usable[0], spread[1], *2 * [usable[one.com[usable, 1].argmin()]]]
    )
    figure, grid = _canvas(1, 4, (11, 4.6), sharey=True)
    for axis, frame, across in zip(grid[0], frames, (0, 0, 0, 2), strict=True):
        _draw_body(axis, one, np.asarray(bodies[frame], float), faces, markers[frame], int(frame), across)
    grid[0][0].set_ylabel("m")
    return _png(figure)


def _draw_body(
    axis: Axes, one: Comparison, vertices: Array, faces: NDArray[np.int64], markers: Array, frame: int, across: int
) -> None:
    """A body seen along the axis that is neither up nor `across`."""
    from matplotlib.collections import PolyCollection

    away = 2 - across
    sign = 1 if away == 2 else -1
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    light = (normal / np.linalg.norm(normal, axis=1, keepdims=True).clip(1e-12))[:, away] * sign
    order = (sign * corners[:, :, away].mean(axis=1)).argsort()
    order = order[light[order] > 0]
    shade = np.repeat((0.45 + 0.45 * light[order])[:, None], 3, axis=1)
    axis.add_collection(
        PolyCollection(list(corners[order][:, :, [across, 1]]), facecolors=shade, edgecolors="face", linewidths=0.3)
    )
    axis.plot(markers[:, across], markers[:, 1], "o", ms=2.5, color="#d62728")
    axis.plot(*one.com[frame, [across, 1]], "P", ms=9, color=colors.COM, mec="w")
    if one.measured is not None and one.complete[frame]:
        axis.plot(one.measured[frame, across], one.measured[frame, 1], "^", ms=7, color="k")
    axis.axhline(float(one.floor.height), color="0.5", lw=0.8)
    middle = vertices[:, across].mean()
    axis.set(xlim=(middle - 0.6, middle + 0.6), xticks=[], aspect="equal")
    axis.set_title(f"{one.times[frame]:.2f} s, {'along z' if across == 0 else 'along x'}", fontsize=9)


def _canvas(rows: int, columns: int, size: tuple[float, float], **options: Any) -> tuple[Figure, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **options)


def _png(figure: Figure) -> bytes:
    for axis in figure.axes:
        axis.spines[["top", "right"]].set_visible(False)
    stream = io.BytesIO()
    figure.savefig(stream, dpi=90, format="png")
    return stream.getvalue()
