"""Files that the fitting tests share."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared():
    """shared("photo") -> that folder of real data; skips, saying so, without it."""
    root = os.environ.get("IPMAN_SHARED_DATA") or Path(__file__).resolve().parents[3] / "shared" / "data"

    def folder(name):
        path = Path(root) / name
        if not path.is_dir():
            pytest.skip(f"{name} is not at {root}: set IPMAN_SHARED_DATA")
        return path

    return folder
