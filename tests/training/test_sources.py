"""Samples by number: shares, what of a data set's frame a sample has, and what happens with bad ones."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch
from PIL import Image

import ipman_rs as ip
from ipman_rs.body import joints, load_body, rotations
from ipman_rs.data import Cameras, Frames
from ipman_rs.training.augment import AugmentConfig
from ipman_rs.training.batch import Batch
from ipman_rs.training.model.keypoint_encoder import KEYPOINTS
from ipman_rs.training.sources import BadSample, Images, Mixture, Share
from ipman_rs.training.sources.mixture import Steps

COUNT = 3


class Numbers:
    """Sample k is the number k, some of them bad."""

    def __init__(self, first, count, bad=()):
        self.first, self.count, self.bad = first, count, bad

    def __len__(self):
        return self.count

    def sample(self, row, draw):
        if row in self.bad:
            raise BadSample(f"row {row} is rotten")
        return {"number": torch.tensor(self.first + row)}


def numbers(mixture, count):
    return np.array([int(mixture[n]["number"]) for n in range(count)])


def test_shares():
    mixture = Mixture([Share("a", Numbers(0, 5), 3), Share("b", Numbers(100, 50), 1)], seed=4)
    drawn = numbers(mixture, 4000)
    assert (drawn < 100).mean() == pytest.approx(0.75, abs=0.025)
    assert set(drawn[drawn < 100]) == set(range(5))
    assert len(set(drawn[drawn >= 100])) == 50


def test_a_sample_depends_on_seed_and_number_alone():
    shares = [Share("a", Numbers(0, 1000))]
    forwards, other = numbers(Mixture(shares, 4), 50), numbers(Mixture(shares, 5), 50)
    mixture = Mixture(shares, 4)
    backwards = [int(mixture[n]["number"]) for n in range(49, -1, -1)]
    assert forwards.tolist() == backwards[::-1]
    assert (forwards != other).mean() > 0.9


def test_bad_samples_are_replaced_and_told():
    mixture = Mixture([Share("a", Numbers(0, 4, bad=(1, 2)))], 0)
    with pytest.warns(UserWarning, match="skipped: a: row 1 is rotten"):
        drawn = numbers(mixture, 200)
    assert set(drawn) == {0, 3}
    with pytest.raises(ValueError, match="50 bad samples in a row, the last: a: row 0 is rotten"), pytest.warns():
        Mixture([Share("a", Numbers(0, 1, bad=(0,)))], 0)[0]


@pytest.mark.parametrize(
    ("shares", "said"),
    [([], "at least one"), ([Share("a", Numbers(0, 0))], "a is empty"), ([Share("a", Numbers(0, 1), 0)], "above 0")],
)
def test_mixtures_that_cannot_be(shares, said):
    with pytest.raises(ValueError, match=said):
        Mixture(shares)


def test_two_processes_see_what_one_does():
    one = list(Steps(0, 5, 8))
    two = [list(Steps(0, 5, 4, rank, 2)) for rank in (0, 1)]
    assert [first + second for first, second in zip(*two, strict=True)] == one
    assert list(Steps(3, 5, 8)) == one[3:]
    assert sum(one, []) == list(range(40))


class People:
    """A data set in memory: T-posed people in front of a camera, images in files."""

    def __init__(self, frames):
        self.frames = frames

    def __len__(self):
        return len(self.frames)

    def __getitem__(self, rows):
        return self.frames[rows]


@pytest.fixture
def frames(tmp_path):
    body = load_body("anny-lite")
    draw = np.random.default_rng(0)
    pose = 0.1 * draw.normal(size=(COUNT, 24, 3))
    betas = draw.normal(size=(COUNT, 10))
    transl = np.tile([0.0, 1.0, 0.0], (COUNT, 1))
    found = np.asarray(body(pose, betas, transl).joints)
    camera = np.tile(np.diag([1.0, -1.0, -1.0]), (COUNT, 1, 1))
    names = [str(tmp_path / f"{number}.png") for number in range(COUNT)]
    for number, name in enumerate(names):
        pixels = np.zeros((200, 300, 3), np.uint8)
        pixels[50:150, 100:200, number % 3] = 255
        Image.fromarray(pixels).save(name)
    keypoints = np.full((COUNT, 2, 3), 1.0)
    keypoints[:, 0, :2], keypoints[:, 1, :2] = [150, 100], [160, 140]
    return Frames(
        names=np.array([f"p{number}" for number in range(COUNT)]),
        sequences=np.array(["s"] * COUNT),
        ground=ip.Ground.y_up(0.25),
        body="anny-lite",
        pose=pose,
        betas=betas,
        transl=transl,
        joints=found,
        joint_names=joints.SMPL,
        images=np.array(names),
        cameras=Cameras(camera, np.tile([0.0, 0.0, 4.0], (COUNT, 1)), np.tile(np.eye(3), (COUNT, 1, 1))),
        keypoints=keypoints,
        keypoint_names=("left_wrist", "left_antenna"),
        boxes=np.tile([100.0, 50.0, 100.0, 100.0], (COUNT, 1)),
        standing=np.ones(COUNT, bool),
        contact=np.array([True, False, True]),
    )


def images(frames, **options):
    return Images(People(frames), load_body("anny-lite"), KEYPOINTS, size=60, **options)


def test_a_frame_becomes_a_sample(frames):
    source = images(frames)
    batch = Batch.of([source.sample(row, None) for row in range(COUNT)])
    camera = np.diag([1.0, -1.0, -1.0])
    own = rotations.from_axis_angle(frames.pose)
    np.testing.assert_allclose(batch.pose[:, 1:], own[:, 1:], atol=1e-6)
    np.testing.assert_allclose(batch.pose[:, 0], camera @ own[:, 0], atol=1e-6)
    np.testing.assert_allclose(batch.joints[..., :3], frames.joints @ camera.T, atol=1e-6)
    np.testing.assert_allclose(batch.hips, frames.joints[:, 1:3].mean(axis=1), atol=1e-6)
    assert not batch.regressed.any()
    np.testing.assert_allclose(batch.height, 0.25)
    assert batch.has_body.all()
    assert batch.has_world.all()
    assert batch.contact.tolist() == [True, False, True]
    # Keypoints by name: the wrist lies in the middle of the box, what the body does not have is left out.
    wrist = KEYPOINTS.index("left_wrist")
    np.testing.assert_allclose(batch.keypoints[:, wrist], [[0, 0, 1]] * COUNT, atol=1e-6)
    assert batch.keypoints[..., 2].sum() == COUNT
    # The coloured square is the box, which takes 50 of the 60 pixels.
    colours = (
        batch.inputs * torch.tensor([0.229, 0.224, 0.225])[:, None, None]
        + torch.tensor([0.485, 0.456, 0.406])[:, None, None]
    )
    for number in range(COUNT):
        inside = colours[number, number % 3] > 0.5
        assert inside.sum().item() == pytest.approx(2500, abs=110)
        assert inside[6:54, 6:54].all()


def test_augmentation_is_drawn(frames):
    source = images(frames, augmenting=AugmentConfig(turned=1.0))
    one, again, other = (source.sample(0, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert all(torch.equal(one[name], again[name]) for name in one)
    assert one["turn"] != other["turn"]
    assert one["turn"] != 0


def test_labels_that_are_not_there(frames):
    """SPIN's files: the body in camera axes, no camera; and a data set with keypoints alone."""
    spin = dataclasses.replace(frames, cameras=None, ground=None, standing=None)
    sample = images(spin).sample(0, None)
    assert (bool(sample["has_body"]), bool(sample["has_world"]), bool(sample["standing"])) == (True, False, False)
    np.testing.assert_allclose(sample["pose"], rotations.from_axis_angle(frames.pose[0]), atol=1e-6)
    bare = dataclasses.replace(spin, pose=None, betas=None, joints=None, body=None)
    sample = images(bare).sample(0, None)
    assert not sample["has_body"]
    assert (sample["joints"] == 0).all()
    assert not images(dataclasses.replace(frames, body="smplx")).sample(0, None)["has_body"]


def test_bad_images_and_labels(frames, tmp_path):
    (tmp_path / "1.png").write_bytes(b"not an image")
    (tmp_path / "2.png").unlink()
    source = images(frames)
    for row, said in ((1, "p1: cannot identify"), (2, "p2: .*there is no such file")):
        with pytest.raises(BadSample, match=said):
            source.sample(row, None)
    boxes = frames.boxes.copy()
    boxes[0, 2:] = np.nan
    with pytest.raises(BadSample, match="p0: box: expected finite"):
        images(dataclasses.replace(frames, boxes=boxes)).sample(0, None)
    pose = frames.pose.copy()
    pose[0, 3] = np.nan
    batch = Batch.of([images(dataclasses.replace(frames, pose=pose)).sample(0, None)]).sound()
    assert not batch.has_body.any()
    assert batch.pose.isfinite().all()


def test_joints_that_mean_something_else_do_not_count(frames):
    """Human3.6M's "head" is no joint of SMPL's, nor is its pelvis, the middle of its hips; its hips are, nearly."""
    own = tuple(name for name in joints.SMPL if name in ("head", "left_hip", "pelvis"))
    rows = [joints.SMPL.index(name) for name in own]
    other = dataclasses.replace(frames, joints=frames.joints[:, rows], joint_names=own)
    confidence = images(other).sample(0, None)["joints"][:, 3]
    assert {joints.SMPL[row] for row in confidence.nonzero().flatten()} == {"left_hip"}
    assert images(frames).sample(0, None)["joints"][:, 3].sum() == 24


def test_parameters_of_a_model_file(frames):
    """What a data set calls smpl fits any file of SMPL's, and not the embedded body."""
    smpl = dataclasses.replace(load_body("anny-lite"), name="SMPL_NEUTRAL", kind="smpl")
    told = dataclasses.replace(frames, body="smpl")
    assert Images(People(told), smpl, KEYPOINTS, 60).sample(0, None)["has_body"]
    assert not images(told).sample(0, None)["has_body"]


def test_a_folder_of_images(frames, tmp_path):
    bare = dataclasses.replace(frames, images=np.array([f"{number}.png" for number in range(COUNT)]))
    inside = images(bare, folder=tmp_path).sample(0, None)["inputs"]
    assert torch.equal(inside, images(frames).sample(0, None)["inputs"])
    with pytest.raises(BadSample, match="there is no such file"):
        images(bare).sample(0, None)
