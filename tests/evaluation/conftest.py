"""Files of truth and predictions that the tests of `ipman evaluate` share."""

from __future__ import annotations

import pytest

from tests.helpers import evaluate_files as files


@pytest.fixture(scope="session")
def true():
    return files.truth()


@pytest.fixture(scope="session")
def guessed(true):
    return files.predictions(true)


@pytest.fixture(scope="session")
def evaluated(tmp_path_factory, true, guessed):
    """The folder of truth.npz and guess.npz, and the job that was done there at once in `out`."""
    folder = tmp_path_factory.mktemp("evaluated")
    job = files.job(folder / "out", files.save(folder / "guess.npz", guessed), files.save(folder / "truth.npz", true))
    files.finish([job])
    return folder, job
