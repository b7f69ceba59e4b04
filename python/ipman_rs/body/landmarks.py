"""Named points of a body: its joints, midpoints of two, and points of its skin.

Those of the skin are found by their shape on the mean body in its zero pose, so for any mesh.

The body stands y up, faces +z, its left at +x and its arms stretched out, palms down. Sides carry `left_` or `right_`:

nose, head_top, eye, ear                               the ear's rim, the eyeball's front
heel, big_toe, small_toe                               the rear of the heel, the tips of the toes
index, pinky, thumb                                    knuckles: of the finger's root, of the thumb's last joint
thumb_tip, index_tip, middle_tip, ring_tip, pinky_tip
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body import BodyModel

MIDPOINTS = {"mid_hip": ("left_hip", "right_hip"), "mid_shoulder": ("left_shoulder", "right_shoulder")}
SIDES = {"left": 1.0, "right": -1.0}
# Directions, along the arm and forwards, in which each fingertip of the spread hand is the farthest point.
FINGERTIPS = {"thumb": (0, 1), "index": (1, 1), "middle": (1, 0), "ring": (1, -0.7), "pinky": (0.5, -1)}
# Where the knuckles lie on the way from the wrist to the tip.
KNUCKLES = {"index": 0.47, "pinky": 0.48, "thumb": 0.73}


def ends(names: Iterable[str], points: Collection[str], body: str, what: str = "names") -> list[tuple[str, str]]:
    """The two of a body's `points` whose midpoint each name means; twice the same for a point itself.

    body, what: the names of the body and of the argument, for errors.

    Raises:
        ValueError: a name is neither one of the points nor a midpoint of two of them.
    """
    pairs = [(name, name) if name in points else MIDPOINTS.get(name, (name, name)) for name in names]
    unknown = [end for pair in pairs for end in pair if end not in points]
    if unknown:
        listed = ", ".join(dict.fromkeys([*points, *MIDPOINTS]))
        raise ValueError(f"{what}: the body {body!r} has no landmark {unknown[0]!r}; it has {listed}")
    return pairs


def point_rows(body: BodyModel) -> dict[str, int]:
    """The row of each joint and named point of the skin among a body's vertices and, after them, its joints."""
    return skin_points(body) | {name: body.num_vertices + j for j, name in enumerate(body.joint_names)}


def skin_points(body: BodyModel) -> dict[str, int]:
    """The vertices of the named points; without those of a head, a foot or a hand that the body lacks."""
    return Skin(body).points()


class Skin:
    """The mean body in its zero pose, and whose skin is whose."""

    def __init__(self, body: BodyModel):
        self.body = body
        posed = body()
        self.vertices = posed.vertices
        self.joints = dict(zip(body.joint_names, posed.joints, strict=True))
        self.owner = np.array(body.joint_names)[body.weights.argmax(1)]

    def points(self) -> dict[str, int]:
        landmarks = self.head()
        for side in SIDES:
            points = {**self.foot(side), **self.hand(side)}
            landmarks |= {f"{side}_{name}": vertex for name, vertex in points.items()}
        return landmarks

    def of(self, *joints: str) -> NDArray[np.bool_]:
        """Which vertices (V,) move mostly with one of these joints."""
        return np.isin(self.owner, joints)

    def farthest(self, among: NDArray[np.bool_], x: float = 0.0, y: float = 0.0, z: float = 0.0) -> int:
        """The vertex that lies farthest in the direction (x, y, z)."""
        return best(among, self.vertices @ np.array([x, y, z]))

    def nearest(self, among: NDArray[np.bool_], point: NDArray[np.float64]) -> int:
        return best(among, -np.linalg.norm(self.vertices - point, axis=1))

    def head(self) -> dict[str, int]:
        head = self.of("head", "jaw", "left_eye_smplhf", "right_eye_smplhf")
        if not head.any():
            return {}
        x, y, z = self.vertices.T
        landmarks = {"head_top": self.farthest(head, y=1)}
        landmarks["nose"] = self.farthest(head & (abs(x) < 0.02), z=1)
        nose = self.vertices[landmarks["nose"]]
        scale = self.vertices[landmarks["head_top"], 1] - nose[1]
        for side, sign in SIDES.items():
            eye = nose[:2] + scale * np.array([0.21 * sign, 0.24])
            off = np.linalg.norm(self.vertices[:, :2] - eye, axis=1)
            landmarks[f"{side}_eye"] = best(head, z - 3 * off)  # in front, not the socket behind it
            landmarks[f"{side}_ear"] = self.farthest(head & (abs(y - nose[1] - 0.1 * scale) < 0.12 * scale), x=sign)
        return landmarks

    def foot(self, side: str) -> dict[str, int]:
        ankle, ball = self.joints[f"{side}_ankle"], self.joints[f"{side}_foot"]
        foot = self.of(f"{side}_ankle", f"{side}_foot")
        if not foot.any():
            return {}
        low = foot & (self.vertices[:, 1] < ankle[1] - 0.3 * (ankle[1] - self.vertices[foot, 1].min()))
        x, z = (ball - ankle)[[0, 2]] / np.hypot(*(ball - ankle)[[0, 2]])  # forwards
        along = partial(self.farthest, low)
        outwards = np.array([z, -x]) * SIDES[side]
        small = 0.35 * np.array([x, z]) + 0.94 * outwards
        big = np.array([x, z]) - 0.2 * outwards
        return {
            "heel": along(x=-x, z=-z),
            "big_toe": along(x=big[0], z=big[1]),
            "small_toe": along(x=small[0], z=small[1]),
        }

    def hand(self, side: str) -> dict[str, int]:
        wrist = self.joints[f"{side}_wrist"]
        hand = np.char.startswith(self.owner, side) & (SIDES[side] * (self.vertices[:, 0] - wrist[0]) > 0)
        if not hand.any():
            return {}
        landmarks = {}
        for finger, (out, forwards) in FINGERTIPS.items():
            last = f"{side}_{finger}3"
            if self.of(last).any():
                away = np.linalg.norm(self.vertices - self.joints[last], axis=1)
                landmarks[f"{finger}_tip"] = best(self.of(last), away)
            else:
                landmarks[f"{finger}_tip"] = self.farthest(hand, x=out * SIDES[side], z=forwards)
        for finger, share in KNUCKLES.items():
            tip = self.vertices[landmarks[f"{finger}_tip"]]
            landmarks[finger] = self.nearest(hand, wrist + share * (tip - wrist))
        return landmarks


def best(among: NDArray[np.bool_], score: NDArray[np.floating]) -> int:
    """The vertex with the highest score among some."""
    return int(np.where(among, score, -np.inf).argmax())
