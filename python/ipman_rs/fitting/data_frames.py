"""Frames of a data set in the fit's axes, and fits back in the data set's: a fit's world has y up.

A data set's world is turned so that its ground's normal is y. Where the body stays in the presented frame (IPMAN-O)
it is moved, too, so that the presented body has its root joint where the fit's parameters have it: R^b = I, t^b = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import ipman_rs.torch as ipt
from ipman_rs.body import BodyModel, formats, pose_arrays
from ipman_rs.data.frames import Frames
from ipman_rs.evaluation.tables.models import FrameBodies

from ..data.keypoints.detections import Detections
from .camera import Camera, level_camera
from .detection_problem import shared_names
from .landmarks import Landmarks
from .presented import PresentedBody, presented_body, self_touching_vertices
from .presented_files import y_up
from .problem import Problem

Array = NDArray[np.float64]

OPENPOSE = "openpose_"  # before the names of OpenPose's points in files of SPIN's form
# Points that annotators and regressors place elsewhere than the body's joint of that name.
OTHERWISE = ("neck", "head", "head_top", "pelvis", "thorax", "spine", "jaw")


@dataclass(frozen=True)
class FitToWorld:
    """Transformation from the fit's world to the data set's: X = Rᵀ (x + shift), R the rotation `turn` (3, 3)."""

    turn: Array
    shift: Array  # (3,) m

    @classmethod
    def of(cls, frame: Frames) -> FitToWorld:
        """Of one frame, whose body is not moved. Without a ground up is the camera's."""
        normal = np.array([0.0, 1.0, 0.0])
        if frame.ground is not None:
            normal = np.asarray(frame.ground.normal, float).reshape(-1, 3)[0]
        elif frame.cameras is not None:
            normal = -np.asarray(frame.cameras.rotation[0], float)[1]
        return cls(y_up(normal).as_matrix(), np.zeros(3))

    def floor(self, frame: Frames) -> float | None:
        """Height of the data set's ground in the fit's world, m."""
        if frame.ground is None:
            return None
        return float(np.ravel(np.asarray(frame.ground.height, float))[0] - self.shift[1])

    def body(self, orient: Array, transl: Array, root: Array) -> tuple[Array, Array]:
        """Root rotation (3,) and translation (3,) of a fitted body in the data set's world; root (3,) m: its root joint
        without translation, about which it turns."""
        turned = (Rotation.from_matrix(self.turn).inv() * Rotation.from_rotvec(orient)).as_rotvec()
        return turned, self.turn.T @ (root + transl + self.shift) - root

    def ground(self, height: float) -> Array:
        """Normal and height (4,) in the data set's world of a level floor of the fit's."""
        return np.array([*self.turn[1], height + self.shift[1]])

    def camera(self, rotation: Array, translation: Array) -> tuple[Array, Array]:
        """R (3, 3) and t (3,) of a camera of the data set, from the fit's world."""
        turned = rotation @ self.turn.T
        return turned, translation + turned @ self.shift


def detections_of(frame: Frames) -> Detections | None:
    """The keypoints of one frame that a data set ships, or None. Of two sets the one with more points in it."""
    if frame.keypoints is None or frame.keypoint_names is None:
        return None
    rows = np.nan_to_num(np.asarray(frame.keypoints[0], float))
    names = [*frame.keypoint_names]
    sets = [
        [(k, name.removeprefix(OPENPOSE)) for k, name in enumerate(names) if name.startswith(OPENPOSE)],
        [(k, name) for k, name in enumerate(names) if not name.startswith(OPENPOSE) and name not in OTHERWISE],
    ]
    chosen = max(sets, key=lambda points: sum(rows[k, 2] > 0 for k, _ in points))
    index = [k for k, _ in chosen]
    if not index or not (rows[index, 2] > 0).any():
        return None
    size = image_size(frame)
    return Detections(
        tuple(name for _, name in chosen),
        rows[None, index, :2],
        rows[None, index, 2].clip(0, 1),
        (str(frame.names[0]),),
        None if size is None else size[None],
    )


def image_size(frame: Frames) -> Array | None:
    """Width and height (2,) of a frame's image: twice the camera's principal point, for frames without the image."""
    return None if frame.cameras is None else 2 * np.asarray(frame.cameras.intrinsics[0], float)[:2, 2]


def presented_of(frame: Frames, own: FrameBodies, body: BodyModel) -> tuple[PresentedBody, FitToWorld]:
    """The recorded pose of one frame, presented to `body`, and the world in which its root joint is the body's.

    own: the data set's own body of that frame. If it is of the same model, the presented floor is the data set's, and
    its shape decides which vertices touch; else the floor lies under the mean body in that pose.
    """
    if frame.pose is None or own.joints is None:
        raise ValueError(f"{frame.names[0]}: no recorded pose to present")
    same = frame.body == body.kind
    whole = FitToWorld.of(frame)
    pose = _on_joints(np.asarray(frame.pose, float), body, frame.body)[0]
    pose[0] = (Rotation.from_matrix(whole.turn) * Rotation.from_rotvec(pose[0])).as_rotvec()
    betas = np.asarray(frame.betas, float)[0, : body.num_betas] if same and frame.betas is not None else None
    contact = self_touching_vertices(body, pose, betas)
    name = str(frame.names[0])
    shift = whole.turn @ np.asarray(own.joints[0, 0], float) - body.J_template[0]
    floor = whole.floor(frame)
    if floor is not None and not same:
        lowest = float(np.asarray(body(pose).vertices)[:, 1].min())
        shift[1] = floor - lowest
    presented = presented_body(name, pose, body, contact, "mesh", None if floor is None else floor - float(shift[1]))
    return presented, FitToWorld(whole.turn, shift)


def _on_joints(pose: Array, body: BodyModel, kind: str | None) -> Array:
    """Absolute rotation vectors (F, j, 3) of a data set on the joints of a body, relative to its mean hands."""
    names = formats.joints_of_pose(pose.shape[1], body, kind)
    return pose_arrays.place([pose_arrays.Piece(pose, names)], body.joint_names, len(pose)) - body.pose_mean


def problem_of(
    body: ipt.BodyModel,
    frames: Sequence[Frames],
    seen: Detections,
    worlds: Sequence[FitToWorld],
    sizes: Sequence[tuple[float, float]] | None,
) -> Problem:
    """The fit of people, one each of the frames. sizes: their height, m, and mass, kg, or None."""
    names = shared_names(body, seen)
    seen = seen.select(names)
    assert seen.image_size is not None
    floors = [world.floor(frame) for world, frame in zip(worlds, frames, strict=True)]
    ground = None
    if all(floor is not None for floor in floors):
        up = torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64).expand(len(frames), 3)
        ground = ipt.Ground(up, torch.tensor(floors, dtype=torch.float64))
    cameras = [
        _camera(frame, world, seen.image_size[row])
        for row, (frame, world) in enumerate(zip(frames, worlds, strict=True))
    ]
    columns = [torch.from_numpy(np.stack(column)) for column in zip(*cameras, strict=True)]
    measured = None if sizes is None else torch.tensor(sizes, dtype=torch.float64)
    return Problem(
        body,
        Landmarks(body, names),
        Camera(*columns),
        ground,
        torch.from_numpy(seen.points),
        torch.from_numpy(seen.confidence),
        image_size=torch.from_numpy(seen.image_size),
        height=None if measured is None else measured[:, 0],
        mass=None if measured is None else measured[:, 1],
    )


def _camera(frame: Frames, world: FitToWorld, size: Array) -> tuple[Array, Array, Array, Array]:
    """focal (2,), center (2,), rotation (3, 3) and translation (3,) in the fit's world."""
    if frame.cameras is None:
        level = np.asarray(level_camera())
        return np.full(2, float(np.hypot(*size))), size / 2, level, np.zeros(3)
    rotation, translation, intrinsics = (
        np.asarray(part[0], float)
        for part in (frame.cameras.rotation, frame.cameras.translation, frame.cameras.intrinsics)
    )
    rotation, translation = world.camera(rotation, translation)
    # Where a camera stands may be unknown; then it is searched for.
    return intrinsics[[0, 1], [0, 1]], intrinsics[:2, 2].copy(), rotation, np.nan_to_num(translation)


def prediction(row: dict[str, Any], world: FitToWorld, body: BodyModel) -> dict[str, Any]:
    """A fitted body, row (`result.Result.arrays`), as `ipman evaluate` reads it: pose (J, 3), betas, transl (3,)."""
    betas = row["betas"][0]
    root = body.J_template[0] + body.J_shapedirs[0, :, : len(betas)] @ betas
    pose = row["full_pose"][0] + body.pose_mean  # absolute hands, as data sets have them
    pose = Rotation.from_rotvec(pose).as_rotvec()  # what nothing held may have turned more than once
    pose[0], transl = world.body(pose[0], row["transl"][0], root)
    return {"pose": pose, "betas": betas, "transl": transl}
