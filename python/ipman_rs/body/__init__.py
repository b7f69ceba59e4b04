"""Body models: the embedded body, SMPL, SMPL+H and SMPL-X files, and a library of named poses.

body = ipman_rs.load_body("anny")
output = body(pose, betas, transl)       # output.vertices (..., V, 3), output.joints (..., J, 3)
body.template                            # a BodyTemplate with the ten parts of the paper
vertices = poses.posed(body, "tree")     # standing on the floor y = 0
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from . import embedded, formats, poses
from .model import BodyModel, BodyOutput
from .parts import PART_NAMES
from .poses import posed

__all__ = ["PART_NAMES", "BodyModel", "BodyOutput", "load_body", "posed", "poses"]


def load_body(
    name_or_path: str | os.PathLike[str],
    *,
    num_betas: int = 10,
    flat_hand_mean: bool = False,
    v_template: ArrayLike | None = None,
) -> BodyModel:
    """The embedded body "anny" or "anny-lite", or a model file (`.npz`, `.pkl`) of a kind in
    `body.formats`: SMPL, SMPL+H or SMPL-X.

    `num_betas` (shape components to keep), `flat_hand_mean` (zero hand pose is the flat hand instead of the mean
    hand; AMASS poses want True) and `v_template` (V, 3) m (a person's own body in the zero pose, instead of the mean
    one) apply to files. Nothing in the file is executed. Raises ValueError for an unknown name, for a file that is
    missing, damaged, hostile or no body model, naming the file and what was expected, and for a template of another
    shape.
    """
    if name_or_path in embedded.NAMES:
        if v_template is not None:
            raise ValueError(f"v_template: is for model files; the body {name_or_path} has its own")
        return embedded.load(str(name_or_path))
    path = Path(name_or_path)
    if not path.is_file():
        raise ValueError(f"no body {str(name_or_path)!r}: it is neither one of {', '.join(embedded.NAMES)} nor a file")
    template = None if v_template is None else np.asarray(v_template, np.float64)
    return formats.load(path, num_betas=num_betas, flat_hand_mean=flat_hand_mean, v_template=template)
