"""The options of a fit: preset, body model, what is known of the camera, the person and the markers."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import torch

import ipman_rs as ip
import ipman_rs.torch as ipt

from ... import spellings
from ...body import BodyModel
from ...data.keypoints.detections import Detections
from .. import camera_file, config, detection_problem, presented
from ..camera_file import KnownCamera
from ..config import FitConfig, uses_terms
from ..presented import PoseSource, PresentedBody
from ..problem import Problem

# Options of one kind of input, here or in `InputOptions`, which mean nothing to the other.
OF_MARKERS = ("up", "units", "rate", "markers", "subject")
OF_IMAGES = (
    "camera", "focal", "pitch", "height", "mass", "pose", "pose_frame", "pose_up", "contact", "person", "image_size",
    "photo",
)  # fmt: skip


@dataclass(frozen=True)
class FitOptions:
    """All that decides how bodies come out, beside the inputs.

    model: name or file of the body model. focal: pixels. pitch: degrees that the camera looks down. ground: height of
    the floor, m; None: under the feet. height, mass: of the person, m and kg. pose: what is presented. Of marker files:
    subject, up (in the file's own axes), units (metres in one of its lengths), rate (Hz), markers (a file of marker
    names and their places), force (fit markers that cannot be a person's, too). obj: write meshes as .obj, too.

    Axes, units, rate and ground ("found") may be the words of the command line (`ipman_rs.spellings`), which become
    numbers. Raises ValueError, naming the argument, for others.
    """

    config: FitConfig
    model: str
    focal: float | None = None
    pitch: float | None = None
    camera: KnownCamera | None = None
    ground: spellings.Spelled | None = None
    height: float | None = None
    mass: float | None = None
    pose: PoseSource | None = None
    subject: str | None = None
    up: spellings.Spelled | None = None
    units: spellings.Spelled | None = None
    rate: spellings.Spelled | None = None
    markers: Path | None = None
    force: bool = False
    obj: bool = False

    def __post_init__(self) -> None:
        spellings.read_fields(
            self, ground=spellings.height_or("found"), up=spellings.axis, units=spellings.unit,
            rate=spellings.rate,
        )  # fmt: skip

    def identity(self) -> str:
        """Text that differs wherever the fits could: the version, the options, and the bytes of their files."""
        files = [] if self.pose is None else self.pose.files
        files += [path for path in (self.markers,) if path is not None and path.is_file()]
        content = [hashlib.sha256(path.read_bytes()).hexdigest() for path in files]
        return json.dumps([ip.__version__, asdict(self), content], default=str, sort_keys=True)

    def presented(self, body: BodyModel) -> PresentedBody | None:
        """The presented pose, if one is named. Raises ValueError."""
        return None if self.pose is None else self.pose.load(body)

    def check(self) -> None:
        """ValueError where the preset needs what is not given, or options contradict each other."""
        if self.pose is None and uses_terms(self.config, "presented_pose", "presented_contact"):
            raise ValueError(f"preset {self.config.name} imitates a pose: give its name or file with `pose`")
        if self.height is None and self.mass is None and uses_terms(self.config, "measured_shape"):
            raise ValueError(f"preset {self.config.name} knows the person's size: give `height` or `mass`, or both")

    def problem(
        self,
        model: ipt.BodyModel,
        detections: Detections,
        presented_body: PresentedBody | None = None,
        focal: Sequence[float | None] | None = None,
        together: bool = False,
    ) -> Problem:
        """The fitting problem of detected people, who imitate a presented pose if there is one. focal: pixels, of each
        photo, where it is known and the options do not say another. together: people of the same source share a camera.
        """
        known = {"focal": focal if self.focal is None else self.focal, "pitch": self.pitch, "ground": self.ground}
        known |= {} if self.camera is None else {"camera": self.camera}
        problem = detection_problem.problem_from_detections(
            model, detections, **known, height=self.height, mass=self.mass
        )
        if together:
            sources = list(dict.fromkeys(detections.sources))
            problem = replace(problem, image=torch.tensor([sources.index(source) for source in detections.sources]))
        if presented_body is None:
            return problem
        return presented.present(problem, [presented_body], self.config.moves_camera)


def changed(options: Any) -> dict[str, Any]:
    """The fields of a dataclass that are not as they are by default."""
    every = {field.name: (getattr(options, field.name), field.default) for field in fields(options)}
    return {name: value for name, (value, default) in every.items() if value != default}


def fit_options(
    preset: str | Path = "fast",
    model: str = "anny-lite",
    iterations: int | None = None,
    camera: str | Path | None = None,
    markers: str | Path | None = None,
    *,
    pose: str | None = None,
    pose_frame: int | None = None,
    pose_up: tuple[float, float, float] | None = None,
    contact: Path | None = None,
    **others: Any,
) -> FitOptions:
    """The options of a fit by a preset's name or file.

    iterations: end each stage after so many at most. camera: a JSON file (`camera_file`). pose: name or file of a
    presented pose, with its frame, its up axis and the file of its contact. markers, others: as in `FitOptions`.

    Raises:
        ValueError: a preset, camera or markers that cannot be read, or details of a pose without one.
    """
    from ...data.markers import own

    chosen = config.load(preset)
    if iterations is not None:
        if iterations < 1:
            raise ValueError(f"iterations: expected 1 or more, got {iterations}")
        chosen = config.limit_iterations(chosen, iterations)
    names = None if markers is None else Path(markers)
    if names is not None:
        own.read(names, ip.load_body(model))  # before anything is fitted
    known = None if camera is None else camera_file.read(camera)
    imitated = PoseSource.of(pose, pose_frame, pose_up, contact)
    return FitOptions(chosen, model, camera=known, markers=names, pose=imitated, **others)
