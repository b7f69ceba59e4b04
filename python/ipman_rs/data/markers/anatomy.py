"""Where on the skin markers are stuck: anatomical sites, found on the mean body in its zero pose, so for any mesh.

From a point among the joints one looks along a direction (outwards, up, forwards) and takes the place where the skin is
left; the marker's centre lies its radius further out. In the zero pose the arms are stretched out with the palms down:
the elbow's lateral side is up, the radius is in front.

Points and fractions are measured on real recordings (`sets` names their markers), relative to the joints.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body import BodyModel

from ...body.landmarks import MIDPOINTS, SIDES, Skin
from ...body.sites import Inner, Site

Array = NDArray[np.float64]
Place = tuple[Mapping[str, float], tuple[float, float, float]]  # where to look from, and where to

RADIUS = 0.01  # m, of a marker
SLACK = 1e-6  # of a face: no ray slips through between two of them
REACH = 0.3  # m: no skin farther than this from the joints is meant
STEP = 0.1  # of a beta, for derivatives by the shape


def _between(upper: str, lower: str, share: float, out: float, up: float, forwards: float) -> Place:
    """Seen from the way between two joints, `share` of it below the upper one."""
    return {upper: 1 - share, lower: share}, (out, up, forwards)


def trunk(share: float, forwards: float) -> Place:
    """In the middle of the trunk, `share` of the way from the shoulders to the hips, in front or behind."""
    return _between("mid_shoulder", "mid_hip", share, 0, 0, forwards)


def head(share: float, out: float, forwards: float) -> Place:
    """On a band around the head, `share` of the way from the ears to its top."""
    return {"left_ear": (1 - share) / 2, "right_ear": (1 - share) / 2, "head_top": share}, (out, 0, forwards)


def thigh(share: float, out: float, forwards: float) -> Place:
    return _between("hip", "knee", share, out, 0, forwards)


def shank(share: float, out: float, forwards: float) -> Place:
    return _between("knee", "ankle", share, out, 0, forwards)


def foot(share: float, out: float, up: float, forwards: float) -> Place:
    """Seen from the way between ankle and ball."""
    return _between("ankle", "foot", share, out, up, forwards)


MIDDLE: dict[str, Place] = {
    "c7": trunk(-0.17, -1),
    "clavicle": trunk(0, 1),
    "sternum": trunk(0.14, 1),
    "lower_sternum": trunk(0.34, 1),
    "t10": trunk(0.31, -1),
    **{f"t{n}": trunk(-0.17 + 0.048 * n, -1) for n in (*range(1, 10), 11, 12)},
    **{f"l{n}": trunk(0.41 + 0.06 * n, -1) for n in range(1, 6)},
    "forehead": head(0.35, 0, 1),
    "occiput": head(0.35, 0, -1),
    "sacrum": ({"mid_hip": 1.33, "mid_knee": -0.33}, (0, 0, -1)),
    "head_top": ({"left_ear": 0.5, "right_ear": 0.5}, (0, 1, 0)),
}
SIDED: dict[str, Place] = {
    "forehead": head(0.35, 0.7, 0.7),
    "occiput": head(0.35, 0.7, -0.7),
    "temple": head(0.15, 1, 0.6),
    "acromion": ({"shoulder": 0.75, "mid_shoulder": 0.25}, (0, 1, 0)),
    "shoulder_front": ({"shoulder": 1}, (0, 0, 1)),
    "shoulder_back": ({"shoulder": 1}, (0, 0, -1)),
    "sternoclavicular": ({"shoulder": 0.13, "mid_shoulder": 0.87}, (0, 0, 1)),
    "scapula": _between("shoulder", "mid_hip", 0.3, 0, 0, -1),
    "upper_arm": _between("shoulder", "elbow", 0.28, 0, 1, 1),
    "biceps": _between("shoulder", "elbow", 0.6, 0, 1, 0.2),
    "elbow_lateral": ({"elbow": 1}, (0, 1, 0)),
    "elbow_medial": ({"elbow": 1}, (0, -1, 0)),
    "forearm": _between("elbow", "wrist", 0.3, 0, 0.6, 0.8),
    "radius": ({"wrist": 1}, (0, 0, 1)),
    "ulna": ({"wrist": 1}, (0, 0, -1)),
    "wrist_back": ({"wrist": 1}, (0, 1, 0)),
    "hand_back": ({"index": 1}, (0, 1, 0)),
    "hand_back_5": ({"pinky": 1}, (0, 1, 0)),
    "asis": ({"hip": 1.16, "knee": -0.16}, (0, 0, 1)),
    "psis": ({"mid_hip": 0.93, "hip": 0.4, "mid_knee": -0.33}, (0, 0, -1)),
    "iliac_crest": ({"hip": 1.25, "knee": -0.25}, (1, 0, 0)),
    "trochanter": ({"hip": 1}, (1, 0, 0)),
    "thigh": thigh(0.6, 1, 0),
    "patella": shank(0, 0, 1),
    "knee_lateral": shank(0.02, 1, 0),
    "knee_medial": shank(0.04, -1, 0),
    "fibula_head": shank(0.1, 1, -0.3),
    "tibial_tuberosity": shank(0.12, 0, 1),
    "shin": shank(0.55, 0, 1),
    "shank": shank(0.5, 1, 0),
    "malleolus_lateral": ({"ankle": 1}, (1, 0, -0.2)),
    "malleolus_medial": ({"ankle": 1}, (-1, 0, 0.1)),
    "heel_marker": ({"heel": 0.75, "ankle": 0.25}, (0, 0, -1)),
    "heel_lateral": ({"heel": 0.6, "ankle": 0.4}, (1, 0, 0)),
    "heel_medial": ({"heel": 0.6, "ankle": 0.4}, (-1, 0, 0)),
    "midfoot_lateral": foot(0.5, 1, 0.3, 0),
    "metatarsal_1": foot(1, -1, 0.2, 0),
    "metatarsal_2": foot(1, -0.5, 1, 0),
    "midfoot_medial": foot(0.5, -1, 0.8, 0),
    "metatarsal_5": foot(0.85, 1, -0.3, 0),
    "toe_tip": ({"foot": 0.5, "big_toe": 0.5}, (0, 0.2, 1)),
}


HIP_CENTRE = "hip_centre"  # a point inside
# How well places are known, m, where it is not the marker's radius: of clusters on plates and wands, which stand off
# the skin and are anywhere on the part, and of hip centres, as far apart as two ways to find them.
ANYWHERE = 0.05
SPREAD = {"thigh": ANYWHERE, "shank": ANYWHERE, HIP_CENTRE: 0.02}


class Anatomy:
    """Sites on one body model."""

    def __init__(self, body: BodyModel, radius: float = RADIUS):
        skin = Skin(body)
        self.body, self.vertices, self.radius = body, skin.vertices, radius
        self.points = {name: skin.vertices[vertex] for name, vertex in skin.points().items()} | skin.joints
        for name, (left, right) in {**MIDPOINTS, "mid_knee": ("left_knee", "right_knee")}.items():
            self.points[name] = (self.points[left] + self.points[right]) / 2
        self.corners = np.moveaxis(self.vertices[body.faces], 1, 0)  # (3, F, 3)

    def site(self, place: Place, side: str | None = None, spread: float = RADIUS) -> Site:
        """The marker at a place, of one side if it is named. ValueError if no skin is there."""
        base, towards = place
        sign = SIDES[side] if side else 1.0
        start = np.zeros(3)
        for name, weight in base.items():
            start = start + weight * self.points[f"{side}_{name}" if f"{side}_{name}" in self.points else name]
        direction = np.array(towards) * [sign, 1.0, 1.0]
        face, point, normal = self.leave(start, direction / np.linalg.norm(direction), sign if side else 0.0)
        corners = self.body.faces[face]
        vertex = int(corners[np.linalg.norm(self.vertices[corners] - point, axis=1).argmin()])
        shift = point + self.radius * normal - self.vertices[vertex]
        turned = np.tensordot(self.body.weights[vertex], self.body.rest_rotation, axes=1)  # from rest to zero pose
        x, y, z = np.linalg.solve(turned, shift)
        return Site(vertex, (float(x), float(y), float(z)), spread)

    def hip_centre(self, side: str) -> Inner:
        """The anatomical centre of a hip joint, which the pelvis carries: by `harrington`, from the body's own markers
        on its iliac spines, for every shape to first order in the betas. The rig's joint `hip` is some 5 cm away."""
        spines = [self.site(SIDED[name], each) for name in ("asis", "psis") for each in SIDES]
        mean = self._hip_centre(side, spines, np.zeros(self.body.num_betas))
        by_betas = []
        for step in STEP * np.eye(self.body.num_betas):
            ahead, behind = (self._hip_centre(side, spines, betas) for betas in (step, -step))
            by_betas.append(tuple(((ahead - behind) / (2 * STEP)).tolist()))
        return Inner("pelvis", tuple(mean.tolist()), tuple(by_betas), SPREAD[HIP_CENTRE])

    def _hip_centre(self, side: str, spines: list[Site], betas: Array) -> Array:
        """Of the body with these betas, in the frame of its resting mesh."""
        posed = self.body(betas=betas)
        root = self.body.joint_names.index("pelvis")
        turned = self.body.rest_rotation
        points = []
        for site in spines:
            rotation = np.tensordot(self.body.weights[site.vertex], turned, axes=1)
            points.append(posed.vertices[site.vertex] + rotation @ site.shift)
        away = harrington(*points)[list(SIDES).index(side)] - posed.joints[root]
        return self.body.J_template[root] + self.body.J_shapedirs[root] @ betas + np.linalg.solve(turned[root], away)

    def leave(self, start: Array, direction: Array, sign: float) -> tuple[int, Array, Array]:
        """Where a ray last leaves the skin: the face, the point and the outward normal. It stays on its side."""
        a, b, c = self.corners
        across, along = b - a, c - a
        normal = np.cross(across, along)
        with np.errstate(divide="ignore", invalid="ignore"):
            steps = ((a - start) * normal).sum(1) / (normal @ direction)
            points = start + steps[:, None] * direction
            away = points - a
            area = (normal**2).sum(1)
            u = (np.cross(away, along) * normal).sum(1) / area
            v = (np.cross(across, away) * normal).sum(1) / area
        hit = (normal @ direction > 0) & (steps > 0) & (steps < REACH) & (points[:, 0] * sign >= 0)
        hit &= (u >= -SLACK) & (v >= -SLACK) & (u + v <= 1 + SLACK)
        if not hit.any():
            raise ValueError(
                f"the body {self.body.name!r} has no skin from {start.round(3)} towards {direction.round(2)}"
            )
        face = int(np.where(hit, steps, -np.inf).argmax())
        return face, points[face], normal[face] / np.sqrt(area[face])


def harrington(left_asis: Array, right_asis: Array, left_psis: Array, right_psis: Array) -> tuple[Array, Array]:
    """The centres of the left and the right hip joint, (3,) m, of markers on the iliac spines, (3,) m each.

    Harrington et al., Prediction of the hip joint centre in adults, children, and patients with cerebral palsy based on
    magnetic resonance imaging, J. Biomech. 40, 2007: the regression by the width and the depth of the pelvis.
    """
    front, back = (left_asis + right_asis) / 2, (left_psis + right_psis) / 2
    width, depth = np.linalg.norm(left_asis - right_asis), np.linalg.norm(front - back)
    left = (left_asis - right_asis) / width
    forwards = front - back - (front - back) @ left * left
    forwards /= np.linalg.norm(forwards)
    up = np.cross(forwards, left)
    middle = front - (0.24 * depth + 0.0099) * forwards - (0.30 * width + 0.0109) * up
    out = (0.33 * width + 0.0073) * left
    return middle + out, middle - out
