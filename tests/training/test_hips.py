"""Bodies are compared and placed by the middle of the hips, of one definition on both sides: SMPL's where a data set
has its own body, those of SPIN's regressor where it labels hips of its own."""

from __future__ import annotations

import dataclasses
import math
import warnings

import numpy as np
import pytest
import torch

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs.body import load_body, rotations
from ipman_rs.body.joint_regressors import EXTRA, HUMAN36M, JointRegressor
from ipman_rs.data import Cameras, Frames
from ipman_rs.data.spin import JOINTS
from ipman_rs.training import losses
from ipman_rs.training.augment import Augmentation
from ipman_rs.training.batch import Batch
from ipman_rs.training.model import Estimate
from ipman_rs.training.model.keypoint_encoder import KEYPOINTS
from ipman_rs.training.posed_estimate import REGRESSED, Posing
from ipman_rs.training.predict import TrainedModel
from ipman_rs.training.projection import project
from ipman_rs.training.sources import Images
from ipman_rs.training.world import to_world

COUNT = 4
CAMERA = rotations.from_axis_angle(np.array([0.3, 0.2, 0.1])) @ np.diag([1.0, -1.0, -1.0])
UP = 0.06  # m from SMPL's hips up to those of the regressor, at rest


@pytest.fixture(scope="module")
def body():
    return dataclasses.replace(load_body("anny-lite"), name="SMPL_NEUTRAL", kind="smpl")


@pytest.fixture(scope="module")
def regressor(body):
    """Each joint is the mean of the twenty vertices nearest to a place of its own; hips lie above SMPL's."""
    rest = body()
    near = ("right_hip", "left_hip", "neck", "head", "pelvis", "spine3", "spine2", "head", "head")
    rows = np.zeros((len(EXTRA), body.num_vertices))
    for row, name in zip(rows, near, strict=True):
        place = rest.joints[body.joint_names.index(name)] + [0, UP, 0]
        row[np.argsort(np.linalg.norm(rest.vertices - place, axis=1))[:20]] = 1 / 20
    return JointRegressor(rows, EXTRA)


class Data:
    def __init__(self, frames):
        self.frames = frames

    def __len__(self):
        return len(self.frames)

    def __getitem__(self, rows):
        return self.frames[rows]

    def image(self, row):
        return np.zeros((200, 300, 3), np.uint8)


@pytest.fixture(scope="module")
def frames(body, regressor):
    """People of SPIN's form: joints called as in `JOINTS`, of which hips and those SMPL lacks are the regressor's."""
    draw = np.random.default_rng(0)
    pose = 0.3 * draw.normal(size=(COUNT, 24, 3))
    betas, transl = draw.normal(size=(COUNT, 10)), draw.normal(size=(COUNT, 3))
    posed = body(pose, betas, transl)
    of_body = {name: posed.joints[:, row] for row, name in enumerate(body.joint_names)}
    points = of_body | dict(zip(EXTRA, regressor.joints(posed.vertices).swapaxes(0, 1), strict=True))
    joints = np.stack([points.get(name, np.full((COUNT, 3), np.nan)) for name in JOINTS], axis=1)
    return Frames(
        names=np.array([f"p{row}" for row in range(COUNT)]),
        sequences=np.array(["s"] * COUNT),
        ground=ip.Ground.y_up(0.0),
        body="smpl",
        genders=np.array(["neutral"] * COUNT),
        pose=pose,
        betas=betas,
        transl=transl,
        joints=joints,
        joint_names=JOINTS,
        cameras=Cameras(np.tile(CAMERA, (COUNT, 1, 1)), np.zeros((COUNT, 3)), np.tile(np.eye(3), (COUNT, 1, 1))),
        boxes=np.tile([100.0, 50.0, 100.0, 100.0], (COUNT, 1)),
    )


def read(frames, body, regressed=False):
    names = (*KEYPOINTS, *REGRESSED) if regressed else KEYPOINTS
    source = Images(Data(frames), body, names, 32, regressed=regressed)
    return source, Batch.of([source.sample(row, None) for row in range(COUNT)]).sound()


def true(frames) -> Estimate:
    matrices = rotations.from_axis_angle(frames.pose)
    matrices[:, 0] = CAMERA @ matrices[:, 0]
    columns = np.concatenate([matrices[..., 0], matrices[..., 1]], axis=-1)
    camera = np.tile([0.9, 0.0, 0.0], (COUNT, 1))
    return Estimate(*(torch.from_numpy(part).float() for part in (columns, frames.betas, camera)))


def stood(frames, body, batch, regressor=None):
    """Vertices in the world of the true bodies as estimates."""
    posed = Posing(ipt.BodyModel(body), (), regressor)(true(frames))
    return to_world(posed.vertices, posed.hips(batch.regressed), batch).numpy()


def test_a_data_set_s_own_body_tells_where_it_stands(frames, body):
    _, batch = read(frames, body)
    posed = body(frames.pose, frames.betas, frames.transl)
    np.testing.assert_allclose(batch.hips, posed.joints[:, 1:3].mean(axis=1), atol=1e-6)
    assert batch.has_world.all()
    # Single precision: a body some metres from the origin comes back to micrometres.
    np.testing.assert_allclose(stood(frames, body, batch), posed.vertices, atol=5e-6)


def test_without_a_body_the_regressor_s_hips_are_put_on_the_labelled_ones(frames, body, regressor):
    bare = dataclasses.replace(frames, pose=None, betas=None, transl=None, body=None, genders=None)
    vertices = body(frames.pose, frames.betas, frames.transl).vertices
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        _, batch = read(bare, body, regressed=True)
    assert batch.regressed.all()
    np.testing.assert_allclose(batch.hips, regressor.joints(vertices)[:, :2].mean(axis=1), atol=1e-6)
    np.testing.assert_allclose(stood(frames, body, batch, regressor), vertices, atol=5e-6)
    with pytest.warns(
        UserWarning, match=r"p0: bodies are put where the data set's hips are, of its joints, .*extra\.npy"
    ):
        _, approximate = read(bare, body)
    assert not approximate.regressed.any()
    off = stood(frames, body, approximate) - vertices
    assert 0.5 * UP < np.linalg.norm(off, axis=-1).mean() < 1.5 * UP  # by what the definitions are apart


def test_a_body_of_another_sex_is_not_ours(frames, body, regressor):
    """A neutral model with a woman's betas has its hips elsewhere: those that are labelled tell more."""
    female = dataclasses.replace(frames, genders=np.array(["female"] * COUNT))
    assert read(female, body, regressed=True)[1].regressed.all()
    with pytest.warns(UserWarning, match="of a female body"):
        _, batch = read(dataclasses.replace(female, joints=None, joint_names=None), body)
    assert batch.has_world.all()


@pytest.mark.parametrize("change", [Augmentation(), Augmentation(flip=True, degrees=25.0)], ids=str)
def test_true_bodies_have_no_error_in_the_data_terms(frames, body, regressor, change):
    """In 3D and, seen by the loss' own camera, in 2D; with SMPL's hips against the regressor's they would have."""
    source, _ = read(frames, body, regressed=True)
    posing = Posing(ipt.BodyModel(body), source.keypoints, regressor)
    samples = [source.cut(row, change)[1] for row in range(COUNT)]
    batch = Batch.of([{**sample, "inputs": torch.zeros(1)} for sample in samples]).sound()
    columns = torch.cat([batch.pose[..., 0], batch.pose[..., 1]], dim=-1)
    posed = posing(Estimate(columns, batch.betas, true(frames).camera))
    rows = [name for name, c in zip(source.joints, batch.joints[0, :, 3], strict=True) if c > 0]
    assert {"left_hip_regressed", "neck_regressed", "head_top_regressed", "left_knee"} <= {*rows}
    assert not {"left_hip", "pelvis", "neck"} & {*rows}
    # The embedded body is a mirror image of itself but for millimetres; not flipped, it is exact.
    largest = 1e-4 if change.flip else 1e-11
    assert losses.joints_3d_loss(posed.all_joints, batch.joints, posing.hips, 24) < largest
    wrong = batch.joints.clone()
    wrong[:, 1:3, 3], wrong[:, 24:, 3] = 1.0, 0.0
    wrong[:, 1:3, :3] = batch.joints[:, [25, 24], :3]
    assert losses.joints_3d_loss(posed.all_joints, wrong, posing.hips, 24) > 2e-4


def test_hips_in_the_image_are_the_regressor_s(frames, body, regressor):
    posing = Posing(ipt.BodyModel(body), (*KEYPOINTS, *REGRESSED), regressor)
    estimate = true(frames)
    seen = project(posing(estimate).keypoints, estimate.camera)
    posed = body(frames.pose, frames.betas)
    # A body turns about its pelvis.
    turned = (regressor.joints(posed.vertices) - posed.joints[:, :1]) @ CAMERA.T + posed.joints[:, :1]
    expected = project(torch.from_numpy(turned).float(), estimate.camera)
    torch.testing.assert_close(seen[:, len(KEYPOINTS) :], expected, rtol=0, atol=2e-5)
    # What a data set in SPIN's form calls left_hip is that; one that names joints as SMPL does means SMPL's.
    points = np.dstack([np.tile(np.arange(24.0)[:, None], (COUNT, 1, 2)), np.ones((COUNT, 24))])
    for names, used in ((JOINTS, "left_hip_regressed"), (body.joint_names, "left_hip")):
        told = dataclasses.replace(frames, keypoints=points, keypoint_names=names)
        source, batch = read(told, body, regressed=True)
        labelled = {name for name, c in zip(source.keypoints, batch.keypoints[0, :, 2], strict=True) if c}
        assert {"left_hip", "left_hip_regressed"} & labelled == {used}
        row = names.index("left_hip")  # at pixel (row, row): the box's middle is (150, 100), its half side 60
        found = batch.keypoints[0, source.keypoints.index(used), :2]
        np.testing.assert_allclose(found, [(row - 150) / 60, (row - 100) / 60], rtol=1e-6)


def test_joints_3d_are_a_mean_over_spin_s_24(body, regressor):
    """The nine joints of the regressor come on top and do not thin the others out."""
    joints, labels = torch.randn(2, 33, 3), torch.rand(2, 33, 4)
    labels[:, 1:3, 3] = 0
    labels[:, 24:26, 3] = 1
    expected = []
    for found, told in zip(joints, labels, strict=True):
        error = (found - found[24:26].mean(0)) - (told[:, :3] - told[24:26, :3].mean(0))
        expected.append((told[:, 3:] * error**2).sum().item() / 72)
    posing = Posing(ipt.BodyModel(body), (), regressor)
    value = losses.joints_3d_loss(joints, labels, posing.hips, 24)
    assert value.item() == pytest.approx(np.mean(expected), rel=1e-5)


class Looking(torch.nn.Module):
    """A regressor that estimates what it is told, off by a lean, one image after the other."""

    def __init__(self, estimate):
        super().__init__()
        self.estimate, self.row = estimate, 0

    def forward(self, inputs):
        row, self.row = self.row, self.row + 1
        return Estimate(*(part[row : row + 1] for part in vars(self.estimate).values()))


@pytest.mark.parametrize("of_body", [True, False])
def test_predicted_bodies_stand_on_the_labelled_hips(frames, body, regressor, of_body):
    from ipman_rs.training.trainer.config import config_of

    if not of_body:
        frames = dataclasses.replace(frames, pose=None, betas=None, transl=None, body=None, genders=None)
    rough = true(dataclasses.replace(frames, pose=np.zeros((COUNT, 24, 3)), betas=np.zeros((COUNT, 10))))
    settings = config_of({"data": [{"name": "x", "path": "y"}], "model": {"size": 32}})
    trained = TrainedModel(Looking(rough), settings, Posing(ipt.BodyModel(body), KEYPOINTS))  # type: ignore[arg-type]
    found = trained.of_data_set(Data(frames), regressor=regressor)
    posed = body(found["pose"], found["betas"], found["transl"])
    middle = posed.joints[:, 1:3] if of_body else regressor.joints(posed.vertices)[:, :2]
    _, batch = read(frames, body, regressed=True)
    np.testing.assert_allclose(middle.mean(axis=1), batch.hips, atol=1e-6)
    turned = rotations.from_axis_angle(found["pose"][:, 0])
    np.testing.assert_allclose(turned, np.tile(np.eye(3), (COUNT, 1, 1)), atol=1e-6)


def test_regressors_that_do_not_fit(body, regressor):
    with pytest.raises(ValueError, match=r"expected J_regressor_extra.npy with its 9 joints, got one of 17"):
        Posing(ipt.BodyModel(body), (), JointRegressor(np.zeros((17, body.num_vertices)), HUMAN36M))
    with pytest.raises(ValueError, match="is for 6890 vertices, but the body 'SMPL_NEUTRAL' has"):
        Posing(ipt.BodyModel(body), (), JointRegressor(np.zeros((9, 6890)), EXTRA))


def test_the_2d_loss_divides_by_49_where_told():
    """SPIN's mean is over 49 keypoints, 25 of them of weight 0."""
    projected, labels = torch.randn(3, 21, 2), torch.rand(3, 21, 3)
    padded = [torch.cat([points, torch.zeros(3, 28, points.shape[2])], dim=1) for points in (projected, labels)]
    value = losses.keypoints_2d_loss(projected, labels, 49)
    assert value.item() == pytest.approx(losses.keypoints_2d_loss(*padded).item(), rel=1e-6)
    assert math.isclose(value * 49 / 21, losses.keypoints_2d_loss(projected, labels), rel_tol=1e-6)
