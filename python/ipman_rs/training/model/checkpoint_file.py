"""Files of torch.save, read as plain tensors: nothing in them runs."""

from __future__ import annotations

import os
import pickle
from typing import Any

import torch


def read_checkpoint(path: str | os.PathLike[str]) -> Any:
    """The content, on the CPU. ValueError, naming the file, if it cannot be read."""
    try:
        return torch.load(path, map_location="cpu", weights_only=True)
    except (OSError, RuntimeError, EOFError, ValueError, KeyError, pickle.UnpicklingError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise ValueError(f"{path}: cannot be read as a checkpoint of plain tensors: {reason}") from None
