"""Where the regressor starts: a mean pose, shape and camera."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body import BodyModel, poses, rotations
from ipman_rs.files import safe_npz

Array = NDArray[np.floating]

SCALE = 0.9  # of the camera: a standing person fills the crop with some room


@dataclass(frozen=True, eq=False)
class MeanParameters:
    """pose (J, 6): two columns of each rotation, the root's in the camera's axes (x right, y down). betas (b,).
    camera (3,): scale and shift."""

    pose: Array
    betas: Array
    camera: Array

    @classmethod
    def of(cls, body: BodyModel) -> MeanParameters:
        """The mean body, standing with arms at 45 degrees, upright in the image and facing the camera."""
        matrices = rotations.from_axis_angle(poses.pose_of(body, "a_pose"))
        matrices[0] = np.diag([1.0, -1.0, -1.0]) @ matrices[0]
        return cls(rotations.to_6d(matrices), np.zeros(body.num_betas), np.array([SCALE, 0.0, 0.0]))

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> MeanParameters:
        """SPIN's `smpl_mean_params.npz`: pose (144,) as 24 matrices (3, 2) row by row, shape (10,), cam (3,).

        ValueError, naming the file, for anything else.
        """
        arrays = {}
        for name, size in (("pose", 144), ("shape", 10), ("cam", 3)):
            array = np.asarray(safe_npz.read(Path(path), name), float).reshape(-1)
            if array.shape != (size,) or not np.isfinite(array).all():
                raise ValueError(f"{path}: {name}: expected {size} finite numbers, got {array.size}")
            arrays[name] = array
        columns = arrays["pose"].reshape(24, 3, 2).swapaxes(1, 2).reshape(24, 6)
        return cls(columns, arrays["shape"], arrays["cam"])
