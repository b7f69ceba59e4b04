"""Joint limits: Σ soft(angle − limit)² over the angles beyond their range, radians.

Each joint's rotation is split into a swing, which says where the bone points, and before it a twist about the bone, by

    q = swing · twist,  twist ∥ bone     angles: the twist's own, and the two components of the swing's rotation vector

For a rotation about one of the body's axes these are the angle of `ipman_rs.body.poses` (degrees about x, y, z of the
parent's axes in the zero pose), and small rotations agree to first order. Euler angles are not used, because shoulders
reach their gimbal lock; a swing is singular only where a bone points back on itself, 180° from the zero pose, and the
twist is what a goniometer reads as axial rotation. Bones: x of arms and hands, y of all others.

The ranges are those of human joints, degrees: active motion after the American Academy of Orthopaedic Surgeons' tables
in Norkin & White, *Measurement of Joint Motion*, appendix; where bearing weight or a hand's pull takes a joint
further, the passive range after Kapandji, *The Physiology of the Joints*. What a model divides among several joints
(spine, neck, the shoulder girdle) is divided here. A `margin` beyond them is free, for people differ and the joints of
body models are not anatomical ones. From there on soft(e) = e² / (e + 5°), smooth at its start and e − 5° far out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor
from torch.autograd import forward_ad

from ipman_rs.body import joints
from ipman_rs.checks import not_negative

from ..candidate import Candidate
from ..forward_mode import dual
from ..problem import Problem
from ..rotations import quaternion
from ..variables import pose_joints
from .term import LeastSquares

Range = tuple[float, float]

# Of the left side, about x, y, z; the right side mirrors y and z.
RANGES: dict[str, tuple[Range, Range, Range]] = {
    # flexion 140 with the knee bent (Kapandji), extension 30; medial and lateral rotation 45, 60 (Kapandji); adduction
    # 30, abduction 45
    "hip": ((-140, 30), (-45, 60), (-30, 45)),
    # flexion 150; rotation of the bent knee 30 in, 40 out (Kapandji)
    "knee": ((0, 150), (-30, 40), (-5, 5)),
    # dorsiflexion 20, plantar flexion 50; inversion 35, eversion 20
    "ankle": ((-20, 50), (-20, 20), (-35, 20)),
    # the toes: extension 70, flexion 45
    "foot": ((-70, 45), (-10, 10), (-10, 10)),
    # thirds of lumbar and thoracic spine: flexion 105, extension 60, lateral 40 (Kapandji), rotation 45
    "spine1": ((-20, 35), (-15, 15), (-14, 14)),
    "spine2": ((-20, 35), (-15, 15), (-14, 14)),
    "spine3": ((-20, 35), (-15, 15), (-14, 14)),
    # halves of the cervical spine: flexion 45, extension 75 (Kapandji), lateral 45, rotation 80
    "neck": ((-38, 23), (-40, 40), (-23, 23)),
    "head": ((-38, 23), (-40, 40), (-23, 23)),
    # the sternoclavicular joint (Neumann, *Kinesiology of the Musculoskeletal System*): rotation 35 backwards, forwards
    # and back 30, up 45, down 10
    "collar": ((-35, 10), (-30, 30), (-10, 45)),
    # rotation: lateral 90, medial 70; horizontal flexion 135, and 80 backwards, which a hanging arm needs for its
    # extension of 60; elevation 180 with the girdle, from the hanging arm at −90 and 10 past it to 90
    "shoulder": ((-90, 70), (-135, 80), (-100, 90)),
    # supination 80, pronation 80; flexion 150; carrying angle 15
    "elbow": ((-80, 80), (-150, 0), (-15, 15)),
    # models share the forearm's rotation with it; radial, ulnar deviation 20, 30; flexion 80, extension 85 under load
    "wrist": ((-40, 40), (-20, 30), (-80, 85)),
    # knuckles: spread 20; flexion 90, extension 45
    "hand": ((-10, 10), (-20, 20), (-90, 45)),
}
ARM = ("collar", "shoulder", "elbow", "wrist", "hand")  # their bones lie along x
SOFTNESS = math.radians(5)


class JointLimits(LeastSquares):
    """margin: degrees beyond each range that are free. Joints that are not SMPL's (fingers, jaw) have no limits."""

    def __init__(self, problem: Problem, margin: float = 10.0):
        super().__init__(problem)
        margin = not_negative("margin", margin)
        like = problem.body.v_template
        there = pose_joints(problem.body.body)
        names = [name for name in there if name in joints.SMPL]
        if not names:
            raise ValueError("joint_limits: expected a body with SMPL's joints, this one has none of them")
        self.joints = [there.index(name) for name in names]
        self.bones = torch.tensor([0 if name.partition("_")[2] in ARM else 1 for name in names], device=like.device)
        ranges = like.new_tensor([range_of(name) for name in names])  # (J, 3, 2)
        self.middle = ranges.mean(dim=-1).deg2rad()
        self.reach = ((ranges[..., 1] - ranges[..., 0]) / 2 + margin).deg2rad()

    def residuals(self, candidate: Candidate) -> Tensor:
        return self._of(candidate.variables["pose"][:, self.joints]).flatten(1)

    def _of(self, pose: Tensor) -> Tensor:
        """Three of each joint, (B, J, 3), for its rotation alone."""
        excess = ((swing_twist(pose, self.bones) - self.middle).abs() - self.reach).clamp(min=0)
        return excess.square() / (excess + SOFTNESS)

    def linearised(self, candidate: Candidate, free: Sequence[str]) -> tuple[Tensor, Tensor]:
        """No joint knows of another: three directions, of all joints at once, find the whole Jacobian."""
        pose = candidate.variables["pose"][:, self.joints]
        bodies, count = pose.shape[:2]
        directions = torch.eye(3, dtype=pose.dtype)[:, None, None].expand(3, bodies, count, 3).flatten(0, 1)
        with forward_ad.dual_level():
            moved = dual(pose.repeat(3, 1, 1), directions.contiguous())
            values, slopes = forward_ad.unpack_dual(self._of(moved))
        slopes = torch.zeros_like(values) if slopes is None else slopes
        blocks = slopes.reshape(3, bodies, count, 3).permute(1, 2, 0, 3)  # body, joint, by which number, which residual
        jacobian = pose.new_zeros(bodies, candidate.variables["pose"].shape[1], 3, count, 3)
        for place, joint in enumerate(self.joints):
            jacobian[:, joint, :, place] = blocks[:, place]
        whole = [
            jacobian.reshape(bodies, -1, 3 * count)
            if name == "pose"
            else pose.new_zeros(bodies, candidate.variables[name][0].numel(), 3 * count)
            for name in free
        ]
        return values[:bodies].flatten(1), torch.cat(whole, dim=1)


def swing_twist(pose: Tensor, bones: Tensor) -> Tensor:
    """Rotation vectors (..., J, 3) -> angles about x, y, z (..., J, 3), radians; bones (J,): each one's axis, 0 to 2.

    With arctangents of half the half angles: torch's atan2 rounds by where in its vector registers a number lies.
    """
    axes = torch.arange(3, device=bones.device)
    q = quaternion(pose)
    q = torch.where(q[..., 3:] < 0, -q, q)  # the same rotation by less than 180°
    cyclic = (bones[:, None] + axes) % 3  # the bone's axis, then the two others, right-handed
    twist, u, v = q[..., :3].gather(-1, cyclic.expand(pose.shape)).unbind(-1)
    w = q[..., 3]
    squared = w * w + twist * twist
    sound = squared > 1e-12  # else the bone points back on itself, and no twist is better than another
    w, twist = torch.where(sound, w, 1), torch.where(sound, twist, 0)
    cosine = torch.where(sound, squared, 1).sqrt()  # of half the swing
    swing_u, swing_v = (u * w - v * twist) / cosine, (v * w + u * twist) / cosine
    ratio = _angle_by_sine(swing_u * swing_u + swing_v * swing_v, torch.where(sound, cosine, 0))
    angles = torch.stack([4 * torch.atan(twist / (cosine + w)), ratio * swing_u, ratio * swing_v], dim=-1)
    return angles.gather(-1, ((axes - bones[:, None]) % 3).expand(pose.shape))


def _angle_by_sine(squared_sine: Tensor, cosine: Tensor) -> Tensor:
    """φ / sin(φ/2) of rotations by φ, from the squared sine and the cosine of φ/2; smooth at φ = 0."""
    small = squared_sine < 1e-8
    sine = torch.where(small, 1, squared_sine).sqrt()
    return torch.where(small, 2 + squared_sine / 3, 4 * torch.atan(sine / (1 + cosine)) / sine)


def range_of(name: str) -> list[Range]:
    """Of a joint of SMPL by its full name, degrees about x, y, z."""
    side, _, joint = name.partition("_")
    if side not in ("left", "right"):
        return list(RANGES[name])
    x, y, z = RANGES[joint]
    return [x, y, z] if side == "left" else [x, (-y[1], -y[0]), (-z[1], -z[0])]
