"""`ipman fit --data` on miniatures of MoYo and RICH: to the paper's tables in two commands, and through a kill."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from click.testing import CliRunner

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs import data
from ipman_rs.cli import main
from ipman_rs.data.keypoints.openpose import BODY_25
from ipman_rs.evaluation.tables.job import Source
from ipman_rs.evaluation.tables.models import Models
from ipman_rs.fitting import config, data_fits
from ipman_rs.fitting.landmarks import Landmarks, landmark_names
from tests.helpers.miniatures import models as model_files
from tests.helpers.miniatures import moyo, rich

# A few iterations: what is tested is the way there and back.
PRESENTED = """\
solver: lbfgs
start: {search: camera, yaws: 4, iterations: 4}
stages:
  - name: pose
    free: [pose, camera_orient, camera_transl, betas]
    iterations: 4
    weights:
      {reprojection: 4, presented_pose: 10000, presented_contact: 125000, measured_shape: 10, stability: 1.0e+4,
       ground: 1.0e+4}
"""
CALIBRATED = """\
solver: levenberg
start: {search: body, yaws: 4, iterations: 8}
stages:
  - name: pose
    free: [orient, pose, betas, transl]
    iterations: 12
    find_ground: true
    weights: {reprojection: 4, pose_prior: 1, hand_prior: 1, stability: 1.0e+3, ground: 1.0e+3}
"""


def keypoints(folder, frames, body):
    """An OpenPose file for each frame: where its cameras see the landmarks of its true body."""
    model = ipt.BodyModel(body, torch.float64)
    names = [name for name in BODY_25 if name in landmark_names(body)]
    pose = torch.from_numpy(np.asarray(frames.pose, float) - body.pose_mean)
    betas = torch.from_numpy(np.asarray(frames.betas, float)[:, : body.num_betas])
    points = Landmarks(model, names)(pose, betas, torch.from_numpy(np.asarray(frames.transl, float))).numpy()
    for row, name in enumerate(frames.names.tolist()):
        seen = points[row] @ frames.cameras.rotation[row].T + frames.cameras.translation[row]
        pixels = seen @ frames.cameras.intrinsics[row].T
        listed = np.zeros((25, 3))
        for column, landmark in enumerate(names):
            listed[BODY_25.index(landmark)] = *(pixels[column, :2] / pixels[column, 2]), 1.0
        path = folder / f"{name}_keypoints.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps({"people": [{"pose_keypoints_2d": listed.ravel().tolist()}]}))


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    return model_files.folder(tmp_path_factory.mktemp("models"))


@pytest.fixture(scope="module")
def yoga(models, tmp_path_factory):
    """MoYo's miniature, its validation sequences with images of camera 1, on a mat of true feet; and its keypoints."""
    pytest.importorskip("ezc3d", reason="ezc3d writes and judges C3D files")
    root = tmp_path_factory.mktemp("moyo")
    for session, day, with_com in ((moyo.HANDS, "220923", False), (moyo.COM, "221004", True)):
        name = moyo.names(day)[2]
        moyo.sequence(root / session, name, "val", 8, with_com)
        moyo.cameras(root / session, day)
        moyo.images(root / session, name, range(4), "val")
    frames = data.open("moyo", root, split="val", camera=1)[:]
    keypoints(root / "keypoints", frames, ip.load_body(models / "SMPLX_FEMALE.npz"))
    return SimpleNamespace(root=root, frames=frames)


@pytest.fixture(scope="module")
def scans(models, tmp_path_factory):
    """RICH's test sequences of IPMAN, each seen by camera 0 and 1; and its keypoints."""
    root = tmp_path_factory.mktemp("rich")
    for name in rich.TEST:
        rich.sequence(root, name, "test", frames=(5, 6))
    for scene in ("Pavallion", "ParkingLot1", "ParkingLot2"):
        rich.scene(root, scene, cameras=2)
    frames = data.open("rich", root, split="ipman-test")[:]
    for gender in ("neutral", "female", "male"):
        rows = np.flatnonzero(frames.genders == gender)
        if len(rows):
            keypoints(root / "keypoints", frames[rows], Models(models).get("smplx", gender))
    return SimpleNamespace(root=root, frames=frames)


def run(*arguments, code=0):
    done = CliRunner().invoke(main, [str(word) for word in arguments])
    assert done.exit_code == code, done.output
    return done.output


@pytest.fixture
def preset(tmp_path):
    def write(content):
        path = tmp_path / "preset.yaml"
        path.write_text(content)
        return path

    return write


def fit_moyo(yoga, models, out, preset, *more):
    where = "--data", "moyo", "--path", yoga.root, "--models", models
    return run("fit", *where, "--keypoints", yoga.root / "keypoints", "--preset", preset, "-o", out, *more)


def arrays(path):
    with np.load(path, allow_pickle=False) as stored:
        return dict(stored)


@pytest.mark.slow
def test_table_2_in_two_commands(yoga, models, tmp_path, preset):
    """One still frame of each sequence of the validation split, seen by camera 1, as the paper has it."""
    said = fit_moyo(yoga, models, tmp_path / "out", preset(PRESENTED))
    assert "next: ipman evaluate" in said
    assert f"--models {models}" in said
    found = arrays(tmp_path / "out" / "predictions.npz")
    stills = data.open("moyo", yoga.root, split="val", frames="selected")[:]
    assert found["names"].tolist() == stills.names.tolist()
    assert len(stills) == 2
    assert str(found["body"]) == "smplx"
    np.testing.assert_allclose(found["ground"], [[0, 0, 1, 0]] * 2, atol=1e-12)  # of MoYo, for whoever reads the file
    # The root keeps the presented rotation, and the body its place: R^b = I, t^b = 0 in the recorded frame.
    np.testing.assert_allclose(found["pose"][:, 0], stills.pose[:, 0], atol=1e-9)
    model = Models(models).get("smplx", "female")
    posed = model(found["pose"], found["betas"], found["transl"])
    true = model(stills.pose, np.asarray(stills.betas)[:, :10], stills.transl)
    # The mean body's pelvis was put on the recorded one; a shape moves its own pelvis by centimetres.
    np.testing.assert_allclose(posed.joints[:, 0], true.joints[:, 0], atol=0.05)
    run(
        "evaluate", tmp_path / "out" / "predictions.npz", "--table", "moyo", "--path", yoga.root, "--models", models,
        "-o", tmp_path / "table",
    )  # fmt: skip
    figures = json.loads((tmp_path / "table" / "evaluation.json").read_text())["methods"]["predictions"]["figures"]
    # Presented the recorded poses, fits stay near them: pose noise of 0.1 rad would be some 100 mm.
    assert figures["mpjpe"]["mean"] < 0.05
    assert figures["mpjpe"]["frames"] == len(stills)
    assert "| IPMAN-O (printed) | 71.9 | 34.3 | 11.4 | 98.6 |" in (tmp_path / "table" / "evaluation.md").read_text()


@pytest.mark.slow
def test_rich_in_two_commands(scans, models, tmp_path, preset):
    where = "--data", "rich", "--path", scans.root, "--models", models
    said = run(
        "fit", *where, "--keypoints", scans.root / "keypoints", "--preset", preset(CALIBRATED), "-o", tmp_path / "o"
    )
    assert "16" in said
    found = arrays(tmp_path / "o" / "predictions.npz")
    assert found["names"].tolist() == scans.frames.names.tolist()
    run(
        "evaluate", tmp_path / "o" / "predictions.npz", "--table", "rich-o-star", "--path", scans.root,
        "--models", models, "--regressor", model_files.regressors(tmp_path / "regressors")[0], "-o", tmp_path / "table",
    )  # fmt: skip
    figures = json.loads((tmp_path / "table" / "evaluation.json").read_text())["methods"]["predictions"]["figures"]
    # The cameras are known: bodies stand near the true ones, upright on the same floor.
    assert figures["mpjpe"]["mean"] < 0.12
    assert figures["tilt"]["mean"] < np.radians(25)
    assert figures["mpjpe_world"]["mean"] < 0.8
    assert "IPMAN-O* (printed) | 240.9 |" in (tmp_path / "table" / "evaluation.md").read_text()


@pytest.mark.slow
def test_killed_half_way_the_bits_are_the_same(yoga, models, tmp_path, preset, monkeypatch):
    """In pieces of 3 frames with a death in the second one, as in one piece."""
    source = Source("moyo", str(yoga.root), "val", (("camera", 1),))

    def job(folder, piece):
        options = {"models": models, "keypoints": yoga.root / "keypoints", "piece": piece}
        return data_fits.DataFit(source, config.load(preset(PRESENTED)), tmp_path / folder, **options)

    whole, pieced = job("whole", 64), job("pieced", 3)
    whole.begin()
    whole.run()
    real = data_fits.DataFit._piece
    monkeypatch.setattr(data_fits.DataFit, "_piece", lambda self, number: real(self, number) if number == 0 else 1 / 0)
    pieced.begin()
    with pytest.raises(ZeroDivisionError):
        pieced.run()
    first = tmp_path / "pieced" / "pieces" / "000000.npz"
    before = first.stat().st_mtime_ns
    assert not (tmp_path / "pieced" / "predictions.npz").exists()
    monkeypatch.setattr(data_fits.DataFit, "_piece", real)
    again = job("pieced", 3)
    again.begin()
    again.run()
    assert first.stat().st_mtime_ns == before
    found = [(tmp_path / name / "predictions.npz").read_bytes() for name in ("whole", "pieced")]
    assert found[0] == found[1]


@pytest.mark.slow
def test_other_options_are_not_mixed_in(yoga, models, tmp_path, preset):
    fit_moyo(yoga, models, tmp_path / "out", preset(PRESENTED), "--every", "2")
    words = "--data", "moyo", "--path", yoga.root, "--models", models
    words += "--keypoints", yoga.root / "keypoints", "--preset", preset(PRESENTED), "-o", tmp_path / "out"
    said = run("fit", *words, code=1)
    assert "holds fits of other options (every differ)" in said


def test_a_named_pose_for_all(yoga, models, tmp_path, preset):
    fit_moyo(yoga, models, tmp_path / "out", preset(PRESENTED), "--pose", "tree", "--every", "2")
    found = arrays(tmp_path / "out" / "predictions.npz")
    model = Models(models).get("smplx", "female")
    vertices = model(found["pose"], found["betas"], found["transl"]).vertices
    drawn = ip.body.posed(model, "tree")
    assert np.ptp(vertices[..., 2], axis=1) == pytest.approx(np.ptp(drawn[:, 1]), abs=0.15)  # z is up in MoYo
    # It began on the floor; after so few iterations shape and pose are still on their way.
    np.testing.assert_allclose(vertices[..., 2].min(axis=1), 0, atol=0.1)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("x.json", "--data", "moyo", "--path", "."), "expected INPUT..., or --data with --path"),
        (("--data", "moyo"), "expected INPUT..., or --data with --path"),
        ((), "expected INPUT..., or --data with --path"),
        (("--data", "moyo", "--path", ".", "--focal", "900"), "leave out --focal"),
        (("--data", "moyo", "--path", ".", "--camera-pitch", "30", "--obj"), "leave out --camera-pitch, --obj"),
        (("--data", "moyo", "--path", ".", "--preset", "nonsense"), "expected one of"),
    ],
)
def test_wrong_usage(words, says, tmp_path):
    assert says in run("fit", *words, "-o", tmp_path / "out", code=2)


def test_what_is_missing_is_named(yoga, models, tmp_path, preset):
    root = "--path", yoga.root, "--split", "val"
    assert "there is no such file" in run(
        "fit", "--data", "moyo", "--path", tmp_path / "absent", "-o", tmp_path / "o", code=1
    )
    said = run("fit", "--data", "moyo", *root, "-o", tmp_path / "o", code=1)
    assert "SMPLX_FEMALE" in said
    assert "--models" in said


@pytest.mark.slow
def test_a_frame_without_keypoints_is_left_out(scans, models, tmp_path, preset, monkeypatch):
    """Without MediaPipe, too; keypoints of a file belong to the frame that it names, and to no other."""
    from ipman_rs.fitting import photo

    def missing():
        raise ImportError("photos need MediaPipe")

    monkeypatch.setattr(photo, "_model", missing)
    folder = tmp_path / "keypoints"
    names = scans.frames.names.tolist()
    for name in names[:2]:
        place = folder / f"{name}_keypoints.json"
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes((scans.root / "keypoints" / f"{name}_keypoints.json").read_bytes())
    where = "--data", "rich", "--path", scans.root, "--models", models, "--preset", preset(CALIBRATED)
    said = run("fit", *where, "--keypoints", folder, "-o", tmp_path / "o", code=1)
    assert "left out: no keypoint file" in said
    assert arrays(tmp_path / "o" / "predictions.npz")["names"].tolist() == names[:2]
    assert "--partial" in said
    said = run("fit", *where, "-o", tmp_path / "p", code=1)
    assert "no frame has a body; the first: photos need MediaPipe; or give keypoint files" in said
