"""What a kind of body model is: how its files are told and loaded, its joints, and the arrays that hold its poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .model import BodyModel
from .model_file import ModelFile

Joints = tuple[str, ...]


class Matches(Protocol):
    def __call__(self, file: ModelFile, /) -> bool: ...


class Load(Protocol):
    def __call__(
        self,
        file: ModelFile,
        /,
        *,
        num_betas: int,
        flat_hand_mean: bool,
        v_template: NDArray[np.float64] | None,
    ) -> BodyModel: ...


@dataclass(frozen=True)
class BodyFormat:
    """A kind of body model. A new one is a file with one of these, and one line in `formats.FORMATS`.

    Joints that are those of SMPL bear SMPL's names: body parts, named poses, landmarks and poses of other models' files
    go by these.
    """

    name: str  # what files and data sets call it: "smplx"
    title: str  # what people call it: "SMPL-X"
    joints: Joints  # in the order of its poses, the root first
    matches: Matches  # whether a file holds such a model; does not raise
    load: Load  # the model of a file for which `matches` holds, its `kind` this format's name; see `load_body`
    written: tuple[str, ...]  # arrays in which poses are written: names of `pieces`, or "pose", if `poses` has `joints`
    pieces: Mapping[str, tuple[Joints, ...]] = field(default_factory=dict)  # of arrays that hold a pose or a piece of
    # it, the sets of joints that they may have; a name that no other format has leaves no doubt whose the pose is
    poses: tuple[Joints, ...] = ()  # the same of arrays with a usual name of a whole pose, such as "poses" and "pose"
    downloaded: Mapping[str, str] = field(default_factory=dict)  # by gender, how files begin beside NAME_GENDER
