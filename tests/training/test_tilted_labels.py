"""Labels that lean, also where the image was flipped and turned; and cameras that are dealt out anew."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import torch

from ipman_rs.ablation.training.shuffled_camera import shuffled_camera
from ipman_rs.training.lifting import views
from ipman_rs.training.tilted_labels import tilt_labels
from ipman_rs.training.world import to_world, world_to_camera


@pytest.fixture(scope="module")
def clean(static):
    return views.views(static, seed=1, per_body=40)


def angle_of(turn):
    return torch.rad2deg(torch.arccos(((turn.diagonal(dim1=1, dim2=2).sum(1) - 1) / 2).clamp(-1, 1)))


@pytest.mark.parametrize("lean", ["camera", "any"])
def test_labels_lean_as_told(clean, lean):
    """Root and joints turn together, about level axes, by 8 ± 5 degrees; nothing else changes."""
    found = tilt_labels(clean, 8.0, 3, lean)
    for name in ("inputs", "keypoints", "camera", "hips", "betas"):
        assert torch.equal(getattr(clean, name), getattr(found, name))
    turn = found.pose[:, 0].double() @ clean.pose[:, 0].double().transpose(1, 2)  # in camera axes
    world = clean.camera.double().transpose(1, 2) @ turn @ clean.camera.double()
    angle = angle_of(world)
    spread = 5.0 * np.random.default_rng(0).standard_normal(100_000) + 8.0
    assert angle.mean().item() == pytest.approx(spread.clip(0).mean(), abs=0.4)
    assert angle.std().item() == pytest.approx(spread.clip(0).std(), abs=0.4)
    of_vertical = torch.rad2deg(torch.arccos(world[:, 1, 1].clamp(-1, 1)))  # all of it
    torch.testing.assert_close(of_vertical, angle, atol=0.1, rtol=0)  # both from single precision
    # Where the head goes: towards the camera, which looks along the third row; or any way.
    level = clean.camera[:, 2].double() * torch.tensor([1.0, 0.0, 1.0])
    nearer = -(level * world[..., 1]).sum(dim=1) / level.norm(dim=1)  # of a head a metre up, in metres
    leant = torch.sin(torch.deg2rad(angle))
    if lean == "camera":
        torch.testing.assert_close(nearer, leant, atol=1e-3, rtol=0)  # arccos of what is nearly 1, in single precision
    else:
        assert ((nearer > 0)[angle > 1]).double().mean().item() == pytest.approx(0.5, abs=0.06)
    moved = (turn.float() @ clean.joints[..., :3].transpose(1, 2)).transpose(1, 2)
    torch.testing.assert_close(moved, found.joints[..., :3], atol=1e-5, rtol=0)
    assert torch.equal(clean.pose[:, 1:], found.pose[:, 1:])


def test_no_lean_changes_nothing_and_leans_grow_with_the_angle(clean):
    assert tilt_labels(clean, 0.0, 3) is clean
    angles = [
        angle_of(tilt_labels(clean, d, 3).pose[:, 0].double() @ clean.pose[:, 0].double().transpose(1, 2))
        for d in (4.0, 8.0)
    ]
    there = angles[0] > 1
    torch.testing.assert_close(2 * angles[0][there], angles[1][there], atol=0.1, rtol=0)


def test_labels_of_augmented_images_lean_as_those_of_the_images(clean):
    """Of a turned image the labelled body leans in the world by the same turn; of a flipped one by the mirror image."""
    count = len(clean)
    generator = torch.Generator().manual_seed(0)
    turned = dataclasses.replace(clean, turn=torch.rand(count, generator=generator) - 0.5)
    flipped = dataclasses.replace(turned, flip=torch.ones(count, dtype=torch.bool))
    mirror = torch.diag(torch.tensor([-1.0, 1.0, 1.0]))
    wanted = clean.camera.transpose(1, 2) @ tilt_labels(clean, 8.0, 3).pose[:, 0]
    for batch, side in ((turned, torch.eye(3)), (flipped, mirror)):
        # The labels of such an image: the world's body, mirrored where it is, seen by its camera.
        seen = world_to_camera(batch)
        root = seen @ side @ clean.camera.transpose(1, 2) @ clean.pose[:, 0] @ side
        pose = torch.cat([root[:, None], clean.pose[:, 1:]], dim=1)
        found = tilt_labels(dataclasses.replace(batch, pose=pose), 8.0, 3)
        torch.testing.assert_close(side @ seen.transpose(1, 2) @ found.pose[:, 0] @ side, wanted, atol=2e-6, rtol=0)


def test_the_camera_of_the_augmented_image_is_the_way_back_of_the_world(clean):
    batch = dataclasses.replace(
        clean, turn=torch.full((len(clean),), math.radians(20)), flip=clean.pose[:, 0, 0, 0] > 0
    )
    points = torch.randn(len(clean), 5, 3, generator=torch.Generator().manual_seed(0))
    world = to_world(points, torch.zeros(len(clean), 3), batch)
    side = torch.where(batch.flip[:, None], torch.tensor([-1.0, 1.0, 1.0]), 1.0)
    back = (world - (side * batch.hips)[:, None]) @ world_to_camera(batch).transpose(1, 2)
    torch.testing.assert_close(back, points, atol=1e-5, rtol=0)


def test_a_shuffled_camera_is_one_of_the_others(clean):
    batch = dataclasses.replace(clean, turn=torch.arange(len(clean)).float())
    found = shuffled_camera(batch, 0)
    order = found.turn.long()
    assert torch.equal(order.sort().values, torch.arange(len(clean)))
    assert (order != torch.arange(len(clean))).float().mean() > 0.99
    assert torch.equal(found.camera, clean.camera[order])
    for name in ("pose", "joints", "hips", "inputs"):
        assert torch.equal(getattr(found, name), getattr(batch, name))
