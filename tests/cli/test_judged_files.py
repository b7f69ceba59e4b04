"""Files as other people's programs write them: read right, or refused or marked with what mends them."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import ipman_rs as ip
from tests.helpers.cli_files import report, strict, walk_parameters
from tests.helpers.miniatures import models


def analyze(run, *arguments):
    result = run("analyze", *arguments, "--json")
    assert result.code == 0, result.err
    (body,) = strict(result.out)["bodies"]
    return body


def refused(run, command, path, *arguments):
    """The line that says why."""
    result = run(command, path, *arguments, "--json")
    assert result.code == 1
    (line,) = result.err.splitlines()
    assert line.startswith(f"ipman: error: {path}: ")
    return line


def figures(body):
    return [(frame["mass"], *frame["center_of_mass"], frame["lowest"]) for frame in body["frames"]]


@pytest.fixture
def mesh(tmp_path, lite_body, standing):
    def written(name, turned=((1, 0, 0), (0, 1, 0), (0, 0, 1)), scale=1.0, pose="standing"):
        path = tmp_path / name
        vertices = standing if pose == "standing" else ip.body.posed(lite_body, pose)
        trimesh.Trimesh(scale * vertices @ np.transpose(turned), lite_body.faces, process=False).export(path)
        return path

    return written


@pytest.fixture(scope="module")
def weight(lite_body, standing):
    return float(ip.mass_properties(standing, lite_body.template).mass)


@pytest.mark.parametrize("command", ["analyze", "simulate"])
@pytest.mark.parametrize("ending", ["obj", "ply", "stl"])
def test_millimetres(run, mesh, weight, command, ending):
    path = mesh(f"mm.{ending}", scale=1e3)
    line = refused(run, command, path)
    assert "looks like millimetres" in line
    assert "--units mm if so" in line
    assert "UnitsWarning" not in line
    mended = run(command, path, "--units", "mm", "--json")
    assert (mended.code, mended.err) == (0, "")
    (body,) = strict(mended.out)["bodies"]
    assert body["flags"] == []
    assert body["frames"][0]["mass"] == pytest.approx(weight, rel=1e-5)  # float32 files
    forced = run(command, path, "--force", "--json")
    assert forced.code == 0
    (body,) = strict(forced.out)["bodies"]
    (flag,) = body["flags"]
    assert "looks like millimetres" in flag
    in_flags = flag.replace("`units='mm'`", "--units mm")
    assert forced.err == f"ipman: warning: {path}: {in_flags}\n"


@pytest.mark.parametrize(
    ("unit", "metres"), [("cm", 0.01), ("in", 0.0254), ("ft", 0.3048), ("0.5", 0.5), ("m", 1), ("dm", 0.1)]
)
def test_units(run, mesh, weight, unit, metres):
    body = analyze(run, mesh("body.ply", scale=1 / metres), "--units", unit)
    assert body["frames"][0]["mass"] == pytest.approx(weight, rel=1e-5)
    assert body["flags"] == []


@pytest.mark.parametrize("wrong", ["furlong", "0", "-1", "nan", "inf"])
def test_units_that_are_none(run, mesh, wrong):
    result = run("analyze", mesh("body.ply"), "--json", f"--units={wrong}")
    assert result.code == 2
    assert "is none of m, dm, cm, mm" in result.err


@pytest.mark.slow
def test_a_body_on_its_head_is_marked_everywhere(run, mesh, tmp_path):
    path = mesh("down.obj", np.diag([1.0, -1.0, -1.0]), pose="tree")
    result = run("analyze", path, "-o", tmp_path / "out")
    assert result.code == 0
    flag = "its head is below its feet; `up='-y'` if so"
    in_flags = flag.replace("`up='-y'`", "--up -y")
    assert result.err == f"ipman: warning: {path}: {in_flags}\n"
    assert "down !" in result.out
    assert f"! {in_flags}" in result.out
    assert report(tmp_path / "out")["bodies"][0]["flags"] == [flag]
    assert "its head is below its feet" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    fallen = run("simulate", path, "--tip-only")
    assert fallen.err == result.err
    assert "down.obj !" in fallen.out
    assert f"! {path}: {in_flags}" in fallen.out
    said = run("analyze", path, "--up", "-y", "-o", tmp_path / "said")
    assert (said.code, said.err) == (0, "")
    assert "!" not in said.out


@pytest.mark.parametrize("command", ["analyze", "simulate"])
def test_a_body_that_stands_on_its_head_is_refused(run, mesh, command):
    path = mesh("down.obj", np.diag([1.0, -1.0, -1.0]))
    line = refused(run, command, path)
    assert "stands on its head, with its feet in the air; --up -y if so" in line
    assert run(command, path, "--force", "--json").code == 0


def test_a_body_on_its_back_is_marked(run, mesh):
    path = mesh("zup.obj", Rotation.from_euler("x", 90, degrees=True).as_matrix())
    assert analyze(run, path)["flags"] == ["lies: its head is beside its feet; `up='z'` if so"]
    assert analyze(run, path, "--up", "z")["flags"] == []


def test_people_of_a_y_up_world_in_amass_arrays_are_refused(run, tmp_path):
    np.savez(tmp_path / "aist.npz", poses=np.zeros((8, 72)), trans=np.tile([0.0, 1.0, 0.0], (8, 1)))
    assert "looks like +y up" in refused(run, "analyze", tmp_path / "aist.npz")
    assert "--up y if so" in refused(run, "simulate", tmp_path / "aist.npz")
    assert analyze(run, tmp_path / "aist.npz", "--up", "y")["flags"] == []


def test_people_in_a_camera_frame_are_refused(run, tmp_path):
    pose = np.zeros((5, 72))
    pose[:, 0] = np.pi  # y down, z away
    np.savez(tmp_path / "wham.npz", pose=pose, trans=np.tile([0.2, 0.9, 4.0], (5, 1)))
    assert "--up -y if so" in refused(run, "analyze", tmp_path / "wham.npz")
    assert analyze(run, tmp_path / "wham.npz", "--up", "-y")["flags"] == []


@pytest.mark.parametrize("pose", ["all_fours", "plank", "cobra"])
def test_a_sequence_on_hands_and_feet_passes(run, tmp_path, lite_body, pose):
    frames = np.repeat(ip.body.posed(lite_body, pose)[None], 4, axis=0)
    np.savez(tmp_path / "yoga.npz", vertices=frames, faces=lite_body.faces)
    assert analyze(run, tmp_path / "yoga.npz")["flags"] == []


def test_degrees(run, tmp_path):
    stored = walk_parameters()
    np.savez(tmp_path / "radians.npz", **stored)
    np.savez(tmp_path / "degrees.npz", **{**stored, "poses": np.degrees(stored["poses"])})
    line = refused(run, "analyze", tmp_path / "degrees.npz", "--body", "anny-lite")
    assert "poses: looks like degrees: rotations by up to 90" in line
    assert "--degrees if so" in line
    true = analyze(run, tmp_path / "radians.npz", "--body", "anny-lite")
    mended = analyze(run, tmp_path / "degrees.npz", "--body", "anny-lite", "--degrees")
    np.testing.assert_allclose(figures(mended), figures(true), atol=1e-6)  # float32 poses
    assert mended["flags"] == []
    wrongly = run("analyze", tmp_path / "radians.npz", "--body", "anny-lite", "--degrees", "--up", "y", "--json")
    assert "no joint turns by more than 1.6 degrees; is it in radians?" in wrongly.err


@pytest.mark.parametrize(("name", "root"), [("global_orient", "body_pose"), ("root_orient", "pose_body")])
def test_degrees_in_pieces(run, tmp_path, name, root):
    pose = np.zeros((2, 63))
    pose[:, 9] = 35.0
    np.savez(tmp_path / "pieces.npz", **{name: np.zeros((2, 3)), root: pose})
    assert f"{root}: looks like degrees" in refused(run, "analyze", tmp_path / "pieces.npz")


@pytest.mark.parametrize("name", ["trans", "transl"])
def test_places_in_millimetres(run, tmp_path, name):
    stored = walk_parameters()
    trans = stored.pop("trans") + [3.0, 2.0, 0.0]
    np.savez(tmp_path / "m.npz", **stored, **{name: trans})
    np.savez(tmp_path / "mm.npz", **stored, **{name: 1e3 * trans})
    line = refused(run, "analyze", tmp_path / "mm.npz", "--body", "anny-lite")
    assert f"{name}: looks like millimetres" in line
    assert "--units mm if so" in line
    true = analyze(run, tmp_path / "m.npz", "--body", "anny-lite")
    mended = analyze(run, tmp_path / "mm.npz", "--body", "anny-lite", "--units", "mm")
    np.testing.assert_allclose(figures(mended), figures(true), atol=1e-6)


def test_places_in_centimetres_are_marked(run, tmp_path):
    stored = walk_parameters()
    np.savez(tmp_path / "cm.npz", **{**stored, "trans": 100 * stored["trans"]})
    flags = analyze(run, tmp_path / "cm.npz", "--body", "anny-lite")["flags"]
    fast, high = flags
    assert fast.startswith("trans: moves at 114.3 m/s in the median, expected up to 15; is its unit (`units`) or its")
    assert high.startswith("vertices: 89.09 m above the origin of their world; is the unit of their places another")


def test_rates(run, tmp_path):
    stored = walk_parameters()
    for number, rate in enumerate((np.nan, 0.0, -30.0)):
        np.savez(tmp_path / f"{number}.npz", **{**stored, "mocap_framerate": rate})
        line = refused(run, "analyze", tmp_path / f"{number}.npz", "--body", "anny-lite")
        assert "--rate HZ says otherwise" in line
    body = analyze(run, tmp_path / "0.npz", "--body", "anny-lite", "--rate", "50")
    assert [frame["seconds"] for frame in body["frames"]] == [number / 50 for number in range(8)]
    np.savez(tmp_path / "fast.npz", **{**stored, "trans": 0 * stored["trans"], "mocap_framerate": 20_000.0})
    assert analyze(run, tmp_path / "fast.npz")["flags"] == ["2e+04 frames a second; `rate=HZ` says otherwise"]


def test_a_rate_for_each_frame(run, tmp_path):
    np.savez(tmp_path / "same.npz", **{**walk_parameters(), "mocap_framerate": np.full(8, 25.0)})
    body = analyze(run, tmp_path / "same.npz", "--body", "anny-lite")
    assert [frame["seconds"] for frame in body["frames"]] == [number / 25 for number in range(8)]
    np.savez(tmp_path / "other.npz", **{**walk_parameters(), "mocap_framerate": np.arange(8.0)})
    line = refused(run, "analyze", tmp_path / "other.npz", "--body", "anny-lite")
    assert "mocap_framerate holds 8 different numbers, expected one; --rate HZ says otherwise" in line


def test_a_root_that_is_one_matrix_is_one_body(run, tmp_path):
    models.smpl(tmp_path / "SMPL_NEUTRAL.npz")
    turn, betas = np.array([0.1, 0.6, -0.1]), np.linspace(-1, 1, 10)
    shared = {"body_pose": np.full((1, 69), 0.05), "betas": betas}
    matrix = Rotation.from_rotvec(turn).as_matrix()
    np.savez(tmp_path / "matrix.npz", global_orient=matrix, **shared)
    np.savez(tmp_path / "vector.npz", global_orient=turn[None], **shared)
    one, same = (
        analyze(run, tmp_path / f"{name}.npz", "--body", tmp_path / "SMPL_NEUTRAL.npz") for name in ("matrix", "vector")
    )
    assert len(one["frames"]) == 1
    assert "global_orient: rotation matrices" in one["notes"]
    np.testing.assert_allclose(figures(one), figures(same), rtol=1e-6)


def test_easymocap(run, tmp_path):
    """Vertices are Rh · body + Th, the body as it is posed by `poses` and shaped by `shapes`."""
    models.smpl(tmp_path / "SMPL_NEUTRAL.npz")
    body = ip.load_body(tmp_path / "SMPL_NEUTRAL.npz")
    draw = np.random.default_rng(0)
    poses, shapes = 0.1 * draw.normal(size=(4, 72)), draw.normal(size=(1, 10))
    poses[:, :3] = 0
    turn, shift = np.array([0.2, 1.0, 0.1]), np.array([[1.0, 2.0, 3.0]])
    np.savez(
        tmp_path / "easymocap.npz",
        poses=poses,
        shapes=shapes,
        Rh=np.tile(turn, (4, 1)),
        Th=shift,
        keypoints3d=np.ones(3),
    )
    found = analyze(run, tmp_path / "easymocap.npz", "--body", tmp_path / "SMPL_NEUTRAL.npz", "--ground", "0")
    vertices = body(poses.reshape(4, 24, 3), shapes).vertices @ Rotation.from_rotvec(turn).as_matrix().T + shift
    expected = ip.analyze(vertices, body.template, ip.Ground())
    for number, frame in enumerate(found["frames"]):
        np.testing.assert_allclose(frame["center_of_mass"], expected.center_of_mass[number], atol=1e-5)
        assert frame["mass"] == pytest.approx(expected.mass[number], rel=1e-5)
    assert "not used: keypoints3d" in found["notes"]


def test_romp(run, tmp_path):
    models.smpl(tmp_path / "SMPL_NEUTRAL.npz")
    body = ip.load_body(tmp_path / "SMPL_NEUTRAL.npz")
    draw = np.random.default_rng(0)
    thetas, betas = 0.1 * draw.normal(size=(1, 72)), draw.normal(size=(1, 10))
    shift = np.array([[0.1, 0.2, 3.0]])
    stored = {"smpl_thetas": thetas, "smpl_betas": betas, "cam_trans": shift, "global_orient": thetas[:, :3]}
    np.savez(tmp_path / "romp.npz", **stored, verts=np.zeros((1, 6890, 3)), pj2d=np.zeros((1, 54, 2)))
    found = analyze(run, tmp_path / "romp.npz", "--body", tmp_path / "SMPL_NEUTRAL.npz", "--ground", "0")
    expected = ip.analyze(body(thetas.reshape(24, 3), betas[0], shift[0]).vertices, body.template, ip.Ground())
    np.testing.assert_allclose(found["frames"][0]["center_of_mass"], expected.center_of_mass, atol=1e-5)
    assert "not used: pj2d, verts" in found["notes"]
    assert "shape: the file's 10 betas" in found["notes"]


def test_a_pickled_result_is_refused_in_one_line(run, tmp_path):
    np.savez(tmp_path / "results.npz", results=np.array({"smpl_thetas": np.zeros((1, 72))}, dtype=object))
    assert "results holds Python objects, which are not loaded" in refused(run, "analyze", tmp_path / "results.npz")


def test_what_is_not_read_is_named_once(run, tmp_path):
    extra = {f"extra{number:02d}": np.zeros(1) for number in range(14)}
    np.savez(tmp_path / "more.npz", **walk_parameters(), **extra, root_orient=walk_parameters()["poses"][:, :3])
    (note,) = [note for note in analyze(run, tmp_path / "more.npz")["notes"] if note.startswith("not used")]
    assert note == f"not used: {', '.join(sorted(extra)[:12])}, … (14 arrays)"
    np.savez(tmp_path / "other.npz", **walk_parameters(), root_orient=walk_parameters()["poses"][:, :3] + 1)
    assert "not used: root_orient" in analyze(run, tmp_path / "other.npz")["notes"]


def test_what_simulate_reads_besides_is_used(run, tmp_path, standing, lite_body):
    np.savez(
        tmp_path / "named.npz", vertices=standing[None], faces=lite_body.faces, names=np.array(["a"]),
        ground=np.array([0.0, 1.0, 0.0, 0.0]), more=np.zeros(2),
    )  # fmt: skip
    result = run("simulate", tmp_path / "named.npz", "--json", "--tip-only")
    (body,) = strict(result.out)["bodies"]
    assert [note for note in body["notes"] if note.startswith("not used")] == ["not used: more"]


def test_all_betas_that_the_body_has_are_used(run, tmp_path):
    models.smplh(tmp_path / "SMPLH_MALE.npz", betas=16)
    body = ip.load_body(tmp_path / "SMPLH_MALE.npz", num_betas=16, flat_hand_mean=True)
    stored = walk_parameters(3)
    stored["betas"] = np.random.default_rng(0).normal(size=16)
    np.savez(tmp_path / "walk_poses.npz", **{**stored, "gender": "male"})
    found = analyze(run, tmp_path / "walk_poses.npz", "--body", tmp_path / "SMPLH_MALE.npz", "--ground", "0")
    vertices = body(stored["poses"].reshape(3, 52, 3), stored["betas"], stored["trans"]).vertices
    expected = ip.analyze(vertices, body.template, ip.Ground.z_up())
    fewer = ip.analyze(
        body(stored["poses"].reshape(3, 52, 3), stored["betas"][:10], stored["trans"]).vertices, body.template,
        ip.Ground.z_up(),
    )  # fmt: skip
    mass = [frame["mass"] for frame in found["frames"]]
    np.testing.assert_allclose(mass, expected.mass, rtol=1e-5)
    assert (np.abs(fewer.mass - expected.mass) > 0.05).all()
    assert "shape: the file's 16 betas" in found["notes"]
    assert found["flags"] == []
    models.smplh(tmp_path / "SMPLH_F.npz", betas=12)
    found = analyze(run, tmp_path / "walk_poses.npz", "--body", tmp_path / "SMPLH_F.npz")
    assert "shape: the first 12 of 16 betas, as many as SMPLH_F has" in found["notes"]
    assert found["flags"] == [
        "the file's gender is male, and the body model SMPLH_F is female; `model` with the male model"
    ]


@pytest.mark.parametrize("said", [np.array("female"), np.array(b"female"), np.array(["female"]), np.array("F")])
def test_genders_in_files_and_folders(run, tmp_path, said):
    for gender in ("male", "female", "neutral"):
        (tmp_path / gender).mkdir()
        models.smplh(tmp_path / gender / "model.npz")
    np.savez(tmp_path / "walk_poses.npz", **{**walk_parameters(), "gender": said})
    for gender in ("male", "female", "neutral"):
        flags = analyze(run, tmp_path / "walk_poses.npz", "--body", tmp_path / gender / "model.npz")["flags"]
        assert len(flags) == (gender != "female"), flags


def test_expression_is_that_of_the_api(run, tmp_path):
    models.smplx_with_a_face(tmp_path / "SMPLX_NEUTRAL.npz")
    body = ip.load_body(tmp_path / "SMPLX_NEUTRAL.npz")
    expression = np.full((1, 10), 3.0)
    stored = {"global_orient": np.zeros((1, 3)), "body_pose": np.zeros((1, 63)), "betas": np.zeros((1, 10))}
    np.savez(tmp_path / "face.npz", **stored, expression=expression)
    found = analyze(run, tmp_path / "face.npz", "--body", tmp_path / "SMPLX_NEUTRAL.npz", "--ground", "0")
    expected = ip.analyze(body(expression=expression[0]).vertices, body.template, ip.Ground())
    assert found["frames"][0]["mass"] == pytest.approx(float(expected.mass), rel=1e-5)
    assert abs(found["frames"][0]["mass"] - float(ip.analyze(body().vertices, body.template, ip.Ground()).mass)) > 0.05
    assert not [note for note in found["notes"] if "expression" in note]


def test_a_body_of_another_mass(run, tmp_path):
    trimesh.creation.box((1.2, 1.2, 1.2)).export(tmp_path / "box.ply")
    line = refused(run, "analyze", tmp_path / "box.ply")
    assert "a person of 1702 kg; --units UNIT says otherwise (--force: it is right as it is)" in line
    assert analyze(run, tmp_path / "box.ply", "--force")["flags"] == [
        "a person of 1702 kg; `units=UNIT` says otherwise"
    ]


def test_a_frame_of_another_size_among_many_is_marked_without_a_python_warning(run, tmp_path, lite_body, standing):
    frames = np.repeat(standing[None], 5, axis=0)
    frames[3] *= 20
    np.savez(tmp_path / "one.npz", vertices=frames, faces=lite_body.faces)
    for command in ("analyze", "simulate"):
        result = run(command, tmp_path / "one.npz", "--json")
        assert result.code == 0
        (flag,) = json.loads(result.out)["bodies"][0]["flags"]
        assert flag.startswith("vertices: 1 of 5 bodies spans 37.03, expected 0.25 to 3.5 metres")
        assert result.err == f"ipman: warning: {tmp_path / 'one.npz'}: {flag}\n"


@pytest.mark.slow
def test_other_files_go_on(run, mesh, tmp_path):
    files = mesh("good.ply"), mesh("mm.ply", scale=1e3)
    result = run("analyze", *files, "-o", tmp_path / "out")
    assert result.code == 1
    record = report(tmp_path / "out")
    assert [body["name"] for body in record["bodies"]] == ["good"]
    assert "`units='mm'`" in record["failures"][0]["error"]


def test_what_is_odd_about_a_predicted_body(lite_body, standing):
    pytest.importorskip("timm", reason="needs the extra train")
    from ipman_rs.training.predicted_images import body_flags

    assert body_flags("a.jpg", standing, lite_body.template, np.array([0.0, 1.0, 0.0])) == ()
    large = body_flags("a.jpg", 1.7 * standing, lite_body.template, np.array([0.0, 1.0, 0.0]))
    assert large == ("a person of 301.4 kg",)
    assert body_flags("a.jpg", standing, lite_body.template, np.array([0.0, -1.0, 0.0])) == (
        "stands on its head, with its feet in the air",
    )
