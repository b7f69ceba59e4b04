"""The grid of two methods, from folders of `ipman fit` and from files of predictions."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

import ipman_rs as ip
from ipman_rs import data
from ipman_rs.cli import main
from ipman_rs.fitting.jobs import outputs

pytestmark = pytest.mark.slow


def fitted(folder, name, body, pose, drop=0.0, **more):
    """A folder as `ipman predict` leaves it: a body in a named pose, `drop` m below its floor y = 0."""
    angles = ip.body.poses.pose_of(body, pose)
    vertices = ip.body.posed(body, pose)
    transl = vertices[0] - np.asarray(body(angles).vertices)[0] - (0.0, drop, 0.0)
    arrays = {
        "global_orient": angles[None, 0],
        "body_pose": angles[1:].reshape(1, -1),
        "betas": np.zeros((1, body.num_betas)),
        "transl": transl[None],
        "image_size": np.array([[320.0, 240.0]]),
        "camera_rotation": np.diag([1.0, -1.0, -1.0])[None],
        "camera_translation": np.array([[0.0, 0.9, 4.0]]),
        "focal": np.full((1, 2), 400.0),
        "center": np.array([[160.0, 120.0]]),
        "ground_normal": np.array([[0.0, 1.0, 0.0]]),
        "ground_height": np.zeros(1),
        "model": np.array(body.name),
    }
    record = {"name": name, "source": f"/gone/{name}.jpg"}
    outputs.write_files(folder / name, {f"{name}.npz": {**arrays, **more}}, record)
    return vertices - (0.0, drop, 0.0)


@pytest.fixture
def methods(tmp_path, lite):
    for name in ("anna", "bert"):
        fitted(tmp_path / "base", name, lite, "lean_past_toes")
        fitted(tmp_path / "ours", name, lite, "tree", drop=0.01)
    return tmp_path / "base", tmp_path / "ours"


def test_two_fitted_folders(figure, methods, lite, tmp_path):
    (tmp_path / "photos").mkdir()
    Image.new("RGB", (320, 240), "#336699").save(tmp_path / "photos" / "anna.jpg")
    titles = "--title", "HMR", "--title", "ours"
    said = figure("compare", *methods, *titles, "--photos", tmp_path / "photos")
    assert said.code == 0, said.err
    people = said.numbers["people"]
    assert list(people) == ["anna", "bert"]
    assert list(people["anna"]) == ["HMR", "ours"]
    about, tree = people["anna"]["ours"], ip.body.posed(lite, "tree") - (0.0, 0.01, 0.0)
    found = ip.analyze(tree, lite.template, ip.Ground.y_up())
    apart = (found.center_of_mass - found.center_of_pressure)[[0, 2]]
    assert about["bose"] is True
    assert about["margin_m"] == pytest.approx(float(found.base_of_support.margin), abs=1e-6)
    assert about["com_cop_m"] == pytest.approx(float(np.hypot(*apart)), abs=1e-6)
    assert about["penetration_m"] == pytest.approx(0.01, abs=1e-6)
    assert about["hover_m"] == 0
    assert people["anna"]["HMR"]["bose"] is False
    lines = (said.folder / "compare.csv").read_text().splitlines()
    assert len(lines) == 5
    assert lines[0] == "person,method,bose,margin_m,com_cop_m,penetration_m,hover_m,ground"
    assert "10 mm into the floor" in said.out
    # The photo fills its cell: Anna's is blue, Bert has none.
    picture = np.asarray(Image.open(said.folder / "compare.png").convert("RGB")).astype(int)
    blue = (np.abs(picture - (0x33, 0x66, 0x99)).max(axis=-1) < 12).any(axis=1)
    assert blue[: len(blue) // 2].any()
    assert not blue[len(blue) // 2 :].any()


def test_folders_of_the_fitter(figure, tmp_path):
    """What `ipman fit` writes with and without physics terms, of one keypoint file."""
    pytest.importorskip("torch", reason="torch is the extra fit")
    from tests.helpers import keypoint_files

    path = keypoint_files.write(tmp_path / "anna.json", keypoint_files.seen("standing"))
    without = keypoint_files.QUICK[: keypoint_files.QUICK.index("  - name: physics")]
    for name, preset in (("with", keypoint_files.QUICK), ("without", without)):
        (tmp_path / f"{name}.yaml").write_text(preset)
        words = ["fit", path, "-o", tmp_path / name, "--preset", tmp_path / f"{name}.yaml", "--pictures", 0]
        assert CliRunner().invoke(main, list(map(str, words))).exit_code == 0
    said = figure("compare", tmp_path / "without", tmp_path / "with")
    assert said.code == 0, said.err
    report = json.loads((tmp_path / "with" / "report.json").read_text())["bodies"][0]["frames"][0]
    about = said.numbers["people"]["anna"]["with"]
    assert about["margin_m"] == pytest.approx(report["margin"], abs=1e-6)
    assert about["bose"] is report["bose"]


def test_predictions_of_a_data_set(figure, tmp_path, lite):
    pytest.importorskip("embreex", reason="embreex is the extra render")
    words = ["data", "render", "-o", tmp_path / "images", "-n", 2, "--size", 64, "-j", 1, "--moving", 0]
    assert CliRunner().invoke(main, list(map(str, words))).exit_code == 0
    true = data.open("rendered", tmp_path / "images", split="train")[:]
    for name, lift in (("truth", 0.0), ("lifted", 0.05)):
        columns = {"names": true.names, "pose": true.pose, "betas": true.betas, "body": true.body}
        np.savez(tmp_path / f"{name}.npz", transl=true.transl + np.float32([0, lift, 0]), **columns)
    files = tmp_path / "truth.npz", tmp_path / "lifted.npz"
    said = figure("compare", *files, "--data", "rendered", "--path", tmp_path / "images", "--split", "train")
    assert said.code == 0, said.err
    for name, about in said.numbers["people"].items():
        assert name in true.names
        assert about["truth"]["hover_m"] < 0.002
        assert about["lifted"]["hover_m"] == pytest.approx(0.05, abs=0.002)
        assert about["truth"]["ground"] == "of the data set"
    wrong = figure("compare", *files)
    assert wrong.code == 2
    assert "--data" in wrong.err


def test_folders_of_predictions_for_moyo(figure, tmp_path):
    """What `ipman fit --data moyo` leaves, an image that is whole and a damaged one. MoYo's camera is an option."""
    pytest.importorskip("ezc3d", reason="ezc3d writes and judges C3D files")
    from tests.helpers import spring_mat
    from tests.helpers.miniatures import moyo

    path, models = spring_mat.write(tmp_path)
    session = path / moyo.HANDS
    moyo.cameras(session, "220923")
    moyo.images(session, spring_mat.NAME, (0, 1), "val")
    whole, damaged = sorted(session.glob("images/**/*.jpg"))
    Image.new("RGB", (1028, 752), "#336699").save(whole)
    true = data.open("moyo", path, camera=1)[:]
    (tmp_path / "fit").mkdir()
    np.savez(
        tmp_path / "fit" / "predictions.npz", names=true.names, pose=true.pose, betas=true.betas, transl=true.transl,
        body=np.array("smplx"),
    )  # fmt: skip
    (tmp_path / "fit" / "fits.json").write_text("{}")
    words = tmp_path / "fit", "--data", "moyo", "--path", path, "--models", models
    said = figure("compare", *words, "--option", "camera=1")
    assert said.code == 0, said.err
    assert said.numbers["methods"] == ["fit"]
    assert list(said.numbers["people"]) == true.names.tolist()
    assert said.err.count("\n") == 1
    assert f"warning: {true.names[1]} is drawn on white: {damaged}: expected an image" in said.err
    picture = np.asarray(Image.open(said.folder / "compare.png").convert("RGB")).astype(int)
    blue = (np.abs(picture - (0x33, 0x66, 0x99)).max(axis=-1) < 12).any(axis=1)
    assert blue[: len(blue) // 2].any()
    assert not blue[len(blue) // 2 :].any()
    unseen = figure("compare", *words)
    assert unseen.code == 1
    assert "no camera for it; of moyo one is chosen by the option camera=1" in unseen.err
    alone = figure("compare", tmp_path / "fit")
    assert alone.code == 1
    assert "name that with --data and --path" in alone.err


def test_a_damaged_photo_of_a_fitted_folder(figure, methods, tmp_path):
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "bert.jpg").write_bytes(b"")
    said = figure("compare", *methods, "--photos", tmp_path / "photos")
    assert said.code == 0, said.err
    assert said.err.count("\n") == 1  # once, though both methods have him
    assert "warning: bert is drawn on white: " in said.err


def test_some_people(figure, methods, contents):
    said = figure("compare", methods[0], "--person", "bert")
    assert list(said.numbers["people"]) == ["bert"]
    again = figure("compare", methods[0], "--person", "bert", out="again")
    assert contents(said.folder) == contents(again.folder)
    one = figure("compare", methods[0], "--most", 1)
    assert list(one.numbers["people"]) == ["anna"]
    lost = figure("compare", *methods, "--person", "carl")
    assert lost.code == 1
    assert "'carl' is not in all of them; these are: anna, bert" in lost.err


def test_bad_input(figure, methods, lite, tmp_path):
    base, ours = methods
    assert figure("compare", base, ours, "--title", "one").code == 2
    assert figure("compare", base, ours, "--data", "amass").code == 2
    said = figure("compare", base, tmp_path / "nowhere")
    assert (said.code, said.err.count("\n")) == (1, 1)
    assert "there is no such folder" in said.err
    (tmp_path / "empty").mkdir()
    assert "no fitted body in this folder" in figure("compare", base, tmp_path / "empty").err
    (ours / "anna" / "anna.npz").write_bytes(b"PK damaged")
    said = figure("compare", base, ours)
    assert (said.code, said.err.count("\n")) == (1, 1)
    assert "anna.npz: not a .npz file" in said.err
    fitted(ours, "anna", lite, "tree", model=np.array("SMPL_NEUTRAL"))
    assert "give --body FILE" in figure("compare", base, ours).err
    fitted(ours, "anna", lite, "tree", betas=np.array(0.0))
    assert "anna.npz: expected parameters" in figure("compare", base, ours).err
    fitted(ours, "anna", lite, "tree")
    (ours / "anna" / "fit.json").write_text("{")
    assert "fit.json: is no JSON" in figure("compare", base, ours).err
    fitted(tmp_path / "others", "carl", lite, "tree")
    assert "nobody of the same name" in figure("compare", base, tmp_path / "others").err
