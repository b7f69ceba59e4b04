"""HMR: where it starts, its backbones, and SPIN's checkpoints, written here from the published names of its weights."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import nn

import ipman_rs.torch as ipt
from ipman_rs.body import load_body, rotations
from ipman_rs.training.model import HMR, MeanParameters, backbone, keypoint_maps_loss, load_spin
from ipman_rs.training.model.backbones import Small, mean_positions
from ipman_rs.training.projection import project

STAGES = ((64, 3), (128, 4), (256, 6), (512, 3))  # of a ResNet-50: width and blocks


@pytest.fixture(scope="module")
def mean():
    return MeanParameters.of(load_body("anny-lite"))


def spin_shapes() -> dict[str, tuple[int, ...]]:
    """Names and shapes of SPIN's weights: a ResNet-50 without classifier, and the regressor."""
    shapes: dict[str, tuple[int, ...]] = {}

    def conv(name, out, inside, size):
        shapes[f"{name}.weight"] = (out, inside, size, size)

    def norm(name, width):
        shapes.update({f"{name}.{part}": (width,) for part in ("weight", "bias", "running_mean", "running_var")})

    conv("conv1", 64, 3, 7)
    norm("bn1", 64)
    inside = 64
    for stage, (width, blocks) in enumerate(STAGES, start=1):
        for block in range(blocks):
            name = f"layer{stage}.{block}"
            if block == 0:
                conv(f"{name}.downsample.0", 4 * width, inside, 1)
                norm(f"{name}.downsample.1", 4 * width)
            for number, (out, size) in enumerate(((width, 1), (width, 3), (4 * width, 1)), start=1):
                conv(f"{name}.conv{number}", out, inside, size)
                norm(f"{name}.bn{number}", out)
                inside = out
    for name, out, wide in (
        ("fc1", 1024, 2048 + 157), ("fc2", 1024, 1024), ("decpose", 144, 1024), ("decshape", 10, 1024),
        ("deccam", 3, 1024),
    ):  # fmt: skip
        shapes |= {f"{name}.weight": (out, wide), f"{name}.bias": (out,)}
    return shapes | {"init_pose": (1, 144), "init_shape": (1, 10), "init_cam": (1, 3)}


@pytest.fixture(scope="module")
def spin_weights():
    generator = torch.Generator().manual_seed(0)
    return {
        name: 0.02 * torch.rand(shape, generator=generator) + 0.01 * name.endswith("running_var")
        for name, shape in spin_shapes().items()
    }


@pytest.fixture(scope="module")
def resnet(mean):
    pytest.importorskip("torchvision", reason="torchvision is not installed")
    return HMR.of_images(mean, "resnet50")


def test_it_starts_at_the_mean_person(mean):
    """Before any training: a person upright in the image, facing the camera, the whole of them in the crop."""
    body = ipt.BodyModel("anny-lite")
    with torch.no_grad():
        estimate = HMR(nn.Flatten(), 8, mean).eval()(torch.randn(3, 8))
    np.testing.assert_allclose(
        estimate.rotations.numpy(), np.tile(rotations.from_6d(mean.pose), (3, 1, 1, 1)), atol=0.05
    )
    posed = body(estimate.pose, estimate.betas)
    names = body.body.joint_names
    head, foot, left, right = (
        posed.joints[:, names.index(name)] for name in ("head", "left_foot", "left_hip", "right_hip")
    )
    assert (head[:, 1] < foot[:, 1] - 1.0).all()  # y runs down
    assert (left[:, 0] > right[:, 0]).all()  # who faces us has their left at our right
    points = project(posed.vertices - posed.joints[:, :1], estimate.camera)
    assert 0.7 < points.abs().amax() < 1.1


def test_rounds_add_up(mean):
    """Three corrections, each from the state before, written out with the layers' own weights."""
    model = HMR(nn.Flatten(), 8, mean, hidden=16).eval()
    regressor, inputs = model.regressor, torch.randn(2, 8)
    for layer in (regressor.decpose, regressor.decshape, regressor.deccam):
        nn.init.normal_(layer.weight, std=0.1)
    state = torch.cat([regressor.init_pose, regressor.init_shape, regressor.init_cam], dim=1).repeat(2, 1)
    heads = torch.cat([layer.weight for layer in (regressor.decpose, regressor.decshape, regressor.deccam)])
    for _ in range(3):
        hidden = torch.cat([inputs, state], dim=1) @ regressor.fc1.weight.T + regressor.fc1.bias
        state = state + (hidden @ regressor.fc2.weight.T + regressor.fc2.bias) @ heads.T
    estimate = model(inputs)
    torch.testing.assert_close(torch.cat([estimate.betas, estimate.camera], dim=1), state[:, 144:])
    # SPIN's order of numbers: rows of (3, 2) matrices.
    torch.testing.assert_close(estimate.pose[0, 5, :3], state[0, 30:36:2])
    torch.testing.assert_close(estimate.pose[0, 5, 3:], state[0, 31:36:2])


def test_rotations_are_those_of_the_body(mean):
    pose = torch.randn(4, 24, 6)
    from ipman_rs.training.model import Estimate

    own = Estimate(pose, torch.zeros(4, 10), torch.zeros(4, 3)).rotations.numpy()
    np.testing.assert_allclose(own, rotations.from_6d(pose.numpy()), atol=1e-5)


def test_spins_mean_parameters(tmp_path):
    """Their pose is 24 matrices (3, 2), row by row."""
    matrices = rotations.from_axis_angle(np.random.default_rng(0).normal(size=(24, 3)))
    np.savez(tmp_path / "mean.npz", pose=matrices[:, :, :2].reshape(144), shape=np.arange(10.0), cam=[0.9, 0, 0])
    mean = MeanParameters.read(tmp_path / "mean.npz")
    np.testing.assert_allclose(rotations.from_6d(mean.pose), matrices, atol=1e-12)
    assert mean.betas.tolist() == list(range(10))
    np.savez(tmp_path / "short.npz", pose=np.zeros(72), shape=np.zeros(10), cam=np.zeros(3))
    with pytest.raises(ValueError, match=r"short\.npz: pose: expected 144 finite numbers, got 72"):
        MeanParameters.read(tmp_path / "short.npz")


def test_the_small_backbone_ignores_its_batch():
    encoder, features = backbone("small")
    images = torch.randn(3, 3, 128, 128)
    together = encoder(images)
    assert together.shape == (3, features)
    torch.testing.assert_close(encoder(images[1:2]), together[1:2], rtol=1e-5, atol=1e-5)


def test_maps_learn_where_keypoints_are():
    """Where the maps are the truth, the loss is its entropy, and the mean position is the keypoint's."""
    keypoints = torch.tensor([[[0.3, -0.55, 1.0], [-1.0, 1.0, 1.0]], [[0.0, 0.1, 1.0], [0.2, 0.2, 0.0]]])
    cells = torch.linspace(-1, 1, 12)
    shares = [(1 - (keypoints[..., k, None] - cells).abs() * 5.5).clamp(min=0) for k in (1, 0)]
    truth = shares[0][..., :, None] * shares[1][..., None, :]

    maps = (truth + 1e-12).log()
    torch.testing.assert_close(mean_positions(maps), keypoints[..., :2], atol=1e-6, rtol=0)
    entropy = -(truth * maps).sum(dim=(2, 3))
    found = keypoint_maps_loss(maps, keypoints)
    torch.testing.assert_close(found, entropy[keypoints[..., 2] > 0].mean(), atol=1e-6, rtol=0)


@pytest.mark.slow
def test_the_small_backbone_finds_a_spot():
    """Bright squares on noise: some steps halve the loss and bring the first map's position to them."""
    generator = torch.Generator().manual_seed(0)
    torch.manual_seed(0)
    encoder = Small()
    optimizer = torch.optim.Adam(encoder.parameters(), lr=3e-3)
    losses = []
    for _ in range(80):
        places = torch.randint(8, 88, (16, 2), generator=generator)
        images = 0.3 * torch.randn(16, 3, 96, 96, generator=generator)
        for image, (x, y) in zip(images, places.tolist(), strict=True):
            image[:, y - 5 : y + 5, x - 5 : x + 5] += 3
        keypoints = torch.cat([places / 48 - 1, torch.ones(16, 1)], dim=1)[:, None]
        loss = keypoint_maps_loss(encoder.maps(images)[0], keypoints)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    assert losses[-1] < 0.5 * losses[0]
    error = mean_positions(encoder.maps(images)[0][:, :1]) - keypoints[..., :2]
    assert error.abs().mean() < 0.15


@pytest.mark.slow
@pytest.mark.parametrize("name", ["resnet18", "mobilenet_v3_small", "timm/resnet10t"])
def test_backbones_by_name(name):
    pytest.importorskip("timm" if name.startswith("timm") else "torchvision")
    encoder, features = backbone(name)
    assert encoder.eval()(torch.zeros(1, 3, 64, 64)).shape == (1, features)


@pytest.mark.parametrize("name", ["resnet51", "timm/resnet51"])
def test_unknown_backbones(name):
    pytest.importorskip("timm" if name.startswith("timm") else "torchvision")
    with pytest.raises(ValueError, match="resnet51.*list_models"):
        backbone(name)


def test_spins_checkpoint(resnet, spin_weights, tmp_path):
    torch.save({"model": spin_weights, "epoch": 3, "optimizer": {"lr": [1e-4]}}, tmp_path / "spin.pt")
    load_spin(resnet, tmp_path / "spin.pt")
    loaded = resnet.state_dict()
    for name in ("layer3.4.bn2.running_var", "layer1.0.downsample.0.weight", "conv1.weight"):
        assert torch.equal(loaded[f"encoder.{name}"], spin_weights[name])
    for name in ("fc1.weight", "deccam.bias", "init_pose"):
        assert torch.equal(loaded[f"regressor.{name}"], spin_weights[name])
    left = {name for name in loaded if not name.endswith("num_batches_tracked")}
    assert len(left) == len(spin_weights)


@pytest.mark.slow
def test_wrong_checkpoints(resnet, spin_weights, tmp_path):
    before = {name: value.clone() for name, value in resnet.state_dict().items()}
    path = tmp_path / "wrong.pt"

    def refused(match, weights):
        torch.save({"model": weights}, path)
        with pytest.raises(ValueError, match=match):
            load_spin(resnet, path)

    refused("wrong.pt.*lacks.*fc1.weight", {name: w for name, w in spin_weights.items() if name != "fc1.weight"})
    refused("unknown.*surprise", {**spin_weights, "surprise": torch.zeros(1)})
    refused(r"decshape.bias \(16,\), not \(10,\)", {**spin_weights, "decshape.bias": torch.zeros(16)})
    refused("not finite in.*deccam.bias", {**spin_weights, "deccam.bias": torch.full((3,), torch.nan)})
    torch.save([1, 2], path)
    with pytest.raises(ValueError, match="under 'model'.*got list"):
        load_spin(resnet, path)
    path.write_bytes(b"not a checkpoint")
    with pytest.raises(ValueError, match="wrong.pt: cannot be read"):
        load_spin(resnet, path)
    with pytest.raises(ValueError, match="missing.pt: there is no such file"):
        load_spin(resnet, tmp_path / "missing.pt")
    assert all(torch.equal(value, before[name]) for name, value in resnet.state_dict().items())


class Bomb:
    def __reduce__(self):
        import os

        return os.mkdir, ("/tmp/ipman_rs_must_not_be_made",)


def test_nothing_in_a_checkpoint_runs(resnet, tmp_path):
    import os

    torch.save({"model": {"conv1.weight": Bomb()}}, tmp_path / "bomb.pt")
    with pytest.raises(ValueError, match="plain tensors"):
        load_spin(resnet, tmp_path / "bomb.pt")
    assert not os.path.exists("/tmp/ipman_rs_must_not_be_made")
