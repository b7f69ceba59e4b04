"""The common form of all data sets: frames of people, as arrays with one row per frame."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ipman_rs.ground import Ground

Array = NDArray[np.floating]
Rows = slice | NDArray[np.integer]


@dataclass(frozen=True, eq=False)
class Cameras:
    """One camera per frame: X_c = R X + t (m, x right, y down, z forward), then x = K X_c / z (pixels)."""

    rotation: Array  # (F, 3, 3)
    translation: Array  # (F, 3) m
    intrinsics: Array  # (F, 3, 3) pixels

    def __getitem__(self, rows: Rows) -> Cameras:
        return Cameras(self.rotation[rows], self.translation[rows], self.intrinsics[rows])


@dataclass(frozen=True, eq=False)
class PressureMaps:
    """Pressure that a mat measured under the body: one map per frame, on a grid of square cells on the ground.

    The point of cell (i, j) is origin + (i + ½) cell e1 + (j + ½) cell e2. Where the mat lay elsewhere in some of the
    frames, origin, e1 and e2 have one row per frame; the maps of one frame, or of one place, never have.
    """

    values: Array  # (F, H, W), in the mat's own unit
    origin: Array  # (3,) or (F, 3) m
    e1: Array  # (3,) or (F, 3) unit vector along the rows' numbers
    e2: Array  # (3,) or (F, 3) unit vector along the columns' numbers
    cell: float  # m

    def __getitem__(self, rows: Rows) -> PressureMaps:
        placed = np.concatenate([np.atleast_2d(part) for part in (self.origin, self.e1, self.e2)], axis=1)
        if len(placed) > 1:
            placed = placed[rows]
        if len(placed) and (placed == placed[0]).all():
            placed = placed[0]
        origin, e1, e2 = np.split(placed, 3, axis=-1)
        return PressureMaps(self.values[rows], origin, e1, e2, self.cell)


@dataclass(frozen=True, eq=False)
class Frames:
    """F frames of one person each. None: the data set has no such thing; NaN: this frame has none.

    Lengths are metres and angles radians. The world of a frame is the one that its body is given in, right-handed, in
    the axes of the data set: `ground` says where up is.
    """

    names: NDArray[np.str_]  # (F,) of the frame, unique in the data set
    sequences: NDArray[np.str_]  # (F,) frames of one sequence follow each other; an image by itself is its own
    ground: Ground | None = None  # one, or one per frame
    frame_rate: float | None = None  # Hz, of the sequences

    body: str | None = None  # "smpl", "smplh", "smplx", or a name of `ipman_rs.load_body`: what pose and betas are of
    genders: NDArray[np.str_] | None = None  # (F,) "neutral", "female" or "male"
    pose: Array | None = None  # (F, J, 3) rotation vectors, the root's first, relative to the parent's
    betas: Array | None = None  # (F, n)
    transl: Array | None = None  # (F, 3) m
    rest_shape: str | None = None  # path of a mesh: the person's own body in the zero pose, whatever the betas say
    vertices: Array | None = None  # (F, V, 3) m
    joints: Array | None = None  # (F, K, 3) m
    joint_names: Sequence[str] | None = None  # K

    images: NDArray[np.str_] | None = None  # (F,) paths
    cameras: Cameras | None = None
    keypoints: Array | None = None  # (F, K2, 3) x, y in pixels and a confidence from 0 to 1
    keypoint_names: Sequence[str] | None = None  # K2
    boxes: Array | None = None  # (F, 4) x, y, width, height in pixels

    center_of_mass: Array | None = None  # (F, 3) m, measured
    center_of_pressure: Array | None = None  # (F, 3) m, measured
    forces: Array | None = None  # (F, plates, 3) N, on the body
    pressure: PressureMaps | None = None
    standing: NDArray[np.bool_] | None = None  # (F,) labelled as balanced (in_bos_label)
    contact: NDArray[np.bool_] | None = None  # (F,) labelled as touching the ground (contact_label)

    def __len__(self) -> int:
        return len(self.names)

    def __getitem__(self, rows: Rows) -> Frames:
        """Those frames, a slice or an array of numbers, in this order."""
        return replace(self, **{field.name: _rows(getattr(self, field.name), rows) for field in fields(self)})


def _rows(value: Any, rows: Rows) -> Any:
    if isinstance(value, (np.ndarray, Cameras, PressureMaps)):
        return value[rows]
    if isinstance(value, Ground) and value.height.ndim:
        return Ground(np.broadcast_to(value.normal, (*value.height.shape, 3))[rows], value.height[rows])
    return value


class DataSet(Protocol):
    """A data set on disk: its number of frames, and any of them read when they are asked for."""

    def __len__(self) -> int: ...

    def __getitem__(self, rows: Rows) -> Frames: ...


def pieces(data: DataSet, size: int) -> Iterator[Frames]:
    """The frames in pieces of `size`."""
    for start in range(0, len(data), size):
        yield data[slice(start, min(start + size, len(data)))]
