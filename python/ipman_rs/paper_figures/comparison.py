"""The qualitative grid: of each person the image, and for each method the body over it, from the side, and its pressure
on the floor from above."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.study.camera import ViewCamera
from ipman_rs.view import Study, cells, colors
from ipman_rs.view.picture import Box, camera_around

from .estimated_people import Estimated, shared_names, studies
from .files import PaperFigure
from .posed_bodies import Progress
from .style import WORDS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.floating]

MOST = 4  # people
VIEWS = ("overlay", "side", "pressure")
CELL = (360, 440)  # pixels
WIDTH, HEIGHT = 1.5, 1.5 * 440 / 360  # inches of a cell
GAP, LINE, HEAD, KEY, EDGE = 0.06, 0.26, 0.52, 0.34, 0.10  # inches
AROUND = 0.10  # of a person's size in the image, on each side


def comparison(
    methods: Sequence[tuple[str, Estimated]],
    people: Sequence[str] = (),
    most: int = MOST,
    preset: str = "paper-r",
    progress: Progress = lambda done: None,
) -> PaperFigure:
    """The grid of the people that all methods have, by title; `people` names some of them, else up to `most` are taken.

    `progress` is called with the number of people done. ValueError without methods or people in common, or, naming the
    file, for what cannot be read.
    """
    if not methods:
        raise ValueError("methods: expected at least one")
    names = shared_names(methods, people, most)
    figure, columns = _paper(len(names), [title for title, _ in methods])
    rows, table = {}, []
    for number, name in enumerate(names):
        bodies = dict(studies(methods, name, preset))
        about = {title: figures(study) for title, study in bodies.items()}
        _draw_row(figure, number, len(names), columns, bodies, about)
        rows[name] = about
        table += [{"person": name, "method": title, **values} for title, values in about.items()]
        progress(number + 1)
    numbers = {"preset": preset, "methods": [title for title, _ in methods], "people": rows}
    lines = [[name, title, caption(about)] for name, each in rows.items() for title, about in each.items()]
    return PaperFigure("compare", figure, numbers, table=table, summary_table=(["person", "method", "stands"], lines))


def figures(study: Study) -> dict[str, Any]:
    """How one estimated body stands: m, and whether its CoM lies over its base of support."""
    value = {key: column[0] for key, column in study.numbers.items()}
    contact = bool(value["has_contact"])
    return {
        "bose": bool(value["bose"]),
        "margin_m": float(value["margin"]) if contact else None,
        "com_cop_m": float(value["com_cop_distance"]),
        "penetration_m": max(0.0, -float(value["lowest"])),
        "hover_m": max(0.0, float(value["lowest"])),
        "ground": study.notes[0].removeprefix("ground: "),
    }


def _paper(rows: int, titles: Sequence[str]) -> tuple[Figure, list[float]]:
    """White paper with the heads of its columns, and the left edges of the columns in inches."""
    from matplotlib.figure import Figure

    columns, left = [EDGE], EDGE + WIDTH + 3 * GAP
    for _ in titles:
        columns += [left + view * (WIDTH + GAP) for view in range(len(VIEWS))]
        left += len(VIEWS) * (WIDTH + GAP) + 2 * GAP
    width = columns[-1] + WIDTH + EDGE
    figure = Figure(figsize=(width, HEAD + rows * (HEIGHT + LINE) + KEY), facecolor="white")
    _write(figure, columns[0] + WIDTH / 2, HEAD - 0.10, "input", WORDS, colors.MUTED)
    for number, title in enumerate(titles):
        first = columns[1 + number * len(VIEWS)]
        middle = first + (len(VIEWS) * (WIDTH + GAP) - GAP) / 2
        _write(figure, middle, 0.17, title, WORDS + 2, colors.INK, weight="bold")
        for view, word in enumerate(VIEWS):
            _write(figure, columns[1 + number * len(VIEWS) + view] + WIDTH / 2, HEAD - 0.10, word, WORDS, colors.MUTED)
    _write_key(figure, width)
    return figure, columns


def _write(figure: Figure, x: float, y: float, text: str, size: float, color: str, **more: Any) -> None:
    """A line of text whose middle is `x` inches from the left and `y` from the top."""
    width, height = figure.get_size_inches()
    style = {"ha": "center", "va": "center", "parse_math": False, **more}
    figure.text(x / width, 1 - y / height, text, size=size, color=color, **style)


def _draw_row(
    figure: Figure,
    number: int,
    rows: int,
    columns: Sequence[float],
    bodies: dict[str, Study],
    about: dict[str, dict[str, Any]],
) -> None:
    top = HEAD + number * (HEIGHT + LINE)
    first = next(iter(bodies.values()))
    box = _around(list(bodies.values()))
    _place(figure, columns[0], top, cells.photo_cell(first, box, CELL, body=False))
    _write(figure, columns[0] + WIDTH / 2, top + HEIGHT + 0.4 * LINE, first.name, WORDS, colors.INK)
    for method, (title, study) in enumerate(bodies.items()):
        at = columns[1 + method * len(VIEWS) :]
        _place(figure, at[0], top, cells.photo_cell(study, box, CELL))
        _place(figure, at[1], top, cells.scene_cell(study, _from_side(study), CELL))
        _place(figure, at[2], top, cells.floor_map(study, CELL))
        middle = at[0] + (len(VIEWS) * (WIDTH + GAP) - GAP) / 2
        good = colors.COP if about[title]["bose"] else "#c0392b"
        _write(figure, middle, top + HEIGHT + 0.4 * LINE, caption(about[title]), WORDS - 0.5, good)


def caption(about: dict[str, Any]) -> str:
    """One line of a body's measured quantities, in mm."""
    parts = [f"CoM–CoP {1e3 * about['com_cop_m']:.0f} mm"]
    if about["margin_m"] is None:
        parts += ["no contact"]
    else:
        parts += [f"margin {1e3 * about['margin_m']:+.0f} mm".replace("-", "−")]
    if about["penetration_m"] >= 5e-4:
        parts += [f"{1e3 * about['penetration_m']:.0f} mm into the floor"]
    if about["hover_m"] >= 5e-4:
        parts += [f"{1e3 * about['hover_m']:.0f} mm above the floor"]
    return "   ".join([*parts, "stable" if about["bose"] else "not stable"])


def _around(bodies: Sequence[Study]) -> Box:
    """A box of the image around the person, as every method has it, of a cell's shape."""
    points = []
    for study in bodies:
        assert study.fitted is not None
        points.append(study.fitted.camera.pixels(np.asarray(study.vertices[0], np.float64))[0])
        points.append(study.fitted.seen[study.fitted.seen[:, 2] > 0, :2])
    corners = np.concatenate(points)
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, half = (low + high) / 2, (high - low) * (0.5 + AROUND)
    half = np.maximum(half, half[::-1] * np.array([CELL[0] / CELL[1], CELL[1] / CELL[0]]))
    return (
        float(middle[0] - half[0]),
        float(middle[1] - half[1]),
        float(middle[0] + half[0]),
        float(middle[1] + half[1]),
    )


def _from_side(study: Study) -> ViewCamera:
    return camera_around([np.asarray(study.vertices[0], np.float64)], study, 90.0, 4.0, cells.box_of(CELL))


def _place(figure: Figure, left: float, top: float, pixels: Array) -> None:
    """A picture as a cell, its upper left corner in inches."""
    width, height = figure.get_size_inches()
    axes = figure.add_axes((left / width, 1 - (top + HEIGHT) / height, WIDTH / width, HEIGHT / height))
    axes.imshow(pixels, interpolation="antialiased", aspect="auto")
    axes.set(xticks=[], yticks=[])
    for side in axes.spines.values():
        side.set_color(colors.GRID)
        side.set_linewidth(0.6)


def _write_key(figure: Figure, width: float) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [
        Line2D([], [], color=color, marker="o", linestyle="", markersize=6, label=word)
        for color, word in ((colors.COM, "centre of mass"), (colors.COP, "centre of pressure"))
    ]
    handles.append(Patch(facecolor=colors.SUPPORT, edgecolor=colors.SUPPORT_EDGE, label="base of support"))
    handles.append(Patch(facecolor="#dc4a3d", label="pressure"))
    figure.legend(
        handles=handles, loc="lower center", ncols=4, fontsize=WORDS - 1, frameon=False, bbox_to_anchor=(0.5, 0.0)
    )
