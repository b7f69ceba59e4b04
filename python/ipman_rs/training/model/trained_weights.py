"""The weights in checkpoints of `ipman train`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from torch import Tensor

from .checkpoint_file import read_checkpoint

OWN = "model."


def read_trained(path: str | os.PathLike[str]) -> tuple[Mapping[str, Any], dict[str, Tensor]]:
    """The configuration, and the weights by the names of `HMR`. ValueError, naming the file, for another file."""
    content = read_checkpoint(path)
    if not isinstance(content, Mapping) or not {"settings", "state_dict"} <= set(content):
        raise ValueError(f"{path}: expected a checkpoint of `ipman train`, which has settings and state_dict")
    weights = content["state_dict"]
    return content["settings"], {name.removeprefix(OWN): weights[name] for name in weights if name.startswith(OWN)}
