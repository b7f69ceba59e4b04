"""Pictures of a comparison: pressure on the floor, what happens over time, and the fitted bodies with their markers."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import ipman_rs as ip

from ..body.sequence import PosedSequence
from ..body.soles import sole_vertices
from ..gravity import GRAVITY
from ..view import colors
from .comparison import MeasuredComparison
from .computed import ALPHA, GAMMA, SOLE, plate_loads

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Bodies = PosedSequence | NDArray[np.floating]  # (T, V, 3) m

CELL = 0.01  # m, of the map
MARGIN = 0.12  # m around the feet
OURS, REFERENCE = "#1f77b4", "#9aa1ad"


def moments(comparison: MeasuredComparison) -> dict[str, int]:
    """The frames that are worth a picture: the middle of each phase's longest run, or where the body is lowest."""
    frames = {}
    for phase, mask in comparison.phases.items():
        known = mask & np.isfinite(comparison.zmp[:, 0])
        rows = np.flatnonzero(known if known.any() else mask)
        if len(rows):
            runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
            longest = max(runs, key=len)
            lowest = rows[int(comparison.com[rows, 1].argmin())]
            frames[phase] = int(lowest if comparison.kind == "movement in place" else longest[len(longest) // 2])
    return frames or {"all": len(comparison.times) // 2}


def pressure_map(comparison: MeasuredComparison, bodies: Bodies, template: ip.BodyTemplate) -> bytes:
    """A PNG of the engine's pressure on the floor, seen from above with the person's front at the top, with the plates
    and all centres."""
    chosen = moments(comparison)
    posed = {frame: np.asarray(bodies[frame], float) for frame in chosen.values()}
    floors = [Floor.under(comparison, vertices, template, frame) for frame, vertices in posed.items()]
    limits = [
        _limits(comparison, posed[f], template, f, floor) for f, floor in zip(chosen.values(), floors, strict=True)
    ]
    tallest = max((high - low)[1] / (high - low)[0] for low, high in limits)
    figure, axes = _canvas(1, len(chosen), (1 + 4.2 * len(chosen), 1.5 + 4.2 * min(tallest, 1.6)))
    for axis, (phase, frame), floor, box in zip(axes[0], chosen.items(), floors, limits, strict=True):
        _draw_map(axis, comparison, posed[frame], template, frame, floor, box)
        title = "" if phase == "all" else f"{phase}, "
        axis.set_title(f"{comparison.name}, {title}{comparison.times[frame]:.2f} s", fontsize=10)
    axes[0][0].set_ylabel("forward, m")
    if comparison.plates is not None and (plate_loads(comparison.plates)[list(chosen.values())] > 0).any():
        axes[0][0].plot([], [], "^", color="black", ms=6, mfc="white", label="CoP of a plate, with its load")
    entries = {name: mark for axis in axes[0] for mark, name in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    return _png(figure)


@dataclass(frozen=True, eq=False)
class Floor:
    """The floor from above as the person faces: right and forward (..., 2) m of the middle of both soles."""

    middle: Array  # (3,) m
    forward: Array  # (3,)

    @classmethod
    def under(cls, one: MeasuredComparison, vertices: Array, template: ip.BodyTemplate, frame: int) -> Floor:
        return cls(vertices[sole_vertices(template, SOLE)].mean(axis=0), one.forward[frame])

    def __call__(self, points: Array) -> Array:
        away = points - self.middle
        return np.stack([away @ np.cross(self.forward, [0.0, 1.0, 0.0]), away @ self.forward], axis=-1)


def _limits(
    comparison: MeasuredComparison, vertices: Array, template: ip.BodyTemplate, frame: int, floor: Floor
) -> tuple[Array, Array]:
    """Corners of the map: around the soles and all centres."""
    centers = floor(np.array([place[frame] for _, place, _ in _places(comparison)]))
    around = np.concatenate([floor(vertices[sole_vertices(template, SOLE)]), centers[np.isfinite(centers).all(axis=1)]])
    return around.min(axis=0) - MARGIN, around.max(axis=0) + MARGIN


def _draw_map(
    axis: Axes,
    comparison: MeasuredComparison,
    vertices: Array,
    template: ip.BodyTemplate,
    frame: int,
    floor: Floor,
    limits: tuple[Array, Array],
) -> None:
    from scipy.ndimage import gaussian_filter

    low, high = limits
    rho = np.asarray(ip.pressure(vertices, template, ip.Ground.under(vertices), ALPHA, GAMMA), float)
    points = floor(np.asarray(ip.sample_surface(vertices, template), float))
    edges = [np.arange(low[k], high[k] + CELL, CELL) for k in range(2)]
    density, *_ = np.histogram2d(*points.T, bins=edges, weights=rho)
    density = gaussian_filter(density, 1.0)
    box = (edges[0][0], edges[0][-1], edges[1][0], edges[1][-1])
    shades = colors.heat(density.T / max(density.max(), np.finfo(float).tiny), 1.0)
    axis.imshow(shades, extent=box, origin="lower", interpolation="bilinear")
    if comparison.plates is not None:
        _draw_plates(axis, comparison, frame, floor)
    for name, place, (mark, color, size) in _places(comparison):
        if np.isfinite(place[frame]).all():
            axis.plot(*floor(place[frame]), mark, color=color, ms=size, mec="white", label=name, zorder=5)
    axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="right, m", aspect="equal")


def _places(comparison: MeasuredComparison) -> list[tuple[str, Array, tuple[str, str, float]]]:
    places = [
        ("CoM on the floor", comparison.com, ("o", colors.COM, 11)),
        ("the paper's CoP, γ = 10", comparison.computed.cop[10], ("o", colors.COP, 9)),
    ]
    if comparison.measured is not None:
        places.append(("measured CoP", comparison.measured, ("^", "black", 10)))
        places.append(("ZMP of the parts", comparison.zmp, ("D", OURS, 6)))
    if comparison.reference is not None:
        places.append((f"CoM by {comparison.reference_name}", comparison.reference, ("s", REFERENCE, 6)))
    return places  # type: ignore[return-value]


def _draw_plates(axis: Axes, comparison: MeasuredComparison, frame: int, floor: Floor) -> None:
    """Each plate's outline, as far as it is known, its centre of pressure and its load."""
    plates = comparison.plates
    assert plates is not None
    for outline in () if plates.corners is None else plates.corners:
        axis.plot(*floor(np.vstack([outline, outline[:1]])).T, color=colors.INK, lw=1, ls="--", zorder=2)
    for plate in np.flatnonzero(plate_loads(plates)[frame] > 0):
        place, load = floor(plates.points[frame, plate]), f"{plates.loads[frame, plate]:.0f} N"
        axis.plot(*place, "^", color="black", ms=6, mfc="white", zorder=4)
        box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 1}
        axis.annotate(
            load, (place[0], place[1]), (9, -14), textcoords="offset points", fontsize=8, bbox=box, zorder=6,
            annotation_clip=True,
        )  # fmt: skip


def over_time(comparison: MeasuredComparison) -> bytes:
    """A PNG of the CoM's height, the centres on the floor along the way that the person faces on average and to the
    left of it, and the load, over time; only what is known."""
    pushed = comparison.plates is not None and bool(np.isfinite(comparison.plates.forces[..., 1]).any())
    rows = 4 if pushed else 3
    figure, grid = _canvas(rows, 1, (9, 2.1 * rows), sharex=True)
    axes = [row[0] for row in grid]
    axes[0].plot(comparison.times, comparison.com[:, 1], color=OURS, lw=1.3, label="fitted body, whole volume")
    if comparison.reference is not None and np.isfinite(comparison.reference).any():
        axes[0].plot(
            comparison.times,
            comparison.reference[:, 1],
            color=REFERENCE,
            lw=2.5,
            zorder=1,
            label=f"by {comparison.reference_name}",
        )
    axes[0].set_ylabel("CoM height, m")
    axes[0].legend(frameon=False, fontsize=7, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1))
    mean = comparison.forward.mean(axis=0)
    forward = comparison.forward[0] if np.linalg.norm(mean) < 0.5 else mean / np.linalg.norm(mean)  # of who turns round
    for axis, way, name in ((axes[1], forward, "forward"), (axes[2], np.cross([0.0, 1.0, 0.0], forward), "left")):
        _draw_centers(axis, comparison, way)
        axis.set_ylabel(f"{name}, mm")
    axes[1].legend(frameon=False, fontsize=7, ncols=5, loc="lower center", bbox_to_anchor=(0.5, 1))
    if pushed:
        _draw_loads(axes[3], comparison)
    axes[-1].set(xlabel="s", xlim=_span(comparison))
    return _png(figure)


def _span(comparison: MeasuredComparison) -> tuple[float, float]:
    """The times of which there are measurements, and a little more."""
    known = (
        comparison.complete
        if comparison.reference is None
        else comparison.complete | np.isfinite(comparison.reference[:, 0])
    )
    times = comparison.times[known] if known.any() else comparison.times
    return max(comparison.times[0], times[0] - 0.3), min(comparison.times[-1], times[-1] + 0.3)


def _draw_centers(axis: Axes, comparison: MeasuredComparison, way: Array) -> None:
    """How far along a way (3,) all centres are, from where the centre of mass is on average."""
    shown = [
        ("CoM", comparison.com, {"color": colors.COM, "lw": 1.2}),
        ("the paper's CoP, γ = 10", comparison.computed.cop[10], {"color": colors.COP, "lw": 1.2}),
    ]
    if comparison.measured is not None:
        measured = np.where(comparison.complete[:, None], comparison.measured, np.nan)
        shown.insert(0, ("measured CoP", measured, {"color": "black", "lw": 2}))
        shown.append(("ZMP of the parts", comparison.zmp, {"color": OURS, "lw": 1.2}))
    if comparison.reference is not None:
        shown.append(
            (f"CoM by {comparison.reference_name}", comparison.reference, {"color": REFERENCE, "lw": 2, "zorder": 1})
        )
    middle = comparison.com.mean(axis=0)
    along = {name: 1e3 * (places - middle) @ way for name, places, _ in shown}
    shown = [each for each in shown if np.isfinite(along[each[0]]).any()]
    for name, _, look in shown:
        axis.plot(comparison.times, along[name], label=name, **look)
    low, high = _span(comparison)
    inside = (comparison.times >= low) & (comparison.times <= high)
    values_shown = np.concatenate([values[inside] for name, values in along.items() if not name.startswith("ZMP")])
    values_shown = values_shown[np.isfinite(values_shown)]
    if len(values_shown):
        room = 0.15 * float(np.ptp(values_shown)) + 5
        axis.set_ylim(float(values_shown.min()) - room, float(values_shown.max()) + room)


def _draw_loads(axis: Axes, comparison: MeasuredComparison) -> None:
    assert comparison.plates is not None
    for plate in range(comparison.plates.forces.shape[1]):
        if plate_loads(comparison.plates)[:, plate].any():
            axis.plot(
                comparison.times,
                comparison.plates.forces[:, plate, 1],
                lw=1,
                color=f"C{1 + plate}",
                label=f"plate {plate + 1}",
            )
    asked = comparison.mass * (GRAVITY + comparison.acceleration[:, 1])
    for values, color, width, name in (
        (comparison.force[:, 1], "black", 1.6, "all plates"),
        (asked, OURS, 1.2, "m (g + acceleration of the fitted CoM)"),
    ):
        if np.isfinite(values).any():
            axis.plot(comparison.times, values, color=color, lw=width, label=name)
    axis.set_ylabel("upward force, N")
    most = float(np.nanmax(comparison.force[:, 1])) if np.isfinite(comparison.force[:, 1]).any() else 0.0
    axis.set_ylim(-30, max(1.1 * most, 100))
    axis.legend(frameon=False, fontsize=7, ncols=5, loc="lower center", bbox_to_anchor=(0.5, 1))


def people(comparison: MeasuredComparison, bodies: Bodies, faces: NDArray[np.int64], markers: Array) -> bytes:
    """A PNG of three fitted bodies with their markers (T, M, 3), seen from their right, and one from its front."""
    usable = np.flatnonzero(comparison.complete) if comparison.complete.any() else np.arange(len(comparison.times))
    spread = usable[np.linspace(0, len(usable) - 1, 5).round().astype(int)[[1, 2, 3]]]
    frames = (
        [*spread, spread[1]]
        if comparison.kind != "movement in place"
        else [usable[0], spread[1], *2 * [usable[comparison.com[usable, 1].argmin()]]]
    )
    figure, grid = _canvas(1, 4, (11, 4.6), sharey=True)
    for axis, frame, side in zip(grid[0], frames, ("right", "right", "right", "front"), strict=True):
        _draw_body(axis, comparison, np.asarray(bodies[frame], float), faces, markers[frame], int(frame), side)
    grid[0][0].set_ylabel("m")
    return _png(figure)


def _draw_body(
    axis: Axes,
    comparison: MeasuredComparison,
    vertices: Array,
    faces: NDArray[np.int64],
    markers: Array,
    frame: int,
    side: str,
) -> None:
    """A body seen from its right or its front."""
    from matplotlib.collections import PolyCollection

    forward = comparison.forward[frame]
    left = np.cross([0.0, 1.0, 0.0], forward)
    across, towards = (forward, -left) if side == "right" else (left, forward)

    def seen(points: Array) -> Array:
        """(..., 2) to the right and up in the picture."""
        return np.stack([points @ across, points[..., 1]], axis=-1)

    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    light = normal / np.linalg.norm(normal, axis=1, keepdims=True).clip(1e-12) @ towards
    order = (corners.mean(axis=1) @ towards).argsort()
    order = order[light[order] > 0]
    shade = np.repeat((0.45 + 0.45 * light[order])[:, None], 3, axis=1)
    axis.add_collection(PolyCollection(list(seen(corners[order])), facecolors=shade, edgecolors="face", linewidths=0.3))
    axis.plot(*seen(markers).T, "o", ms=2.5, color="#d62728")
    axis.plot(*seen(comparison.com[frame]), "P", ms=9, color=colors.COM, mec="w")
    if comparison.measured is not None and comparison.complete[frame]:
        axis.plot(*seen(comparison.measured[frame]), "^", ms=7, color="k")
    axis.axhline(float(comparison.floor.height), color="0.5", lw=0.8)
    middle = seen(vertices)[:, 0].mean()
    axis.set(xlim=(middle - 0.6, middle + 0.6), xticks=[], aspect="equal")
    axis.set_title(
        f"{comparison.times[frame]:.2f} s, from {'their right' if side == 'right' else 'their front'}", fontsize=9
    )


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
