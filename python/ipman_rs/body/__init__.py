"""Body models: the embedded body, SMPL, SMPL+H and SMPL-X files, and a library of named poses.

body = ipman_rs.load_body("anny")
output = body(pose, betas, transl)       # output.vertices (..., V, 3), output.joints (..., J, 3)
body.template                            # a BodyTemplate with the ten parts of the paper
vertices = poses.posed(body, "tree")     # standing on the floor y = 0
"""

from __future__ import annotations

import os
from pathlib import Path

from . import embedded, poses, smpl_files
from .model import BodyModel, BodyOutput
from .parts import PART_NAMES
from .poses import posed

__all__ = ["PART_NAMES", "BodyModel", "BodyOutput", "load_body", "posed", "poses"]


def load_body(name_or_path: str | os.PathLike[str], *, num_betas: int = 10, flat_hand_mean: bool = False) -> BodyModel:
    """The embedded body "anny" or "anny-lite", or a model file in the SMPL, SMPL+H or SMPL-X format (`.npz`, `.pkl`).

    `num_betas` (shape components to keep) and `flat_hand_mean` (zero hand pose is the flat hand instead of the mean
    hand; AMASS poses want True) apply to files. Nothing in the file is executed. Raises ValueError for an unknown
    name and for a file that is missing, damaged, hostile or no body model, naming the file and what was expected.
    """
    if name_or_path in embedded.NAMES:
        return embedded.load(str(name_or_path))
    path = Path(name_or_path)
    if not path.is_file():
        raise ValueError(f"no body {str(name_or_path)!r}: it is neither one of {', '.join(embedded.NAMES)} nor a file")
    return smpl_files.load(path, num_betas=num_betas, flat_hand_mean=flat_hand_mean)
