"""The report of `ipman validate`: tables in Markdown, and series of numbers.

Records are what `figures.figures` gives of a recording, with `body` (its model's name) and `fit` (how it was fitted:
`markers`, mean distance from them in m, `shape_from`, `converged`), and `flags`, what is odd about it.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..study.table import number
from .comparison import MeasuredComparison
from .computed import GAMMAS, METHODS, plate_loads

Record = dict[str, Any]

# mm, of the paper's supplement: on MoYo, against the centre of mass of Vicon's Plug-in Gait.
PAPER = {"vertex_mean": 264.1, "sample_mean": 68.5, "face_area": 70.0, "pcom": 53.3}
WORDS = {
    "exact": "exact: whole volume",
    "pcom": "pCoM, the paper's",
    "sample_mean": "mean of the samples",
    "face_area": "faces by their area",
    "vertex_mean": "mean of the vertices",
}
MODELS = ("at rest: g(CoM)", "moving: ZMP of the CoM", "moving: ZMP of the parts", "CoM along the force")


def markdown(records: Sequence[Record], source: str, notes: Sequence[str], pictures: Sequence[str]) -> str:
    """The page: what is unusual, all tables that have rows, notes, and pictures."""
    lines = [f"# Bodies fitted to markers, against measurements: {source}", ""]
    odd = [f"- {record['name']}: {flag}" for record in records for flag in record["flags"]]
    if odd:
        lines += ["## Odd", "", *odd, ""]
    for title, explanation, table in TABLES:
        rows = list(table(records))
        if len(rows) > 2:
            lines += [f"## {title}", "", explanation, "", *rows, ""]
    if notes:
        lines += ["## Notes", "", *(f"- {note}" for note in notes), ""]
    if pictures:
        lines += ["## Pictures", "", *(f"![{path}]({path})\n" for path in pictures)]
    return "\n".join(lines).rstrip() + "\n"


def recordings(records: Iterable[Record]) -> Iterator[str]:
    yield (
        "| recording | kind | body | shape from | frames | per second | markers, mm | volume × 985, kg "
        "| by the plates, kg | standing still, kg | off | upward force, rms |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|---|---|"
    for record in records:
        mass, force = record["mass"], record["force"]
        spread = f"{_number(mass['volume_mean'])} ({_number(mass['volume_least'])} to {_number(mass['volume_most'])})"
        plates = off = ""
        if mass["plates"] is not None:
            plates = f"{_number(mass['plates'])} ± {_number(mass['plates_std'])}"
            plates += " !" if any(flag.startswith("weight by the plates") for flag in record["flags"]) else ""
        if weighed(record) is not None:
            off = f"{mass['volume_mean'] / weighed(record) - 1:+.1%}"
        still = "" if mass["standing"] is None else _number(mass["standing"])
        pushed = f"{force['rms']:.0f} N, {force['share']:.1%} (at rest {force['at_rest']:.1%})" if force else ""
        yield (
            f"| {record['name']} | {record['kind']} | {_body(record)} | {record['frames']} "
            f"| {record['rate_hz']:.0f} | {1e3 * record['fit']['markers']:.1f} | {spread} | {plates} | {still} | {off} "
            f"| {pushed} |"
        )


def weighed(record: Record) -> float | None:
    """The person's mass, kg: by plates on which they stood still, or else on which they move; None without plates."""
    mass = record["mass"]
    return mass["plates"] if mass["standing"] is None else mass["standing"]


def centers_of_mass(records: Iterable[Record]) -> Iterator[str]:
    yield "| recording | against | body | shape from | frames | forward, rms (mean) | left | up | distance, mean |"
    yield "|---|---|---|---|---|---|---|---|---|"
    for record in _records_with(records, "com"):
        exact = record["com"]["methods"]["exact"]
        axes = [f"{1e3 * rms:.1f} ({1e3 * mean:+.1f})" for rms, mean in zip(exact["rms"], exact["mean"], strict=True)]
        yield (
            f"| {record['name']} | {record['com']['judge']} | {_body(record)} "
            f"| {record['com']['frames']} | {' | '.join(axes)} | {1e3 * exact['distance']:.1f} |"
        )


def formulations(records: Iterable[Record]) -> Iterator[str]:
    """One row per formulation, one column per recording, and the paper's values."""
    compared = list(_records_with(records, "com"))
    if not compared:
        return
    titles = [
        f"{record['name']}, {record['body']}, shape from {record['fit']['shape_from']}, "
        f"against {record['com']['judge']}"
        for record in compared
    ]
    yield f"| formulation | {' | '.join(titles)} | the paper, on MoYo |"
    yield f"|---|{'---|' * len(titles)}---|"
    for method in reversed(METHODS):
        cells = [record["com"]["methods"][method] for record in compared]
        texts = [f"{1e3 * cell['distance']:.1f} (up {1e3 * cell['mean'][2]:+.0f})" for cell in cells]
        yield f"| {WORDS[method]} | {' | '.join(texts)} | {PAPER.get(method, '')} |"


def standing(records: Iterable[Record]) -> Iterator[str]:
    yield (
        "| recording | body | shape from | CoM − CoP forward, left | means apart | distance, mean | sway of CoM "
        "| sway of CoP |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    for record in _records_with(records, "standing"):
        values = record["standing"]
        forward, left = (1e3 * value for value in values["offset"])
        rest = (values[name] for name in ("offset_length", "distance", "sway_com", "sway_cop"))
        yield (
            f"| {record['name']} | {_body(record)} | {forward:+.1f}, {left:+.1f} "
            f"| {' | '.join(f'{1e3 * value:.1f}' for value in rest)} |"
        )


def centers_of_pressure(records: Iterable[Record]) -> Iterator[str]:
    yield (
        f"| recording | phase | body | shape from | frames | {' | '.join(MODELS)} "
        f"| {' | '.join(f'γ = {gamma}' for gamma in GAMMAS)} |"
    )
    yield f"|---|---|---|---|---|{'---|' * (len(MODELS) + len(GAMMAS))}"
    for record in records:
        for phase, distances in record["cop"].items():
            names = [*MODELS, *(f"γ = {gamma}" for gamma in GAMMAS)]
            cells = [_millimetres(distances["distance"].get(name)) for name in names]
            yield (f"| {record['name']} | {phase} | {_body(record)} | {distances['frames']} | {' | '.join(cells)} |")


def references(records: Iterable[Record]) -> Iterator[str]:
    yield (
        "| recording | phase | body | shape from | frames | ours at rest | reference at rest | ours along the force "
        "| reference along the force |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    for record in records:
        for phase, distances in record["cop"].items():
            if not distances.get("reference_frames"):
                continue
            cells = [
                _millimetres(distances[whose][name])
                for name in (MODELS[0], MODELS[3])
                for whose in ("on_reference_frames", "reference")
            ]
            yield (
                f"| {record['name']} | {phase} | {_body(record)} | {distances['reference_frames']} "
                f"| {' | '.join(cells)} |"
            )


def shares(records: Iterable[Record]) -> Iterator[str]:
    yield "| recording | body | shape from | frames | measured | computed | apart, mean |"
    yield "|---|---|---|---|---|---|---|"
    for record in _records_with(records, "shares"):
        values = record["shares"]
        texts = (f"{values[name]:.1%}" for name in ("measured", "computed", "difference"))
        yield f"| {record['name']} | {_body(record)} | {values['frames']} | {' | '.join(texts)} |"


TABLES: tuple[tuple[str, str, Callable[[Iterable[Record]], Iterator[str]]], ...] = (
    (
        "Weight",
        "Volume × 985 kg/m³: of the posed mesh, mean over the frames and range. By the plates: upward force over g + "
        "the CoM's acceleration, ± over the frames (!: not reliable, see above). Standing still: from the same "
        "person's quiet standing, which takes precedence. Off: the volume's mass compared with it. Last column: error "
        "of m (g + acceleration) compared with the force, and of the weight m g alone (at rest).",
        recordings,
    ),
    (
        "Centre of mass",
        "Of the whole volume, compared with the reference, mm: forward, left and up as the person's pelvis faces.",
        centers_of_mass,
    ),
    (
        "Formulations of the centre of mass",
        "Mean distance in space from the reference, mm; in brackets the mean vertical offset. The paper's values are "
        "for another data set.",
        formulations,
    ),
    (
        "Quiet standing",
        "Centre of mass and measured centre of pressure on the floor, mm, as the pelvis faces.",
        standing,
    ),
    (
        "Centre of pressure",
        "Mean distance on the floor, mm, between the measured centre of pressure and: its place for a body at rest; "
        "the zero-moment point (ZMP), its place by dynamics, from the acceleration of the fitted centre of mass, and "
        "from those of the ten parts, which includes swinging limbs; the point where the measured force's line "
        "through the centre of mass meets the floor; the paper's for each γ (1/m). In walking, separately for one and "
        "two plates.",
        centers_of_pressure,
    ),
    ("The same for the reference's centre of mass", "On the frames that have one, mm.", references),
    (
        "Load of the first plate",
        "Its share of the load while two plates are loaded, and the share of the paper's pressure (γ = 10) on its "
        "side.",
        shares,
    ),
)


def series(comparison: MeasuredComparison) -> dict[str, NDArray[Any]]:
    """Everything over time, by name: columns (T,), and vectors (T, 3), metres, newtons, seconds."""
    columns: dict[str, NDArray[Any]] = {"time_s": comparison.times, "volume_mass_kg": comparison.computed.mass}
    columns |= {f"com_{method}_m": points for method, points in comparison.computed.com.items()}
    columns["com_acceleration_mps2"] = comparison.acceleration
    columns["forward_1"] = comparison.forward
    columns |= {f"cop_gamma_{gamma}_m": points for gamma, points in comparison.computed.cop.items()}
    if comparison.reference is not None:
        columns["com_reference_m"] = comparison.reference
    if comparison.plates is not None:
        assert comparison.measured is not None
        columns |= {
            "force_N": comparison.force,
            "cop_measured_m": comparison.measured,
            "complete": comparison.complete,
            "beside": comparison.beside,
        }
        columns |= {"loads_N": plate_loads(comparison.plates), "first_share_computed": comparison.computed.shares}
        names = ("zmp_com_m", "zmp_parts_m", "com_along_force_m")
        columns |= {name: comparison.centers[model] for name, model in zip(names, MODELS[1:], strict=True)}
    return columns


def table(columns: dict[str, NDArray[Any]]) -> str:
    """A series as CSV, a vector's axes in columns of their own; what is not finite stays empty."""
    heads: list[str] = []
    values: list[NDArray[Any]] = []
    for name, column in columns.items():
        stem, _, unit = name.rpartition("_")
        names = [name] if column.ndim == 1 else [f"{stem}_{axis}_{unit}" for axis in _axes(name, column.shape[1])]
        heads += names
        values += [column] if column.ndim == 1 else [*column.T]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(heads)
    for row in zip(*values, strict=True):
        writer.writerow([f"{value:.6g}" if np.isfinite(value) else "" for value in row])
    return stream.getvalue()


def _axes(name: str, count: int) -> Sequence[str]:
    return [f"plate{number}" for number in range(1, count + 1)] if name == "loads_N" else "xyz"


def phase_table(records: Sequence[Record]) -> tuple[list[str], list[list[str]]]:
    """A row for each phase of each recording: weight, centre of mass and centre of pressure against the measured. A
    weight by plates that is not to be trusted has a mark."""
    head = [
        "recording", "", "markers mm", "kg", "by plates", "CoM mm", "CoP: at rest mm", "ZMP mm", "γ = 10 mm"
    ]  # fmt: skip
    return head, [row for record in records for row in _phases(record)]


def _phases(record: Record) -> Iterator[list[str]]:
    values = [
        (record["fit"]["markers"], 1e3),
        (record["mass"]["volume_mean"], 1),
        (record["mass"]["plates"], 1),
        (record["com"]["methods"]["exact"]["distance"] if record["com"] else None, 1e3),
    ]
    cells = [number(value, factor, 1) for value, factor in values]
    cells[2] += " !" if any(flag.startswith("weight by the plates") for flag in record["flags"]) else ""
    lead = [record["name"], record["kind"], *cells]
    for phase, compared in (record["cop"] or {"all": {"distance": {}}}).items():
        if phase != "all":
            lead[1] = f"{record['kind']}, {phase}"
        away = [compared["distance"].get(name) for name in ("at rest: g(CoM)", "moving: ZMP of the parts", "γ = 10")]
        yield [*lead, *(number(value, 1e3, 1) for value in away)]
        lead = [""] * len(lead)


def flag_lines(records: Sequence[Record]) -> list[str]:
    """What is odd about each recording."""
    return [f"look: {record['name']}: {flag}" for record in records for flag in record["flags"]]


def _records_with(records: Iterable[Record], key: str) -> Iterator[Record]:
    return (record for record in records if record[key])


def _body(record: Record) -> str:
    """The cells of a row that name the body model and the source of its shape."""
    return f"{record['body']} | {record['fit']['shape_from']}"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"


def _millimetres(metres: float | None) -> str:
    return "" if metres is None else f"{1e3 * metres:.1f}"
