"""Real people and force plates: the tables that `tools/validate_bodies.py` prints, and what must be true of them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def tables(data: Path) -> str:
    return subprocess.run(
        [sys.executable, str(ROOT / "tools" / "validate_bodies.py")],
        env={**os.environ, "IPMAN_SHARED_DATA": str(data)}, capture_output=True, text=True, timeout=300, check=True,
    ).stdout  # fmt: skip


@pytest.fixture(scope="module")
def printed() -> str:
    data = Path(os.environ.get("IPMAN_SHARED_DATA") or ROOT.parent / "shared" / "data")
    if not (data / "mhr_bodies").is_dir():
        pytest.skip(f"measured bodies are not at {data}: set IPMAN_SHARED_DATA")
    return tables(data)


@pytest.mark.slow
def test_volumes_of_real_people(printed):
    rows = re.findall(r"\| img_subj\d+ \|.*\| ([\d.]+) \| (\S+) \| (\S+) m \| (\S+) \|", printed)
    assert len(rows) == 2
    for litres, *differences in rows:
        assert 40 < float(litres) < 120  # a grown person
        assert max(float(difference) for difference in differences) < 1e-3  # the promise; float64 leaves about 1e-14


def test_force_plates(printed):
    quiet, *_ = re.findall(r"body mass by the plates.* \| ([\d.]+)", printed)
    *_, walking = re.findall(r"body mass by the plates.* \| ([\d.]+)", printed)
    assert float(quiet) == pytest.approx(60.03, abs=0.05)  # the data's own note
    assert float(walking) == pytest.approx(72.6, rel=0.01)  # the model's mass; its CoM knows nothing of the plates


@pytest.mark.slow
def test_without_the_data(tmp_path):
    printed = tables(tmp_path)
    assert "bodies: left out" in printed
    assert "plates: left out" in printed
