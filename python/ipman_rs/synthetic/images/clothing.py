"""The colours of a person: skin, hair, and clothes that end at a neckline, on the arms, at the waist and on the legs.

They are painted onto the mean body in its zero pose: the colour of a point of the skin depends on where that point lies
there (x to the left, y up, z forward), so that seams are sharp whatever the mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body import load_body
from ipman_rs.body.landmarks import skin_points

from .cameras import dot
from .textures import CLOTH, Texture, draw_texture, linear_color

Array = NDArray[np.floating]

SKIN = ((0.08, 0.35, 0.95), (0.07, 0.42, 0.88), (0.07, 0.50, 0.75), (0.06, 0.55, 0.58), (0.06, 0.58, 0.40))  # HSV
HAIR = ((0.08, 0.6, 0.12), (0.07, 0.65, 0.28), (0.09, 0.6, 0.5), (0.12, 0.5, 0.8), (0.05, 0.75, 0.5), (0.1, 0.05, 0.7))
SLEEVES = (-0.05, 0.22, 0.35, 0.55, 0.97)  # of the way from the shoulder to the wrist
LEGS = (0.15, 0.3, 0.5, 0.75, 0.97, 1.0)  # of the way from the hip to the ankle


@dataclass(frozen=True)
class Clothes:
    """Lengths in m on the zero pose."""

    skin: Array  # (3,) linear light, as the other colours
    hair: Array
    eyes: Array
    lips: Array
    shoes: Array | None
    shirt: Texture
    trousers: Texture
    neckline: float  # y
    sleeve: float  # |x|
    waist: float  # y
    hem: float  # y, where the trousers end
    collar: float  # y of the shoes' rim
    hairline: float  # y above the nose at the front of the head
    long_hair: bool

    def __call__(self, resting: Array, body: str) -> Array:
        """Colours (N, 3) of points that lie at `resting` (N, 3) m on the mean body in its zero pose."""
        place, marks = resting, landmarks(body)
        x, y, z = np.abs(place[:, 0]), place[:, 1], place[:, 2]
        colors = np.tile(self.skin, (len(place), 1))
        head = (y > marks["neck"][1]) & (x < marks["left_shoulder"][0])
        legs = (y < self.waist) & (y > self.hem)
        shirt = (y >= self.waist) & (y < self.neckline) & (x < self.sleeve)
        across = np.arctan2(place[:, 0], z) * 0.15  # around the trunk and the legs, so that patterns do not smear
        on_arms = (x > marks["left_shoulder"][0])[:, None]
        flat = np.where(on_arms, place[:, [2, 0]], np.stack([across, y], axis=1))
        colors[shirt] = self.shirt(flat[shirt])
        colors[legs] = self.trousers(flat[legs])
        if self.shoes is not None:
            colors[y < self.collar] = self.shoes
        self.paint_face(colors, place, marks, head)
        return colors

    def paint_face(self, colors: Array, place: Array, marks: dict[str, Array], head: NDArray[np.bool_]) -> None:
        y, z = place[:, 1], place[:, 2]
        nose, middle = marks["nose"], marks["head"]
        slope = 0.9 * (z - nose[2]).clip(-0.13, 0)
        hair = head & (y - nose[1] > self.hairline + slope)
        if self.long_hair:
            hair |= head & (z < middle[2] - 0.01)
        for name in ("left_eye", "right_eye"):
            colors[inside_ellipsoid(place, marks[name], (0.015, 0.008, 0.03)) & head] = self.eyes
        mouth = nose + np.array([0.0, -0.045, -0.02])
        colors[inside_ellipsoid(place, mouth, (0.024, 0.008, 0.04)) & head] = self.lips
        colors[hair] = self.hair


def inside_ellipsoid(points: Array, center: Array, radii: tuple[float, float, float]) -> NDArray[np.bool_]:
    """Which points (N, 3) are inside an ellipsoid."""
    scaled = (points - center) / radii
    return dot(scaled, scaled) < 1


@cache
def landmarks(body: str) -> dict[str, Array]:
    """Joints and points of the skin of the mean body in its zero pose."""
    model = load_body(body)
    posed = model()
    skin = {name: posed.vertices[vertex] for name, vertex in skin_points(model).items()}
    return {**skin, **dict(zip(model.joint_names, posed.joints, strict=True))}


def draw_clothes(draw: np.random.Generator, body: str) -> Clothes:
    marks = landmarks(body)
    shoulder, wrist = marks["left_shoulder"], marks["left_wrist"]
    hip, ankle = marks["left_hip"], marks["left_ankle"]
    skin = linear_color(*SKIN[draw.integers(len(SKIN))]) * draw.uniform(0.85, 1.15)
    shirt = draw_cloth(draw)
    trousers = shirt if draw.random() < 0.12 else draw_cloth(draw)
    sleeve = shoulder[0] + SLEEVES[draw.integers(len(SLEEVES))] * (wrist[0] - shoulder[0])
    leg = LEGS[draw.integers(len(LEGS))]
    return Clothes(
        skin=skin.clip(0, 0.9),
        hair=linear_color(*HAIR[draw.integers(len(HAIR))]),
        eyes=np.full(3, 0.02),
        lips=(skin * [1.0, 0.55, 0.55]).clip(0, 0.9),
        shoes=linear_color(draw.random(), draw.uniform(0, 0.5), draw.uniform(0.1, 0.95))
        if draw.random() < 0.75
        else None,
        shirt=shirt,
        trousers=trousers,
        neckline=marks["neck"][1] - draw.uniform(-0.02, 0.05),
        sleeve=sleeve,
        waist=marks["pelvis"][1] + draw.uniform(-0.02, 0.12),
        hem=hip[1] - leg * (hip[1] - ankle[1]),
        collar=ankle[1] + draw.uniform(-0.02, 0.06),
        hairline=draw.uniform(0.07, 0.11),
        long_hair=draw.random() < 0.4,
    )


def draw_cloth(draw: np.random.Generator) -> Texture:
    """A third are grey, black or white, as clothes are."""
    saturation = draw.uniform(0, 0.12) if draw.random() < 0.35 else draw.uniform(0.2, 0.9)
    color = linear_color(draw.random(), saturation, draw.uniform(0.12, 0.95))
    return draw_texture(draw, CLOTH, color, (0.03, 0.14), 0.5)
