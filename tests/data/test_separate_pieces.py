"""Separate pieces of a surface, in files of every kind and over time."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh
from click.testing import CliRunner

import ipman_rs as ip
from ipman_rs.cli import main
from ipman_rs.data import separate_pieces

SEVERAL = "2 large separate pieces are measured as one body; several people, things beside one, or clothes over one?"


@pytest.fixture(scope="module")
def person():
    body = ip.load_body("anny-lite")
    return trimesh.Trimesh(ip.body.posed(body, "standing"), body.faces, process=False)


def beside(mesh, other, place):
    return trimesh.util.concatenate([mesh, other.copy().apply_translation(place)])


def findings(mesh):
    return [each.what for each in separate_pieces.check_pieces(mesh.vertices, mesh.faces, np.array([0.0, 1.0, 0.0]))]


def write(path, mesh, frames):
    if path.suffix == ".npz":
        vertices = np.asarray(mesh.vertices)
        np.savez(path, vertices=vertices if frames == 1 else np.stack([vertices] * frames), faces=mesh.faces)
    else:
        mesh.export(path)
    return path


@pytest.mark.slow
@pytest.mark.parametrize(("name", "frames"), [("two.obj", 1), ("two.ply", 1), ("two.npz", 1), ("film.npz", 3)])
def test_two_bodies_in_one_file_are_marked_everywhere(tmp_path, person, name, frames):
    path = write(tmp_path / name, beside(person, person, [1, 0, 0]), frames)
    done = CliRunner().invoke(main, ["analyze", str(path), "-o", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert f"! {SEVERAL}" in done.output
    (body,) = json.loads((tmp_path / "out" / "report.json").read_text())["bodies"]
    assert body["flags"] == [SEVERAL]
    assert not any("pieces" in note for note in body["notes"])
    assert SEVERAL in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "thing", [trimesh.creation.box((0.45, 0.9, 0.45)), trimesh.creation.box((1.0, 0.001, 1.0))], ids=["chair", "floor"]
)
def test_a_thing_beside_a_body_is_a_piece(person, thing):
    assert findings(beside(person, thing, [0, 0.45, 0.8])) == [SEVERAL.partition(";")[0]]


def test_eyes_and_shoes_are_no_bodies(person):
    eye, shoe = trimesh.creation.icosphere(1, 0.012), trimesh.creation.box((0.1, 0.05, 0.3))
    assert findings(beside(beside(person, eye, [0, 1.6, 0.1]), shoe, [0.1, 0.0, 0.0])) == []


@pytest.mark.parametrize(
    "speck", [trimesh.creation.icosphere(1, 0.001), trimesh.Trimesh(np.eye(3) * 1e-3, [[0, 1, 2]])]
)
def test_a_speck_below_the_soles_is_marked(tmp_path, person, speck):
    mesh = beside(person, speck, [0, -0.4, 0])
    said = f"{len(speck.vertices)} of {len(mesh.vertices):,} vertices, in small separate pieces, lie up to 0.40 m below"
    path = write(tmp_path / "speck.npz", mesh, 1)
    done = CliRunner().invoke(main, ["analyze", str(path), "--json"])
    (flag,) = json.loads(done.stdout)["bodies"][0]["flags"]
    assert flag == f"{said} the body; the ground and the contact are theirs: take them out of the file"
    assert findings(beside(person, speck, [0, 2.0, 0])) == []
