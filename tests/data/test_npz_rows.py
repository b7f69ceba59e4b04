"""Rows of large .npz files without reading them, and archives that lie."""

from __future__ import annotations

import contextlib
import struct
import tracemalloc
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ipman_rs.data as data
from ipman_rs.data import naming
from ipman_rs.files import safe_npz
from tests.helpers.miniatures import human36m


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("order", ["C", "F"])
def test_same_as_numpy(tmp_path, packed, order):
    rng = np.random.default_rng(0)
    arrays = {
        "a": np.asarray(rng.normal(size=(7, 3, 2)), order=order), "b": rng.integers(0, 9, (5,), np.int16),
        "c": np.array(["x", "yyy"]), "d": np.zeros((0, 4)), "e": np.float32(3.5), "f": np.array([True, False]),
    }  # fmt: skip
    file = tmp_path / "a.npz"
    (np.savez_compressed if packed else np.savez)(file, **arrays)
    for name, array in arrays.items():
        for read in (safe_npz.memory_map, safe_npz.read):
            found = read(file, name)
            np.testing.assert_array_equal(found, array)
            assert found.dtype == array.dtype
    assert isinstance(safe_npz.memory_map(file, "a"), np.memmap) != packed


def test_rows_cost_what_is_looked_at(tmp_path):
    """Ten rows of 200,000: what is allocated is less than a tenth of the file, most of it for the text of the names."""
    file = tmp_path / "h36m_train_world.npz"
    count = 200_000
    images = np.array([f"S1/Walking_1.54138969/{row:06d}.jpg" for row in range(count)], "S32")
    with zipfile.ZipFile(file, "w", allowZip64=True) as archive:
        for name, value in (("imgname", images), ("center", (2,)), ("scale", ()), ("S_world", (24, 4))):
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                if isinstance(value, np.ndarray):
                    np.lib.format.write_array(member, value)
                    continue
                head = {"descr": "<f4", "fortran_order": False, "shape": (count, *value)}
                np.lib.format.write_array_header_1_0(member, head)
                for _ in range(100):
                    member.write(bytes(count // 100 * 4 * int(np.prod(value))))
    tracemalloc.start()
    frames = data.open("human36m", file)
    assert len(frames) == count
    found = frames[199_990:]
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found.names[-1] == "S1/Walking_1.54138969/199999"
    assert np.isnan(found.joints).all()  # zeros with confidence 0
    assert peak < 4 << 20 < file.stat().st_size / 20


@pytest.mark.parametrize("what", ["offset", "rows", "end"])
def test_archives_that_lie(tmp_path, what):
    file = tmp_path / "a.npz"
    np.savez(file, a=np.arange(12.0))
    content = bytearray(file.read_bytes())
    if what == "offset":
        at = content.index(b"PK\1\2") + 42
        content[at : at + 4] = struct.pack("<I", 7)
    elif what == "rows":
        content = content.replace(b"(12,)", b"(99,)")
    else:
        at = content.index(b"PK\1\2") + 20
        content[at : at + 8] = struct.pack("<II", 1 << 30, 1 << 30)
    file.write_bytes(content)
    with pytest.raises(ValueError, match=r"a\.npz: array 'a' cannot be read"):
        safe_npz.memory_map(file, "a")


def test_objects_are_refused(tmp_path):
    file = tmp_path / "a.npz"
    np.savez(file, a=np.array([{"a": 1}], object))
    with pytest.raises(ValueError, match="array 'a' cannot be read: holds Python objects"):
        safe_npz.memory_map(file, "a")
    with pytest.raises(ValueError, match="array 'b' cannot be read"):
        safe_npz.memory_map(file, "b")


@settings(max_examples=200, deadline=None)
@given(position=st.integers(0, 1 << 30), value=st.integers(0, 255), cut=st.integers(0, 400))
def test_damaged_bytes_never_do_anything_but_raise(tmp_path_factory, position, value, cut):
    """Any byte of a file changed or its end cut off: the array as it was, other numbers, or a ValueError."""
    file = tmp_path_factory.mktemp("damaged") / "a.npz"
    np.savez(file, a=np.arange(12.0).reshape(4, 3))
    content = bytearray(file.read_bytes())
    content = content[: max(len(content) - cut, 1)]
    content[position % len(content)] = value
    file.write_bytes(content)
    with contextlib.suppress(ValueError):
        assert safe_npz.memory_map(file, "a").nbytes <= len(content)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.sampled_from("abc")))
def test_occurrence(images):
    found = naming.occurrence(np.array(images, np.str_), np.array(images, np.str_))
    assert found.tolist() == [images[:row].count(image) for row, image in enumerate(images)]


def test_person():
    """Two people of a sequence, the second in fewer frames; then another sequence."""
    images = np.array(["s/1", "s/2", "s/3", "s/2", "s/3", "t/1", "t/1"])
    sequences = np.array(["s", "s", "s", "s", "s", "t", "t"])
    assert naming.person(images, sequences).tolist() == [0, 0, 0, 1, 1, 0, 1]
    assert naming.person(images[:0], sequences[:0]).tolist() == []


def test_frame_rate():
    labels = [(f"s/{number}", "s") for number in (1, 6, 11, 31)] + [("t/1", "t")]
    assert naming.frame_rate(labels, 50.0) == 10.0
    assert naming.frame_rate(labels[:1], 50.0) is None
    assert naming.frame_rate(labels, None) is None


def test_reading_a_row_does_not_depend_on_its_neighbours(tmp_path):
    frames = data.open("human36m", human36m.write(tmp_path)[0])
    every = frames[:]
    for row in range(12):
        alone = frames[row : row + 1]
        for name in ("joints", "pose", "transl", "betas", "keypoints", "boxes"):
            assert getattr(alone, name)[0].tobytes() == getattr(every, name)[row].tobytes()


def test_packed_files_that_unpack_to_too_much(tmp_path, monkeypatch):
    file, _ = human36m.write(tmp_path, packed=True)
    monkeypatch.setattr("ipman_rs.data.rows.UNPACKED", 5000)
    with pytest.raises(ValueError, match="unpacks to more than .*save it again with numpy.savez"):
        data.open("human36m", file)
    file, _ = human36m.write(tmp_path)
    assert len(data.open("human36m", file)) == 12
