"""Several files as one data set."""

from __future__ import annotations

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs.data import Cameras, Frames, PressureMaps
from ipman_rs.data.joined import Joined, concatenate


def frames(count, start=0, **fields):
    names = np.array([f"f{start + i}" for i in range(count)])
    return Frames(names, names, joints=np.arange(start, start + count)[:, None, None] * np.ones((1, 2, 3)), **fields)


def test_every_way_of_asking_for_rows():
    """Against numpy's own rows of all frames in memory."""
    parts = [frames(3), frames(1, 3), frames(0, 4), frames(4, 4)]
    joined, every = Joined(parts), concatenate(parts)
    assert len(joined) == len(every) == 8
    rng = np.random.default_rng(0)
    asked = [slice(None), slice(2, 5), slice(6, 1, -2), slice(3, 3), np.array([], int), np.array([7, 3, 3, 0, -1])]
    for rows in [*asked, *(rng.integers(-8, 8, 5) for _ in range(50))]:
        assert joined[rows].names.tolist() == every.names[rows].tolist()
        np.testing.assert_array_equal(joined[rows].joints, every.joints[rows])


def test_parts_that_are_not_asked_for_are_not_read():
    class Never:
        def __len__(self):
            return 5

        def __getitem__(self, rows):
            raise AssertionError

    assert Joined([Never(), frames(3), Never()])[5:8].names.tolist() == ["f0", "f1", "f2"]


def test_grounds():
    same = concatenate([frames(2, ground=ip.Ground.z_up(0.5)), frames(3, ground=ip.Ground.z_up(0.5))])
    assert same.ground.height.ndim == 0
    own = concatenate([frames(2, ground=ip.Ground.z_up(0.5)), frames(2, ground=ip.Ground.y_up(np.array([1.0, 2.0])))])
    np.testing.assert_array_equal(own.ground.height, [0.5, 0.5, 1, 2])
    np.testing.assert_array_equal(own.ground.normal, [[0, 0, 1], [0, 0, 1], [0, 1, 0], [0, 1, 0]])


def test_what_differs():
    cameras = Cameras(np.zeros((2, 3, 3)), np.zeros((2, 3)), np.zeros((2, 3, 3)))
    both = concatenate([frames(2, cameras=cameras, frame_rate=30.0), frames(2, cameras=cameras, frame_rate=60.0)])
    assert both.frame_rate is None
    assert both.cameras.rotation.shape == (4, 3, 3)
    betas = concatenate([frames(1, betas=np.ones((1, 10))), frames(1, betas=np.ones((1, 16)))]).betas
    assert betas.sum(axis=1).tolist() == [10, 16]
    with pytest.raises(ValueError, match="cameras: some files have it and some do not"):
        concatenate([frames(2, cameras=cameras), frames(1)])
    with pytest.raises(ValueError, match="body: smpl in one file and smplx in another"):
        concatenate([frames(1, body="smpl"), frames(1, body="smplx")])


def test_mats_in_different_places():
    def mat(x):
        return PressureMaps(np.zeros((1, 2, 2)), np.array([x, 0.0, 0.0]), np.eye(3)[0], np.eye(3)[1], 0.01)

    same = concatenate([frames(1, pressure=mat(0)), frames(1, pressure=mat(0))]).pressure
    assert same.values.shape == (2, 2, 2)
    assert same.origin.shape == (3,)
    own = concatenate([frames(1, pressure=mat(0)), frames(1, pressure=mat(1))]).pressure
    np.testing.assert_array_equal(own.origin[:, 0], [0, 1])
