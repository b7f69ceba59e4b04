"""Meshes of every form through the command line: what a user of `ipman analyze` and `ipman simulate` sees.

The golden figures are trimesh's, of the body before it was written in another form.
"""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

from tests.helpers import gltf_files
from tests.helpers.cli_files import strict


def analyze(run, *arguments):
    result = run("analyze", *arguments, "--json")
    assert result.code == 0, result.err
    return strict(result.out)["bodies"]


def obj(vertices, faces) -> str:
    return "\n".join([f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {a} {b} {c}" for a, b, c in faces + 1])


def frames(body):
    """Without the label, which is the file's name."""
    return [{name: value for name, value in frame.items() if name != "label"} for frame in body["frames"]]


def stray(standing):
    return np.concatenate([standing, [[0.3, -0.4, 0.0]]])


@pytest.mark.slow
def test_a_loose_vertex_is_no_part_of_the_body(run, tmp_path, lite_body, standing):
    """0.4 m below the soles: the ground stays at them, and the body's ten parts are still known."""
    for name, vertices in (("whole", standing), ("stray", stray(standing))):
        (tmp_path / f"{name}.obj").write_text(obj(vertices, lite_body.faces))
        np.savez(tmp_path / f"{name}.npz", vertices=vertices, faces=lite_body.faces)
        np.savez(tmp_path / f"{name}_walk.npz", vertices=np.stack([vertices, vertices]), faces=lite_body.faces)
    for ending in (".obj", ".npz", "_walk.npz"):
        (whole,), (body,) = (analyze(run, tmp_path / f"{name}{ending}") for name in ("whole", "stray"))
        assert frames(body) == frames(whole)
        assert body["template"] == whole["template"]
        assert len(body["template"]["parts"]) == 10
        assert body["notes"][0] == "1 vertex that no face uses left out"
    fallen = {}
    for name in ("stray", "whole"):
        done = run("simulate", tmp_path / f"{name}.obj", "-o", tmp_path / name)
        assert done.code == 0, done.err
        assert ("1 vertex that no face uses left out" in done.out) == (name == "stray")
        (body,) = strict((tmp_path / name / "simulation.json").read_text(encoding="utf-8"))["bodies"]
        fallen[name] = [frame["stands"] for frame in frames(body)], [frame["margin"] for frame in frames(body)]
    assert fallen["stray"] == fallen["whole"]


@pytest.mark.parametrize("by", ["vertices", "faces"])
def test_parts_count_the_vertices_and_faces_of_the_file(run, tmp_path, lite_body, standing, by):
    """A loose vertex and a flat face before all others; the mesh is no known body's, since its faces are turned."""
    turned = lite_body.faces[::-1]
    points = np.concatenate([[[0.3, -0.4, 0.0]], standing])
    (tmp_path / "a.obj").write_text(obj(points, np.concatenate([[[1, 1, 2]], turned + 1])))
    (tmp_path / "plain.obj").write_text(obj(standing, turned))
    low = standing[:, 1] < 0.8
    parts, plain = tmp_path / "parts.json", tmp_path / "plain.json"
    if by == "vertices":
        parts.write_text(json.dumps({"low": [0, *(np.flatnonzero(low) + 1).tolist()]}))
        plain.write_text(json.dumps({"low": np.flatnonzero(low).tolist()}))
    else:
        labels = low[turned].all(axis=1).astype(int).tolist()
        parts.write_text(json.dumps([0, *labels]))
        plain.write_text(json.dumps(labels))
    (body,) = analyze(run, tmp_path / "a.obj", "--parts", parts)
    (expected,) = analyze(run, tmp_path / "plain.obj", "--parts", plain)
    assert frames(body) == frames(expected)


def test_forms_of_one_body_agree(run, tmp_path, lite_body, standing):
    """As a soup, grown by a morph target, and laid down by a skin."""
    whole = trimesh.Trimesh(standing, lite_body.faces, process=False)
    rng = np.random.default_rng(2)
    soup = trimesh.Trimesh((whole.triangles + rng.uniform(-1e-7, 1e-7, (2454, 3, 3))).reshape(-1, 3),
                           np.arange(3 * 2454).reshape(-1, 3), process=False)  # fmt: skip
    soup.export(tmp_path / "soup.stl")
    morphed = gltf_files.of(standing, lite_body.faces)
    grown = whole.vertex_normals * 0.01
    target = {"POSITION": morphed.array(grown)}
    morphed.json["meshes"][0]["primitives"][0]["targets"] = [target]
    morphed.json["meshes"][0]["weights"] = [1.0]
    (tmp_path / "morphed.glb").write_bytes(morphed.glb())
    lying = gltf_files.of(standing, lite_body.faces, {"skin": 0, "translation": [0, 5, 0]})
    lying.json["nodes"].append({"rotation": [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]})
    lying.json["skins"] = [{"joints": [1]}]
    attributes = lying.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["JOINTS_0"] = lying.array(np.zeros((1229, 4)), "B")
    attributes["WEIGHTS_0"] = lying.array(np.tile([255, 0, 0, 0], (1229, 1)), "B", normalized=True)
    (tmp_path / "lying.glb").write_bytes(lying.glb())
    volumes = {}
    for name in ("soup.stl", "morphed.glb", "lying.glb"):
        (body,) = analyze(run, tmp_path / name, "--up", "y")
        assert body["template"]["watertight"]
        volumes[name] = body["frames"][0]["volume"]
    np.testing.assert_allclose(volumes["soup.stl"], whole.volume, rtol=1e-5)
    grown = trimesh.Trimesh(standing + grown, lite_body.faces, process=False)
    np.testing.assert_allclose(volumes["morphed.glb"], grown.volume, rtol=1e-6)
    np.testing.assert_allclose(volumes["lying.glb"], whole.volume, rtol=1e-6)
    x, y, z = whole.center_mass
    exact = body["frames"][0]["center_of_mass_exact"]
    np.testing.assert_allclose(exact, [x, -z, y], atol=1e-6)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("cloud.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                      "end_header\n1 2 3\n", "point cloud of 1 vertices"),
        ("cloud.obj", "v 0 0 0\n", "point cloud of 1 vertices"),
        ("wide.obj", "v 0 0 0\n".encode("utf-16-le").decode("latin-1"), "no text; save it as UTF-8"),
        ("none.gltf", "{}", "export it as glTF 2.0"),
        ("commas.obj", "v 0,5 0 0\n", "decimals need a point"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("command", ["analyze", "simulate"])
def test_one_line(run, tmp_path, command, name, content, said):
    (tmp_path / name).write_bytes(content.encode("latin-1"))
    result = run(command, tmp_path / name, "-o", tmp_path / "out")
    assert result.code == 1
    (line,) = result.err.strip().splitlines()
    assert line.startswith(f"ipman: error: {tmp_path / name}: ")
    assert said in line
