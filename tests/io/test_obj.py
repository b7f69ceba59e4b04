"""The dialects of .obj files. trimesh reads the plain form, and its volume judges all others."""

from __future__ import annotations

import os

import numpy as np
import pytest
import trimesh

from ipman_rs.files.mesh.read_mesh import read_mesh

BOX = trimesh.creation.box((0.4, 1.7, 0.3))
V = "".join(f"v {x} {y} {z}\n" for x, y, z in BOX.vertices)
F = "".join(f"f {a} {b} {c}\n" for a, b, c in BOX.faces + 1)
# The corners of the box's six sides, counted from 1, counter-clockwise from outside.
QUADS = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
VOLUME = 0.4 * 1.7 * 0.3


@pytest.fixture
def read(tmp_path):
    def call(content: bytes | str):
        (tmp_path / "a.obj").write_bytes(content.encode() if isinstance(content, str) else content)
        return read_mesh(tmp_path / "a.obj")

    return call


def relative(faces: str) -> str:
    return "\n".join("f " + " ".join(str(int(word) - 9) for word in line.split()[1:]) for line in faces.splitlines())


DIALECTS = {
    "plain": V + F,
    "latin-1 name": b"mtllib caf\xe9.mtl\n" + (V + F).encode(),
    "cp932 object": "o \u4eba\u4f53\n".encode("cp932") + (V + F).encode(),
    "byte order mark": b"\xef\xbb\xbf" + (V + F).encode(),
    "UTF-16": (V + F).encode("utf-16"),
    "UTF-16 big-endian": b"\xfe\xff" + (V + F).encode("utf-16-be"),
    "Windows": (V + F).replace("\n", "\r\n"),
    "old Macintosh": (V + F).replace("\n", "\r"),
    "no last line end": (V + F).rstrip(),
    "tabs and spaces": (V + F).replace(" ", " \t  ").replace("v", "  v"),
    "comments": "# a body\n" + V + "#f 1 2\n\n" + F,
    "colours": V.replace("\n", " 0.5 0.25 1\n") + F,
    "weights": V.replace("\n", " 1.0\n") + F,
    "quads": V + QUADS,
    "relative": V + relative(QUADS),
    "normals": V + "vn 0 1 0\n" + "".join(f"f {a}//1 {b}//1 {c}//1\n" for a, b, c in BOX.faces + 1),
    "texture": V + "vt 0 0\nvt 1 1\n" + "".join(f"f {a}/1/1 {b}/2 {c}/1\n" for a, b, c in BOX.faces + 1),
    "faces first": F + V,
    "groups, smoothing, materials": V + "g arm\ns 1\nusemtl skin\n" + F.replace("f", "g leg\ns off\nf", 5),
    "lines and points": V + "p 1 2\nl 1 2 3\n" + F,
    "continued line": V + F.replace("f 2 ", "f \\\n2 "),
    "exponents": "".join(f"v {x:e} {y:E} {z:+}\n" for x, y, z in BOX.vertices) + F,
    "fo": V + F.replace("f ", "fo "),
}


@pytest.mark.parametrize("name", DIALECTS)
def test_dialects(read, name):
    mesh = read(DIALECTS[name])
    np.testing.assert_array_equal(mesh.vertices, BOX.vertices)
    np.testing.assert_allclose(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).volume, VOLUME)
    assert mesh.notes == ()
    if "quads" not in name and "relative" not in name:
        np.testing.assert_array_equal(mesh.faces, BOX.faces)


def test_polygons_of_many_corners(read):
    """A cylinder whose two ends are polygons of 24 corners."""
    tube = trimesh.creation.cylinder(radius=0.2, height=1.0, sections=24)
    angle = 2 * np.pi * np.arange(24) / 24
    ring = np.stack([0.2 * np.cos(angle), 0.2 * np.sin(angle)], axis=1)
    lines = [f"v {x} {y} {z}" for z in (-0.5, 0.5) for x, y in ring]
    lines += ["f " + " ".join(map(str, range(24, 0, -1))), "f " + " ".join(map(str, range(25, 49)))]
    lines += [f"f {k + 1} {(k + 1) % 24 + 1} {(k + 1) % 24 + 25} {k + 25}" for k in range(24)]
    mesh = read("\n".join(lines))
    whole = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert whole.is_watertight
    np.testing.assert_allclose(whole.volume, tube.volume)


def test_several_objects_are_named(read):
    second = "".join(f"v {x + 7} {y} {z}\n" for x, y, z in BOX.vertices) + relative(F)
    mesh = read("o body\n" + V + F + "o caf\u00e9\n" + second)
    assert mesh.notes[0] == "2 objects are joined: body, caf\u00e9"
    np.testing.assert_allclose(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).volume, 2 * VOLUME)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (V, "point cloud of 8 vertices and no faces, no surface"),
        (V + "p 1\nl 1 2\n", "point cloud of 8"),
        ("# nothing\n", "it is empty"),
        (V.replace(".", ",") + F, "line 1: expected numbers, got 'v -0,2 -0,85 -0,15'; decimals need a point"),
        (V + "f 1 2 x\n", "line 9: expected numbers, got 'f 1 2 x'"),
        ("v 1 2\n" + F, "line 1: expected numbers, got 'v 1 2'"),
        (V + "f 0 1 2\n", "vertex 0, but .obj files count from 1"),
        (V + F + "f 1 2 9\n", "a face names vertex 8 of 8"),
        (V + F + "f -9 -1 -2\n", "a face names vertex -1 of 8"),
        ((V + F).encode("utf-16-le"), "zero bytes and so is no text; save it as UTF-8"),
        (V + "f 1 2 " + "9" * 40 + "\n", "it holds a number larger than any"),
    ],
)
def test_damage_is_one_line(read, content, said):
    with pytest.raises(ValueError, match="is no readable .obj mesh") as caught:
        read(content)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_special_files_are_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.obj")
    (tmp_path / "zero.obj").symlink_to("/dev/zero")
    (tmp_path / "folder.obj").mkdir()
    for name, said in (("pipe", "a pipe"), ("zero", "a device"), ("folder", "a folder"), ("none", "no such file")):
        with pytest.raises(ValueError, match=f"{name}.obj: .*{said}"):
            read_mesh(tmp_path / f"{name}.obj")
