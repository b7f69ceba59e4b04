"""The centres of mass on one body, and the centre of pressure of binary contact."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import ipman_rs as ip

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def named(lite):
    return np.stack([ip.body.posed(lite, name) for name in ("tree", "walking", "plank")])


def test_binary_contact_is_the_mean_of_the_touching_samples(named, lite):
    found = ip.binary_center_of_pressure(named, lite.template, ip.Ground.y_up(0.01), 0.03)
    for body, center in zip(named, found, strict=True):
        samples = lite.template.regressor() @ body
        near = samples[np.abs(samples[:, 1] - 0.01) < 0.03]
        np.testing.assert_allclose(center, near.sum(axis=0) / len(near), atol=1e-6)


def test_binary_contact_of_a_box_is_the_middle_of_its_bottom():
    box = trimesh.creation.box((0.4, 0.6, 0.2))
    template = ip.BodyTemplate(box.vertices, box.faces)
    vertices = np.asarray(box.vertices) + (1.0, 0.3, -2.0)
    found = ip.binary_center_of_pressure(vertices, template, ip.Ground.y_up(), 1e-6)
    # 1,500 or more samples, of a spread of 0.4/√12 m: three standard errors.
    np.testing.assert_allclose(found, (1.0, 0.0, -2.0), atol=0.01)


def test_binary_centers_beyond_double_precision_are_infinite(recwarn):
    """The sum of the contacts' x overflows; y and z, which are finite, stay right, and nothing warns."""
    box = trimesh.creation.box((0.4, 0.6, 0.2))
    template = ip.BodyTemplate(box.vertices, box.faces)
    vertices = np.asarray(box.vertices) + (0.0, 0.3, 0.0)
    vertices[:, 0] = 1e308
    found = ip.binary_center_of_pressure(vertices, template, ip.Ground.y_up(), 1e-6)
    assert np.isposinf(found[0])
    assert np.isfinite(found[1:]).all()
    assert not recwarn


def test_binary_contact_in_any_batch(named, lite):
    ground = ip.Ground.y_up()
    together = ip.binary_center_of_pressure(named, lite.template, ground)
    alone = [ip.binary_center_of_pressure(body, lite.template, ground) for body in named]
    assert np.array_equal(together, alone)
    assert ip.binary_center_of_pressure(named[:0], lite.template, ground).shape == (0, 3)
    heights = ip.Ground((0, 1, 0), [0.0, 0.0, -5.0])
    found = ip.binary_center_of_pressure(named, lite.template, heights)
    assert np.array_equal(found[:2], together[:2])
    assert np.isnan(found[2]).all()  # in the air
    with pytest.raises(ValueError, match="threshold"):
        ip.binary_center_of_pressure(named, lite.template, ground, 0.0)


def test_a_named_pose(figure, lite, contents):
    said = figure("com", "warrior", "--body", "anny-lite")
    assert said.code == 0, said.err
    body, ground = ip.body.posed(lite, "warrior"), ip.Ground.y_up()
    about = said.numbers["centers_of_mass"]
    assert set(about) == {"pcom", "vertex_mean", "sample_mean", "face_area", "exact"}
    exact = ip.center_of_mass(body, lite.template, "exact")
    pressure = ip.center_of_pressure(body, lite.template, ground)
    for method, each in about.items():
        center = ip.center_of_mass(body, lite.template, method)
        np.testing.assert_allclose(each["position"], center, atol=1e-6)
        assert each["height_m"] == pytest.approx(float(center[1]), abs=1e-6)
        assert each["to_exact_m"] == pytest.approx(float(np.linalg.norm(center - exact)), abs=1e-6)
        aside = np.hypot(*(center - pressure)[[0, 2]])
        assert each["to_center_of_pressure_on_ground_m"] == pytest.approx(float(aside), abs=1e-6)
    binary = ip.binary_center_of_pressure(body, lite.template, ground)
    np.testing.assert_allclose(said.numbers["binary_center_of_pressure"], binary, atol=1e-6)
    again = figure("com", "warrior", "--body", "anny-lite", out="again")
    assert contents(said.folder) == contents(again.folder)


def test_a_body_in_the_air(figure, lite, tmp_path):
    np.savez(tmp_path / "jump.npz", vertices=ip.body.posed(lite, "standing"), faces=lite.faces)
    said = figure("com", tmp_path / "jump.npz", "--body", "anny-lite", "--ground", -1)
    assert said.code == 0, said.err
    assert said.numbers["binary_center_of_pressure"] == [None, None, None]
    assert said.numbers["margin_m"] is None
    assert "–" in said.out


def test_a_body_in_millimetres(figure, lite, tmp_path):
    np.savez(tmp_path / "mm.npz", vertices=1000 * ip.body.posed(lite, "standing"), faces=lite.faces)
    said = figure("com", tmp_path / "mm.npz", "--body", "anny-lite")
    assert (said.code, said.err.count("\n")) == (1, 1)
    assert "looks like millimetres" in said.err
    assert "--units mm" in said.err
    assert figure("com", tmp_path / "mm.npz", "--body", "anny-lite", "--units", "mm").code == 0


@pytest.mark.parametrize(
    ("body", "more", "code", "words"),
    [
        ("nonsense", (), 2, "warrior"),
        ("nothing.obj", (), 1, "nothing.obj: there is no such file"),
        ("two.npz", ("--frame", 2), 2, "has 2 frames"),
        ("plank", ("--frame", 4), 2, "--frame: is for files; plank is a named pose"),
        ("plank", ("--up", "z"), 2, "--up: is for files"),
        ("plank", ("--parts", "parts.json"), 2, "--parts: is for files"),
        ("two.npz", ("--frame", 1), 1, "finite"),
    ],
)
def test_bad_input(body, more, code, words, figure, lite, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    vertices = np.stack([ip.body.posed(lite, "standing")] * 2)
    vertices[1, 7] = np.nan
    np.savez("two.npz", vertices=vertices, faces=lite.faces)
    said = figure("com", body, "--body", "anny-lite", *more)
    assert said.code == code
    assert words in said.err
    assert "Traceback" not in said.err
