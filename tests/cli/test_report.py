"""The report's files: strict JSON, arrays equal to `ip.analyze`, pictures with the paper's colours, harmless names."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs import view
from ipman_rs.files import safe_names
from ipman_rs.study.camera import look_at
from ipman_rs.view import colors
from ipman_rs.view.geometry import pressure_at
from ipman_rs.view.raster import rasterize
from tests.helpers.cli_files import report, walk_parameters


def read_png(path):
    from PIL import Image

    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def count(pixels, color, tolerance=10):
    return int((np.abs(pixels - np.round(colors.rgb(color) * 255)).max(axis=-1) <= tolerance).sum())


@pytest.fixture(scope="module")
def study(lite_body):
    vertices = ip.body.posed(lite_body, "warrior")
    return view.study("warrior", vertices, lite_body.template, ip.Ground())


@pytest.mark.slow
def test_pictures_show_the_body_and_the_paper_colours(study, tmp_path):
    view.draw_picture(study, 0, tmp_path / "a.png")
    view.draw_floor_view(study, 0, tmp_path / "b.png")
    for name in ("a.png", "b.png"):
        pixels = read_png(tmp_path / name)[150:-130]  # without title and legend
        assert min(count(pixels, colors.COM), count(pixels, colors.COP)) > 100
        assert count(pixels, colors.SUPPORT_EDGE, 30) > 300
        heat = np.unique(pixels.reshape(-1, 3), axis=0)
        assert len(heat) > 500
        assert ((heat[:, 0] - heat[:, 1] > 80) & (heat[:, 2] < 140)).sum() > 50  # warm: the feet
    skin = read_png(tmp_path / "a.png")[200:900]
    grey = (np.ptp(skin, axis=-1) < 25) & (skin.max(axis=-1) < 235)
    assert grey.mean() > 0.03


@pytest.mark.slow
def test_the_picture_has_a_body_without_contact_and_one_of_nan(lite_body, standing, tmp_path):
    for shift in (2.0, np.nan):
        odd = view.study("odd", standing + shift, lite_body.template, ip.Ground())
        view.write_report([odd], tmp_path / str(shift))
        frame = report(tmp_path / str(shift))["bodies"][0]["frames"][0]
        assert frame["margin"] is None
        assert frame["polygon"] == []
        assert frame["status"] == (["NON_FINITE"] if np.isnan(shift) else ["NO_CONTACT"])


@pytest.mark.slow
def test_npz_is_what_analyze_gives(lite_body, tmp_path):
    names = ("standing", "tree", "cobra")
    vertices = np.stack([ip.body.posed(lite_body, name) for name in names])
    view.write_report([view.study("three", vertices, lite_body.template, ip.Ground(), labels=names)], tmp_path)
    expected = ip.analyze(vertices, lite_body.template, ip.Ground())
    with np.load(tmp_path / "report.npz", allow_pickle=False) as stored:
        for key in ("pressure", "center_of_mass", "center_of_pressure", "inertia", "part_volumes", "balance", "status"):
            np.testing.assert_array_equal(stored[key], getattr(expected, key), err_msg=key)
        for key in ("margin", "area", "inside", "num_contacts"):
            np.testing.assert_array_equal(stored[key], getattr(expected.base_of_support, key), err_msg=key)
        starts = stored["polygon_start"]
        for t in range(3):
            outline = stored["polygon"][starts[t] : starts[t + 1]]
            np.testing.assert_array_equal(outline, expected.base_of_support.polygon[t])
        corners = stored["vertices"][1][stored["faces"][stored["sample_faces"]]]
        samples = np.einsum("sk,skd->sd", stored["sample_barycentric"], corners)
        np.testing.assert_allclose(samples, ip.sample_surface(vertices[1], lite_body.template), atol=1e-12)
    record = report(tmp_path)
    assert record["bodies"][0]["preset"]["alpha"] == 100
    np.testing.assert_array_equal([f["margin"] for f in record["bodies"][0]["frames"]], expected.base_of_support.margin)
    for kind in ("perspective", "floor"):
        assert sorted(p.name for p in tmp_path.glob(f"{kind}_*.png")) == sorted(f"{kind}_{name}.png" for name in names)


def test_skin_pressure_is_the_core_pressure(study):
    heights = ip.sample_surface(study.vertices[0], study.template)[:, 1]
    np.testing.assert_allclose(pressure_at(heights, 100.0, 10.0), study.pressure[0], rtol=1e-12)
    sunk = ip.pressure(study.vertices[0] - [0, 0.05, 0], study.template, ip.Ground())
    np.testing.assert_allclose(pressure_at(heights - 0.05, 100.0, 10.0), sunk, rtol=1e-9)


@pytest.mark.slow
def test_a_long_sequence_keeps_key_frames_and_all_numbers(run, tmp_path):
    np.savez(tmp_path / "walk.npz", **walk_parameters(70))
    result = run("analyze", tmp_path / "walk.npz", "--body", "anny-lite", "-o", tmp_path / "out")
    assert result.code == 0, result.err
    assert "walk (70 frames)" in result.out
    assert len(report(tmp_path / "out")["bodies"][0]["frames"]) == 70
    with np.load(tmp_path / "out" / "report.npz") as stored:
        assert stored["margin"].shape == (70,)
        keys = stored["key_frames"]
        assert (len(keys), keys[0], keys[-1]) == (48, 0, 69)
        assert stored["pressure"].shape == (48, 20_000)
    timeline = read_png(tmp_path / "out" / "timeline.png")
    assert min(count(timeline, colors.COM), count(timeline, colors.COP), count(timeline, colors.SUPPORT_EDGE)) > 200
    assert {"perspective_00.png", "floor_69.png"} <= {p.name for p in (tmp_path / "out").iterdir()}


@pytest.mark.slow
def test_names_cannot_leave_the_folder_or_the_text(lite_body, standing, tmp_path, monkeypatch):
    names = ["../../up", "<script>alert(1)</script>", "a/b\\c", "", "...", "BODY", "body", "x" * 300, "\x1b[31mred\n"]
    studies = [view.study(n, standing, lite_body.template, ip.Ground(), source=n, notes=[n]) for n in names]
    monkeypatch.setattr("ipman_rs.view.report.draw_picture", lambda study, frame, path: path.write_bytes(b"png"))
    out = tmp_path / "deep" / "out"
    view.write_report(studies, out)
    assert {p.name for p in tmp_path.iterdir()} == {"deep"}
    assert {p.name for p in (tmp_path / "deep").iterdir()} == {"out"}
    assert sum(p.is_dir() for p in out.iterdir()) == len(names)
    html = (out / "report.html").read_text(encoding="utf-8")
    assert "<script>alert(1)" not in html
    assert html.count("<script") == 3
    assert [body["name"] for body in report(out)["bodies"]] == names


def test_safe_names():
    assert safe_names(["a b", "a_b", "A_B", "../x", "é"]) == ["a_b", "a_b_2", "A_B_3", "x", "body"]


@pytest.mark.slow
def test_hostile_file_names(run, tmp_path, lite_body, standing):
    folder = tmp_path / "in"
    folder.mkdir()
    path = folder / "<script>alert(1)<.npz"
    np.savez(path, vertices=standing, faces=lite_body.faces)
    result = run("analyze", path, folder / "[red]bad[/red]\n.obj", "-o", tmp_path / "out")
    assert result.code == 1
    assert len(result.err.strip().splitlines()) == 1
    assert "<script>alert(1)" in result.out
    assert "<script>alert" not in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_demo(run, tmp_path, monkeypatch):
    """The whole command with two poses of the light body: all poses take half a minute to draw."""
    monkeypatch.setattr(ip.body.poses, "NAMES", ("tree", "lean_past_toes"))
    load = ip.load_body
    monkeypatch.setattr(ip, "load_body", lambda name: load("anny-lite"))
    result = run("demo", "-o", tmp_path)
    assert result.code == 0, result.err
    assert "lean_past_toes" in result.out
    assert "report.html" in result.out
    frames = report(tmp_path)["bodies"][0]["frames"]
    assert [(f["label"], f["bose"]) for f in frames] == [("tree", True), ("lean_past_toes", False)]
    assert {"perspective_tree.png", "floor_tree.png", "report.npz", "report.html"} <= set(os.listdir(tmp_path))


@pytest.mark.slow
def test_help_needs_no_heavy_imports():
    script = "import sys\ntry:\n import ipman_rs.cli as c; c.main(['{}'])\nexcept SystemExit: pass\n"
    script += "print([m for m in ('matplotlib', 'trimesh', 'scipy', 'rich', 'jinja2', 'torch') if m in sys.modules])"
    for option, said in (("--help", "ipman demo -o"), ("--version", f"ipman {ip.__version__}")):
        done = subprocess.run([sys.executable, "-c", script.format(option)], capture_output=True, text=True, check=True)
        assert said in done.stdout
        assert done.stdout.strip().splitlines()[-1] == "[]"


def test_rasterize_covers_a_square_and_keeps_the_nearest():
    square = np.array([[[2, 2], [8, 2], [8, 8]], [[2, 2], [8, 8], [2, 8]]], float)
    corners = np.concatenate([square, square + 3])
    near = np.array([1.0, 1.0, 2.0, 2.0])[:, None] * np.ones((1, 3))
    image, covered = rasterize(corners, near, near[..., None], 12, 11)
    assert covered.sum() == 36 + 36 - 9
    np.testing.assert_allclose(image[5:8, 5:8, 0], 2)
    np.testing.assert_allclose(image[2:5, 2:8, 0], 1)


def test_the_camera_just_fits_its_points(rng):
    points = rng.normal(size=(200, 3)) * [1, 2, 0.5]
    pixels, distance = look_at(points, np.array([0.0, 0, 1]), (100, 50, 900, 650)).pixels(points)
    assert (distance > 0).all()
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    assert (low >= [100 - 1e-6, 50 - 1e-6]).all()
    assert (high <= [900 + 1e-6, 650 + 1e-6]).all()
    # One of the two directions is filled to its edges.
    np.testing.assert_allclose(((high - low) / [800, 600]).max(), 1.0, atol=1e-6)
