"""`ipman fit` on keypoints of bodies whose poses are known, and on inputs that are not what they should be."""

from __future__ import annotations

import importlib.util
import json
import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

import ipman_rs as ip
from ipman_rs.cli import main
from ipman_rs.data import keypoints
from ipman_rs.fitting import camera_file, detection_problem
from tests.helpers import keypoint_files as files


@pytest.fixture(scope="module")
def standing():
    return files.seen("standing")


@pytest.fixture
def fit(tmp_path):
    """`fit(path, ...)` into tmp_path/out with a preset of few iterations: exit code, stdout, stderr, and the report."""
    (tmp_path / "quick.yaml").write_text(files.QUICK)
    out = tmp_path / "out"

    def call(*arguments, preset=tmp_path / "quick.yaml", pictures=0):
        words = ["fit", *map(str, arguments), "-o", str(out), "--preset", str(preset), "--pictures", str(pictures)]
        result = CliRunner().invoke(main, words)
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        page = out / "report.json"
        report = json.loads(page.read_text()) if page.is_file() else {"bodies": [], "failures": []}
        flags = {body["name"]: body["flags"] for body in report["bodies"] if "fit" in body}
        return SimpleNamespace(
            code=result.exit_code, out=result.stdout, err=result.stderr, folder=out, report=report, flags=flags
        )

    return call


def arrays(path):
    with np.load(path, allow_pickle=False) as stored:
        return dict(stored)


@pytest.mark.slow
def test_a_standing_body(fit, tmp_path, standing):
    said = fit(files.write(tmp_path / "anna.json", standing), preset="fast", pictures=1)
    assert said.code == 0, said.err
    assert sorted(path.name for path in (said.folder / "anna").iterdir()) == [
        "anna.glb", "anna.npz", "before_after.png", "fit.json", "floor.png", "overlay.png", "report.npz", "side.png",
    ]  # fmt: skip
    (body,) = said.report["bodies"]
    # The points are the body's own, but priors pull at them.
    assert body["fit"]["reprojection"]["median_percent"] < 1.0
    assert body["flags"] == body["fit"]["flags"] == []
    assert [stage["name"] for stage in body["fit"]["stages"]] == [
        "coarse", "pose", "weigh", "physics", "settle",
    ]  # fmt: skip
    frame = body["frames"][0]
    assert frame["inside"]
    assert abs(frame["lowest"]) < 0.02
    page = (said.folder / "report.html").read_text()
    assert page.count("data:image/jpeg;base64,") == 3


def test_terms_by_iteration_end_with_the_terms(fit, tmp_path, standing):
    fit(files.write(tmp_path / "anna.json", standing))
    record = json.loads((tmp_path / "out" / "anna" / "fit.json").read_text())
    for stage in record["stages"]:
        assert {name: costs[-1] for name, costs in stage["trace"].items()} == pytest.approx(stage["terms"], rel=1e-12)
        total = np.sum(list(stage["trace"].values()), axis=0)
        assert (np.diff(total) < 0).all()


def test_parameters_are_those_of_the_mesh(fit, tmp_path, standing):
    import trimesh

    folder = fit(files.write(tmp_path / "anna.json", standing), "--obj").folder / "anna"
    stored = arrays(folder / "anna.npz")
    assert stored["global_orient"].shape == (1, 3)
    assert stored["body_pose"].shape == (1, 69)
    body = ip.load_body(str(stored["model"]))
    pose = np.concatenate([stored["global_orient"], stored["body_pose"]], axis=1).reshape(-1, 3)
    vertices = body(pose, stored["betas"][0], stored["transl"][0]).vertices
    for ending in ("obj", "glb"):
        mesh = trimesh.load(folder / f"anna.{ending}", process=False, force="mesh")
        # .obj is written with 8 digits, .glb in single precision
        np.testing.assert_allclose(mesh.vertices, vertices, atol=1e-6)
    points = vertices @ stored["camera_rotation"][0].T + stored["camera_translation"][0]
    assert (points[:, 2] > 1).all()
    pixels = stored["focal"][0] * points[:, :2] / points[:, 2:] + stored["center"][0]
    shown = stored["keypoints"][0]
    assert (pixels.min(axis=0) - 20 < shown[:, :2].min(axis=0)).all()
    assert (pixels.max(axis=0) + 20 > shown[:, :2].max(axis=0)).all()


def test_analyze_reads_the_parameters(fit, tmp_path, standing):
    said = fit(files.write(tmp_path / "anna.json", standing))
    result = CliRunner().invoke(main, ["analyze", str(said.folder / "anna" / "anna.npz"), "--json"])
    assert result.exit_code == 0, result.stderr
    (again,) = json.loads(result.stdout)["bodies"]
    assert again["template"]["vertices"] == 1229
    assert again["frames"][0]["volume"] == pytest.approx(said.report["bodies"][0]["frames"][0]["volume"], rel=1e-5)


@pytest.mark.slow
def test_bad_items_leave_the_others_as_they_are(fit, tmp_path, standing):
    alone = fit(files.write(tmp_path / "good.json", standing))
    expected = (alone.folder / "good" / "good.npz").read_bytes()
    folder = tmp_path / "inputs"
    folder.mkdir()
    files.write(folder / "good.json", standing)
    files.write(folder / "nan.json", np.where(np.arange(132).reshape(33, 4) == 13, np.nan, standing))
    files.write(folder / "zero.json", standing * [1, 1, 1, 0])
    files.write(folder / "nobody.json", np.zeros((0, 4)))
    files.write(folder / "few.json", np.where(np.arange(33)[:, None] < 29, standing * [1, 1, 1, 0], standing))
    (folder / "corrupt.json").write_text('{"landmarks": [[0.1,')
    (folder / "other.json").write_text("[1, 2]")
    (folder / "pixel.png").write_bytes(one_pixel())
    files.write(folder / "turned.json", np.column_stack([standing[:, 0], 1 - standing[:, 1], standing[:, 2:]]))

    said = fit(folder)
    assert said.code == 1
    assert (said.folder / "good" / "good.npz").read_bytes() == expected
    failures = {entry["file"].rsplit("/", 1)[1].split(".")[0]: entry["error"] for entry in said.report["failures"]}
    assert sorted(failures) == ["corrupt", "few", "nan", "nobody", "other", "pixel", "zero"]
    assert "expected finite numbers" in failures["nan"]
    assert "confidence above 0" in failures["zero"]
    assert "expected a person" in failures["nobody"]
    assert "only 4 of" in failures["few"]
    assert "is no JSON" in failures["corrupt"]
    assert "one of the formats" in failures["other"]
    assert "at least 32" in failures["pixel"] or "ipman_rs[photo]" in failures["pixel"]
    assert any("upside-down" in flag for flag in said.flags["turned"])
    for name in failures:
        assert name in said.err


def one_pixel() -> bytes:
    import io

    from PIL import Image

    stream = io.BytesIO()
    Image.new("RGB", (1, 1)).save(stream, "PNG")
    return stream.getvalue()


def test_when_all_fail_there_is_no_report(fit, tmp_path):
    (tmp_path / "corrupt.json").write_text("{")
    said = fit(tmp_path / "corrupt.json", tmp_path / "absent.json")
    assert said.code == 1
    assert "is no JSON" in said.err
    assert "there is no such file" in said.err
    assert not said.report["bodies"]


def test_left_and_right_swapped(fit, tmp_path, standing):
    swapped = standing.copy()
    swapped[[11, 12]] = standing[[12, 11]]  # the shoulders alone
    said = fit(files.write(tmp_path / "swapped.json", swapped))
    assert any("swapped" in flag for flag in said.flags["swapped"])


def test_x_and_y_swapped(standing):
    """What stands in an image lies in it with its coordinates swapped."""
    names = keypoints.mediapipe.NAMES
    known = [column for column, name in enumerate(names) if name]
    points, size = standing[known, :2] * [1920, 1080], np.array([1920, 1080])
    seen = [str(names[column]) for column in known], standing[known, 3]
    right, swapped = (
        detection_problem.keypoint_flags(seen[0], each, seen[1], size[::way])
        for each, way in ((points, 1), (points[:, ::-1], -1))
    )
    said = "lies across the image, head beside feet: are x and y of the keypoints swapped?"
    assert said not in right
    assert said in swapped


def test_half_of_the_points(fit, tmp_path, standing):
    half = standing.copy()
    half[23:, 3] = 0  # nothing below the hips
    said = fit(files.write(tmp_path / "half.json", half))
    assert said.code == 0
    assert any("no foot was seen" in flag for flag in said.flags["half"])


@pytest.mark.parametrize("option", [("--ground", "3"), ("--focal", "1e9")])
def test_scenes_that_cannot_be(fit, tmp_path, standing, option):
    """A floor above the body, and a camera kilometres away: a body, finite, and a word of warning."""
    said = fit(files.write(tmp_path / "anna.json", standing), *option)
    assert said.code == 0, said.err
    assert said.flags["anna"]
    stored = arrays(said.folder / "anna" / "anna.npz")
    assert all(np.isfinite(value).all() for value in stored.values() if value.dtype.kind == "f")


@pytest.mark.slow
def test_image_of_one_pixel(fit, tmp_path, standing):
    said = fit(files.write(tmp_path / "tiny.json", standing, (1, 1)), pictures=1)
    assert said.code == 0
    assert (said.folder / "tiny" / "overlay.png").is_file()


@pytest.mark.slow
def test_resume(fit, tmp_path, standing):
    files.write(tmp_path / "a.json", standing)
    files.write(tmp_path / "b.json", files.seen("tree"))
    inputs = (tmp_path / "a.json", tmp_path / "b.json", "--resume")
    first = fit(*inputs)
    kept = {name: first.folder / name / f"{name}.npz" for name in "ab"}
    content = {name: path.read_bytes() for name, path in kept.items()}
    stamps = {name: path.stat().st_mtime_ns for name, path in kept.items()}

    said = (first.folder / "report.json").read_bytes()
    fit(*inputs)
    assert (first.folder / "report.json").read_bytes() == said  # of bodies that were read back
    assert {name: path.stat().st_mtime_ns for name, path in kept.items()} == stamps

    (first.folder / "b" / "b.glb").unlink()
    fit(*inputs)
    assert kept["a"].stat().st_mtime_ns == stamps["a"]
    assert kept["b"].stat().st_mtime_ns != stamps["b"]
    assert kept["b"].read_bytes() == content["b"]
    assert (first.folder / "b" / "b.glb").is_file()

    fit(*inputs, "--focal", "900")  # other options: nothing is kept
    assert kept["a"].stat().st_mtime_ns != stamps["a"]


def bodies(said):
    return {body["name"]: body for body in said.report["bodies"]}


def test_equal_names_get_folders_of_their_own(fit, tmp_path, standing):
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        files.write(tmp_path / name / "anna.json", standing)
    said = fit(tmp_path / "one", tmp_path / "two" / "anna.json")
    assert [body["name"] for body in said.report["bodies"]] == ["anna", "anna_2"]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--preset", "nonsense"), "expected one of"),
        (("--preset", "balanced"), "give its name or file with --pose"),
        (("--preset", "balanced", "--pose", "standing"), "give --height or --mass"),
        (("--body", "nobody"), "nobody"),
        (("--camera-pitch", "95"), "pitch"),
        (("--focal", "-1"), "focal"),
        (("--focal", "nan"), "focal"),
        (("--height", "0"), "height"),
        (("--ground", "floor"), "neither a height in metres nor found"),
        (("--image-size", "wide"), "1920x1080"),
        (("--image", "absent.png"), "absent.png"),
        (("--pose", "nonsense"), "no pose 'nonsense'"),
    ],
)
def test_wrong_usage(tmp_path, standing, options, says):
    path = files.write(tmp_path / "anna.json", standing)
    words = ["fit", str(path), "-o", str(tmp_path / "out"), *options]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == (1 if "--image" in options else 2), result.output
    assert says in result.stderr


def test_a_file_without_image_size(fit, tmp_path, standing):
    people = {"people": [{"pose_keypoints_2d": np.tile([100.0, 100.0, 1.0], 25).tolist()}]}
    (tmp_path / "open.json").write_text(json.dumps(people))
    said = fit(tmp_path / "open.json")
    assert said.code == 1
    assert "--image-size" in said.err


def openpose(landmarks, scale=1.0):
    """OpenPose's 25 points of MediaPipe's, relative to the image times `scale`."""
    from ipman_rs.data.keypoints import mediapipe
    from ipman_rs.data.keypoints.openpose import BODY_25

    places = dict(zip(mediapipe.NAMES, landmarks[:, [0, 1, 3]], strict=True))
    points = np.array([places.get(name, np.zeros(3)) for name in BODY_25]) * [*np.broadcast_to(scale, 2), 1]
    return {"pose_keypoints_2d": points.ravel().tolist()}


def test_points_relative_to_the_image(fit, tmp_path, standing):
    (tmp_path / "scale3.json").write_text(json.dumps({"people": [openpose(standing)]}))
    (tmp_path / "pixels.json").write_text(json.dumps({"people": [openpose(standing, files.SIZE)]}))
    said = fit(tmp_path / "scale3.json")
    assert said.code == 1
    assert "look relative to the image and need it, got none; give --image-size WIDTHxHEIGHT" in said.err
    said = fit(tmp_path / "scale3.json", tmp_path / "pixels.json", "--image-size", "480x640")
    assert said.code == 0, said.err
    relative, pixels = (body["fit"] for body in said.report["bodies"])
    assert "look relative to the image: taken as 0 to 1 of its 480 × 640 pixels" in relative["notes"][0]
    assert pixels["notes"] == []
    # The same points up to the sixteenth digit, and so nearly the same body.
    assert relative["reprojection"]["median_px"] == pytest.approx(pixels["reprojection"]["median_px"], rel=1e-3)


def test_points_of_another_image_size(fit, tmp_path, standing):
    (tmp_path / "large.json").write_text(json.dumps({"people": [openpose(standing, np.multiply(files.SIZE, 4))]}))
    options = ("--image-size", "480x640")
    said = fit(tmp_path / "large.json", *options)
    assert said.code == 1
    assert "points lie outside the image of 480 × 640 pixels" in said.err
    assert "is that its size? (--image-size WxH) (--force: it is right as it is)" in said.err
    said = fit(tmp_path / "large.json", *options, "--force")
    assert any("lie outside the image of 480 × 640" in flag for flag in said.report["bodies"][0]["flags"])


@pytest.mark.slow
def test_a_photo_of_another_size(fit, tmp_path, standing):
    from PIL import Image

    Image.new("RGB", (96, 128)).save(tmp_path / "small.png")
    path = files.write(tmp_path / "anna.json", standing)
    photo = ("--image", tmp_path / "small.png")
    notes = fit(path, *photo).report["bodies"][0]["fit"]["notes"]
    assert "the file says that its image has 480 × 640 pixels; 96 × 128 were given" in notes[0]
    notes = fit(path, *photo, "--image-size", "480x640").report["bodies"][0]["fit"]["notes"]
    assert "the photo has 96 × 128 pixels, `image_size` says 480 × 640" in notes[0]


@pytest.mark.slow
def test_a_video_of_mmpose(fit, tmp_path, standing):
    """Three frames, of which the second shows nobody: two bodies, or one over time."""
    from ipman_rs.data.keypoints import coco, mediapipe

    places = dict(zip(mediapipe.NAMES, standing[:, :2] * files.SIZE, strict=True))
    points = [list(places[name]) for name in coco.NAMES]
    frames = [{"frame_id": n, "instances": [{"keypoints": points, "keypoint_scores": [5.0] * 17}]} for n in range(3)]
    frames[1]["instances"] = []
    (tmp_path / "video.json").write_text(json.dumps(frames))
    said = fit(tmp_path / "video.json", "--image-size", "480x640")
    assert said.code == 0, said.err
    notes = {body["name"]: body["fit"]["notes"] for body in said.report["bodies"]}
    assert sorted(notes) == ["video_0", "video_1"]
    for what in ("scores up to 5", "1 of 3 images left out", "`sequence` fits one person over time"):
        assert any(what in note for note in notes["video_0"])
    assert notes["video_1"] == []  # of the file, and said once
    over_time = fit(tmp_path / "video.json", "--image-size", "480x640", "--sequence")
    assert over_time.code == 0, over_time.err
    (body,) = over_time.report["bodies"]
    assert body["frames"][-1]["frame"] == 1
    assert any("1 of 3 images left out" in note for note in body["notes"])


@pytest.mark.slow
def test_mirrored_points_and_a_camera_of_another_image_are_flagged(fit, tmp_path, standing):
    mirrored = standing * [-1, 1, 1, 1] + [1, 0, 0, 0]
    (tmp_path / "camera.json").write_text(json.dumps({"K": [[800, 0, 960], [0, 800, 540], [0, 0, 1]]}))
    paths = files.write(tmp_path / "plain.json", standing), files.write(tmp_path / "mirrored.json", mirrored)
    flags = fit(*paths).flags
    assert not any("mirrored" in flag for flag in flags["plain"])
    assert any("are the points mirrored" in flag for flag in flags["mirrored"])
    flags = fit(paths[0], "--camera", tmp_path / "camera.json").flags
    assert any("is the camera of another image size?" in flag for flag in flags["plain"])


def test_without_torch(tmp_path, standing, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "torch" else object())
    result = CliRunner().invoke(main, ["fit", "x.json", "-o", str(tmp_path)])
    assert result.exit_code == 1
    assert "pip install 'ipman_rs[fit]'" in result.stderr


@pytest.mark.slow
def test_a_known_camera(fit, tmp_path, standing):
    """The same scene told as one camera in a turned and moved world: the body is the same, where the world says."""
    c, s = math.cos(0.4), math.sin(0.4)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])  # of the world about its upward axis
    rotation, translation = np.diag([1.0, -1.0, -1.0]) @ turn.T, np.array([0.3, 1.2, 0.5])
    content = {"R": rotation.tolist(), "t": translation.tolist(), "K": [[800, 0, 240], [0, 800, 320], [0, 0, 1]]}
    camera = tmp_path / "camera.json"
    camera.write_text(json.dumps(content))
    anna = files.write(tmp_path / "anna.json", standing)
    plain = arrays(fit(anna, "--focal", "800").folder / "anna" / "anna.npz")
    known = arrays(fit(anna, "--camera", str(camera)).folder / "anna" / "anna.npz")
    np.testing.assert_allclose(known["focal"][0], [800, 800])
    # A few iterations, whose damping knows the world's axes, end somewhat apart.
    np.testing.assert_allclose(known["projected"], plain["projected"], atol=2)
    np.testing.assert_allclose(known["body_pose"], plain["body_pose"], atol=0.03)

    def seen(stored):
        place = stored["transl"][0] + ip.load_body("anny-lite").forward().joints[0]  # the root, at about mean shape
        return stored["camera_rotation"][0] @ place + stored["camera_translation"][0]

    np.testing.assert_allclose(seen(known), seen(plain), atol=0.05)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("no json", "is no JSON"),
        ('{"eye": 3}', "expected an object with some of R, t"),
        ('{"R": [1, 2, 3]}', "R: expected 3 × 3 finite numbers"),
        ('{"R": [[2, 0, 0], [0, 1, 0], [0, 0, 1]]}', "R: expected a rotation"),
        ('{"focal": -3}', "focal: expected positive pixels"),
        ('{"t": [0, 0, NaN]}', "t: expected 3 finite numbers"),
    ],
)
def test_what_is_no_camera(tmp_path, content, says):
    path = tmp_path / "camera.json"
    path.write_text(content)
    with pytest.raises(ValueError, match=re.escape(says)):
        camera_file.read(path)


def test_focal_length_is_the_diagonal(fit, tmp_path, standing):
    said = fit(files.write(tmp_path / "anna.json", standing))
    assert arrays(said.folder / "anna" / "anna.npz")["focal"][0] == pytest.approx([math.hypot(*files.SIZE)] * 2)


@pytest.mark.slow
def test_frames_of_one_person(fit, tmp_path):
    """A sequence has one shape, its poses over time in one file, and leaves out a frame that cannot be read."""
    folder = tmp_path / "walk"
    folder.mkdir()
    for frame in range(4):
        files.write(folder / f"{frame}.json", files.seen("standing", depth=4.0 + 0.02 * frame))
    (folder / "9.json").write_text("{broken")
    said = fit(folder, "--sequence", "--fps", "10")
    assert said.code == 1  # for the broken file
    stored = arrays(said.folder / "walk" / "walk.npz")
    assert stored["body_pose"].shape == (4, 69)
    assert stored["betas"].shape == (1, 10)
    assert stored["mocap_frame_rate"] == 10
    steps = np.diff(stored["transl"][:, 2])
    np.testing.assert_allclose(steps, -0.02, atol=0.01)  # away from the camera
    record = json.loads((said.folder / "walk" / "fit.json").read_text())
    assert record["median_error_px"] < 3
    before = (said.folder / "walk" / "fit.json").stat().st_mtime_ns
    fit(folder, "--sequence", "--fps", "10", "--resume")
    assert (said.folder / "walk" / "fit.json").stat().st_mtime_ns == before


@pytest.mark.slow
def test_markers(fit, shared):
    said = fit(shared("gait2354") / "subject01_static.trc", "--every", "100", preset="markers")
    assert said.code == 0
    record = json.loads((said.folder / "subject01_static" / "fit.json").read_text())
    assert record["mean_marker_error_m"] < 0.02
    stored = arrays(said.folder / "subject01_static" / "subject01_static.npz")
    assert len(stored["transl"]) == len(stored["body_pose"])


@pytest.mark.slow
def test_all_people_of_an_image(fit, tmp_path, standing):
    """A row each, with one pitch of the camera for all; without --people all the most visible one alone."""
    from ipman_rs.data.keypoints import coco, mediapipe

    places = dict(zip(mediapipe.NAMES, standing[:, :2] * files.SIZE, strict=True))
    points = np.array([places[name] for name in coco.NAMES])
    people = [
        {"keypoints": (points * [1, 1] + [shift, 0]).tolist(), "keypoint_scores": [0.9 - 0.1 * number] * 17}
        for number, shift in enumerate((-100.0, 100.0))
    ]
    path = tmp_path / "two.json"
    path.write_text(json.dumps([{"frame_id": 0, "instances": people}]))
    said = fit(path, "--image-size", "480x640", "--people", "all", preset="fast")
    assert said.code == 0, said.err
    assert [body["name"] for body in said.report["bodies"]] == ["two_0", "two_1"]
    one, other = (
        json.loads((said.folder / name / "fit.json").read_text())["confidence"] for name in ("two_0", "two_1")
    )
    assert one["camera_pitch"] == other["camera_pitch"]
    assert [body["name"] for body in fit(path, "--image-size", "480x640").report["bodies"]] == ["two"]
    refused = fit(path, "--image-size", "480x640", "--people", "all", "--person", "0")
    assert refused.code == 2
    assert "goes neither with --person" in refused.err
