"""The named poses of a body, analysed: what `ipman demo` shows."""

from __future__ import annotations

import numpy as np

import ipman_rs as ip

from ..body import BodyModel
from ..progress import Progress, silent
from .study import Study, study


def named_poses(body: BodyModel, preset: str = "paper-r", progress: Progress = silent) -> Study:
    """The study of all poses of `ipman_rs.body.poses.NAMES`, standing on the plane y = 0, y up."""
    names = ip.body.poses.NAMES
    with progress("posing and measuring", len(names)) as step:
        vertices = np.stack([ip.body.posed(body, name) for name in names])
        return study(
            "Named poses", vertices, body.template, ip.Ground.y_up(), preset, labels=names, progress=step.to,
            source=f"the built-in body “{body.name}”, y up, standing on the plane y = 0",
        )  # fmt: skip
