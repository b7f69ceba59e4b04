"""The fitting problem of detected keypoints: cameras from focal length and pitch, and warnings about each person."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

import ipman_rs.torch as ipt
from ipman_rs.renamed import old_names

from ..body.sites import FEWEST_POINTS
from ..data.keypoints.detections import Detections
from .camera import Camera, level_camera
from .camera_file import KnownCamera
from .landmarks import Landmarks, landmark_names
from .problem import Problem
from .start import SEEN

NOTHING_KNOWN = KnownCamera()
FACE_SEEN = 0.8  # confidence of nose and eyes that the face of a person is turned to the camera
CENTER = 0.2  # of the image's size: how far a camera's center is from its middle at most
MIRRORED = (
    "the face is seen, yet left and right are as from behind: are the points mirrored, or is the person turned away?"
)
ACROSS = 1.5  # of its height in the image: how broad a person is at least who lies across it
FEET = (
    "left_ankle",
    "right_ankle",
    "left_heel",
    "right_heel",
    "left_big_toe",
    "right_big_toe",
    "left_foot",
    "right_foot",
)


def problem_from_detections(
    body: ipt.BodyModel,
    detections: Detections,
    *,
    focal: float | Sequence[float | None] | None = None,
    pitch: float | None = None,
    camera: KnownCamera = NOTHING_KNOWN,
    ground: float | None = None,
    height: float | None = None,
    mass: float | None = None,
) -> Problem:
    """The fit of each person of `detections`, a row each. ValueError without image sizes, or for numbers out of range.

    `focal`: pixels, one for all or one for each; the image's diagonal where None. `pitch`: degrees by which the camera
    looks down, under 90 either way; None: unknown, and found by presets with `hypotheses`, while the others take the
    camera for level. It stands at the world's origin. What `camera` knows goes before both. `ground`: height of the
    floor in the world (below the camera: negative), found by the fit if None. `height` m and `mass` kg of the person.
    """
    if detections.image_size is None:
        raise ValueError("image_size: expected width and height of the images, got none")
    if pitch is not None and not abs(pitch) < 90:
        raise ValueError(f"pitch: expected more than -90 and less than 90 degrees, got {pitch}")
    names = shared_names(body, detections)
    seen = detections.select(names)
    people = len(seen)
    size = torch.from_numpy(np.asarray(detections.image_size, dtype=np.float64))

    def each(name: str, value: float | None) -> Tensor | None:
        return None if value is None else torch.full((people,), check_measurement(name, value), dtype=torch.float64)

    def known_of(numbers: tuple[float, ...] | None, *shape: int) -> Tensor | None:
        if numbers is None:
            return None
        return torch.tensor(numbers, dtype=torch.float64).reshape(shape).repeat(people, *(1 for _ in shape))

    several = [focal] * people if focal is None or isinstance(focal, (int, float)) else focal
    known = [None if own is None else check_measurement("focal", own) for own in several]
    length = torch.tensor(
        [diagonal if own is None else own for own, diagonal in zip(known, size.norm(dim=1).tolist(), strict=True)],
        dtype=torch.float64,
    )
    rotation, translation = known_of(camera.rotation, 3, 3), known_of(camera.translation, 3)
    lengths, center = known_of(camera.focal, 2), known_of(camera.center, 2)
    before = Camera(
        length[:, None].expand(people, 2).clone() if lengths is None else lengths,
        size / 2 if center is None else center,
        level_camera(math.radians(pitch or 0.0)).expand(people, 3, 3).clone() if rotation is None else rotation,
        torch.zeros(people, 3, dtype=torch.float64) if translation is None else translation,
    )
    return Problem(
        body,
        Landmarks(body, names),
        before,
        None if ground is None else _floor(people, ground),
        torch.from_numpy(seen.points),
        torch.from_numpy(seen.confidence),
        image_size=size,
        height=each("height", height),
        mass=each("mass", mass),
        pitch_known=pitch is not None or rotation is not None,
        relative_points=None if seen.points_3d is None else torch.from_numpy(seen.points_3d),
        relative_confidence=None if seen.confidence_3d is None else torch.from_numpy(seen.confidence_3d),
    )


# What a focal length, a person's height and a mass can be: unit, least and largest.
POSSIBLE = {"focal": ("pixels", 0.0, math.inf), "height": ("metres", 0.4, 2.8), "mass": ("kilograms", 3.0, 400.0)}


def check_measurement(name: str, value: float) -> float:
    """A plausible focal length, height or mass. ValueError, with its unit, for an impossible one."""
    unit, least, largest = POSSIBLE[name]
    if not least < value < largest:
        within = "above 0" if largest == math.inf else f"between {least:g} and {largest:g}"
        raise ValueError(f"{name}: expected {unit} {within}, got {value:g}")
    return float(value)


def shared_names(body: ipt.BodyModel, detections: Detections) -> tuple[str, ...]:
    """The detected points that the body has, too."""
    there = set(landmark_names(body.body))
    return tuple(name for name in detections.names if name in there)


def _floor(people: int, height: float) -> ipt.Ground:
    if not math.isfinite(height):
        raise ValueError(f"ground: expected a height in metres, got {height}")
    up = torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64).expand(people, 3)
    return ipt.Ground(up, torch.full((people,), float(height), dtype=torch.float64))


def missing_keypoints(names: Sequence[str], confidence: np.ndarray) -> str | None:
    """Why a person with these confidences (K,) cannot be fitted, or None."""
    count = int((confidence > SEEN).sum())
    if count >= FEWEST_POINTS:
        return None
    return (
        f"only {count} of {len(names)} points were seen (confidence above {SEEN:g}); {FEWEST_POINTS} are needed: "
        "use an image that shows more of the person"
    )


def keypoint_flags(names: Sequence[str], points: np.ndarray, confidence: np.ndarray, size: np.ndarray) -> list[str]:
    """Warnings about one person's points (K, 2) that may be wrong, or that constrain the body poorly."""
    where = {name: points[k] for k, name in enumerate(names) if confidence[k] > SEEN}
    flags = []
    hips, shoulders = _pair(where, "hip"), _pair(where, "shoulder")
    if hips and shoulders:
        down = (hips[0] + hips[1] - shoulders[0] - shoulders[1]) / 2
        if down[1] < -abs(down[0]):
            flags.append("upside-down: the shoulders are below the hips; y of a keypoint points down")
        if _across(down) and _across(_feet(where, hips) - (shoulders[0] + shoulders[1]) / 2):
            flags.append("lies across the image, head beside feet: are x and y of the keypoints swapped?")
        turns = [np.sign(left[0] - right[0]) for left, right in (hips, shoulders)]
        crossed = min(abs(left[0] - right[0]) for left, right in (hips, shoulders)) > 0.1 * np.linalg.norm(down)
        if crossed and turns[0] != turns[1]:
            flags.append("left and right may be swapped: hips and shoulders face opposite ways")
        elif crossed and _mirrored(names, points, confidence, turns[0]):
            flags.append(MIRRORED)
    if len(where) <= len(names) / 2:
        flags.append(f"only {len(where)} of {len(names)} points were seen")
    if not any(name in where for name in FEET):
        flags.append("no foot was seen: the floor is a guess")
    outside = sum(not ((point >= 0) & (point <= size)).all() for point in where.values())
    if outside:
        flags.append(f"{outside} points lie outside the image")
    return flags


def _across(way: np.ndarray) -> bool:
    """Whether a way (2,) in the image is nearer to its rows than to its columns."""
    return bool(abs(way[0]) > ACROSS * abs(way[1]))


def _feet(where: dict[str, np.ndarray], hips: list[np.ndarray]) -> np.ndarray:
    """Where a person ends: in the middle of the ankles, or else of the knees or hips, that were seen."""
    pair = _pair(where, "ankle") or _pair(where, "knee") or hips
    return (pair[0] + pair[1]) / 2


def _mirrored(names: Sequence[str], points: np.ndarray, confidence: np.ndarray, turn: float) -> bool:
    """Whether nose and both eyes are surely seen, and the eyes as well as the trunk have left on the image's left."""
    surely = {name: points[k] for k, name in enumerate(names) if confidence[k] > FACE_SEEN}
    face = [surely.get(name) for name in ("nose", "left_eye", "right_eye")]
    nose, left, right = face
    if nose is None or left is None or right is None:
        return False
    return bool(turn < 0 and left[0] < nose[0] < right[0])


def camera_flags(camera: KnownCamera, size: np.ndarray) -> list[str]:
    """Warnings if a known camera seems to belong to images of another size than `size` (2,), width and height."""
    if camera.center is None:
        return []
    center = np.array(camera.center)
    if (abs(center - size / 2) < CENTER * size).all():
        return []
    flag = f"the camera's center ({center[0]:g}, {center[1]:g}) is far from the middle of the {size[0]:g} × {size[1]:g}"
    return [f"{flag} image: is the camera of another image size?"]


def _pair(where: dict[str, np.ndarray], joint: str) -> list[np.ndarray]:
    pair = [where.get(f"{side}_{joint}") for side in ("left", "right")]
    return [point for point in pair if point is not None] if all(point is not None for point in pair) else []


__getattr__ = old_names(__name__, {"problem": "problem_from_detections"})
