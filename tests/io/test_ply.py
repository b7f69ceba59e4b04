"""The forms of .ply files: text and both byte orders, polygons of mixed lengths, lists of any type."""

from __future__ import annotations

import struct

import numpy as np
import pytest
import trimesh

from ipman_rs.files.mesh.read_mesh import read_mesh, read_points

BOX = trimesh.creation.box((0.4, 1.7, 0.3))
POINTS = np.asarray(BOX.vertices, np.float32)
# Five quads of the box, counter-clockwise from outside, and the sixth side as two triangles.
MIXED = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7], [1, 7, 3]]
TRIANGLES = BOX.faces.tolist()
CODES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d",
         "uint8": "B", "int32": "i", "float32": "f", "float64": "d"}  # fmt: skip


def ply(
    order, faces, length="uchar", index="int", real="float", extra=False, end="\n", corners="vertex_indices"
) -> bytes:
    """A file with, if `extra`, colours of vertices, and a number and a list of each face beside its corners."""
    head = ["ply", f"format {order} 1.0", "comment made by hand", "obj_info scan", f"element vertex {len(POINTS)}"]
    head += [f"property {real} {axis}" for axis in "xyz"] + (["property uchar red"] if extra else [])
    head += [f"element face {len(faces)}"] + (["property uchar flags"] if extra else [])
    head += [f"property list {length} {index} {corners}"]
    head += ["property list uchar float texcoord", "property short group"] if extra else []
    rows = [[(real, float(x)) for x in point] + ([("uchar", 200)] if extra else []) for point in POINTS]
    for k, face in enumerate(faces):
        row = [("uchar", 1)] if extra else []
        row += [(length, len(face)), *((index, corner) for corner in face)]
        row += [("uchar", k % 3), *(("float", 0.5),) * (k % 3), ("short", -1)] if extra else []
        rows.append(row)
    start = end.join([*head, "end_header"]).encode() + end.encode()
    if order == "ascii":
        return start + end.join(" ".join(str(value) for _, value in row) for row in rows).encode()
    sign = "<" if "little" in order else ">"
    return start + b"".join(struct.pack(sign + CODES[kind], value) for row in rows for kind, value in row)


@pytest.fixture
def read(tmp_path):
    def call(content: bytes, reader=read_mesh):
        (tmp_path / "a.ply").write_bytes(content)
        return reader(tmp_path / "a.ply")

    return call


@pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("faces", [TRIANGLES, MIXED, MIXED[::-1]], ids=["triangles", "mixed", "triangles first"])
@pytest.mark.parametrize(
    "form",
    [
        {},
        {"length": "int", "index": "uint", "real": "double"},
        {"length": "ushort", "index": "short", "real": "float64", "corners": "vertex_index"},
        {"length": "uint8", "index": "int32", "real": "float32", "extra": True},
        {"length": "char", "index": "uchar", "extra": True, "end": "\r\n"},
        {"end": "\r"},
    ],
    ids=["usual", "wide", "vertex_index", "more properties", "bytes, Windows", "Macintosh"],
)
def test_forms(read, order, faces, form):
    mesh = read(ply(order, faces, **form))
    np.testing.assert_array_equal(mesh.vertices, POINTS)
    whole = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert len(mesh.faces) == 12
    assert whole.is_watertight
    np.testing.assert_allclose(whole.volume, 0.4 * 1.7 * 0.3, rtol=1e-6)
    assert mesh.notes == ()


def test_trimesh_s_own_files_in_their_order(read):
    for encoding in ("binary", "ascii"):
        mesh = read(BOX.export(file_type="ply", encoding=encoding))
        np.testing.assert_array_equal(mesh.faces, BOX.faces)
        np.testing.assert_allclose(mesh.vertices, BOX.vertices, atol=1e-7)


@pytest.mark.parametrize("order", ["ascii", "binary_little_endian"])
def test_other_elements_are_named_and_clouds_are_clouds(read, order):
    whole = ply(order, MIXED)
    before = whole.replace(b"element vertex", b"element camera 1\nproperty float fov\nelement vertex")
    at = before.index(b"end_header\n") + 11
    before = before[:at] + (b"40\n" if order == "ascii" else struct.pack("<f", 40)) + before[at:]
    mesh = read(before)
    assert len(mesh.faces) == 12
    assert mesh.notes == ("not used: camera",)
    cloud = ply(order, [])
    np.testing.assert_array_equal(read(cloud, read_points), POINTS)
    for content in (cloud, cloud.replace(b"element face 0\nproperty list uchar int vertex_indices\n", b"")):
        with pytest.raises(ValueError, match="point cloud of 8 vertices and no faces, no surface; reconstruct one"):
            read(content)


@pytest.mark.slow
@pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_every_cut_is_told(read, order):
    whole = ply(order, MIXED, extra=True)
    for length in range(0, len(whole), 3):
        with pytest.raises(ValueError, match="a.ply: is no readable .ply mesh"):
            read(whole[:length])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (b"element face 7", b"element face 900000000000", "claims 900000000000 of face but has only"),
        (b"format ascii", b"format text", "its format is 'text'"),
        (b"property float x", b"property half x", "a property of a known type"),
        (b"property float x", b"property float q", "no vertices with x, y and z"),
        (b"property float x", b"proprety float x", "its header says 'proprety float x'"),
        (b"4 0 1 3 2", b"1000000000 0 1 3 2", "row 0 of face is cut"),
        (b"4 0 1 3 2", b"-4 0 1 3 2", "row 0 of face is cut"),
        (b"4 0 1 3 2", b"4 0 1 3 8", "a face names vertex 8 of 8"),
        (b"4 0 1 3 2", b"4 0 1 3 1.5", "expected whole numbers"),
        (b"4 0 1 3 2", b"4 0 1 3 nan", "expected whole numbers"),
        (b"4 0 1 3 2", b"4 0 1 3 x", "row 0 of face: expected numbers, got '4 0 1 3 x'"),
        (b"element face", b"element tristrips", "its triangles are in strips (tristrips), which are not read"),
        (b"vertex_indices", b"corners", "its faces have corners; expected vertex_indices"),
    ],
)
def test_damage(read, old, new, said):
    with pytest.raises(ValueError, match="is no readable .ply mesh") as caught:
        read(ply("ascii", MIXED).replace(old, new))
    assert said in str(caught.value)
