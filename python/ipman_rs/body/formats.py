"""The kinds of body models that can be read from files. A new one is a file of its own and a line here."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import smpl_files
from .body_format import BodyFormat, Joints
from .joints import BODY
from .model import BodyModel
from .model_file import ModelFile

FORMATS: dict[str, BodyFormat] = {
    "smpl": smpl_files.SMPL,
    "smplh": smpl_files.SMPLH,
    "smplx": smpl_files.SMPLX,
}


def titles() -> str:
    """The kinds of models, for readers: "SMPL, SMPL+H or SMPL-X"."""
    titles = [format.title for format in FORMATS.values()]
    return f"{', '.join(titles[:-1])} or {titles[-1]}"


def load(
    path: Path,
    num_betas: int = 10,
    flat_hand_mean: bool = False,
    v_template: NDArray[np.float64] | None = None,
) -> BodyModel:
    """The body model in `path`; see `ipman_rs.load_body`.

    Raises:
        ValueError: the file holds no model, or may be one of several kinds; names the file and what was expected.
    """
    file = ModelFile.open(path, titles())
    fitting = [format for format in FORMATS.values() if format.matches(file)]
    if not fitting:
        smpl_files.refuse(file)
    if len(fitting) > 1:
        candidates = " or of ".join(format.title for format in fitting)
        raise ValueError(f"{path}: may be a model of {candidates}; nothing in it tells which")
    return fitting[0].load(file, num_betas=num_betas, flat_hand_mean=flat_hand_mean, v_template=v_template)


def kind_named(word: str | None) -> str | None:
    """The kind of model that a word in a file names, or None."""
    return None if word is None or word.lower() not in FORMATS else word.lower()


def of_kind(sets: list[Joints], own: tuple[Joints, ...]) -> list[Joints]:
    """Of these sets of joints those that count if a kind of model has `own`: no other of the same size."""
    sizes = {len(joints) for joints in own}
    return [joints for joints in sets if joints in own or len(joints) not in sizes]


def joints_of_pose(count: int, body: BodyModel, kind: str | None = None) -> Joints:
    """The names of a pose's joints, of which only the number is known: of the kind `kind` if that has so many, else of
    the body, else of the only kind that has.

    A shorter pose that is no kind's lacks the body's last joints: hands and face.

    Raises:
        ValueError: several kinds have so many joints.
    """
    known = [(FORMATS[each].joints, *FORMATS[each].poses) for each in (kind, body.kind) if each in FORMATS]
    own = next((joints for sets in (*known, (body.joint_names,)) for joints in sets if len(joints) == count), None)
    if own is not None:
        return own
    sets = {
        joints: each.title for each in FORMATS.values() for joints in (each.joints, *each.poses) if len(joints) == count
    }
    if len(sets) > 1:
        raise ValueError(f"pose: has {count} joints, as {' and '.join(sets.values())} have; say of which model it is")
    return next(iter(sets), body.joint_names[:count])


def on_joints(pose: NDArray[Any], body: BodyModel, kind: str | None = None) -> NDArray[Any]:
    """A pose (F, j, 3) on the joints of a body, by their names (`joints_of_pose`); those that it lacks are at rest.

    Raises:
        ValueError: there are more joints than the body has, or too few for one.
    """
    given, wanted = pose.shape[1], body.num_joints
    if given == wanted:
        return pose
    if not len(BODY) <= given < wanted:
        raise ValueError(f"pose: has {given} joints, but the body {body.name} has {wanted}; is the right body named?")
    names = joints_of_pose(given, body, kind)
    filled = np.zeros((len(pose), wanted, 3), pose.dtype)
    for column, name in enumerate(names):
        if name in body.joint_names:
            filled[:, body.joint_names.index(name)] = pose[:, column]
    return filled
