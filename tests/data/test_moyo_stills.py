"""One still frame a pose of MoYo: by rule, and by a list like the authors'; and her own template."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

from tests.helpers.miniatures import models

pytest.importorskip("ezc3d", reason="ezc3d writes and judges C3D files")

import ipman_rs as ip
import ipman_rs.data as data
from ipman_rs.cli import main
from ipman_rs.data import moyo, moyo_stills
from ipman_rs.evaluation.tables.models import Models
from tests.helpers.miniatures import moyo as miniature

FIRST, SECOND = "220923_yogi_body_hands_03596_", "221004_yogi_nexus_body_hands_03596_"
BOAT, CROW, TREE = "Boat_Pose_-a", "Crane_(Crow)_Pose_or_Bakasana_-a", "Tree_-b"


@pytest.fixture
def sessions(tmp_path):
    """A session of three poses, and one whose names say nexus; 24 frames each, in val."""
    root = tmp_path / "MOYO"
    for session, prefix in ((miniature.HANDS, FIRST), (miniature.COM, SECOND)):
        for seed, pose in enumerate((BOAT, CROW, TREE)):
            miniature.sequence(root / session, prefix + pose, "val", seed=seed, with_com=session == miniature.COM)
    return root


def constants(path, combined, nexus):
    """A file like the authors': other things, comments, and both dictionaries."""
    path.write_text(
        "import os\nHERE = os.path.join('a', 'b')  # not a literal\n"
        f"frame_select_dict_combined = {combined!r}\n"
        "# another comment\nframe_select_dict_first_session = {'x': 1}\n"
        f"frame_select_dict_nexus = {nexus!r}\n"
    )
    return str(path)


def moving(frames, still, seed=0):
    """Poses (F, 165) that turn by 0.02 rad a frame about x, but for the frames in `still`."""
    step = np.where(np.isin(np.arange(frames), still), 0.0, 0.02)
    pose = np.zeros((frames, 165))
    pose[:, 3:66:3] = np.cumsum(step)[:, None]
    pose[:, :3] = miniature.STANDING
    return pose


def test_the_stillest_frame_of_the_middle(tmp_path):
    """Still at the beginning (while she waits) and from 181 to 240: the middle of the latter, an even frame."""
    pose = moving(400, [*range(60), *range(181, 241)])
    name = FIRST + BOAT
    miniature.body(tmp_path / "mosh" / "val" / f"{name}_stageii.pkl", 400, fullpose=pose)
    frames = data.open("moyo", tmp_path, frames="selected")[:]
    (number,) = (int(each.rpartition("/")[2]) for each in frames.names)
    assert number == 196  # the first even frame whose half second is still
    assert frames.frame_rate is None
    everything = data.open("moyo", tmp_path)[:]
    assert frames.names[0] == everything.names[number]
    np.testing.assert_array_equal(frames.pose[0], everything.pose[number])


def test_frames_that_are_not_known_are_not_still(tmp_path):
    pose = moving(400, range(240, 280))
    pose[150:200] = np.nan
    miniature.body(tmp_path / "mosh" / "val" / f"{FIRST}{BOAT}_stageii.pkl", 400, fullpose=pose)
    (name,) = data.open("moyo", tmp_path, frames="selected")[:].names
    assert 240 <= int(name.rpartition("/")[2]) <= 280


def test_short_sequences_have_one(tmp_path):
    for length in (1, 2, 3, 5):
        miniature.body(tmp_path / str(length) / "mosh" / "val" / f"{FIRST}{BOAT}_stageii.pkl", length)
        assert len(data.open("moyo", tmp_path / str(length), frames="selected")) == 1


def test_the_authors_list(sessions, tmp_path):
    """Image n is frame 2 n; recordings with centres of mass have a list of their own; other poses are left out."""
    file = constants(tmp_path / "constants.py", {BOAT: 4, CROW: 11}, {CROW: 7, TREE: 3})
    found = data.open("moyo", sessions, split="val", frames=file)[:]
    expected = [FIRST + BOAT + "/00008", FIRST + CROW + "/00022", SECOND + CROW + "/00014", SECOND + TREE + "/00006"]
    assert found.names.tolist() == expected
    whole = data.open("moyo", sessions)[:]
    rows = [whole.names.tolist().index(name) for name in expected]
    for part in ("pose", "transl", "center_of_mass", "center_of_pressure", "forces"):
        np.testing.assert_array_equal(getattr(found, part), getattr(whole, part)[rows])
    np.testing.assert_array_equal(found.pressure.values, whole.pressure.values[rows])
    one = tmp_path / "chosen.json"
    one.write_text(json.dumps({BOAT: 4, TREE: 0}))
    names = data.open("moyo", sessions, frames=str(one))[:].names.tolist()
    assert names == [
        FIRST + BOAT + "/00008",
        FIRST + TREE + "/00000",
        SECOND + BOAT + "/00008",
        SECOND + TREE + "/00000",
    ]


@pytest.mark.slow
def test_only_frames_that_a_camera_shows(sessions, tmp_path):
    miniature.cameras(sessions / miniature.HANDS, "220923")
    miniature.images(sessions / miniature.HANDS, FIRST + BOAT, range(3, 8), "val")
    file = constants(tmp_path / "constants.py", {BOAT: 4, CROW: 11}, {CROW: 7})
    frames = data.open("moyo", sessions / miniature.HANDS, frames=file, camera=1)[:]
    assert frames.names.tolist() == [FIRST + BOAT + "/00008"]
    assert frames.images[0].endswith("_YOGI_Cam_01_0004.jpg")
    where = "--path", sessions / miniature.HANDS, "--models", models.folder(tmp_path / "models"), "-o", tmp_path / "out"
    options = "--option", "camera=1", "--option", f"frames={file}"
    done = CliRunner().invoke(main, ["evaluate", "truth", "--table", "moyo", *map(str, (*where, *options))])
    assert done.exit_code == 0, done.output
    assert json.loads((tmp_path / "out" / "evaluation.json").read_text())["methods"]["truth"]["frames"] == 1


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.json", '{"Boat_Pose_-a": 4.5}', "whole numbers from 0"),
        ("a.json", '{"Boat_Pose_-a": -1}', "whole numbers from 0"),
        ("a.json", "[1, 2]", "whole numbers from 0"),
        ("a.json", "{", "expected the chosen image of each pose"),
        (
            "a.json",
            '{"Boat_Pose_-a": 12}',
            "Boat_Pose_-a: expected one of its 24 frames, got image 12, which is frame 24",
        ),
        ("a.json", '{"Warrior": 2}', "a.json: has none of the poses in .*, such as 220923_yogi_body_hands_03596_Boat"),
        ("a.py", "x = 1", "no frame_select_dict_combined in it; it should be moyo/utils/constants.py of moyo_toolkit"),
        ("a.py", "def f(:", "expected the chosen image of each pose"),
        (
            "a.py",
            "frame_select_dict_combined = __import__('os').mkdir('hacked')\nframe_select_dict_nexus = {}",
            "expected the chosen image of each pose",
        ),
        ("a.py", "frame_select_dict_combined = {}\nframe_select_dict_nexus = {'a': 1}", "whole numbers from 0"),
    ],
)
def test_lists_that_cannot_be(sessions, tmp_path, name, content, message, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_text(content)
    with pytest.raises(ValueError, match=message) as caught:
        data.open("moyo", sessions, frames=str(tmp_path / name))
    assert str(tmp_path / name) in str(caught.value)
    assert not (tmp_path / "hacked").exists()


def test_words_that_are_no_choice(sessions, tmp_path):
    with pytest.raises(
        ValueError, match="frames: expected all, selected, or a list in a .py or .json file, got 'still'"
    ):
        data.open("moyo", sessions, frames="still")
    with pytest.raises(ValueError, match=r"none.json: there is no such file"):
        data.open("moyo", sessions, frames=str(tmp_path / "none.json"))


def ply(path, vertices, faces=((0, 1, 2),)):
    import trimesh

    trimesh.Trimesh(vertices, faces, process=False).export(path)
    return path


@pytest.fixture(scope="module")
def bodies(tmp_path_factory):
    return models.folder(tmp_path_factory.mktemp("models"))


@pytest.fixture(scope="module")
def her(bodies):
    """Vertices of somebody a tenth larger, shifted."""
    return 1.1 * ip.load_body(bodies / "SMPLX_FEMALE.npz").v_template + [0.0, 0.02, 0.0]


def test_a_body_of_one_s_own(bodies, her):
    """Joints go with it: a body that is a tenth larger all over moves like the model, a tenth larger."""
    mean, own = (
        ip.load_body(bodies / "SMPLX_FEMALE.npz", flat_hand_mean=True, v_template=template) for template in (None, her)
    )
    pose = 0.3 * np.random.default_rng(0).standard_normal((2, 55, 3))
    moved = 1.1 * mean(pose).vertices
    offset = (own(pose).vertices - moved)[:, :1]  # a rigid shift of the whole body
    np.testing.assert_allclose(own(pose).vertices, moved + offset, atol=1e-9)
    np.testing.assert_allclose(own.J_template, 1.1 * mean.J_template + [0.0, 0.02, 0.0], atol=1e-12)
    with pytest.raises(ValueError, match=r"v_template: expected \(1229, 3\), as .*SMPLX_FEMALE.npz has, got \(10, 3\)"):
        ip.load_body(bodies / "SMPLX_FEMALE.npz", v_template=her[:10])
    with pytest.raises(ValueError, match="v_template: is for model files; the body anny has its own"):
        ip.load_body("anny", v_template=her)


@pytest.mark.parametrize("ending", [".ply", ".obj"])
def test_her_template_is_posed_without_betas(sessions, bodies, her, tmp_path, ending):
    file = ply(tmp_path / f"mesh{ending}", her, ip.load_body("anny-lite").faces)
    frames = data.open("moyo", sessions, frames="selected", v_template=str(file))[:]
    assert frames.rest_shape == str(file)
    posed = Models(bodies).posed(frames)
    body = ip.load_body(bodies / "SMPLX_FEMALE.npz", flat_hand_mean=True, v_template=her)
    expected = body(frames.pose, None, frames.transl)
    np.testing.assert_allclose(posed.vertices, expected.vertices, atol=1e-6)  # float32 in the .ply
    np.testing.assert_allclose(posed.model_joints, expected.joints, atol=1e-6)
    assert (
        np.abs(posed.vertices - Models(bodies).posed(data.open("moyo", sessions, frames="selected")[:]).vertices).max()
        > 0.05
    )


def test_templates_that_cannot_be(sessions, bodies, her, tmp_path):
    for file, message in (
        (tmp_path / "none.ply", "none.ply: expected a mesh in a .ply or .obj file, got no such file"),
        (ply(tmp_path / "mm.ply", 1000 * her), "mm.ply: expected a body in metres, got one that spans .*millimetres"),
    ):
        with pytest.raises(ValueError, match=message):
            data.open("moyo", sessions, v_template=file)
    (tmp_path / "half.ply").write_bytes((tmp_path / "mm.ply").read_bytes()[:500])
    with pytest.raises(ValueError, match="half.ply: "):
        data.open("moyo", sessions, v_template=tmp_path / "half.ply")
    other = ply(tmp_path / "other.ply", her[:100])
    frames = data.open("moyo", sessions, frames="selected", v_template=other)[:]
    with pytest.raises(ValueError, match=r"v_template: expected \(1229, 3\)"):
        Models(bodies).posed(frames)


@pytest.mark.slow
def test_the_table_of_the_paper_by_its_list_and_template(sessions, bodies, her, tmp_path):
    """The command line; the files go into what the figures are made of by their content, not their place."""
    file = ply(tmp_path / "mesh.ply", her, ip.load_body("anny-lite").faces)
    chosen = constants(tmp_path / "constants.py", {BOAT: 4, CROW: 11}, {CROW: 7, TREE: 3})
    out = tmp_path / "out"
    where = "--path", sessions, "--models", bodies, "-o", out
    options = "--option", f"frames={chosen}", "--option", f"v_template={file}"
    done = CliRunner().invoke(main, ["evaluate", "truth", "--table", "biomech", *map(str, (*where, *options))])
    assert done.exit_code == 0, done.output
    record = json.loads((out / "evaluation.json").read_text())
    assert record["methods"]["truth"]["frames"] == 4
    assert record["methods"]["truth"]["figures"]["com_error"]["frames"] == 2
    page = (out / "evaluation.md").read_text()
    assert f"Data: moyo, val, frames={chosen}, v_template={file}, 4 frames" in page
    assert "Without the authors' list the figures are not exactly the paper's." in page
    (tmp_path / "elsewhere").mkdir()
    for path in (tmp_path / "constants.py", file):
        path.rename(tmp_path / "elsewhere" / path.name)
    options = [option.replace(f"{tmp_path}/", f"{tmp_path}/elsewhere/") for option in options]
    again = CliRunner().invoke(main, ["evaluate", "truth", "--table", "biomech", *map(str, (*where, *options))])
    assert again.exit_code == 0, again.output
    assert "frames in" not in again.output  # nothing is measured again


def test_what_the_loader_says(sessions):
    said = CliRunner().invoke(main, ["data", "layout", "moyo"]).output
    assert 'frames="selected"' in said
    assert "v_template=mesh.ply" in said
    assert moyo_stills.POSE.sub("", SECOND + CROW) == CROW
    assert moyo.NAME == "moyo"
