"""The distribution of L_stability = ‖g(m̄) − g(s̄)‖ (Eq. 4) over the bodies of data sets.

The paper says of this histogram that it "peaks at 0" for AMASS and MoYo: people whom motion capture saw standing would
have their centre of mass over their centre of pressure. A distance in the plane has a density of 0 at 0 whenever its
two coordinates are spread at all (the distribution of a distance is Rayleigh's if the coordinates are normal), so the
peak lies at the usual error, not at 0, even for an estimate without bias.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import ipman_rs as ip
from ipman_rs.data.frames import DataSet
from ipman_rs.evaluation.tables.models import Models
from ipman_rs.presets import Preset
from ipman_rs.progress import Progress as Stages
from ipman_rs.progress import silent

from .files import PaperFigure
from .inputs import DataSets
from .posed_bodies import Progress, posed_bodies
from .style import SERIES, WORDS, new_figure, plot_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.floating]

MANY = 1000  # bodies: bins are 10 mm wide from there on, 20 mm below
CLOSE = 0.05  # m
SHOWN = 99.5  # % of the bodies lie in the picture, whatever a few outliers do


@dataclass(frozen=True, eq=False)
class Losses:
    """L_stability (F,) m of the bodies of one data set, with the names of their frames; `touching`: whether a sample
    of the body is within the preset's τ of the ground."""

    name: str
    values: Array
    frames: NDArray[np.str_]
    touching: NDArray[np.bool_]
    preset: str


def of_data_set(
    name: str,
    data: DataSet,
    models: Models | None = None,
    every: int = 1,
    preset: str = "paper-r",
    progress: Progress = lambda done: None,
) -> Losses:
    """L_stability of each `every`-th frame of a data set. models: None if its bodies need no files.

    Raises as `posed_bodies`; ValueError if there is no finite body.
    """
    constants = ip.presets.get(preset)
    rows = np.arange(0, len(data), every)
    values: list[Array] = []
    touching: list[NDArray[np.bool_]] = []
    names: list[str] = []
    for body in posed_bodies(name, data, models or Models(), rows, progress):
        lengths, contacts = _losses(body.vertices, body.model.template, body.ground, constants)
        values.append(lengths)
        touching.append(contacts)
        names += body.frames.names.tolist()
    if not names:
        raise ValueError(f"{name}: none of its {len(rows)} bodies is finite")
    return Losses(name, np.concatenate(values), np.array(names), np.concatenate(touching), preset)


def of_built_people(people: int, preset: str = "paper-r", progress: Progress = lambda done: None) -> Losses:
    """L_stability of built people at rest, whose exact centre of mass lies over what they stand on: the "balanced"
    scenes of `ipman benchmark fit` from seed 0. Truth here, not an estimate."""
    from ipman_rs.synthetic.at_rest import draw_people

    constants = ip.presets.get(preset)
    scenes = draw_people(people, 0, progress=progress)
    columns = [_losses(scene.vertices[None], scene.template, ip.Ground.y_up(), constants) for scene in scenes]
    names = np.array([f"{number:05d}/{scene.name}" for number, scene in enumerate(scenes)])
    values, touching = (np.concatenate(column) for column in zip(*columns, strict=True))
    return Losses("built people at rest", values, names, touching.astype(bool), preset)


def of_data_sets(
    data_sets: DataSets, people: int, every: int = 1, preset: str = "paper-r", progress: Stages = silent
) -> list[Losses]:
    """L_stability of each `every`-th frame of each data set; of so many built people where there is no data set.

    Raises as `of_data_set`.
    """
    losses = []
    with data_sets.open() as opened:
        for name, data in opened:
            with progress(f"measuring {name}", len(range(0, len(data), every))) as step:
                losses.append(of_data_set(name, data, data_sets.models, every, preset, step.to))
    if not losses:
        with progress("building people", people) as step:
            losses.append(of_built_people(people, preset, step.to))
    return losses


def _losses(
    vertices: Array, template: ip.BodyTemplate, ground: ip.Ground, preset: Preset
) -> tuple[Array, NDArray[np.bool_]]:
    curve = preset.alpha, preset.gamma, preset.epsilon
    values = np.asarray(ip.stability_loss(vertices, template, ground, *curve), dtype=np.float64)
    support = ip.base_of_support(vertices, template, ground, preset.threshold, contact=preset.contact)
    return values, np.asarray(support.has_contact)


def stability_distribution(losses: Sequence[Losses]) -> PaperFigure:
    """The histogram of one or several data sets, with medians, shares below 50 mm, and where each peaks. ValueError
    without any."""
    if not losses:
        raise ValueError("losses: expected those of at least one data set")
    width = 0.01 if min(len(each.values) for each in losses) >= MANY else 0.02
    summaries = [summary(each, width) for each in losses]
    table = [
        {"data": each["name"], "from_mm": round(1e3 * low), "to_mm": round(1e3 * (low + width)), "share": share}
        for each in summaries
        for low, share in zip(each["bin_edges_m"], each["shares"], strict=False)
    ]
    arrays = {
        f"{key}_{number}": getattr(each, key) for number, each in enumerate(losses) for key in ("values", "frames")
    }
    numbers = {"preset": losses[0].preset, "bin_width_m": width, "claim": "the paper: peaks at 0", "data": summaries}
    return PaperFigure(
        "stability", _draw(losses, summaries, width), numbers, arrays, table, [*map(_in_words, summaries)]
    )


def _in_words(about: dict[str, Any]) -> str:
    low, high = (1e3 * edge for edge in about["peak_m"])
    return (
        f"{about['name']}: {about['bodies']:,} bodies, median {1e3 * about['median_m']:.0f} mm, "
        f"{100 * about['share_below_50_mm']:.0f} % below 50 mm; peaks at {low:.0f}–{high:.0f} mm (the paper: at 0)"
    )


def summary(losses: Losses, width: float) -> dict[str, Any]:
    """The numbers of one histogram: m, and shares of the bodies from 0 to 1."""
    edges = np.arange(np.ceil(losses.values.max() / width) + 1) * width
    edges = edges if len(edges) > 1 else np.array([0.0, width])
    shares = np.histogram(losses.values, edges)[0] / len(losses.values)
    fullest = int(shares.argmax())
    return {
        "name": losses.name,
        "bodies": len(losses.values),
        "touching": float(losses.touching.mean()),
        "median_m": float(np.median(losses.values)),
        "percentiles_m": {str(q): float(np.percentile(losses.values, q)) for q in (5, 25, 75, 95)},
        "share_below_50_mm": float((losses.values < CLOSE).mean()),
        "peak_m": [float(edges[fullest]), float(edges[fullest + 1])],
        "peaks_at_0": fullest == 0,
        "bin_edges_m": edges,
        "shares": shares,
    }


def _draw(losses: Sequence[Losses], summaries: Sequence[dict[str, Any]], width: float) -> Figure:
    figure = new_figure(6.4, 3.8)
    axes = figure.subplots()
    for number, (each, about) in enumerate(zip(losses, summaries, strict=True)):
        color = SERIES[number % len(SERIES)]
        low, high = (1e3 * edge for edge in about["peak_m"])
        label = (
            f"{each.name} (n = {about['bodies']:,})\nmedian {1e3 * about['median_m']:.0f} mm, "
            f"{100 * about['share_below_50_mm']:.0f} % below 50 mm, peak {low:.0f}–{high:.0f} mm"
        )
        edges = 1e3 * np.asarray(about["bin_edges_m"])
        shown = {"fill": True, "alpha": 0.35 if len(losses) > 1 else 0.55, "color": color}
        axes.stairs(100 * np.asarray(about["shares"]), edges, linewidth=1.2, **shown)
        axes.stairs(100 * np.asarray(about["shares"]), edges, linewidth=1.2, color=color, label=label)
        axes.axvline(1e3 * about["median_m"], color=color, linewidth=1.4, linestyle=(0, (4, 2)))
    plot_style(
        axes, "", "L_stability: CoM to CoP on the ground, mm (dashed: median)", f"% of bodies per {1e3 * width:.0f} mm"
    )
    end = max(float(np.percentile(each.values, SHOWN)) for each in losses)
    axes.set_xlim(0, 1e3 * width * np.ceil(1.02 * max(end, CLOSE) / width))
    above = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.4}
    axes.legend(fontsize=WORDS - 1, frameon=False, **above)
    return figure
