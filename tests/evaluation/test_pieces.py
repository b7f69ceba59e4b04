"""However the pieces came about, what comes out of them is the same to the bit."""

from __future__ import annotations

import shutil
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ipman_rs.evaluation.tables import Shard
from tests.helpers import evaluate_files as files

RUN = """
import sys, time
from tests.helpers import evaluate_files as files
from pathlib import Path
from ipman_rs.evaluation.tables.job import Job

folder, wait = Path(sys.argv[1]), float(sys.argv[2])
whole = Job.measure

def slow(self, number):
    whole(self, number)
    time.sleep(wait)

Job.measure = slow
files.finish([files.job(folder / "out", folder / "guess.npz", folder / "truth.npz")])
"""


@pytest.fixture
def again(evaluated, tmp_path):
    """A folder with the same truth and predictions, where nothing is done yet, and its job."""
    folder, _ = evaluated
    for name in ("guess.npz", "truth.npz"):
        shutil.copy(folder / name, tmp_path / name)
    return tmp_path, files.job(tmp_path / "out", tmp_path / "guess.npz", tmp_path / "truth.npz")


def the_same(evaluated, job):
    expected, found = (files.content(Path(each.folder)) for each in (evaluated[1], job))
    assert len(expected) == 4 + 8
    assert found.keys() == expected.keys()
    assert [name for name in expected if found[name] != expected[name]] == []


@pytest.mark.parametrize("count", [1, 2, 7])
def test_shards_add_up_to_the_same_bits(count, evaluated, again):
    _, job = again
    job.begin()
    for index in range(count, 0, -1):
        job.run(Shard(index, count))
    files.write([job])
    the_same(evaluated, job)


@pytest.mark.slow
def test_shards_of_other_machines_are_copied_together(evaluated, again):
    folder, job = again
    elsewhere = [replace(job, folder=str(folder / f"machine{index}")) for index in (1, 2, 3)]
    for index, other in enumerate(elsewhere, 1):
        other.begin()
        other.run(Shard(index, 3))
        assert len(other.missing()) in (5, 6)
        shutil.copytree(other.pieces_folder, job.pieces_folder, dirs_exist_ok=True)
    files.finish([job])
    the_same(evaluated, job)


@pytest.mark.slow
def test_killed_twice_it_goes_on_and_ends_the_same(evaluated, again):
    folder, job = again
    for pieces in (2, 5):
        process = files.process(RUN, str(folder), "0.2")
        begun = time.monotonic()
        while len(list(job.pieces_folder.glob("*.npz"))) < pieces:
            assert process.poll() is None, process.communicate()
            assert time.monotonic() - begun < 120
            time.sleep(0.01)
        process.kill()
        process.communicate()
        assert process.returncode == -signal.SIGKILL
        assert 0 < len(job.missing()) <= 8 - pieces
    kept = {number: job.file(number).stat().st_mtime_ns for number in range(8) if number not in job.missing()}
    last = files.process(RUN, str(folder), "0")
    _, said = last.communicate(timeout=120)
    assert last.returncode == 0, said
    assert {number: job.file(number).stat().st_mtime_ns for number in kept} == kept  # nothing is done twice
    the_same(evaluated, job)


@pytest.mark.slow
def test_a_half_written_piece_is_done_again(evaluated, again):
    _, job = again
    files.finish([job])
    whole = job.file(3).read_bytes()
    job.file(3).write_bytes(whole[: len(whole) // 2])
    job.file(5).write_bytes(b"")
    (job.pieces_folder / ".000006.npz.999.part").write_bytes(whole[:100])  # what a killed process leaves
    assert job.damaged() == [3, 5]
    assert job.missing() == [3, 5]
    files.finish([job])
    the_same(evaluated, job)


@pytest.mark.slow
def test_a_piece_of_another_evaluation_is_not_taken(evaluated, again):
    folder, job = again
    files.finish([job])
    arrays = dict(np.load(folder / "guess.npz"))
    arrays["transl"] = arrays["transl"] + np.float32(0.01)
    other = files.job(folder / "other", files.save(folder / "other.npz", arrays), folder / "truth.npz")
    files.finish([other])
    shutil.copy(other.file(2), job.file(2))
    assert job.damaged() == [2]
    files.finish([job])
    the_same(evaluated, job)


def test_a_full_disk_loses_nothing(again, monkeypatch):
    _, job = again
    job.begin()
    job.run(Shard(1, 2))
    there = sorted(job.pieces_folder.iterdir())

    def full(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("os.fsync", full)
        with pytest.raises(OSError, match="No space left"):
            job.run(Shard(2, 2))
    assert sorted(job.pieces_folder.iterdir()) == there


def test_other_predictions_under_the_same_name_are_refused(evaluated, again):
    folder, job = again
    files.finish([job])
    arrays = dict(np.load(folder / "guess.npz"))
    files.save(folder / "guess.npz", arrays | {"betas": arrays["betas"] * 0})
    other = files.job(folder / "out", folder / "guess.npz", folder / "truth.npz")
    with pytest.raises(ValueError, match=r"holds figures of another evaluation \(predictions differ\); choose another"):
        other.begin()


def test_ray_gives_the_same_bits(evaluated, again):
    pytest.importorskip("ray", reason="the extra ray is not installed")
    from ipman_rs.evaluation.tables import on_ray

    _, job = again
    job.begin()
    done = []
    on_ray.run([job], done.append)
    assert sum(done) == files.FRAMES
    assert job.missing() == []
    files.write([job])
    the_same(evaluated, job)


def test_ray_is_named_where_it_is_missing(again, monkeypatch):
    from ipman_rs.evaluation.tables import on_ray

    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(ValueError, match=r"pip install 'ipman_rs\[ray\]'"):
        on_ray.run([again[1]], print)


def test_threads_do_not_change_a_bit(evaluated, again):
    import ipman_rs

    _, job = again
    before = ipman_rs.get_num_threads()
    try:
        ipman_rs.set_num_threads(1)
        files.finish([job])
    finally:
        ipman_rs.set_num_threads(before)
    the_same(evaluated, job)


@pytest.mark.slow
def test_memory_does_not_grow_with_the_frames(tmp_path):
    """What numpy and Python hold at the most while pieces are measured: six times the frames would be six times as much
    if it grew with them. A block of 256 bodies may wait for the collection of garbage, hence the factor of two."""
    import tracemalloc

    peaks = []
    for frames in (400, 2400):
        true = files.truth(frames)
        guess = files.save(tmp_path / f"{frames}.npz", files.predictions(true))
        job = files.job(tmp_path / f"out{frames}", guess, files.save(tmp_path / f"true{frames}.npz", true))
        job.begin()
        tracemalloc.start()
        job.run(Shard())
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 2 * peaks[0]
