"""The data set's own bodies as predictions: nothing is wrong with them, wherever the file's own joints lie."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import ipman_rs as ip
from ipman_rs import data
from ipman_rs.body.joint_regressors import EXTRA, HUMAN36M
from ipman_rs.cli import main
from ipman_rs.evaluation.tables import TABLES
from ipman_rs.evaluation.tables.joints import COUNTED
from ipman_rs.evaluation.tables.models import Models
from tests.helpers.miniatures import human36m, models, rich, rich_ipman, spin, threedpw

MOVED = np.array([0.03, 0.0, 0.0])  # m: the file's joints from those of the regressor


@pytest.fixture(scope="module")
def bodies(tmp_path_factory):
    return models.folder(tmp_path_factory.mktemp("models"))


@pytest.fixture(scope="module")
def regressors(tmp_path_factory):
    return models.regressors(tmp_path_factory.mktemp("regressors"))


def evaluated(*arguments):
    done = CliRunner().invoke(main, ["evaluate", *map(str, arguments)])
    return done.exit_code, done.output


def record(out):
    return json.loads((out / "evaluation.json").read_text())


def save_own(path, frames, **changes):
    arrays = {name: getattr(frames, name) for name in ("names", "genders", "pose", "betas", "transl")}
    arrays = {"body": frames.body} | {name: value for name, value in arrays.items() if value is not None}
    np.savez(path, **arrays | changes)
    return path


def moved_joints(name, file, bodies, regressor):
    """The SPIN file's S_world: where it has a name of the regressor's, 30 mm from that joint of its own bodies."""
    frames = data.open(name, file)[:]
    points = np.einsum("kv,fvc->fkc", np.load(regressor), Models(bodies).posed(frames).vertices)
    joints = np.concatenate([np.nan_to_num(frames.joints), np.isfinite(frames.joints[..., :1])], axis=2)
    for place, joint in enumerate(spin.J24):
        if joint in HUMAN36M:
            joints[:, place] = np.append(points[:, HUMAN36M.index(joint)] + MOVED, np.ones((len(points), 1)), axis=1)
    return joints


def spin_file(module, data_set, folder, bodies, regressor, **options):
    file, _ = module.write(folder, **options)
    joints = moved_joints(data_set, file, bodies, regressor)
    module.write(folder, S_world=joints, part=None, **options)  # keypoints in the image would lie elsewhere
    return file


def make(table, folder, bodies, regressor):
    """The data set of a table, in a new folder."""
    folder.mkdir()
    if table in ("rich", "push-pull"):
        options = {"name": "rich_world_test_new.npz", "cameras": (0, 1)}
        spin_file(rich_ipman, "rich-ipman", folder, bodies, regressor, **options)
    elif table == "h36m":
        spin_file(human36m, "human36m", folder, bodies, regressor)
    elif table == "3dpw":

        def change(content):
            content["jointPositions"] = [joints + np.tile(MOVED, 24) for joints in content["jointPositions"]]

        threedpw.write(folder, change=change)
    elif table == "rich-o-star":
        rich.write(folder)
    else:
        pytest.importorskip("ezc3d", reason="ezc3d writes and judges C3D files")
        from tests.helpers.miniatures import moyo

        moyo.write(folder)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("with_regressor", [True, False])
@pytest.mark.parametrize("table", TABLES)
def test_own_bodies_have_no_error(table, with_regressor, bodies, regressors, tmp_path):
    folder = make(table, tmp_path / "data", bodies, regressors[0])
    source = TABLES[table]
    options = {"hands": Models(bodies).hands()} if source.data == "rich" else dict(source.options)
    frames = data.open(source.data, folder, split=source.split, **options)[:]
    own = save_own(tmp_path / "own.npz", frames)
    given = ("--regressor", regressors[0]) if with_regressor else ()
    out = tmp_path / "out"
    code, said = evaluated(own, "--table", table, "--path", folder, "--models", bodies, *given, "-o", out)
    assert code == 0, said
    figures = record(out)["methods"]["own"]["figures"]
    for name in ("mpjpe", "pa_mpjpe", "pve"):
        assert figures[name]["frames"] == len(frames) > 0
        assert figures[name]["largest"] <= 1e-9, name
    compared = record(out)["joints"]["own"]
    assert compared["same"]
    assert compared["truth"] == compared["estimate"] == ("h36m" if with_regressor else "own")
    page = (out / "evaluation.md").read_text()
    if with_regressor:
        assert compared["names"] == list(COUNTED)
        assert "truth and estimate by J_regressor_h36m × vertices; aligned at the pelvis." in page
    paper = "The paper compares 14 other joints: give `regressors=J_regressor_h36m.npy`." in page
    assert paper == (source.regressor and not with_regressor)
    for method, printed in source.published.items():
        row = page if source.across else next(line for line in page.splitlines() if f"| {method} (printed) |" in line)
        assert all(f"{value:.1f}" in row or f"{value:.2f}" in row for value in printed.values())


def guess_of(frames, path, turn=0.2):
    """Bodies near those of the data set: every joint but the root turned by some hundredths of a radian."""
    noise = (
        turn
        * np.random.default_rng(3).standard_normal(frames.pose.shape)
        * (np.arange(frames.pose.shape[1]) > 0)[:, None]
    )
    return save_own(path, frames, pose=frames.pose + noise)


def plain_mpjpe(true, guess, names, known):
    """(F, K, 3) of both, by plain loops: mean over the counted joints, less the pelvis."""
    errors = []
    for own, real in zip(guess, true, strict=True):
        off = own - own[names.index("pelvis")] - (real - real[names.index("pelvis")])
        errors.append(np.mean([np.linalg.norm(off[names.index(name)]) for name in known]))
    return np.mean(errors)


def test_measured_joints_take_the_regressor_of_the_protocol(bodies, regressors, tmp_path):
    """Human3.6M's validation has marker joints and no bodies: J_regressor_h36m of the estimate, or a refusal."""
    file, _ = human36m.write(tmp_path)
    frames = data.open("human36m", file)[:]
    guess = guess_of(frames, tmp_path / "guess.npz")
    human36m.write(tmp_path, with_smpl=False)
    asked = guess, "--table", "h36m", "--path", file, "--models", bodies
    code, said = evaluated(*asked, "-o", tmp_path / "refused")
    assert code == 1
    assert "human36m: has measured joints and no bodies here, and the predictions are bodies" in said
    assert "--regressor with J_regressor_h36m.npy makes the measured ones of the predicted vertices" in said
    assert not (tmp_path / "refused" / "methods" / "guess" / "000000.npz").exists()
    code, said = evaluated(*asked, "--regressor", regressors[0], "-o", tmp_path / "out")
    assert code == 0, said
    with np.load(guess) as stored:
        parts = {name: stored[name] for name in ("names", "pose", "betas", "transl", "genders")}
        posed = Models(bodies).posed(data.Frames(sequences=parts["names"], body="smpl", **parts))
    points = np.einsum("kv,fvc->fkc", np.load(regressors[0]), posed.vertices)
    measured = {name: frames.joints[:, k] for k, name in enumerate(frames.joint_names)}
    true = np.stack([measured[name] for name in HUMAN36M], axis=1)
    found = record(tmp_path / "out")
    expected = plain_mpjpe(true, points, HUMAN36M, COUNTED)
    assert found["methods"]["guess"]["figures"]["mpjpe"]["mean"] == pytest.approx(expected, abs=1e-9)
    assert "pve" not in found["methods"]["guess"]["figures"]
    assert found["joints"]["guess"]["names"] == list(COUNTED)
    assert not found["joints"]["guess"]["same"]
    page = (tmp_path / "out" / "evaluation.md").read_text()
    assert "truth by the joints that the data set gives, estimate by J_regressor_h36m × vertices; aligned at" in page


@pytest.mark.slow
def test_the_table_of_rich_by_plain_loops(bodies, regressors, tmp_path):
    """Both sides' joints and pelvis of their vertices; the file's own joints, 30 mm away, do not count."""
    folder = make("rich", tmp_path / "data", bodies, regressors[0])
    frames = data.open("rich-ipman", folder, split="test-all")[:]
    guess = guess_of(frames, tmp_path / "guess.npz")
    where = "--path", folder, "--models", bodies, "--regressor", regressors[0], "-o", tmp_path / "out"
    code, said = evaluated(guess, "--table", "rich", *where)
    assert code == 0, said
    figures = record(tmp_path / "out")["methods"]["guess"]["figures"]
    with np.load(guess) as stored:
        meshes = [
            ip.load_body(bodies / "SMPL_NEUTRAL.npz")(pose, frames.betas, frames.transl).vertices
            for pose in (frames.pose, stored["pose"])
        ]
    weights = np.load(regressors[0])
    true, own = ([weights @ vertices for vertices in mesh] for mesh in meshes)
    assert figures["mpjpe"]["mean"] == pytest.approx(plain_mpjpe(true, own, HUMAN36M, COUNTED), abs=1e-12)
    pve = [
        np.linalg.norm((b - own[k][0]) - (a - true[k][0]), axis=1).mean()
        for k, (a, b) in enumerate(zip(*meshes, strict=True))
    ]
    assert figures["pve"]["mean"] == pytest.approx(np.mean(pve), abs=1e-12)
    assert 0.01 < figures["pve"]["mean"] < 0.5


@pytest.mark.slow
def test_poses_that_are_known_nowhere_are_no_bodies(bodies, regressors, tmp_path):
    """has_smpl_world is 0 in every row: Human3.6M's measured joints are all that there is."""
    file, _ = human36m.write(tmp_path)
    guess = guess_of(data.open("human36m", file)[:], tmp_path / "guess.npz")
    human36m.write(tmp_path, has_smpl_world=np.zeros(12))
    asked = guess, "--table", "h36m", "--path", file, "--models", bodies
    code, said = evaluated(*asked, "--regressor", regressors[0], "-o", tmp_path / "out")
    assert code == 0, said
    found = record(tmp_path / "out")
    assert found["joints"]["guess"]["truth"] == "given"
    assert found["methods"]["guess"]["figures"]["mpjpe"]["frames"] == 12


@pytest.mark.slow
def test_one_camera_of_rich(bodies, tmp_path):
    folder = make("rich-o-star", tmp_path / "data", bodies, None)
    where = "--path", folder, "--models", bodies, "-o", tmp_path / "out"
    code, said = evaluated("truth", "--table", "rich-o-star", *where, "--option", "cameras=1")
    assert code == 0, said
    assert record(tmp_path / "out")["methods"]["truth"]["frames"] == 12  # of 36 by three cameras
    assert record(tmp_path / "out")["printed"]["IPMAN-O*"] == {"mpjpe": 240.9, "pve": 217.1, "bose": 98.0}


@pytest.mark.slow
def test_measured_joints_of_spin_s_definition_take_its_extra_regressor(bodies, regressors, tmp_path):
    """RICH in IPMAN's form without bodies: joints as SPIN defines them, limbs the body's own, the middle regressed."""
    file, _ = rich_ipman.write(tmp_path)
    frames = data.open("rich-ipman", file)[:]
    own = save_own(tmp_path / "own.npz", frames)
    posed = Models(bodies).posed(frames)
    joints = np.concatenate([frames.joints, np.ones((len(frames), 24, 1))], axis=2)
    extra = np.einsum("kv,fvc->fkc", np.load(regressors[1]), posed.vertices)
    for place, joint in enumerate(spin.J24):
        if joint in EXTRA:
            joints[:, place, :3] = extra[:, EXTRA.index(joint)]
        elif joint in posed.model_joint_names:
            joints[:, place, :3] = posed.model_joints[:, posed.model_joint_names.index(joint)]
    rich_ipman.write(tmp_path, S_world=joints, pose_world=None, part=None)
    asked = own, "--data", "rich-ipman", "--path", file, "--models", bodies
    code, said = evaluated(*asked, "--regressor", regressors[0], "-o", tmp_path / "refused")
    assert code == 1
    assert "--regressor with J_regressor_extra.npy" in said
    code, said = evaluated(*asked, "--regressor", regressors[1], "-o", tmp_path / "out")
    assert code == 0, said
    found = record(tmp_path / "out")
    assert found["methods"]["own"]["figures"]["mpjpe"]["largest"] <= 1e-9
    assert len(found["joints"]["own"]["names"]) == 19  # nose, eyes and ears are vertices of SMPL
    both = [part for file in regressors for part in ("--regressor", file)]
    code, said = evaluated(*asked, *both, "-o", tmp_path / "both")
    assert code == 0, said
    assert record(tmp_path / "both")["joints"]["own"]["names"] == list(COUNTED)
    assert record(tmp_path / "both")["methods"]["own"]["figures"]["mpjpe"]["largest"] <= 1e-9


@pytest.mark.slow
def test_bodies_of_another_model_are_compared_by_name_and_it_is_said(bodies, tmp_path):
    pytest.importorskip("ezc3d", reason="ezc3d writes and judges C3D files")
    from tests.helpers.miniatures import moyo

    moyo.write(tmp_path / "moyo")
    frames = data.open("moyo", tmp_path / "moyo", split="val", frames="selected")[:]
    guess = save_own(tmp_path / "smpl.npz", frames, body="smpl", pose=frames.pose[:, :24])
    where = "--path", tmp_path / "moyo", "--models", bodies, "-o", tmp_path / "out"
    code, said = evaluated(guess, "--table", "moyo", *where)
    assert code == 0, said
    found = record(tmp_path / "out")
    assert not found["joints"]["smpl"]["same"]
    assert "pve" not in found["methods"]["smpl"]["figures"]
    page = (tmp_path / "out" / "evaluation.md").read_text()
    assert "truth by the joints of the body smplx, estimate by the joints of the body smpl; aligned at" in page
    assert "Only the names agree: where definitions differ, errors carry their distance." in page
    assert "PVE: not to be had without bodies of one mesh in the data and in the predictions, and a pelvis of" in page


def test_a_truth_whose_model_is_missing(regressors, tmp_path):
    """Bodies are not held against the joints of a file that has bodies, too."""
    file, _ = rich_ipman.write(tmp_path)
    frames = data.open("rich-ipman", file)[:]
    vertices = np.random.default_rng(0).random((len(frames), 1229, 3))
    np.savez(tmp_path / "guess.npz", names=frames.names, body="smpl", vertices=vertices)
    asked = tmp_path / "guess.npz", "--data", "rich-ipman", "--path", file, "-o", tmp_path / "out"
    code, said = evaluated(*asked, "--regressor", regressors[0])
    assert code == 1
    assert "rich-ipman: its truth is bodies of smpl, to which predicted bodies are compared: --models FOLDER" in said


def test_the_gender_of_a_missing_model_is_the_one_that_is_needed(tmp_path):
    """MoYo's people are female, of SMPL-X; without the file of any gender nothing is posed."""
    pytest.importorskip("ezc3d", reason="ezc3d writes and judges C3D files")
    from tests.helpers.miniatures import moyo

    moyo.write(tmp_path)
    code, said = evaluated("truth", "--table", "moyo", "--path", tmp_path, "-o", tmp_path / "out")
    assert code == 1
    assert "smplx (female) needs its model file, SMPLX_FEMALE.npz or .pkl: no folder is named by --models" in said
    frames = data.open("moyo", tmp_path)[:2]
    beside = replace(frames, joints=np.zeros((2, 1, 3)), joint_names=("pelvis",))
    assert Models().posed(beside).missing_model == "SMPLX_FEMALE"
    assert Models().posed(replace(beside, genders=None)).missing_model == "SMPLX_NEUTRAL"


def test_what_is_asked_of_a_data_set_must_be_there(regressors, tmp_path):
    file, _ = rich_ipman.write(tmp_path)
    asked = "truth", "--data", "rich-ipman", "--path", file, "-o", tmp_path / "out"
    code, said = evaluated(*asked, "--option", "cameras=1")
    assert code == 1
    assert "rich-ipman: has no option 'cameras'; it has split, frame, height" in said
    code, said = evaluated(*asked, "--regressor", regressors[0], "--regressor", regressors[0])
    assert code == 1
    assert "expected one regressor of 17 joints, got two" in said
