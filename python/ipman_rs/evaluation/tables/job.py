"""One evaluation: predictions against a data set, computed in pieces that are kept on disk.

A piece holds the metrics of some thousand frames (see `resumable`). A killed evaluation therefore continues where it
stopped, and pieces can be computed elsewhere. The final results come from all pieces and do not depend on how these
were computed.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from ipman_rs import __version__, data
from ipman_rs.data import check, plausibility
from ipman_rs.data.frames import DataSet, Frames, Rows
from ipman_rs.ground import Ground
from ipman_rs.volume import mass_properties

from ..procrustes import similarity
from . import predictions as predicted
from .frame_metrics import Columns, Setup, piece_metrics
from .joints import Definition, Regressors, define, paired_joints
from .models import Models
from .resumable import Resumable

PIECE = 4096  # frames: some seconds of work, little memory
SAMPLED_BODIES = 16  # bodies
LARGE_TURN = 60.0  # degrees: a smaller rotation counts as an error of the estimate
COMMON_TURN = 30.0  # degrees from the mean rotation: below, all people are turned in the same way
OWN = "own"  # name of the data set of a user's own file, which has the form of predictions
TRUTH = "truth"  # in place of a file of predictions: the data set's own bodies


@dataclass(frozen=True)
class Source:
    """A data set by name, path, split and options: plain values, so that another process or machine can open it."""

    name: str
    path: str
    split: str | None = None
    options: tuple[tuple[str, str | int | float], ...] = ()

    def open(self, unpacked: Path, models: Models) -> DataSet:
        """The data set. ValueError, naming the file, if it is missing or something is wrong with it."""
        if self.name == OWN:
            return predicted.read(self.path, unpacked)
        if self.name not in data.DATASETS:
            raise ValueError(f"data: expected {OWN}, or one of {', '.join(data.DATASETS)}, got {self.name!r}")
        options: dict[str, Any] = {**({} if self.split is None else {"split": self.split}), **dict(self.options)}
        allowed = [*inspect.signature(data.module(self.name).open).parameters][1:]
        for name in options:
            if name not in allowed or name == "hands":
                raise ValueError(f"{self.name}: has no option {name!r}; it has {', '.join(allowed)}")
        if not Path(self.path).exists():
            raise ValueError(f"{self.path}: there is no such file or folder; it should hold the data set {self.name}")
        if "hands" in allowed:  # without them the fingers are straight
            options["hands"] = models.hands()
        return data.open(self.name, self.path, **options)

    @property
    def manifest(self) -> list[list[Any]]:
        """The options; for files, a hash of their content, because paths differ between machines."""
        return [[name, predicted.fingerprint(Path(value)) if is_file(value) else value] for name, value in self.options]


@dataclass(frozen=True)
class Shard:
    """Shard `index` (from 1) of `count`: every count-th piece."""

    index: int = 1
    count: int = 1

    def of(self, pieces: int) -> range:
        return range(self.index - 1, pieces, self.count)


@dataclass(frozen=True)
class Job(Resumable):
    """The evaluation of one file of predictions, or of the data set's own bodies (`TRUTH`).

    All fields are plain values, so that it can be sent to other processes.

    folder: of the results. models: folder of model files. partial: frames without a prediction are left out instead of
    raising an error. unit: metres per unit of length of the predictions. degrees: their rotations are in degrees.
    force: implausible people are evaluated, too.
    """

    name: str
    predictions: str
    source: Source
    folder: str
    models: str | None = None
    regressors: tuple[str, ...] = ()
    preset: str = "paper-r"
    partial: bool = False
    unit: float = 1.0
    degrees: bool = False
    force: bool = False
    piece: int = PIECE

    @cached_property
    def pieces_folder(self) -> Path:
        return Path(self.folder) / "methods" / self.name

    @cached_property
    def unpacked(self) -> Path:
        return Path(self.folder) / "unpacked"

    @cached_property
    def data(self) -> DataSet:
        return self.source.open(self.unpacked, self.body_models)

    @cached_property
    def estimates(self) -> predicted.Predictions:
        return predicted.read(
            self.predictions, self.unpacked, predicted.ReadOptions(self.unit, self.degrees, self.force)
        )

    @cached_property
    def body_models(self) -> Models:
        return Models(None if self.models is None else Path(self.models))

    @cached_property
    def joint_regressors(self) -> Regressors:
        return Regressors.read(self.regressors)

    @cached_property
    def sample(self) -> Frames:
        """Some frames of the data set: one if it has no joints; more if it has, because some joints may be missing."""
        first = self.data[slice(0, 1)]
        return first if first.joints is None else check.sample(self.data)

    @cached_property
    def without_bodies(self) -> bool:
        """Whether the data set has joints, and an array of poses that is NaN in all frames of the sample."""
        pose = self.sample.pose
        return self.sample.joints is not None and pose is not None and not np.isfinite(pose).all(axis=(1, 2)).any()

    @cached_property
    def definition(self) -> Definition | None:
        """Which joints are compared, derived from a few frames. ValueError where their definitions would differ."""
        measured: frozenset[str] = frozenset()
        if self.sample.joints is not None:
            finite = np.asarray(np.isfinite(self.sample.joints).all(axis=2))
            names = enumerate(self.sample.joint_names or ())
            measured = frozenset(name for k, name in names if finite[:, k].any())
        truth = self.body_models.posed(self._truth(slice(0, 1)))
        guess = truth if self.predictions == TRUTH else self.body_models.posed(self.estimates[slice(0, 1)])
        return define(truth, guess, measured, self.joint_regressors, self.source.name)

    @cached_property
    def setup(self) -> Setup:
        """What the metrics of frames need besides the frames."""
        return Setup(self.body_models, self.definition, self.joint_regressors, self.preset)

    @property
    def pieces(self) -> int:
        return -(-len(self.data) // self.piece)

    def frames(self, number: int) -> int:
        """The number of frames of a piece."""
        return min(self.piece, len(self.data) - number * self.piece)

    def begin(self) -> None:
        """Creates the folder. ValueError if it holds results of another evaluation, or if frames lack predictions."""
        _ = self.joint_regressors  # fails early
        self.pieces_folder.mkdir(parents=True, exist_ok=True)
        self.check_folder(self.pieces_folder, "figures of another evaluation")
        if self.predictions != TRUTH and len(self.estimates) < len(self.data) and not self.partial:
            raise ValueError(
                f"{self.predictions}: has {len(self.estimates):,} frames, but the data set {self.source.name} has "
                f"{len(self.data):,}; `partial` leaves out those without prediction"
            )
        _ = self.flags
        _ = self.definition
        self.mark_folder(self.pieces_folder)

    @cached_property
    def flags(self) -> tuple[str, ...]:
        """What is unusual about the estimated people, in words. ValueError for people who are implausible, or whose up
        is not the data set's."""
        if self.predictions == TRUTH:
            return ()
        findings = [*(self._axes() or self._turned()), *self._masses(), *self._betas(), *self._of_truth()]
        return (*self.estimates.flags, *plausibility.admit(self.predictions, findings, self.force))

    def _of_truth(self) -> list[check.Finding]:
        """Findings about arrays of the user's own truth that no metric uses."""
        unused = self.data.unused() if isinstance(self.data, predicted.Predictions) else []
        return [replace(each, what=f"the truth, {self.source.path}: {each.what}") for each in unused]

    def _masses(self) -> list[check.Finding]:
        """Findings about the masses of a few estimated bodies."""
        bodies = self.body_models.posed(self.estimates[check.evenly(len(self.estimates), SAMPLED_BODIES)])
        if bodies.vertices is None or bodies.model is None:
            return []
        masses = mass_properties(bodies.vertices, bodies.model.template).mass
        finite = masses[np.isfinite(masses)]
        return plausibility.mass(float(np.median(finite))) if len(finite) else []

    def _betas(self) -> list[check.Finding]:
        """Findings if the predictions have more shape components than the body model."""
        first = self.estimates[slice(0, 1)]
        if (
            first.betas is None
            or first.body is None
            or first.vertices is not None
            or not self.body_models.has(first.body)
        ):
            return []
        gender = "neutral" if first.genders is None else str(first.genders[0])
        width, model = first.betas.shape[1], self.body_models.get(first.body, gender, first.betas.shape[1])
        if width <= model.num_betas:
            return []
        return [check.Finding("odd", f"betas: the first {model.num_betas} of {width}, as many as {model.name} has")]

    def _axes(self) -> list[check.Finding]:
        """Findings if the estimated people stand along another axis than the data set's up."""
        frames = check.sample(self.estimates)
        ground = frames.ground or self.data[slice(0, 1)].ground
        bodies = self.body_models.posed(frames)
        if ground is None or bodies.joints is None:
            return []
        normal = ground.normal if ground.normal.ndim == 1 else ground.normal[0]
        standing = replace(frames, joints=bodies.joints, joint_names=bodies.joint_names, ground=Ground(normal))
        findings = [each for each in check.check_frames(standing) if each.what.startswith("joints: looks like")]
        return [replace(each, advice=self._other_axes, option="") for each in findings]

    def _turned(self) -> list[check.Finding]:
        """Findings if the estimated people match the true ones only after a rotation, such as from a camera's axes."""
        from scipy.spatial.transform import Rotation

        true = self._truth(check.evenly(len(self.data), SAMPLED_BODIES))
        rows = self.estimates.index.find(true.names)
        paired = np.flatnonzero(rows >= 0)
        if self.definition is None or not len(paired):
            return []
        truth, guess = self.body_models.posed(true[paired]), self.body_models.posed(self.estimates[rows[paired]])
        joints = paired_joints(truth, guess, self.definition, self.joint_regressors)
        _, matrices, _ = similarity(joints.true, joints.estimated)
        matrices = matrices[np.isfinite(matrices).all(axis=(1, 2))]
        if not len(matrices):
            return []
        turns = Rotation.from_matrix(matrices)
        angle = float(np.degrees(np.median(turns.magnitude())))
        if angle <= LARGE_TURN:
            return []
        message = f"predicted people are the true ones turned by {angle:.0f} degrees in the median"
        mean = turns.mean()
        if np.degrees(np.median((mean.inv() * turns).magnitude())) < COMMON_TURN:
            axis = mean.as_rotvec() / mean.magnitude()
            axis *= np.sign(axis[np.abs(axis).argmax()]) if angle > 179 else 1.0  # either way about it is the same
            message += f", about ({', '.join(f'{number + 0.0:.2g}' for number in axis.round(2))})"
        advice = f"turn them back if their axes are other ones than the data set's{self._other_frame}"
        return [check.Finding("odd", message, advice)]

    @property
    def _other_axes(self) -> str:
        """Advice for predictions in other axes than the data set's."""
        return f"turn them, or give the file a ground (4,) of its own: normal and height{self._other_frame}"

    @property
    def _other_frame(self) -> str:
        """The option of the data set's reader that gives its people in other axes, where it has one."""
        options = () if self.source.name == OWN else inspect.signature(data.module(self.source.name).open).parameters
        return ", or the option frame=camera or frame=world" if "frame" in options else ""

    @cached_property
    def manifest(self) -> dict[str, Any]:
        """Everything that determines the results; no paths, because these differ between machines."""
        kinds = {self.data[slice(0, 1)].body}
        if self.predictions != TRUTH:
            kinds.add(self.estimates[slice(0, 1)].body)
        files = [path for kind in kinds - {None} for path in self.body_models.files(str(kind))]
        true = self.data
        return {
            "predictions": TRUTH if self.predictions == TRUTH else self.estimates.fingerprint,
            "data": self.source.name,
            "content": true.fingerprint
            if isinstance(true, predicted.Predictions)
            else _content(check.sample(true, 16)),
            "split": self.source.split,
            "options": self.source.manifest,
            "frames": len(self.data),
            "models": {path.name: predicted.fingerprint(path) for path in sorted(files)},
            "regressors": sorted(predicted.fingerprint(Path(path)) for path in self.regressors),
            "preset": self.preset,
            "partial": self.partial,
            "piece": self.piece,
            "version": __version__,
            **({"unit": self.unit} if self.unit != 1.0 else {}),
            **({"degrees": True} if self.degrees else {}),
        }

    def run(self, shard: Shard, progress: Callable[[int], None] = lambda frames: None) -> None:
        """Computes the missing pieces of a shard; `progress(frames)` is called after each with its number of frames."""
        for number in shard.of(self.pieces):
            if not self.done(number):
                self.measure(number)
                progress(self.frames(number))

    def measure(self, number: int) -> None:
        """Computes and saves a piece. ValueError where frames have no prediction, or shapes do not match."""
        start = number * self.piece
        self.save(number, piece_metrics(self.pair, self.setup, start, start + self.frames(number)))

    def damaged(self) -> list[int]:
        """Pieces that exist but are incomplete or of another evaluation: `run` computes them again."""
        return [number for number in range(self.pieces) if self.file(number).exists() and not self.done(number)]

    def missing(self) -> list[int]:
        """Pieces that are not there, or damaged."""
        return [number for number in range(self.pieces) if not self.done(number)]

    def results(self) -> Iterator[Columns]:
        """The metrics of all pieces, in the order of the frames. ValueError if a piece is missing."""
        for number in range(self.pieces):
            yield self.result(number)

    def pair(self, rows: slice) -> tuple[Frames, Frames, NDArray[np.int64]]:
        """True and estimated frames of the same names, and their numbers. ValueError if a frame has no estimate."""
        true = self._truth(rows)
        if self.predictions == TRUTH:
            return true, true, rows.start + np.arange(len(true))
        matches = self.estimates.index.find(true.names)
        if (matches < 0).any() and not self.partial:
            lacking = true.names[matches < 0]
            raise ValueError(
                f"{self.predictions}: no prediction for {len(lacking)} of the frames {true.names[0]} to "
                f"{true.names[-1]} of {self.source.name}, such as {str(lacking[0])!r}; the file's names are like "
                f"{str(self.estimates.columns['names'][:1][0])!r}; `partial` leaves them out"
            )
        paired = np.flatnonzero(matches >= 0)
        return true[paired], self.estimates[matches[paired]], rows.start + paired

    def _truth(self, rows: Rows) -> Frames:
        true = self.data[rows]
        return replace(true, pose=None) if self.without_bodies else true


def is_file(value: str | int | float) -> TypeGuard[str]:
    return isinstance(value, str) and Path(value).is_file()


def _content(frames: Frames) -> str:
    """A hash of the numbers of some frames, which identifies a data set."""
    digest = hashlib.sha256()
    for field in fields(frames):
        value = getattr(frames, field.name)
        if isinstance(value, np.ndarray) and field.name != "images":  # which are paths
            digest.update(f"{field.name} {value.shape} {value.dtype}".encode())
            digest.update(np.ascontiguousarray(value).tobytes())
    return digest.hexdigest()


def method_names(files: Sequence[Path]) -> list[str]:
    """A unique name for each file of predictions: the file's name, with a number if it occurs again."""
    names: list[str] = []
    for path in files:
        name, number = path.stem, 2
        while name in names:
            name, number = f"{path.stem}-{number}", number + 1
        names.append(name)
    return names
