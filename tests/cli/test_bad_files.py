"""Every bad file is one line on stderr and exit code 1: no traceback, nothing lost, nothing written elsewhere."""

from __future__ import annotations

import io
import pickle
import struct
import subprocess
import sys
import zipfile

import numpy as np
import pytest
import trimesh

from tests.helpers.cli_files import report, strict


def npz_bytes(**arrays) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def npz_claiming(shape: str) -> bytes:
    """An array whose header claims a shape that its bytes do not have."""
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode()
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("vertices.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + b"\0" * 240)
    return stream.getvalue()


class Evil:
    def __reduce__(self):
        return exec, ("raise SystemExit('executed')",)


BOX = trimesh.creation.box((0.4, 0.4, 0.4))  # 63 kg
PLY = BOX.export(file_type="ply")
GLB = trimesh.Scene([BOX]).export(file_type="glb")
FACES = np.asarray(BOX.faces)
HUGE_PLY = b"""ply
format binary_little_endian 1.0
element vertex 900000000000
property float x
property float y
property float z
element face 12
property list uchar int vertex_indices
end_header
"""


BAD = {
    "empty.obj": (b"", "is empty"),
    "empty.npz": (b"", "is empty"),
    "text.obj": (b"this is no mesh\n", "no surface|no readable"),
    "text.ply": (b"this is no mesh\n", "no readable .ply mesh"),
    "text.stl": (b"this is no mesh\n", "no readable .stl mesh|no surface"),
    "text.glb": (b"this is no mesh, but long enough for a header\n", "no readable .glb mesh"),
    "text.npz": (b"this is no archive\n", "not a .npz file"),
    "picture.png": (b"\x89PNG", "unknown kind '.png'"),
    "noending": (b"v 0 0 0\n", "unknown kind"),
    "points.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no surface|no readable"),
    "cut.ply": (PLY[:-40], "no readable|face|vertex|edge"),
    "cut.glb": (GLB[: len(GLB) // 2], "no readable"),
    "huge.ply": (HUGE_PLY + b"\0" * 100, "claims 900000000000 of vertex"),
    "huge.stl": (b"\0" * 80 + struct.pack("<I", 4_000_000_000) + b"\0" * 100, "no readable|no surface"),
    "huge.npz": (npz_claiming("(1000000000000, 3)"), "carries"),
    "negative.npz": (npz_claiming("(-1, 3)"), "cannot be read"),
    "cut.npz": (npz_bytes(vertices=BOX.vertices, faces=FACES)[:-60], "not a .npz file"),
    "objects.npz": (npz_bytes(vertices=np.array([{}, {}], dtype=object), faces=FACES), "objects"),
    "evil.npz": (npz_bytes(poses=np.array([Evil()], dtype=object)), "objects"),
    "pickle.npz": (pickle.dumps({"vertices": 1}), "not a .npz file"),
    "words.npz": (npz_bytes(vertices=np.array(["a", "b"]), faces=FACES), "not numbers"),
    "other.npz": (npz_bytes(something=np.zeros(3)), "holds something; expected vertices and faces"),
    "flat.npz": (npz_bytes(vertices=np.zeros((8, 2)), faces=FACES), "shape (8, 2)"),
    "none.npz": (npz_bytes(vertices=np.zeros((0, 3)), faces=FACES), "shape (0, 3)"),
    "outside.npz": (
        npz_bytes(vertices=BOX.vertices, faces=FACES + 1),
        "8 vertices, counted from 0 to 7; do they count from 1?",
    ),
    "before.npz": (npz_bytes(vertices=BOX.vertices, faces=FACES - 1), "faces name vertex -1, but there are 8 vertices"),
    "digits.npz": (npz_claiming(f"({'9' * 400}, 3)"), "its header claims a shape that no array can have"),
    "many.npz": (
        npz_bytes(pred_vertices=BOX.vertices, **{f"another_array_{k:02d}": np.zeros(3) for k in range(60)}),
        "holds pred_vertices, another_array_00, ",
    ),
    "nofaces.npz": (npz_bytes(vertices=BOX.vertices), "no faces"),
    "nan.npz": (npz_bytes(vertices=BOX.vertices * np.nan, faces=FACES), "finite"),
    "inward.npz": (npz_bytes(vertices=BOX.vertices, faces=FACES[:, ::-1]), "inside out"),
    "twice.npz": (npz_bytes(vertices=BOX.vertices, faces=np.vstack([FACES, FACES[:1]])), "face|edge"),
    "oddpose.npz": (npz_bytes(poses=np.zeros((4, 71))), "shape (4, 71)"),
    "nopose.npz": (npz_bytes(poses=np.zeros((0, 72))), "shape (0, 72)"),
    "trans.npz": (npz_bytes(poses=np.zeros((4, 72)), trans=np.zeros((3, 3))), "trans has shape (3, 3)"),
    "betas.npz": (npz_bytes(pose=np.zeros((4, 72)), betas=np.zeros((3, 10))), "betas has shape (3, 10)"),
    "pieces.npz": (npz_bytes(global_orient=np.zeros((4, 3)), body_pose=np.zeros((3, 69))), "frames"),
}


@pytest.mark.parametrize("name", BAD)
def test_one_line(run, tmp_path, name):
    content, said = BAD[name]
    (tmp_path / name).write_bytes(content)
    result = run("analyze", tmp_path / name, "-o", tmp_path / "out")
    assert result.code == 1
    (line,) = result.err.strip().splitlines()
    assert line.startswith(f"ipman: error: {tmp_path / name}: ")
    assert any(part in line for part in said.split("|")), line
    assert result.out == ""
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("parts.json", b"{", "no JSON"),
        ("parts.json", b'{"a": [0, 99]}', "vertex 99 of 8"),
        ("parts.json", b'{"a": "b"}', "whole numbers"),
        ("parts.json", b"[0, 1]", "2 labels for 12 faces"),
        ("parts.npy", b"\x93NUMPY", "no readable .npy"),
        ("parts.txt", b"0", "expected JSON"),
        ("missing.json", None, "there is no such file"),
    ],
)
def test_bad_parts(run, tmp_path, name, content, said):
    (tmp_path / "box.ply").write_bytes(PLY)
    if content is not None:
        (tmp_path / name).write_bytes(content)
    result = run("analyze", tmp_path / "box.ply", "--json", "--parts", tmp_path / name)
    assert result.code == 1
    (line,) = result.err.strip().splitlines()
    assert str(tmp_path / name) in line
    assert said in line


def test_a_bad_body_model(run, tmp_path):
    np.savez(tmp_path / "pose.npz", pose=np.zeros(72))
    (tmp_path / "SMPL.pkl").write_bytes(pickle.dumps(Evil()))
    for model in (tmp_path / "SMPL.pkl", tmp_path / "nothing.pkl", "somebody"):
        result = run("analyze", tmp_path / "pose.npz", "--json", "--body", model)
        assert result.code == 1
        assert len(result.err.strip().splitlines()) == 1
        assert str(model) in result.err


@pytest.mark.slow
def test_a_bad_file_among_good_ones_loses_nothing(run, tmp_path):
    trimesh.creation.icosphere(3, radius=0.25).export(tmp_path / "ball.ply")
    (tmp_path / "bad.obj").write_bytes(b"no mesh")
    files = [tmp_path / name for name in ("missing.obj", "ball.ply", "bad.obj")]
    result = run("analyze", *files, "-o", tmp_path / "out")
    assert result.code == 1
    assert len(result.err.strip().splitlines()) == 2
    record = report(tmp_path / "out")
    assert [body["name"] for body in record["bodies"]] == ["ball"]
    assert len(record["failures"]) == 2
    assert "there is no such file" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_a_folder_that_cannot_be_written(run, tmp_path):
    (tmp_path / "box.ply").write_bytes(PLY)
    (tmp_path / "file").write_text("not a folder")
    result = run("analyze", tmp_path / "box.ply", "-o", tmp_path / "file" / "out")
    assert result.code == 1
    assert "cannot be written" in result.err
    assert len(result.err.strip().splitlines()) == 1


def test_wrong_usage_is_2(run, tmp_path):
    assert run("analyze").code == 2
    assert run("analyze", tmp_path / "box.ply").code == 2
    assert run("demo").code == 2
    assert run("nothing").code == 2


def ipman(*arguments, **options):
    command = [sys.executable, "-c", "from ipman_rs.cli import main; main(prog_name='ipman')", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, **options)


@pytest.mark.slow
def test_the_real_program(tmp_path):
    (tmp_path / "box.ply").write_bytes(PLY)
    good = ipman("analyze", tmp_path / "box.ply", "--json")
    assert (good.returncode, good.stderr) == (0, "")
    np.testing.assert_allclose(strict(good.stdout)["bodies"][0]["frames"][0]["volume"], 0.064)
    bad = ipman("analyze", tmp_path / "none.ply", "--json")
    assert bad.returncode == 1
    assert bad.stderr == f"ipman: error: {tmp_path / 'none.ply'}: there is no such file\n"
    assert strict(bad.stdout)["bodies"] == []


@pytest.mark.slow
def test_a_reader_that_leaves_early_costs_no_report(tmp_path):
    """`ipman analyze ... | head -0`: the page is written before anything is printed."""
    trimesh.creation.icosphere(2, radius=0.25).export(tmp_path / "ball.ply")
    program = f'{sys.executable} -c "from ipman_rs.cli import main; main()"'
    command = f"{program} analyze {tmp_path}/ball.ply -o {tmp_path}/out | true"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=120, check=True)
    assert (tmp_path / "out" / "report.html").is_file()
    assert "Traceback" not in done.stderr
