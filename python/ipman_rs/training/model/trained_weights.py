"""Checkpoints of `ipman train`, read as plain tensors: nothing in the file runs."""

from __future__ import annotations

import os
import pickle
from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

OWN = "model."


def read_trained(path: str | os.PathLike[str]) -> tuple[Mapping[str, Any], dict[str, Tensor]]:
    """The configuration, and the weights by the names of `HMR`. ValueError, naming the file, for another file."""
    try:
        content: Any = torch.load(path, map_location="cpu", weights_only=True)
    except (OSError, RuntimeError, EOFError, ValueError, KeyError, pickle.UnpicklingError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise ValueError(f"{path}: cannot be read as a checkpoint: {reason}") from None
    if not isinstance(content, Mapping) or not {"settings", "state_dict"} <= set(content):
        raise ValueError(f"{path}: expected a checkpoint of `ipman train`, which has settings and state_dict")
    weights = content["state_dict"]
    return content["settings"], {name.removeprefix(OWN): weights[name] for name in weights if name.startswith(OWN)}
