"""Damaged JSON, YAML, .npy, .npz and special files end in one line that names the file, at once."""

import io
import os
import socket
import sys

import numpy as np
import pytest
from click.testing import CliRunner

from ipman_rs.body import joint_regressors
from ipman_rs.cli import main
from ipman_rs.data import moyo
from ipman_rs.evaluation.tables.rows import open_npz
from ipman_rs.files import parse_json, parse_yaml, read_json, read_yaml, regular_file, safe_npz, safe_pickle, safe_xml
from ipman_rs.files.errors import FileError
from ipman_rs.fitting import camera_file, config, presented_files
from ipman_rs.io.parts import read_parts
from ipman_rs.training.model.checkpoint_file import read_checkpoint

FACES = np.array([[0, 1, 2], [0, 2, 3]])

DAMAGED_JSON = {
    "nothing": b"",
    "half": b'{"R": [[1, 0',
    "nested": b"[" * 100_000,
    "nested objects": b'{"R":' * 100_000,
    "400 digits": b'{"focal": ' + b"9" * 400 + b"}",
    "5000 digits": b'{"focal": ' + b"9" * 5000 + b"}",
    "latin 1": b'{"R": "\xe9"}',
    "half a character": b'{"R": "\\ud800"}',
    "zero bytes": b"\0" * 64,
    "null": b"null",
    "a list of text": b'["a", "b"]',
}


@pytest.mark.parametrize("damage", DAMAGED_JSON)
@pytest.mark.parametrize("read", [camera_file.read, lambda path: read_parts(path, FACES, None)])
def test_damaged_json_is_refused_by_name(tmp_path, read, damage):
    path = tmp_path / "damaged.json"
    path.write_bytes(DAMAGED_JSON[damage])
    with pytest.raises((ValueError, FileError)) as refused:
        read(path)
    assert "damaged.json" in str(refused.value)
    assert type(refused.value) in (ValueError, FileError)  # no OverflowError, RecursionError or UnicodeError


@pytest.mark.parametrize(
    "text",
    ['{"focal": %s}' % ("9" * 400), '{"K": [[%s, 0, 0], [0, 1, 0], [0, 0, 1]]}' % ("9" * 309), '{"center": [{}, null]}',
     '{"t": {"x": 1}}', '{"focal": true}', '{"focal": NaN}', '{"focal": -1e999}', '{"R": "identity"}'],
)  # fmt: skip
def test_camera_of_numbers_that_are_none(tmp_path, text):
    path = tmp_path / "camera.json"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"camera\.json: "):
        camera_file.read(path)


def test_json_in_the_encodings_that_it_may_have():
    for encoding in ("utf-8", "utf-8-sig", "utf-16", "utf-32"):
        assert parse_json('{"é": 1}'.encode(encoding)) == {"é": 1}
    assert parse_json(b"[%d]" % 2**64) == [2**64]  # long, but a float can hold it


PRESETS = {
    "noweights": "free: [orient]",
    "listiter": "free: [orient], iterations: [4], weights: {reprojection: 4}",
    "free is a number": "free: 7, weights: {reprojection: 4}",
    "weights are text": "free: [orient], weights: heavy",
    "a weight is a list": "free: [orient], weights: {reprojection: [4]}",
    "a weight is infinite": "free: [orient], weights: {reprojection: .inf}",
    "a weight is not a number": "free: [orient], weights: {reprojection: .nan}",
    "a weight is too long": f"free: [orient], weights: {{reprojection: {'9' * 400}}}",
    "solver is a list": "free: [orient], solver: [lbfgs], weights: {reprojection: 4}",
    "an option is text": "free: [orient], weights: {reprojection: 4}, terms: {reprojection: {rho: wide}}",
    "terms are a list": "free: [orient], weights: {reprojection: 4}, terms: [reprojection]",
    "a name is a list": "free: [orient], weights: {[1]: 4}",
}


@pytest.mark.parametrize("what", PRESETS)
def test_presets_of_other_types_are_refused_by_name(tmp_path, what):
    path = tmp_path / "mine.yaml"
    path.write_text(f"stages:\n- {{name: pose, {PRESETS[what]}}}\n")
    with pytest.raises(ValueError, match=r"mine\.yaml: "):
        config.load(path)
    path.write_text("start: {yaws: null}\nstages:\n- {name: pose, free: [orient], weights: {reprojection: 4}}\n")
    with pytest.raises(ValueError, match=r"mine\.yaml: start, yaws: "):
        config.load(path)
    path.write_text("stages:\n- {name: pose, free: [orient], weights: {reprojection: 4}}\n")
    assert config.load(path).stages[0].weights == {"reprojection": 4.0}


DAMAGED_YAML = {
    "nested": "[" * 5000,
    "indented": "".join("  " * k + "a:\n" for k in range(400)),
    "laughs": "a0: &a0 [x, x]\n" + "".join(f"a{k}: &a{k} [*a{k - 1}, *a{k - 1}]\n" for k in range(1, 40)),
    "itself": "a: &a [*a]",
    "python": "a: !!python/object/apply:os.system [ls]",
    "a date that is none": "a: 2001-99-99",
    "a date": "a: 2001-01-01",
    "bytes": "a: !!binary aGFsbG8=",
    "a set": "a: !!set {x, y}",
    "digits": "a: " + "9" * 400,
    "more digits": "a: " + "9" * 5000,
    "float of nothing": 'a: !!float ""',
    "int of text": "a: !!int text",
    "tabs": "a:\n\t- b",
    "half a character": 'a: "\\ud800"',
    "anchor without end": "a: *b",
    "control": "a: \x07",
}


@pytest.mark.slow
@pytest.mark.parametrize("damage", DAMAGED_YAML)
def test_damaged_yaml_is_refused(tmp_path, damage):
    with pytest.raises(ValueError):  # noqa: PT011  (its kinds are many, all of them ValueError itself)
        parse_yaml(DAMAGED_YAML[damage])
    path = tmp_path / "damaged.yaml"
    path.write_bytes(DAMAGED_YAML[damage].encode())
    with pytest.raises(ValueError, match=r"damaged\.yaml: "):
        config.load(path)


def test_yaml_in_other_encodings(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_bytes("a: é".encode("utf-16"))
    assert read_yaml(path) == {"a": "é"}
    path.write_bytes("a: é".encode("latin-1"))
    with pytest.raises(ValueError, match=r"a\.yaml: is no YAML: it is no text in UTF-8; save it as UTF-8"):
        read_yaml(path)


def npy(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def test_damaged_npy_is_refused_by_name(tmp_path):
    path = tmp_path / "labels.npy"
    good = npy(np.array([0, 1]))
    path.write_bytes(good)
    assert read_parts(path, FACES, None)[0].tolist() == [0, 1]
    bad_unicode = bytearray(npy(np.array(["ab", "cd"])))
    bad_unicode[-4:] = b"\xff\xff\xff\x7f"
    damages = [
        good.replace(b"}", b" ", 1), good.replace(b"{", b"(", 1), good.replace(b"'descr'", b"'descr"),  # tokens
        good[:20], good[:-1], b"", b"\x93NUMPY", good.replace(b"(2,)", b"(9,)"), good.replace(b"(2,)", b"(-2,)"[:4]),
        good.replace(b"<i8", b"|O8"), good.replace(b"\x01\x00", b"\x09\x00", 1), bytes(bad_unicode),
        good[:8] + b"\xff\xff" + good[10:],
    ]  # fmt: skip
    for damaged in damages:
        path.write_bytes(damaged)
        with pytest.raises((ValueError, FileError), match=r"labels\.npy: "):
            read_parts(path, FACES, None)
        with pytest.raises(ValueError, match=r"labels\.npy: "):
            joint_regressors.read(path)
    path.write_bytes(good.replace(b"}", b" ", 1))
    with pytest.raises(FileError, match=r"is no readable \.npy file \(its header is damaged"):
        read_parts(path, FACES, None)


def test_text_of_characters_that_are_none(tmp_path):
    names = np.array(["first", "second"])
    path = tmp_path / "predictions.npz"
    np.savez(path, names=names)
    content = bytearray(path.read_bytes())
    for code in (b"\xff\xff\x11\x00", b"\x00\xd8\x00\x00"):  # beyond Unicode, and half a character
        place = content.index("second".encode("utf-32-le"))
        content[place : place + 4] = code
        path.write_bytes(content)
        with pytest.raises(ValueError, match=r"predictions\.npz: "):
            open_npz(path, "names", tmp_path)[:]
        content = content.replace(code, "s".encode("utf-32-le"), 1)


def test_member_at_a_place_that_cannot_be(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, x=np.arange(5.0))
    content = bytearray(path.read_bytes())
    directory = content.index(b"PK\x01\x02")
    content[directory + 42 : directory + 46] = b"\xff\xff\xff\x7f"
    path.write_bytes(content)
    for read in (safe_npz.read, safe_npz.memory_map, lambda path, name: open_npz(path, name, tmp_path)):
        with pytest.raises(ValueError, match=r"a\.npz: "):
            read(path, "x")


@pytest.mark.parametrize("content", [b"", b"PK\3\4", b"\x80\x02X\xff\xff\xff\x7f", b"text", b"\x80\x02cos\nsystem\n."])
def test_damaged_checkpoints_are_refused_by_name(tmp_path, content):
    path = tmp_path / "some.ckpt"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"some\.ckpt: cannot be read"):
        read_checkpoint(path)


READERS = {
    "json": read_json,
    "yaml": read_yaml,
    "preset": config.load,
    "camera": camera_file.read,
    "parts": lambda path: read_parts(path.with_suffix(".json"), FACES, None),
    "npz": lambda path: safe_npz.read(path, "x"),
    "npz names": safe_npz.names,
    "npz mapped": lambda path: safe_npz.memory_map(path, "x"),
    "npz rows": lambda path: open_npz(path, "x", path.parent),
    "npy": safe_npz.read_npy,
    "pickle": safe_pickle.read,
    "XML": safe_xml.read,
    "trace of a mat": moyo.read_trace,
    "presented pose": lambda path: presented_files._Stored.open(path),
    "checkpoint": read_checkpoint,
}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
@pytest.mark.parametrize("read", READERS)
def test_special_files_are_refused_at_once(tmp_path, read):
    pipe, plug = tmp_path / "pipe.json", tmp_path / "plug"
    os.mkfifo(pipe)
    with pytest.raises((ValueError, FileError), match="is a pipe"):
        READERS[read](pipe)
    if read == "parts":
        return
    with pytest.raises(ValueError, match="/dev/zero: is a device"):
        READERS[read](type(pipe)("/dev/zero"))
    with pytest.raises(ValueError, match="is a folder"):
        READERS[read](tmp_path)
    server = socket.socket(socket.AF_UNIX)
    server.bind(os.path.relpath(plug))
    with pytest.raises(ValueError, match="is a socket"):
        READERS[read](plug)
    server.close()


def test_names_that_no_file_can_have(tmp_path):
    for name in ("x" * 300, "a\0b"):
        with pytest.raises(ValueError, match="cannot be opened"):
            regular_file(tmp_path / name)
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    with pytest.raises(ValueError, match="cannot be opened"):
        regular_file(loop)


def test_xml_of_too_many_attributes_is_refused(tmp_path):
    path = tmp_path / "wide.xml"
    path.write_text("<a " + " ".join(f'b{k}="1"' for k in range(300_000)) + "/>")
    with pytest.raises(ValueError, match=r"wide\.xml: cannot be read as XML: an element of 300000 attributes"):
        safe_xml.read(path)


def test_the_command_line_says_one_line(tmp_path):
    """Through the command itself: no traceback, exit code 1 or 2, and the file's name."""
    mesh = tmp_path / "box.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    for damage in ("nested", "400 digits", "half a character"):
        parts = tmp_path / "mine.json"
        parts.write_bytes(DAMAGED_JSON[damage])
        done = CliRunner().invoke(main, ["analyze", str(mesh), "--parts", str(parts), "-o", str(tmp_path / "out")])
        assert isinstance(done.exception, SystemExit), repr(done.exception)
        assert done.exit_code in (1, 2)
        assert "mine.json" in done.output


def test_names_of_inputs_that_no_file_can_have(tmp_path):
    for name in ("x" * 300 + ".obj", "loop.obj"):
        path = tmp_path / name
        if name == "loop.obj":
            path.symlink_to(path)
        done = CliRunner().invoke(main, ["analyze", str(path), "-o", str(tmp_path / "out")])
        assert isinstance(done.exception, SystemExit), repr(done.exception)
        assert done.exit_code == 1
        assert "cannot be opened" in done.output
        done = CliRunner().invoke(main, ["data", "check", "amass", str(path)])
        assert isinstance(done.exception, SystemExit), repr(done.exception)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="names are bytes on Linux alone")
def test_names_that_are_no_text(tmp_path):
    """A name of bytes that are no UTF-8 is read, and the report about it written."""
    path = tmp_path / os.fsdecode(b"body\xff.obj")
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    done = CliRunner().invoke(main, ["analyze", str(path), "-o", str(tmp_path / "out")])
    assert not isinstance(done.exception, UnicodeError), done.exception
