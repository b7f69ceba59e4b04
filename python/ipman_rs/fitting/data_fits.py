"""Fits of a data set's people, frame by frame, saved piece by piece: predictions for `ipman evaluate`.

Keypoints are the data set's, or those of files, or MediaPipe's in its images; cameras and ground are the data set's. A
preset that imitates a pose is presented the frame's recorded pose (as in the paper), or one pose for all.

A piece holds the fits of some frames (`evaluation.tables.resumable`): a killed run continues from the last saved
piece, and its results are the same bits.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs.body import BodyModel, embedded
from ipman_rs.data.frames import DataSet, Frames
from ipman_rs.evaluation.tables.job import Source
from ipman_rs.evaluation.tables.models import Models
from ipman_rs.evaluation.tables.predictions import fingerprint
from ipman_rs.evaluation.tables.resumable import Resumable
from ipman_rs.files import atomic_write, regular_file, write_whole

from ..data import keypoints
from ..data.keypoints.detections import Detections, join
from . import data_frames, photo, presented, start
from .config import FitConfig, uses_terms
from .data_frames import FitToWorld
from .detection_problem import missing_keypoints
from .fit import fit
from .landmarks import landmark_names
from .presented import PoseSource
from .problem import Problem
from .result import FitResult, fit_results, parameters
from .terms.measured_shape import DENSITY
from .variables import full_pose

PIECE = 64  # frames: fitted side by side
PREDICTIONS, RECORD = "predictions.npz", "fits.json"
_COLUMNS = ("names", "pose", "betas", "transl", "genders", "ground")

Progress = Callable[[int], None]


@dataclass(frozen=True)
class PaperFit:
    """The paper's fit of a data set: preset, split, and the table of `ipman evaluate` that reports it."""

    preset: str
    split: str
    table: str
    options: Mapping[str, str | int] = field(default_factory=dict)  # of the data set's reader


PAPER = {
    "moyo": PaperFit("ipman-o", "val", "moyo", {"frames": "selected", "camera": 1}),
    "rich": PaperFit("ipman-o-star", "ipman-test", "rich-o-star"),
}


def source_of(name: str, path: str, split: str | None, options: Mapping[str, str | float]) -> Source:
    """A data set; settings that are not given are the paper's, if the paper fits that data set."""
    paper = PAPER.get(name)
    if paper is None:
        return Source(name, path, split, tuple(options.items()))
    return Source(name, path, split or paper.split, tuple({**paper.options, **options}.items()))


@dataclass(frozen=True)
class DetectedFrame:
    """A frame with the keypoints detected in it and the gender of its body model."""

    frame: Frames
    detections: Detections
    gender: str


@dataclass(frozen=True)
class DataFit(Resumable):
    """The fits of one data set by one preset.

    folder: of the results. models: folder of model files. body: an embedded body or a model file; None: the data set's
    own. keypoints: folder of keypoint files, named as the frames. images: where the paths of images begin. every: fit
    each n-th frame. pose: what all are presented; None: the recorded poses. height, mass: of the person; None: of the
    data set's body.
    """

    source: Source
    config: FitConfig
    folder: Path
    models: Path | None = None
    body: str | None = None
    keypoints: Path | None = None
    images: Path = Path()
    every: int = 1
    pose: PoseSource | None = None
    height: float | None = None
    mass: float | None = None
    piece: int = PIECE

    @cached_property
    def data(self) -> DataSet:
        return self.source.open(self.folder / "unpacked", self.bodies)

    @cached_property
    def bodies(self) -> Models:
        return Models(self.models)

    @cached_property
    def rows(self) -> NDArray[np.int64]:
        """The frames that are fitted."""
        return np.arange(0, len(self.data), self.every)

    @property
    def pieces(self) -> int:
        return -(-len(self.rows) // self.piece)

    @cached_property
    def imitates(self) -> bool:
        return uses_terms(self.config, "presented_pose", "presented_contact")

    def begin(self) -> None:
        """Makes the folder. ValueError where it holds other fits, or something that all frames need is missing."""
        first = self.data[slice(0, 1)]
        if self.body is None and first.body is None:
            raise ValueError(f"{self.source.name}: has no body model of its own; name one with `model`")
        body = self.model(self._gender(first))
        if self.imitates and self.pose is None and first.pose is None:
            raise ValueError(f"{self.source.name}: has no poses to present; give one with `pose`")
        if first.cameras is None and not self.config.moves_camera:
            raise ValueError(f"{self.source.name}: has no cameras here, and the preset needs them")
        if self.pose is not None:
            self.pose.load(body)
        if uses_terms(self.config, "measured_shape") and self.height is None and self.mass is None:
            self.size(first)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.check_folder(self.folder, "fits of other options")
        self.mark_folder(self.folder)

    @cached_property
    def manifest(self) -> dict[str, Any]:
        """All that decides the fits, as plain values; no paths, for a folder may be moved."""
        files = [] if self.models is None else self.bodies.files(str(self.data[slice(0, 1)].body))
        files += [] if self.body is None or not Path(self.body).is_file() else [Path(self.body)]
        files += [] if self.pose is None else self.pose.files
        contact = None if self.pose is None else self.pose.contact
        listed = [] if self.keypoints is None else sorted(self.keypoints.rglob("*.json"))
        content = hashlib.sha256()
        for path in listed:
            content.update(str(path.relative_to(self.keypoints or path)).encode() + regular_file(path).read_bytes())
        return {
            "data": self.source.name,
            "split": self.source.split,
            "options": [list(each) for each in self.source.options],
            "frames": len(self.data),
            "first": hashlib.sha256(repr(self.data[slice(0, 1)].names.tolist()).encode()).hexdigest(),
            "every": self.every,
            "preset": json.loads(json.dumps(asdict(self.config), default=str)),
            "body": None if self.body is None else Path(self.body).name,
            "pose": None if self.pose is None else [Path(self.pose.name).name, self.pose.frame, str(self.pose.up)],
            "contact": None if contact is None else contact.name,
            "files": {path.name: fingerprint(path) for path in sorted(files)},
            "keypoints": None if self.keypoints is None else content.hexdigest(),
            "height": self.height,
            "mass": self.mass,
            "piece": self.piece,
            "version": ip.__version__,
        }

    def model(self, gender: str) -> BodyModel:
        """The body that is fitted to people of a gender; its hands are relative to its mean hand."""
        if gender not in self._models:
            kind = self.body or str(self.data[slice(0, 1)].body)
            is_named = self.body is not None or kind in embedded.NAMES
            self._models[gender] = ip.load_body(kind if is_named else self.bodies.file(kind, gender))
        return self._models[gender]

    @cached_property
    def _models(self) -> dict[str, BodyModel]:
        return {}

    def _gender(self, frame: Frames) -> str:
        return "neutral" if frame.genders is None or self.body is not None else str(frame.genders[0])

    @property
    def pieces_folder(self) -> Path:
        return self.folder / "pieces"

    def run(self, progress: Progress = lambda done: None) -> dict[str, Any]:
        """Does the pieces that are not there yet and writes the predictions; gives the record of all fits.

        `progress` is told how many frames are done. ValueError where no frame has a body.
        """
        self.pieces_folder.mkdir(exist_ok=True)
        for number in range(self.pieces):
            if not self.done(number):
                self.save(number, self._piece(number))
            progress(min((number + 1) * self.piece, len(self.rows)))
        return self._finish()

    def _piece(self, number: int) -> dict[str, Any]:
        rows = self.rows[number * self.piece : (number + 1) * self.piece]
        frames = self.data[rows]
        detected, left_out = self._detect([frames[slice(k, k + 1)] for k in range(len(frames))])
        rows_of_fits: list[dict[str, Any]] = [{}] * len(detected)
        for gender in sorted({each.gender for each in detected}):
            index = [k for k, each in enumerate(detected) if each.gender == gender]
            for k, row in zip(index, self._fitted([detected[k] for k in index], gender), strict=True):
                rows_of_fits[k] = row
        bad = {row["names"]: "the fit found no finite body" for row in rows_of_fits if not row["finite"]}
        finite = [row for row in rows_of_fits if row["finite"]]
        lost = {**left_out, **bad}
        columns = {name: np.array([row[name] for row in finite]) for name in (finite[0] if finite else ())}
        return {**columns, "left_out": np.array([*lost], np.str_), "why": np.array([*lost.values()], np.str_)}

    def _detect(self, frames: Sequence[Frames]) -> tuple[list[DetectedFrame], dict[str, str]]:
        """The frames with keypoints, and why others are left out."""
        detected: list[DetectedFrame] = []
        left_out: dict[str, str] = {}
        with ExitStack() as opened:
            detect: Callable[[Path], Detections] | None = None
            for frame in frames:
                name = str(frame.names[0])
                try:
                    _check_camera(frame, self.config.moves_camera)
                    detections = self._keypoints(frame)
                    if detections is None:
                        if frame.images is None or not str(frame.images[0]):
                            raise ValueError("has no keypoints and no image")
                        detect = detect or opened.enter_context(photo.detector())
                        detections = detect(self.images / str(frame.images[0]))
                    there = landmark_names(self.model(self._gender(frame)))
                    shared = [name for name in detections.names if name in there]
                    why = missing_keypoints(shared, detections.select(shared).confidence[0])
                    if why is not None or detections.image_size is None:
                        raise ValueError(why or "the size of its image is not known")
                except ImportError as error:
                    left_out[name] = f"{error}; or give keypoint files (`keypoints`)"
                    continue
                except ValueError as error:
                    left_out[name] = str(error)
                    continue
                detected.append(DetectedFrame(frame, detections, self._gender(frame)))
        return detected, left_out

    def _keypoints(self, frame: Frames) -> Detections | None:
        """Of the folder of keypoint files, or else those that the data set ships."""
        if self.keypoints is None:
            return data_frames.detections_of(frame)
        name = str(frame.names[0])
        endings = [f"{mark}{suffix}" for suffix in keypoints.suffixes() for mark in ("", "_keypoints")]
        places = [self.keypoints / f"{name}{ending}" for ending in endings]
        place = next((place for place in places if place.is_file()), None)
        if place is None:
            raise ValueError(f"no keypoint file {places[0]}")
        size = data_frames.image_size(frame)
        given = None if size is None else (float(size[0]), float(size[1]))
        detections = keypoints.read(place, image_size=given)
        if len(detections) > 1:
            raise ValueError(f"{place}: expected the keypoints of one frame, got {len(detections)} images")
        return detections

    def _fitted(self, detected: Sequence[DetectedFrame], gender: str) -> Iterator[dict[str, Any]]:
        body = self.model(gender)
        frames = [each.frame for each in detected]
        shown, worlds = self._presented(frames, body)
        sizes = [self.size(frame) for frame in frames] if uses_terms(self.config, "measured_shape") else None
        model = ipt.BodyModel(body)
        problem = data_frames.problem_of(model, frames, join([each.detections for each in detected]), worlds, sizes)
        if shown is not None:
            problem = presented.present(problem, shown, self.config.moves_camera)
        problem, variables = start.initial_state(problem, self.config.start)
        fitted = fit(problem, variables, self.config)
        for row, result in enumerate(fit_results(fitted, self.config, variables)):
            contacts = len(shown[row].contact) if shown is not None else 0
            yield self._row(result, problem, worlds[row], detected[row], contacts)

    def _presented(
        self, frames: Sequence[Frames], body: BodyModel
    ) -> tuple[list[presented.PresentedBody] | None, list[FitToWorld]]:
        """The presented pose of each frame, if the preset imitates one, and the worlds of the fits."""
        whole = [FitToWorld.of(frame) for frame in frames]
        if self.pose is not None:
            shown = self.pose.load(body)
            return [shown] * len(frames), [_on_floor(world, frame, shown.floor(body), self.config.moves_camera)
                                           for world, frame in zip(whole, frames, strict=True)]  # fmt: skip
        if not self.imitates:
            return None, whole
        presented_frames = [data_frames.presented_of(frame, self.bodies.posed(frame), body) for frame in frames]
        worlds = [world for _, world in presented_frames]
        return [each for each, _ in presented_frames], worlds if self.config.moves_camera else whole

    def size(self, frame: Frames) -> tuple[float, float]:
        """Height, m, and mass, kg, of a person: as given, or of the data set's own body in its zero pose."""
        if self.height is not None and self.mass is not None:
            return self.height, self.mass
        if frame.pose is None or frame.body is None:
            raise ValueError(f"{self.source.name}: does not know how tall its people are: give `height` and `mass`")
        gender = "neutral" if frame.genders is None else str(frame.genders[0])
        body = self.bodies.get(frame.body, gender, rest_shape=frame.rest_shape)
        known = frame.betas is not None and frame.rest_shape is None
        betas = np.asarray(frame.betas, float)[0, : body.num_betas] if known else None
        resting = np.asarray(body(betas=betas).vertices)
        volume = float(np.asarray(ip.part_volumes(resting, body.template)).sum())
        height = float(np.ptp(resting[:, 1])) if self.height is None else self.height
        return height, DENSITY * volume if self.mass is None else self.mass

    def _row(
        self, result: FitResult, problem: Problem, world: FitToWorld, detected: DetectedFrame, contacts: int
    ) -> dict[str, Any]:
        body = problem.body.body
        variables = result.candidate.variables
        arrays = {**parameters(body, variables), "full_pose": full_pose(variables, body).numpy()}
        errors = result.reprojection()
        row = {
            "names": str(detected.frame.names[0]),
            "genders": detected.gender,
            **data_frames.prediction(arrays, world, body),
            "finite": result.finite,
            "converged": result.converged,
            "median_px": errors["median_px"],
            "median_percent": errors["median_percent"],
            "contact_vertices": contacts,
        }
        ground = result.candidate.problem.ground
        if ground is not None:
            row["ground"] = world.ground(float(ground.height.reshape(-1)[0]))
        return row

    def _finish(self) -> dict[str, Any]:
        """Writes predictions and record, made of all pieces."""
        pieces = [self.result(number) for number in range(self.pieces)]
        filled = [piece for piece in pieces if "names" in piece]
        left_out = [
            {"frame": str(name), "why": str(why)}
            for piece in pieces
            for name, why in zip(piece["left_out"], piece["why"], strict=True)
        ]
        if not filled:
            why = left_out[0]["why"] if left_out else "there are no frames"
            raise ValueError(f"{self.source.name}: no frame has a body; the first: {why}")
        arrays = {
            name: np.concatenate([piece[name] for piece in filled])
            for name in filled[0]
            if name not in ("left_out", "why")
        }
        kind = self.model(str(arrays["genders"][0])).kind
        columns = {name: arrays[name] for name in _COLUMNS if name in arrays}
        with atomic_write(self.folder / PREDICTIONS) as out:
            np.savez(out, allow_pickle=False, body=np.array(kind), **columns)
        source = "the recorded pose of each frame" if self.pose is None else self.pose.name
        record = {
            "data": self.source.name,
            "split": self.source.split,
            "preset": self.config.name,
            "body": kind,
            "frames": len(self.rows),
            "every": self.every,
            "fitted": len(arrays["names"]),
            "converged": int(arrays["converged"].sum()),
            "median_reprojection_px": float(np.median(arrays["median_px"])),
            "median_reprojection_percent": float(np.median(arrays["median_percent"])),
            "with_presented_contact": int((arrays["contact_vertices"] > 0).sum()) if self.imitates else None,
            "presented": source if self.imitates else None,
            "left_out": left_out,
        }
        write_whole(self.folder / RECORD, json.dumps(record, indent=1, ensure_ascii=False) + "\n")
        return record


def _on_floor(world: FitToWorld, frame: Frames, floor: float, stays: bool) -> FitToWorld:
    """The world moved up or down, so that a presented body that stays stands on the data set's floor."""
    height = world.floor(frame)
    return world if height is None or not stays else FitToWorld(world.turn, np.array([0.0, height - floor, 0.0]))


def _check_camera(frame: Frames, stays: bool) -> None:
    """ValueError where the body could not be put into the world."""
    if frame.cameras is None or stays:
        return
    if not np.isfinite(np.asarray(frame.cameras.translation[0], float)).all():
        raise ValueError("the place of its camera is not known")
