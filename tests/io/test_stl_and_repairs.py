"""Triangle soups of .stl files, and what is mended in a mesh: every repair leaves a note.

trimesh's volume of the mesh before it was taken apart is the judge.
"""

from __future__ import annotations

import struct

import numpy as np
import pytest
import trimesh

import ipman_rs as ip
from ipman_rs.files.mesh import repair
from ipman_rs.files.mesh.read_mesh import read_mesh


@pytest.fixture(scope="module")
def body():
    lite = ip.load_body("anny-lite")
    return trimesh.Trimesh(ip.body.posed(lite, "standing"), lite.faces, process=False)


@pytest.fixture
def read(tmp_path):
    def call(content: bytes | str, name: str = "a.stl"):
        (tmp_path / name).write_bytes(content.encode() if isinstance(content, str) else content)
        return read_mesh(tmp_path / name)

    return call


def binary(corners: np.ndarray, header: bytes = b"scan", behind: bytes = b"") -> bytes:
    facets = b"".join(struct.pack("<12fH", 0, 0, 0, *corner.reshape(-1), 0) for corner in corners)
    return header.ljust(80, b"\0") + struct.pack("<I", len(corners)) + facets + behind


def words(corners: np.ndarray, name: str = "body") -> str:
    lines = [f"solid {name}"]
    for corner in corners:
        lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {x:.9g} {y:.9g} {z:.9g}" for x, y, z in corner)]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, f"endsolid {name}", ""])


def agrees(mesh, body, rtol=1e-5):
    whole = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert whole.is_watertight
    assert len(mesh.vertices) == len(body.vertices)
    np.testing.assert_allclose(whole.volume, body.volume, rtol=rtol)


@pytest.mark.parametrize("form", ["binary", "solid", "behind", "text", "Windows", "capitals", "two solids"])
def test_forms_of_stl(read, body, form):
    corners = body.triangles
    content = {
        "binary": lambda: binary(corners),
        "solid": lambda: binary(corners, b"solid body of a scanner"),  # as some programs begin the binary form
        "behind": lambda: binary(corners, behind=b"\0\0\0"),
        "text": lambda: words(corners),
        "Windows": lambda: words(corners).replace("\n", "\r\n"),
        "capitals": lambda: words(corners).upper(),
        "two solids": lambda: words(corners[:1000], "upper") + words(corners[1000:], "lower"),
    }[form]()
    mesh = read(content)
    agrees(mesh, body)
    said = {"two solids": "2 solids are joined: upper, lower", "behind": "3 bytes behind the 2454 triangles left out"}
    merged = f"{3 * 2454 - 1229} vertices that lie on each other were merged"
    assert mesh.notes == ((said[form],) if form in said else ()) + (merged,)


@pytest.mark.parametrize("noise", [1e-7, 1e-6, 4e-6])
@pytest.mark.parametrize("name", ["a.stl", "a.obj"])
def test_corners_of_a_soup_within_the_tolerance_are_merged(read, body, noise, name):
    """The tolerance is 1e-5 of the body's 2.06 m, 0.02 mm, and is in the note."""
    soup = body.triangles + np.random.default_rng(5).uniform(-noise, noise, (2454, 3, 3))
    if name == "a.stl":
        mesh = read(binary(soup))
    else:
        lines = [f"v {x} {y} {z}" for x, y, z in soup.reshape(-1, 3)]
        mesh = read("\n".join(lines + [f"f {k} {k + 1} {k + 2}" for k in range(1, len(lines), 3)]), name)
    agrees(mesh, body, rtol=1e-4)
    assert any(note.endswith("vertices within 2e-05 of another were merged") for note in mesh.notes)
    assert np.abs(mesh.vertices[mesh.vertex_map] - soup.reshape(-1, 3)).max() < 4 * noise


def test_the_tolerance_goes_with_the_size(read, body):
    soup = 1000 * (body.triangles + np.random.default_rng(5).uniform(-1e-6, 1e-6, (2454, 3, 3)))
    mesh = read(binary(soup))
    np.testing.assert_allclose(trimesh.Trimesh(mesh.vertices, mesh.faces).volume, 1e9 * body.volume, rtol=1e-4)


def test_a_soup_that_no_tolerance_joins_is_refused(read, body):
    soup = body.triangles + np.random.default_rng(5).uniform(-1e-3, 1e-3, (2454, 3, 3))
    with pytest.raises(ValueError, match=r"its faces share no vertices \(.*\), so there is no surface; merge"):
        read(binary(soup))


def test_a_dense_cloud_of_corners_takes_no_quadratic_time(read):
    """100,000 corners within the tolerance of each other are five thousand million pairs."""
    soup = np.random.default_rng(0).uniform(0, 1e-6, (33_334, 3, 3))
    soup[0] = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    with pytest.raises(ValueError, match="is no readable"):
        read(binary(soup))


def test_open_meshes_keep_their_holes(read, body):
    """A hole of an open body is no seam: nothing is merged."""
    lines = [f"v {x} {y} {z}" for x, y, z in body.vertices] + [f"f {a} {b} {c}" for a, b, c in body.faces[40:] + 1]
    mesh = read("\n".join(lines), "a.obj")
    assert mesh.vertex_map is None or (mesh.vertex_map >= -1).all()
    assert not any("merged" in note for note in mesh.notes)


@pytest.mark.parametrize(
    "content", [b"", b"solid", b"scan".ljust(84, b"\1"), b"solid a\nfacet normal 0 0 0\nouter loop\n"]
)
def test_no_stl(read, content):
    with pytest.raises(ValueError, match="a.stl: is no readable .stl mesh"):
        read(content)


@pytest.mark.slow
def test_every_cut_of_an_stl_is_told(read):
    box = trimesh.creation.box((1, 1, 1)).triangles
    for whole in (binary(box), words(box).encode().split(b"endsolid")[0]):
        for length in range(0, len(whole), 7):
            with pytest.raises(ValueError, match="is no readable"):
                read(whole[:length])


def test_loose_vertices_are_left_out_wherever_they_stand(read, body):
    """Between the body's own, and the map still says where each went."""
    stray = np.array([[0.3, -0.4, 0.0]])
    points = np.concatenate([stray, body.vertices[:500], stray, body.vertices[500:], stray])
    number = np.arange(1229) + 1 + (np.arange(1229) >= 500)
    lines = [f"v {x} {y} {z}" for x, y, z in points] + [f"f {a} {b} {c}" for a, b, c in number[body.faces] + 1]
    mesh = read("\n".join(lines), "a.obj")
    np.testing.assert_array_equal(mesh.vertices, body.vertices)
    np.testing.assert_array_equal(mesh.faces, body.faces)
    np.testing.assert_array_equal(mesh.vertex_map[number], np.arange(1229))
    np.testing.assert_array_equal(mesh.vertex_map[[0, 501, 1231]], -1)
    assert mesh.notes == ("3 vertices that no face uses left out",)


def test_flat_and_repeated_faces_are_left_out():
    box = trimesh.creation.box((1, 1, 1))
    faces = np.concatenate([box.faces[:3], [[0, 0, 1]], box.faces[:1, [1, 2, 0]], box.faces[3:], box.faces[5:7]])
    mesh = repair.repair_mesh(repair.Mesh(box.vertices, faces))
    np.testing.assert_array_equal(mesh.faces, box.faces)
    np.testing.assert_array_equal(mesh.face_map, [0, 1, 2, *range(5, 14)])
    assert mesh.notes == ("1 face without area (a vertex twice) left out", "3 repeated faces left out")


def test_a_loose_vertex_far_away_does_not_widen_the_tolerance(read, body):
    """1 km away: a tolerance of its distance would be 1 cm, and merge a body's fingers."""
    soup = body.triangles.reshape(-1, 3)
    lines = [f"v {x} {y} {z}" for x, y, z in soup] + ["v 1000 0 0"]
    lines += [f"f {k} {k + 1} {k + 2}" for k in range(1, len(soup), 3)]
    mesh = read("\n".join(lines[: len(soup) + 1] + lines[len(soup) + 2 :]), "a.obj")  # one face less: an open edge
    assert len(mesh.vertices) == 1229
    assert not any("within" in note for note in mesh.notes)


def test_a_mesh_without_any_area_is_refused(read):
    with pytest.raises(ValueError, match="none of its faces has an area"):
        read(binary(np.zeros((4, 3, 3))))
