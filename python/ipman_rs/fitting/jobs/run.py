"""Fit files, in batches and resumable, one input's failure being its own.

    fits = fit_files(["photo.jpg", "squats.trc"], "out", fit_options(preset="fast"))
    fits.studies[0].numbers["stability"], fits.failures

Each body is posed, analysed and handed over as it was written; only what `resume` finds finished is read back.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ipman_rs.torch as ipt

from ...data.keypoints.detections import join
from ...files import path_list, safe_names
from ...files.errors import FileError
from ...files.names import Paths
from ...progress import Progress, silent
from ...study import Study
from .. import detection_problem, start
from ..camera_file import KnownCamera
from ..fit import fit
from ..presented import PresentedBody
from ..result import FitResult, fit_results
from . import recordings
from .items import (
    IMAGES,
    KEYPOINTS,
    MARKERS,
    InputOptions,
    Item,
    detect,
    detect_everyone,
    expand_all,
    identity,
    is_markers,
    read_all,
)
from .options import OF_IMAGES, OF_MARKERS, FitOptions, changed, fit_options
from .outputs import FittedItem, read_item, study_of, write_item
from .recordings import Pace

BATCH = 64  # items fitted together; after each batch its outputs are on the disk
_INPUT = InputOptions()
_PACE = Pace()


@dataclass(frozen=True)
class Fits:
    """The analysed bodies, recordings first; (input, reason) of each that has none; and of recordings (input, flags),
    what is odd about them."""

    studies: list[Study]
    failures: list[tuple[str, str]]
    flags: list[tuple[str, tuple[str, ...]]]


def fit_files(
    inputs: Paths,
    output: str | Path,
    options: FitOptions | None = None,
    reading: InputOptions = _INPUT,
    pace: Pace = _PACE,
    resume: bool = False,
    pictures: int = 8,
    progress: Progress = silent,
) -> Fits:
    """Fit photos, keypoint files, marker files and folders of them; each gets a folder in `output`.

    `pictures`: of the first so many items the photo and the body before the physics terms are kept for the report. The
    report itself is `view.report.write_report(fits.studies, output, fits.failures, own_folders=True)`.

    Raises:
        ValueError: options that fit no input or contradict each other.
        TypeError: `options` are not `FitOptions`.
        OSError: `output` cannot be written.
    """
    output, options = Path(output), fit_options() if options is None else options
    if not isinstance(options, FitOptions):
        raise TypeError(f"options: expected FitOptions (of `fit_options`), got {type(options).__name__}")
    if pictures < 0:
        raise ValueError(f"pictures: expected 0 or more, got {pictures}")
    pace.check()
    paths, failures = expand_all(path_list(inputs))
    _check_kinds(paths, options, reading)
    markers = [path for path in paths if is_markers(path)]
    items, unread = read_all([path for path in paths if not is_markers(path)], reading)
    failures += unread
    studies: list[Study] = []
    flags: list[tuple[str, tuple[str, ...]]] = []
    for recording in recordings.recordings(markers, items if reading.sequence else []):
        try:
            fitted = recordings.fit_recording(recording, options, pace, output, resume, progress=progress)
            studies.append(recordings.study_of(fitted, options.model))
            flags.append((recording.source, studies[-1].flags))
        except FileError as error:
            failures.append((recording.source, error.what))
        except OSError as error:
            failures.append((recording.source, str(error)))
    if items and not reading.sequence:
        if reading.everyone:
            items = _everyone(items, progress)
        studies += fit_items(items, options, output, resume, pictures, progress, reading.everyone)
        failures += [(item.source, item.failure) for item in items if item.failure is not None]
    return Fits(studies, failures, flags)


def _check_kinds(paths: Sequence[Path], options: FitOptions, reading: InputOptions) -> None:
    """ValueError for an option that no input can use: markers' without a marker file, keypoints' without another."""
    if reading.photo is not None and len(paths) > 1:
        raise ValueError(f"photo: belongs to one keypoint file, got {len(paths)} inputs")
    markers = [path for path in paths if is_markers(path)]
    images = [path for path in paths if path.suffix.lower() in (*KEYPOINTS, *IMAGES)]
    if images and options.config.name == "markers":
        raise ValueError(f"preset: markers fits marker files ({' '.join(MARKERS)}) alone, got {images[0]}")
    given = {**changed(options), **changed(reading)}
    for names, there, others, kind in (
        (OF_MARKERS, markers, images, f"marker files ({' '.join(MARKERS)})"),
        (OF_IMAGES, images, markers, "photos and keypoint files"),
    ):
        needless = [name for name in names if name in given]
        if needless and others and not there:
            raise ValueError(f"{needless[0]}: belongs to {kind}, of which there are none")


def fit_items(
    items: list[Item],
    options: FitOptions,
    output: Path,
    resume: bool = False,
    pictures: int = 8,
    progress: Progress = silent,
    together: bool = False,
) -> list[Study]:
    """Fit items, write the folder of each under `output`, and analyse those that have a body, in their order.

    together: the people of one image share its camera, and are fitted anew if one of them is.

    Items without a body say why in `failure`. Raises ValueError for options that fit no item, and OSError.
    """
    options.check()
    model = ipt.BodyModel(options.model)
    body, presented_body = model.body, options.presented(model.body)
    text = options.identity()
    hashes = {item.name: identity(item, text) for item in items}
    finished: dict[str, FittedItem] = {}
    if resume:
        stored = [read_item(item, body, output / item.name, hashes[item.name]) for item in items]
        finished = {fitted.item.name: fitted for fitted in stored if fitted is not None}
    todo = [item for item in items if item.name not in finished]
    if together:
        images = {_image_of(item) for item in todo}
        todo = [item for item in items if _image_of(item) in images]
    for batch in _batches(todo, progress, together):
        for item, result in _fit_batch(batch, options, model, presented_body, progress, together):
            record: dict[str, Any] = {**result.record(), "preset": options.config.name, "model": body.name}
            if presented_body is not None:
                record["presented"] = presented_body.record(body)
                item.notes += presented_body.notes
            record |= {"flags": item.flags, "notes": item.notes, "identity": hashes[item.name]}
            finished[item.name] = write_item(item, result, body, output / item.name, record, options.obj)
    studies = []
    with progress("measuring", len(finished)) as step:
        for number, fitted in enumerate(finished[item.name] for item in items if item.name in finished):
            studies.append(study_of(fitted, body, number < pictures))
            step.one()
    return studies


def _everyone(items: Sequence[Item], progress: Progress) -> list[Item]:
    """An item for each person of each photo, under names of their own; items that are no photos stay."""
    people: list[Item] = []
    with progress("looking for people", len(items)) as step:
        for item in items:
            try:
                people += [item] if item.detections is not None else detect_everyone(item)
            except FileError as error:
                item.failure = error.what
                people.append(item)
            step.one()
    for item, name in zip(people, safe_names([item.name for item in people]), strict=True):
        item.name = name
    return people


def _image_of(item: Item) -> str:
    return item.source if item.detections is None else item.detections.sources[0]


def _batches(items: Iterable[Item], progress: Progress, together: bool = False) -> Iterator[list[Item]]:
    """Items whose points have the same names, up to `BATCH` together: what else is in a batch changes no bit of any.
    together: those of one image are in one batch, which may be longer for them."""
    groups: dict[tuple[str, ...], list[Item]] = {}
    todo = list(items)
    with progress("reading", len(todo)) as step:
        for item in todo:
            try:
                if item.failure is not None:
                    continue
                if item.detections is None:
                    detect(item)
                assert item.detections is not None
                groups.setdefault(item.detections.names, []).append(item)
            except FileError as error:
                item.failure = error.what
            step.one()
    for group in groups.values():
        batch: list[Item] = []
        for item in group:
            if len(batch) >= BATCH and not (together and _image_of(item) == _image_of(batch[-1])):
                yield batch
                batch = []
            batch.append(item)
        yield batch


def _fit_batch(
    batch: list[Item],
    options: FitOptions,
    model: ipt.BodyModel,
    presented_body: PresentedBody | None,
    progress: Progress,
    together: bool = False,
) -> Iterator[tuple[Item, FitResult]]:
    """The items of a batch that have a body, each with its result."""
    usable = [item for item in batch if not _refuse(item, model, options.camera)]
    if not usable:
        return
    detections = join([item.detections for item in usable if item.detections is not None])
    problem = options.problem(model, detections, presented_body, [item.focal for item in usable], together)
    config = options.config
    with progress(f"fitting {len(usable)}", len(usable) * len(config.stages)) as step:
        problem, variables = start.initial_state(problem, config.start)
        before = {stage.name: number * len(usable) for number, stage in enumerate(config.stages)}
        fitted = fit(problem, variables, config, lambda stage, ended: step.to(before[stage] + ended), trace=True)
    for item, result in zip(usable, fit_results(fitted, config, variables), strict=True):
        if not result.finite:
            item.failure = "the fit found no finite body; check focal length, image size and points"
            continue
        item.flags += result.flags()
        yield item, result


def _refuse(item: Item, model: ipt.BodyModel, camera: KnownCamera | None) -> bool:
    """Whether too few points of an item are visible, which becomes its failure; else its oddities become flags."""
    assert item.detections is not None
    names = detection_problem.shared_names(model, item.detections)
    shared = item.detections.select(names)
    item.failure = detection_problem.missing_keypoints(names, shared.confidence[0])
    if item.failure is not None:
        return True
    assert shared.image_size is not None
    item.flags += detection_problem.keypoint_flags(names, shared.points[0], shared.confidence[0], shared.image_size[0])
    item.flags += [] if camera is None else detection_problem.camera_flags(camera, shared.image_size[0])
    return False
