"""The three errors of an estimated body of the same model as the true one."""

from __future__ import annotations

from typing import Any, NamedTuple

from .mpjpe import mpjpe, pa_mpjpe
from .pve import pve


class BodyErrors(NamedTuple):
    """(...) m each: mean distance of the joints, of the joints after the best similarity, and of the vertices."""

    mpjpe: Any
    pa_mpjpe: Any
    pve: Any


def body_errors(vertices: Any, joints: Any, true_vertices: Any, true_joints: Any) -> BodyErrors:
    """MPJPE, PA-MPJPE and PVE of bodies (..., V, 3) and (..., J, 3), arrays or tensors, whose joint 0 is the pelvis:
    MPJPE and PVE with pelvis on pelvis. ValueError where shapes differ."""
    return BodyErrors(
        mpjpe(joints, true_joints),
        pa_mpjpe(joints, true_joints),
        pve(vertices, true_vertices, joints[..., 0, :], true_joints[..., 0, :]),
    )
