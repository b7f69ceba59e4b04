"""The presented pose (SMPLify-XMC): the pose that a person was shown and imitates, by its name or from a file
(`presented_files`).

Where a file knows no floor, or is of another body than the one that is fitted, the floor lies under the presented body;
where it knows no contact, that is found on the presented body: vertices within `NEAR` of opposite surface.

The fit's world has y up and its origin where the body's parameters have theirs, so IPMAN-O's R^b = I and t^b = 0 mean
the body as presented: the root keeps its rotation, but for the turn that brings the file's up to y.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs import spellings
from ipman_rs.body import BodyModel, poses

from . import presented_files
from .presented_files import ENDINGS, Array, Axis
from .problem import Presented, Problem

NEAR, GEODESIC = 0.02, 0.3  # m: to touch, and from where on along the surface two places are different ones


@dataclass(frozen=True, eq=False)
class PresentedBody:
    """A presented pose on one body model, in a world with y up.

    pose (J, 3): rotation vectors, the root first. height: m, of the floor above the world's origin; None: under the
    body. contact (n,): the vertices that touch. contact_from: "file", "mesh", or "given".
    """

    source: str
    pose: NDArray[np.float64]
    contact: NDArray[np.int64]
    contact_from: str
    height: float | None = None
    notes: tuple[str, ...] = ()

    def vertices(self, body: BodyModel) -> NDArray[np.float64]:
        """The mean body (V, 3) m in this pose, where the fit's world has it."""
        return np.asarray(body(self.pose).vertices, np.float64)

    def floor(self, body: BodyModel) -> float:
        """Height of the floor in the fit's world, m."""
        return float(self.vertices(body)[:, 1].min()) if self.height is None else self.height

    def record(self, body: BodyModel) -> dict[str, Any]:
        """Plain values for JSON."""
        up = self.vertices(body)[:, 1]
        return {
            "source": self.source,
            "body_height_m": float(np.ptp(up)),
            "lowest_above_floor_m": float(up.min() - self.floor(body)),
            "contact_vertices": len(self.contact),
            "contact_from": self.contact_from,
        }


@dataclass(frozen=True)
class PoseSource:
    """What names a presented pose; fields as in `load`."""

    name: str
    frame: int | None = None
    up: spellings.Spelled | None = None
    contact: Path | None = None

    def __post_init__(self) -> None:
        spellings.read_fields(self, up=spellings.axis)

    @classmethod
    def of(
        cls, pose: str | None, pose_frame: int | None = None, pose_up: Axis | None = None, contact: Path | None = None
    ) -> PoseSource | None:
        """Of options as `ipman fit` has them; None where no pose is named. ValueError for the others without it."""
        if pose is not None:
            return cls(pose, pose_frame, pose_up, contact)
        if pose_frame is not None or pose_up is not None or contact is not None:
            raise ValueError("`contact`, `pose_frame` and `pose_up` say more of a `pose`: give that, too")
        return None

    @property
    def files(self) -> list[Path]:
        """The files that are read."""
        return [Path(path) for path in (self.name, self.contact) if path is not None and Path(path).is_file()]

    def load(self, body: BodyModel) -> PresentedBody:
        """The presented pose for a body model. Raises ValueError."""
        return load(self.name, body, contact=self.contact, frame=self.frame, up=self.up)


def load(
    name: str | Path,
    body: BodyModel,
    *,
    contact: str | Path | None = None,
    frame: int | None = None,
    up: Axis | None = None,
) -> PresentedBody:
    """The presented pose of a name (`body.poses`), or of a file, for a body model.

    contact: a file (.json, .npz, .pkl) of vertices of that body, instead of the pose's own. frame: which of a file's
    bodies, where it has several. up: of the file's world; None: y, and z for AMASS's and MoYo's arrays.

    Raises:
        ValueError: no pose of that name, or a file that is missing, damaged, or holds several bodies or none.
    """
    given = None if contact is None else presented_files.read_contact(Path(contact), body)
    if str(name) in poses.NAMES:
        if frame is not None or up is not None:
            raise ValueError(
                f"pose {name}: is a named pose, of which there is one: leave out `pose_frame` and `pose_up`"
            )
        return presented_body(str(name), poses.pose_of(body, str(name)), body, given)
    path = Path(name)
    if path.suffix.lower() not in ENDINGS:
        if path.exists():
            what = "is a folder; name the file in it" if path.is_dir() else "expected a file ending in .npz or .pkl"
            raise ValueError(f"{path}: {what}")
        listed = ", ".join(poses.NAMES)
        raise ValueError(f"no pose {str(name)!r}; there are {listed}, or a file ending in {' '.join(ENDINGS)}")
    stored = presented_files.read(path, body, frame, up)
    contact_from = "file" if given is None else "given"
    known = stored.contact if given is None else given
    return presented_body(str(path), stored.pose, body, known, contact_from, stored.height, stored.notes)


def presented_body(
    source: str,
    pose: NDArray[np.floating],
    body: BodyModel,
    contact: NDArray[np.int64] | None = None,
    contact_from: str = "given",
    height: float | None = None,
    notes: Sequence[str] = (),
) -> PresentedBody:
    """A pose (J, 3) in a world with y up; contact is found on the mean body where it is not known."""
    if contact is None:
        contact, contact_from = self_touching_vertices(body, pose), "mesh"
    notes = [*notes]
    if not len(contact):
        notes.append(f"pose {source}: nothing touches in it, so presented_contact is left out")
    return PresentedBody(source, np.asarray(pose, float), contact, contact_from, height, tuple(notes))


def self_touching_vertices(
    body: BodyModel, pose: NDArray[np.floating], betas: Array | None = None
) -> NDArray[np.int64]:
    """The vertices that touch another part of the same body in a pose, found by the self-contact engine."""
    vertices = np.asarray(body(pose, betas).vertices, float)
    return np.flatnonzero(np.isfinite(ip.self_contact_distance(vertices, body.template, NEAR, GEODESIC)))


def present(problem: Problem, bodies: Sequence[PresentedBody], stays: bool) -> Problem:
    """The problem whose people imitate these poses, one for all or one each.

    stays: the body stays in the frame in which it is presented, and the camera moves around it: its floor is then that
    of the presented pose, unless the problem knows one.
    """
    count, body = problem.num_bodies, problem.body.body
    bodies = [*bodies] * (count if len(bodies) == 1 else 1)
    pose = torch.from_numpy(np.stack([each.pose for each in bodies]))
    touching = torch.zeros(count, body.num_vertices, dtype=torch.bool)
    for row, each in enumerate(bodies):
        touching[row, torch.from_numpy(each.contact)] = True
    ground = problem.ground
    if ground is None and stays:
        up = torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64).expand(count, 3)
        ground = ipt.Ground(up, torch.tensor([each.floor(body) for each in bodies], dtype=torch.float64))
    return replace(problem, presented=Presented(pose[:, 1:], touching, pose[:, 0]), ground=ground)
