"""One image with its labels, drawn from a seed, a split and an index."""

from __future__ import annotations

import io
import json
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body import load_body
from ipman_rs.synthetic.at_rest import FAMILIES

from ...data.rendered.layout import SPLITS, key_of
from .camera_sensor import draw_sensor
from .cameras import ImageCamera, draw_camera
from .clothing import draw_clothes
from .environment import draw_environment
from .people import draw_person, keypoints
from .renderer import Solid, render
from .textures import float32

Array = NDArray[np.floating]

DEPTH_OF_JOINTS, DEPTH_OF_SKIN = 0.15, 0.02  # m that a seen point may lie behind the skin that is in front of it


@dataclass(frozen=True)
class RenderSettings:
    """size: pixels of a side. body: "anny-lite" or "anny". moving: the probability that a body is not at rest."""

    seed: int = 0
    size: int = 224
    body: str = "anny-lite"
    moving: float = 0.15


@dataclass(frozen=True)
class Sample:
    """image (S, S, 3) uint8; `arrays` and `record` as `ipman_rs.data.rendered` lists them; covered (S, S): the share of
    each pixel that the person takes."""

    key: str
    image: NDArray[np.uint8]
    arrays: dict[str, NDArray[Any]]
    record: dict[str, Any]
    covered: Array
    quality: int


def draw_sample(settings: RenderSettings, split: str, index: int) -> Sample:
    """Draw sample `index` of a split; it is the same in whatever order and process it is drawn."""
    seed = [settings.seed, SPLITS.index(split), index]
    draw = np.random.default_rng(seed)
    family = list(FAMILIES)[index % len(FAMILIES)]
    figure = draw_person(draw, settings.body, family, settings.moving)
    vertices, joints = figure.posed()
    camera = round_camera(draw_camera(draw, vertices, settings.size))
    clothes, around = draw_clothes(draw, settings.body), draw_environment(draw)
    film = draw_sensor(draw, settings.size)
    solid = Solid(vertices, load_body(settings.body).faces)
    picture = render(solid, rest_vertices(settings.body), clothes, settings.body, around, camera)
    points = keypoints(settings.body, vertices, joints)
    flat = camera.project(points)[:, :2]
    inside = np.asarray(((flat >= 0) & (flat <= settings.size)).all(axis=1))
    arrays = {
        "pose": figure.pose,
        "betas": figure.betas,
        "transl": figure.transl,
        "joints": joints,
        "keypoints": np.concatenate([flat, inside[:, None]], axis=1),
        "camera_rotation": camera.rotation,
        "camera_translation": camera.translation,
        "intrinsics": camera.intrinsics,
        "box": bounding_box(camera.project(vertices)[:, :2]),
    }
    stored: dict[str, NDArray[Any]] = {name: float32(value) for name, value in arrays.items()}
    stored["visible"] = inside & visible_points(solid, camera, points, len(joints))
    key = key_of(split, index)
    record = {
        "name": key, "split": split, "seed": seed, "body": settings.body, "family": figure.family,
        "pose": figure.pose_name, "kind": figure.kind, "static": figure.kind == "static", "surroundings": around.kind,
    }  # fmt: skip
    return Sample(key, film.develop(picture.colors), stored, record, picture.covered, film.quality)


def round_camera(camera: ImageCamera) -> ImageCamera:
    """The camera in float32, as it is written, so that labels and image agree."""
    written = (float32(value).astype(float) for value in (camera.rotation, camera.translation, camera.intrinsics))
    return ImageCamera(camera.size, *written)


def visible_points(solid: Solid, camera: ImageCamera, points: Array, num_joints: int) -> NDArray[np.bool_]:
    """Which points (K, 3) are not behind other parts of the body; joints lie inside it."""
    ways = points - camera.eye
    distance = np.sqrt((ways**2).sum(axis=1))
    behind = distance - solid.met(camera.eye, ways / distance[:, None])[2]
    return behind < np.where(np.arange(len(points)) < num_joints, DEPTH_OF_JOINTS, DEPTH_OF_SKIN)


def bounding_box(flat: Array) -> Array:
    """x, y, width, height around pixels (N, 2)."""
    return np.concatenate([flat.min(axis=0), np.ptp(flat, axis=0)])


@cache
def rest_vertices(body: str) -> Array:
    """Vertices (V, 3) of the mean body in its zero pose."""
    return load_body(body)().vertices


def files(sample: Sample) -> dict[str, bytes]:
    """The sample as the files of a shard, by their endings."""
    from PIL import Image

    image, arrays = io.BytesIO(), io.BytesIO()
    Image.fromarray(sample.image).save(image, "JPEG", quality=sample.quality)
    np.savez(arrays, allow_pickle=False, **sample.arrays)
    return {"jpg": image.getvalue(), "json": json.dumps(sample.record).encode(), "npz": arrays.getvalue()}
