"""The folder of one fitted or predicted body: its files, and a record that is written last and makes it complete."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from .whole import write_whole

RECORD = "fit.json"


def write_files(folder: Path, files: dict[str, Any], record: dict[str, Any]) -> dict[str, Any]:
    """Write files, bytes or arrays for an .npz, and then the record, with their names, that makes the folder complete;
    that record. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / RECORD).unlink(missing_ok=True)  # incomplete from here on
    for name, content in files.items():
        write_whole(folder / name, content if isinstance(content, bytes) else npz(content))
    record = {**record, "files": sorted(files)}
    write_whole(folder / RECORD, json.dumps(record, allow_nan=False, ensure_ascii=False, indent=1) + "\n")
    return record


def npz(arrays: dict[str, np.ndarray]) -> bytes:
    """The file of these arrays."""
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=False, **arrays)
    return stream.getvalue()
