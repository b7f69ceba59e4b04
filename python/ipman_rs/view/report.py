"""Write a report: `report.html`, `report.json`, `report.npz` and the pictures, all inside one folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from ipman_rs.files import atomic_write, safe_names, write_whole

from ..study.study import MAX_LISTED_FRAMES, Study
from .fitted import draw_fitted
from .floor import draw_floor_view
from .html import page
from .picture import draw_picture
from .record import report_record, study_arrays
from .timeline import draw_timeline


def write_report(
    studies: Sequence[Study],
    directory: Path,
    failures: Sequence[tuple[str, str]] = (),
    progress: Callable[[str], None] = lambda written: None,
    own_folders: bool = False,
) -> Path:
    """Write the report of one or more studies into ``directory`` and return the path of its page.

    `report.html` and `report.json` cover all studies. `report.npz` and the pictures of a single study lie beside them,
    those of several studies, or with ``own_folders``, in a folder each, named after the study. ``failures`` are (file,
    error) pairs to be told in the report. Of a recording of more than 10,000 frames the page and `report.json` list
    evenly spaced ones and those with pictures, and only these keep the outline of their base of support; `report.npz`
    has the figures of all.
    ``progress`` is called with the name of each file written. Raises OSError where nothing can be written.
    """
    directory = Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    excerpts = [study.excerpt() for study in studies]
    record = json.dumps(report_record(excerpts, failures), allow_nan=False, ensure_ascii=False, indent=1)
    write_whole(directory / "report.json", record + "\n")
    progress("report.json")
    names = safe_names([study.name for study in studies])
    folders = [directory if len(studies) == 1 and not own_folders else directory / name for name in names]
    for study, folder in zip(studies, folders, strict=True):
        folder.mkdir(exist_ok=True)
        for written in _write_study(study, folder):
            progress(written)
    path = directory / "report.html"
    write_whole(path, page(excerpts, failures, folders))
    progress("report.html")
    return path


def count_files(studies: Sequence[Study]) -> int:
    """How many files `write_report` will write: the length of its progress bar."""
    return 2 + sum(_count_files(study) for study in studies)


def _count_files(study: Study) -> int:
    if study.fitted is not None:
        return 1 + len(study.fitted.pictures()) + (study.fitted.pictured and study.fitted.before is not None)
    return 1 + 2 * len(study.pictured()) + _has_timeline(study)


def _has_timeline(study: Study) -> bool:
    return study.num_frames > 1 and not study.labels


def _write_study(study: Study, folder: Path) -> Iterator[str]:
    # Packing millions of numbers would take longer than finding them.
    save = np.savez_compressed if study.num_frames <= MAX_LISTED_FRAMES else np.savez
    with atomic_write(folder / "report.npz") as file:
        save(file, allow_pickle=False, **study_arrays(study))
    yield "report.npz"
    if study.fitted is not None:
        yield from _write_fitted(study, folder)
        return
    frames = study.pictured()
    digits = len(str(study.num_frames))
    labels = safe_names([study.labels[frame] if study.labels else f"{frame:0{digits}d}" for frame in frames])
    for frame, label in zip(frames, labels, strict=True):
        end = "" if study.num_frames == 1 else f"_{label}"
        for draw, kind in ((draw_picture, "perspective"), (draw_floor_view, "floor")):
            draw(study, frame, folder / f"{kind}{end}.png")
            yield f"{kind}{end}.png"
    if _has_timeline(study):
        draw_timeline(study.excerpt(), folder / "timeline.png")
        yield "timeline.png"


def _write_fitted(study: Study, folder: Path) -> Iterator[str]:
    yield from draw_fitted(study, folder)
    if study.fitted is not None and study.fitted.pictured:
        draw_floor_view(study, 0, folder / "floor.png")
        yield "floor.png"
