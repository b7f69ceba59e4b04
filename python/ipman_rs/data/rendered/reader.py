"""Reading shards of rendered images: as Frames, or an image with its labels at a time, in any order."""

from __future__ import annotations

import io
import tarfile
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body.joints import SMPL
from ipman_rs.files import parse_json, regular_file
from ipman_rs.ground import Ground

from ..frames import Cameras, Frames, Rows
from .layout import INDEX, SPLITS, read_index, shards_of

Array = NDArray[np.floating]
ByteRange = tuple[int, int]  # where a file starts in its shard, and how many bytes it has

SHAPES = {
    "pose": (24, 3), "betas": (10,), "transl": (3,), "joints": (24, 3), "camera_rotation": (3, 3),
    "camera_translation": (3,), "intrinsics": (3, 3), "box": (4,),
}  # fmt: skip


class BadSample(ValueError):
    """A sample that cannot be used; says which and why."""


@dataclass(frozen=True)
class Labels:
    """What is known about one image; arrays as `ipman_rs.data.rendered` lists them."""

    arrays: dict[str, Array]
    record: dict[str, Any]

    @property
    def static(self) -> bool:
        return bool(self.record["static"])

    @property
    def touching(self) -> bool:
        """Whether the body touches the floor."""
        return self.record["kind"] != "jumping"


class Rendered:
    """The images of a folder, of one split or of all: a `DataSet` of Frames.

    `bad`: names of samples that turned out missing or damaged, and why. Each is warned of once.
    """

    def __init__(self, folder: Path, split: str | None = None):
        if split is not None and split not in SPLITS:
            raise ValueError(f"split: expected one of {', '.join(SPLITS)}, got {split!r}")
        self.folder, self.index = folder, read_index(folder)
        self.shards = [shard for shard in shards_of(self.index) if split in (None, shard.split)]
        missing = [shard.name for shard in self.shards if not (folder / shard.name).is_file()]
        if missing:
            raise ValueError(
                f"{folder}: {missing[0]} is missing, one of {len(missing)} of {len(self.shards)} shards; "
                "was the rendering interrupted? The same command again finishes it"
            )
        if not self.shards:
            raise ValueError(f"{folder / INDEX}: no images{f' of the split {split}' if split else ''}")
        self.keypoint_names: tuple[str, ...] = tuple(self.index["keypoint_names"])
        self.names = np.array([key for shard in self.shards for key in shard.keys])
        self.bad: dict[str, str] = {}
        self._ends = np.cumsum([shard.count for shard in self.shards])
        self._members: dict[Path, dict[str, ByteRange]] = {}  # read when they are first asked for

    def __len__(self) -> int:
        return len(self.names)

    def __getitem__(self, rows: Rows) -> Frames:
        """The labels of those images. Those of bad samples are NaN."""
        numbers = np.arange(len(self))[rows]
        return self._frames(numbers, [self._labels_or_none(int(row)) for row in numbers])

    def labels(self, row: int) -> Labels:
        """Of one image. BadSample if they are missing, damaged or not finite."""
        name = str(self.names[row])
        try:
            record = parse_json(self._bytes(row, "json"))
            with np.load(io.BytesIO(self._bytes(row, "npz")), allow_pickle=False) as stored:
                arrays = {key: stored[key] for key in (*SHAPES, "keypoints", "visible")}
            if not isinstance(record, dict) or not {"static", "kind"} <= set(record):
                raise ValueError("json: expected static and kind")
        except Exception as error:  # damaged bytes can fail in any way
            raise self._bad(name, f"labels cannot be read: {error}") from None
        count = len(self.keypoint_names)
        for key, shape in {**SHAPES, "keypoints": (count, 3), "visible": (count,)}.items():
            if arrays[key].shape != shape or arrays[key].dtype.kind not in "fb":
                actual = f"{arrays[key].shape} of {arrays[key].dtype}"
                raise self._bad(name, f"{key}: expected numbers of shape {shape}, got {actual}")
            if not np.isfinite(arrays[key]).all():
                raise self._bad(name, f"{key}: not finite")
        return Labels(arrays, record)

    def image(self, row: int) -> NDArray[np.uint8]:
        """(S, S, 3) RGB. BadSample if it is missing or damaged."""
        from PIL import Image

        name, size = str(self.names[row]), self.index["settings"]["size"]
        try:
            with Image.open(io.BytesIO(self._bytes(row, "jpg")), formats=["JPEG", "PNG"]) as image:
                if image.size != (size, size):
                    raise ValueError(f"expected {size} x {size} pixels, got {image.size}")
                return np.asarray(image.convert("RGB"))
        except Exception as error:
            raise self._bad(name, f"image cannot be read: {error}") from None

    def _labels_or_none(self, row: int) -> Labels | None:
        try:
            return self.labels(row)
        except BadSample:
            return None

    def _frames(self, numbers: NDArray[np.integer], labels: list[Labels | None]) -> Frames:
        def rows(key: str, shape: tuple[int, ...]) -> Array:
            none = np.full(shape, np.nan, np.float32)
            return (
                np.stack([none if each is None else each.arrays[key] for each in labels]) if labels else none[None][:0]
            )

        values = {key: rows(key, shape) for key, shape in SHAPES.items()}
        names = self.names[numbers]
        images = [f"{self._shard(int(row))}/{name}.jpg" for row, name in zip(numbers, names, strict=True)]
        return Frames(
            names=names,
            sequences=names,
            ground=Ground.y_up(),
            body=self.index["settings"]["body"],
            pose=values["pose"],
            betas=values["betas"],
            transl=values["transl"],
            joints=values["joints"],
            joint_names=SMPL,
            images=np.array(images, np.str_),
            cameras=Cameras(values["camera_rotation"], values["camera_translation"], values["intrinsics"]),
            keypoints=rows("keypoints", (len(self.keypoint_names), 3)),
            keypoint_names=self.keypoint_names,
            boxes=values["box"],
            standing=np.array([each is not None and each.static for each in labels], bool),
            contact=np.array([each is not None and each.touching for each in labels], bool),
        )

    def _bytes(self, row: int, ending: str) -> bytes:
        path, name = self._shard(row), f"{self.names[row]}.{ending}"
        if path not in self._members:
            self._members[path] = members(path)
        if name not in self._members[path]:
            raise ValueError(f"{name} is not in {path.name}")
        start, size = self._members[path][name]
        with path.open("rb") as stream:
            stream.seek(start)
            content = stream.read(size)
        if len(content) != size:
            raise ValueError(f"{path} is cut off")
        return content

    def _shard(self, row: int) -> Path:
        """The file that an image lies in."""
        return self.folder / self.shards[np.searchsorted(self._ends, row, side="right")].name

    def _bad(self, name: str, why: str) -> BadSample:
        if name not in self.bad:
            self.bad[name] = why
            warnings.warn(f"{self.folder}: {name} is skipped: {why}", stacklevel=4)
        return BadSample(f"{name}: {why}")


def members(path: Path) -> dict[str, ByteRange]:
    """The files of a shard, as far as it can be read."""
    places: dict[str, ByteRange] = {}
    try:
        with tarfile.open(regular_file(path), "r:") as archive:
            for member in archive:
                places[member.name] = member.offset_data, member.size
    except Exception as error:  # damaged bytes can fail in any way
        warnings.warn(f"{path}: damaged after {len(places)} files: {error}", stacklevel=2)
    return places
