"""Fit items in batches and keep their outputs, one item's failure being its own."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import ipman_rs as ip
import ipman_rs.torch as ipt

from ...body import BodyModel
from ...data.keypoints.detections import Detections, join
from ...files.errors import FileError
from ...progress import Progress, silent
from .. import detection_problem, presented, start
from ..camera_file import KnownCamera
from ..config import Config, uses_terms
from ..fit import fit
from ..presented import PresentedBody
from ..problem import Problem
from ..result import FitResult, fit_results
from .items import Item, identity, look
from .outputs import complete, write_item

BATCH = 64  # items fitted together; after each batch its outputs are on the disk


@dataclass(frozen=True)
class Settings:
    """The options of one command that decide how bodies come out."""

    config: Config
    model: str
    focal: float | None = None
    pitch: float = 0.0
    camera: KnownCamera | None = None
    ground: float | None = None
    height: float | None = None
    mass: float | None = None
    pose: str | None = None
    pose_frame: int | None = None
    pose_up: tuple[float, float, float] | None = None
    contact: Path | None = None
    subject: str | None = None
    up: tuple[float, float, float] | None = None  # of a marker file, in its own axes
    units: float | None = None  # metres in one of a marker file's lengths
    rate: float | None = None  # Hz, of a marker file
    markers: Path | None = None  # a file of marker names and their places
    force: bool = False  # markers that cannot be a person's are fitted, too
    obj: bool = False

    def identity(self) -> str:
        files = [path for path in (self.pose, self.contact, self.markers) if path is not None and Path(path).is_file()]
        content = [hashlib.sha256(Path(path).read_bytes()).hexdigest() for path in files]
        return json.dumps([ip.__version__, asdict(self), content], default=str, sort_keys=True)

    def presented(self, body: BodyModel) -> PresentedBody | None:
        """The pose that `--pose` names, if it names one. Raises ValueError."""
        if self.pose is None:
            return None
        return presented.load(self.pose, body, contact=self.contact, frame=self.pose_frame, up=self.pose_up)


def run(
    items: list[Item], settings: Settings, output: Path, resume: bool = False, progress: Progress = silent
) -> dict[str, dict[str, Any]]:
    """Fit the items and write them under `output`; the records of those that have a body, by name.

    Items that fail say so in `failure`. Raises ValueError for options that fit no item.
    """
    _check(settings)
    body = ipt.BodyModel(settings.model)
    imitated = settings.presented(body.body)
    options = settings.identity()
    records: dict[str, dict[str, Any]] = {}
    hashes = {item.name: identity(item, options) for item in items}
    if resume:
        found = {item.name: complete(output / item.name, hashes[item.name]) for item in items}
        records = {name: record for name, record in found.items() if record is not None}
    waiting = [item for item in items if item.name not in records]
    for batch in _batches(waiting, progress):
        for item, result in _fitted(batch, settings, body, imitated, progress):
            told = {**result.record(), "preset": settings.config.name, "model": body.body.name}
            if imitated is not None:
                told["presented"] = imitated.record(body.body)
                item.notes += imitated.notes
            told |= {"flags": item.flags, "notes": item.notes, "identity": hashes[item.name]}
            records[item.name] = write_item(item, result, body.body, output / item.name, told, settings.obj)
    return records


def _check(settings: Settings) -> None:
    config = settings.config
    if settings.pose is None and uses_terms(config, "presented_pose", "presented_contact"):
        raise ValueError(f"preset {config.name} imitates a pose: give its name or file with --pose")
    if settings.pose is None and (settings.contact or settings.pose_frame is not None or settings.pose_up):
        raise ValueError("--contact, --pose-frame and --pose-up say more of a --pose: give that, too")
    if settings.height is None and settings.mass is None and uses_terms(config, "measured_shape"):
        raise ValueError(f"preset {config.name} knows the person's size: give --height or --mass, or both")


def _batches(items: Iterable[Item], progress: Progress) -> Iterator[list[Item]]:
    """Items whose points have the same names, up to `BATCH` together: what else is in a batch changes no bit of any."""
    waiting: dict[tuple[str, ...], list[Item]] = {}
    todo = list(items)
    with progress("reading", len(todo)) as step:
        for item in todo:
            try:
                if item.seen is None:
                    look(item)
                assert item.seen is not None
                waiting.setdefault(item.seen.names, []).append(item)
            except FileError as error:
                item.failure = error.what
            step.one()
    for group in waiting.values():
        for first in range(0, len(group), BATCH):
            yield group[first : first + BATCH]


def _fitted(
    batch: list[Item], settings: Settings, body: ipt.BodyModel, imitated: PresentedBody | None, progress: Progress
) -> Iterator[tuple[Item, FitResult]]:
    kept = [item for item in batch if not _refused(item, body, settings.camera)]
    if not kept:
        return
    problem = problem_of(body, join([item.seen for item in kept if item.seen is not None]), settings, imitated)
    config = settings.config
    with progress(f"fitting {len(kept)}", len(kept) * len(config.stages)) as step:
        problem, variables = start.initial_state(problem, config.start)
        done = {stage.name: number * len(kept) for number, stage in enumerate(config.stages)}
        found = fit(problem, variables, config, lambda stage, ended: step.to(done[stage] + ended), trace=True)
    for item, result in zip(kept, fit_results(found, config, variables), strict=True):
        if not result.finite:
            item.failure = "the fit found no finite body; check focal length, image size and points"
            continue
        item.flags += result.doubts()
        yield item, result


def problem_of(
    body: ipt.BodyModel, seen: Detections, settings: Settings, imitated: PresentedBody | None = None
) -> Problem:
    """What is known of each person that was seen, who imitates a pose, or none."""
    where = {"focal": settings.focal, "pitch": settings.pitch, "ground": settings.ground}
    where |= {} if settings.camera is None else {"camera": settings.camera}
    problem = detection_problem.problem_from_detections(body, seen, **where, height=settings.height, mass=settings.mass)
    if imitated is None:
        return problem
    return presented.present(problem, [imitated], settings.config.moves_camera)


def _refused(item: Item, body: ipt.BodyModel, camera: KnownCamera | None) -> bool:
    """Whether too little is seen of an item; else its oddities become flags."""
    assert item.seen is not None
    names = detection_problem.shared_names(body, item.seen)
    seen = item.seen.select(names)
    item.failure = detection_problem.missing_keypoints(names, seen.confidence[0])
    if item.failure is not None:
        return True
    assert seen.image_size is not None
    item.flags += detection_problem.suspicious_keypoints(names, seen.points[0], seen.confidence[0], seen.image_size[0])
    item.flags += [] if camera is None else detection_problem.camera_mismatch(camera, seen.image_size[0])
    return False
