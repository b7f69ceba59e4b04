"""Files of torch.save, read as plain tensors: nothing in them runs."""

from __future__ import annotations

import os
from typing import Any

import torch

from ipman_rs.files import regular_file


def read_checkpoint(path: str | os.PathLike[str]) -> Any:
    """The content, on the CPU. ValueError, naming the file, if it cannot be read."""
    regular_file(path)
    try:
        return torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # damaged bytes can fail in any way
        reason = str(error).splitlines()[0] if str(error).strip() else type(error).__name__
        raise ValueError(f"{path}: cannot be read as a checkpoint of plain tensors: {reason}") from None
