"""Studies in a table: head, rows of text, and whether each is good."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..files.errors import one_line
from .study import Study, flagged_name

STUDIES = ("kg", "CoM–CoP mm", "margin mm", "BoS cm²", "contacts", "balance", "stable")
FITS = ("item", "converged", "iterations", "error px", "error %", "CoM–CoP mm", "margin mm", "notes")

Row = tuple[list[str], bool]


def study_table(studies: Sequence[Study]) -> tuple[list[str], list[Row]]:
    """A row for each body or named pose; a recording's has medians, and the smallest margin of its contacts.

    Stable: the CoM lies over the base of support (BoS), in all frames where the row is good.
    """
    head = ["body" if not studies[0].labels else "pose", *STUDIES]
    return head, [row for study in studies for row in _rows(study)]


def _rows(study: Study) -> Iterator[Row]:
    one_each = bool(study.labels) or study.num_frames == 1
    for frames in range(study.num_frames) if one_each else (slice(None),):
        yield _row(study, frames)


def _row(study: Study, frames: int | slice) -> Row:
    value = {key: np.atleast_1d(column[frames]) for key, column in study.numbers.items() if column.ndim == 1}
    single = isinstance(frames, int)
    name = flagged_name(study.label(frames) if single else f"{study.name} ({study.num_frames} frames)", study.flags)
    stable = value["bose"].astype(bool)
    if single:
        verdict = "yes" if stable[0] else ("no" if value["has_contact"][0] else "no contact")
    else:
        verdict = f"{100 * stable.mean():.0f} %"
    cells = [
        one_line(name),
        number(np.median(value["mass"]), 1, 1),
        number(np.median(value["com_cop_distance"]), 1e3, 0),
        number(value["margin"].min(where=value["has_contact"], initial=np.inf), 1e3, 0),
        number(np.median(value["area"]), 1e4, 0),
        number(np.median(value["num_contacts"]), 1, 0),
        number(np.median(value["balance"]), 1, 2),
        verdict,
    ]
    return cells, bool(stable.all())


def fit_table(studies: Sequence[Study]) -> tuple[list[str], list[Row]]:
    """A row for each fitted body: how its fit went, how it stands, and the notes on it; good if it converged."""
    return list(FITS), [_fit_row(study) for study in studies if study.fitted is not None]


def _fit_row(study: Study) -> Row:
    assert study.fitted is not None
    record = study.fitted.record
    value = {key: column[0] for key, column in study.numbers.items()}
    errors = record["reprojection"]
    cells = [
        one_line(study.name),
        "yes" if record["converged"] else f"no: {record['reason']}",
        str(record["iterations"]),
        number(errors["median_px"], 1, 1),
        number(errors["median_percent"], 1, 1),
        number(value["com_cop_distance"], 1e3, 0),
        number(value["margin"] if value["has_contact"] else np.inf, 1e3, 0),
        "; ".join(one_line(text) for text in (*study.flags, *record["notes"])),
    ]
    return cells, record["converged"]


def number(value: float | None, factor: float, digits: int) -> str:
    """A number in another unit; a dash for one that is unknown or not finite."""
    return "–" if value is None or not np.isfinite(value) else f"{value * factor:.{digits}f}"
