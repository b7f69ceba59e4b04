"""Damaged, hostile and mistaken model files: a ValueError that names the file, nothing run, nothing allocated."""

from __future__ import annotations

import pickle
import struct
import tracemalloc
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ipman_rs as ip
from ipman_rs.files import safe_npz, safe_pickle

MUCH = 1 << 31  # what hostile headers ask for
LITTLE = 20 << 20  # what reading them may cost


@pytest.fixture
def arrays(random_arrays):
    return random_arrays(24, 40, 10)


def refused(path, match):
    """`path` is refused with a message that names it, and without allocating what it claims."""
    tracemalloc.start()
    with pytest.raises(ValueError, match=match) as caught:
        ip.load_body(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert str(path) in str(caught.value)
    assert peak < LITTLE


def op_global(name):
    return b"c" + name.replace(".", "\n", 1).encode() + b"\n"


class Runs:
    """Would create a file when unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


@pytest.mark.parametrize("protocol", range(6))
def test_code_is_refused_by_name_and_not_run(tmp_path, arrays, protocol):
    victim = tmp_path / "victim"
    path = tmp_path / "evil.pkl"
    path.write_bytes(pickle.dumps(arrays | {"extra": Runs(victim)}, protocol))
    refused(path, r"names (io|_io|__builtin__)\.open, which no body model needs; it is refused")
    assert not victim.exists()


@pytest.mark.parametrize(
    "name",
    ["os.system", "posix.system", "builtins.eval", "__builtin__.apply", "builtins.getattr", "operator.attrgetter",
     "numpy.load", "numpy.core.multiarray.fromfile", "scipy.sparse.coo_matrix", "chumpy.ch.wrt", "functools.partial"],
)  # fmt: skip
def test_globals_off_the_list(tmp_path, name):
    module, _, attribute = name.rpartition(".")
    path = tmp_path / "evil.pkl"
    path.write_bytes(f"c{module}\n{attribute}\n(S'x'\ntR.".encode())
    refused(path, name.replace(".", r"\."))


HUGE_ARRAY = (
    b"\x80\x02}(X\x0a\x00\x00\x00v_templatecnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\nJ"
    + struct.pack("<i", MUCH - 1)
    + b"\x85C\x01b\x87Ru."
)
HUGE_STATE = pickle.dumps({"v_template": np.zeros((7, 3))}, 2).replace(
    b"K\x07K\x03\x86", b"J" + struct.pack("<i", MUCH - 1) + b"K\x03\x86"
)


@pytest.mark.parametrize(
    "data",
    [
        HUGE_ARRAY,
        HUGE_STATE,
        b"\x80\x04\x8e" + struct.pack("<Q", MUCH) + b"x.",  # bytes
        b"\x80\x05\x96" + struct.pack("<Q", MUCH) + b"x.",  # bytearray
        b"\x80\x04\x8d" + struct.pack("<Q", MUCH) + b"x.",  # text
        b"\x80\x02\x8b" + struct.pack("<i", MUCH - 1) + b"x.",  # a long integer
        b"\x80\x04\x95" + struct.pack("<Q", MUCH) + b"N.",  # a frame
        b"\x80\x02Nr" + struct.pack("<I", MUCH) + b".",  # a memo index
        b"c__builtin__\nbytearray\n(J\xff\xff\xff\x7ftR.",
        b"c__builtin__\nbytes\n(J\xff\xff\xff\x7ftR.",
    ],
    ids=["array", "array-state", "bytes", "bytearray", "text", "long", "frame", "memo", "bytearray-call", "bytes-call"],
)
def test_small_files_that_ask_for_gigabytes(tmp_path, data):
    path = tmp_path / "huge.pkl"
    path.write_bytes(data)
    assert len(data) < 500
    refused(path, "huge.pkl")


def test_oversized_file(tmp_path):
    path = tmp_path / "big.pkl"
    with path.open("wb") as stream:
        stream.truncate(safe_pickle.MAX_BYTES + 1)  # a hole: no disk is used
    refused(path, "more than any body model has")


@pytest.mark.slow
def test_deep_nesting_does_not_overflow_the_stack(tmp_path):
    path = tmp_path / "deep.pkl"
    path.write_bytes(b"\x80\x02}N" + b"\x85" * 1_000_000 + b"Ns.")
    with pytest.raises(ValueError, match="dictionary key that is neither text nor a number"):
        ip.load_body(path)


@pytest.mark.parametrize(
    ("data", "match"),
    [
        (b"", "Ran out of input|EOFError"),
        (b"# a text file\n", "cannot be read as a pickled body model"),
        (b"\x80\x02]q\x00.", "found a list"),
        (b"\x80\x02U\x02idQ.", "cannot be read"),  # a persistent id
        (b"\x80\x02\x82\x01.", "cannot be read"),  # an extension code
        (op_global("_codecs.encode") + b"}U\x0c__defaults__Nsb.", "tries to set the state of a function"),
        (op_global("chumpy.Ch") + b"}U\x07resolveNsb.", "tries to set the state of a type"),
    ],
    ids=["empty", "text", "list", "persistent", "extension", "state-of-function", "state-of-class"],
)
def test_pickles_that_are_no_body_model(tmp_path, data, match):
    path = tmp_path / "bad.pkl"
    path.write_bytes(data)
    refused(path, match)


def test_truncated_pickle(tmp_path, arrays):
    whole = pickle.dumps(arrays, 2)
    path = tmp_path / "cut.pkl"
    for length in np.linspace(0, len(whole) - 1, 40).astype(int):
        path.write_bytes(whole[:length])
        refused(path, "cannot be read as a pickled body model")


def test_sparse_matrix_that_claims_too_much(tmp_path, arrays, write_upstream):
    path = write_upstream(arrays)
    data = path.read_bytes()
    assert data.count(b"K\x18K(\x86") >= 1  # the shape (24, 40)
    path.write_bytes(data.replace(b"K\x18K(\x86", b"J\xff\xff\xff\x7fK(\x86"))
    refused(path, "J_regressor: expected shape")


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(st.data())
def test_any_damage_gives_a_model_or_a_value_error(tmp_path_factory, data):
    rng = np.random.default_rng(0)
    content = {"v_template": rng.normal(size=(3, 3)), "f": np.zeros((1, 3), np.uint32), "text": "x"}
    whole = bytearray(pickle.dumps(content, data.draw(st.sampled_from([0, 2, 4, 5]))))
    for _ in range(data.draw(st.integers(1, 4))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "damaged.pkl"
    path.write_bytes(whole)
    with pytest.raises(ValueError, match="damaged.pkl"):  # at best: keys are missing
        ip.load_body(path)


BROKEN = {
    "missing": (lambda a: a.pop("weights"), "no array 'weights' in it"),
    "rank": (lambda a: a.update(v_template=a["v_template"].ravel()), r"v_template: expected shape \(any, 3\)"),
    "weights": (
        lambda a: a.update(weights=a["weights"][:, :20]),
        r"weights: expected shape \(40, 24\), got \(40, 20\)",
    ),
    "regressor": (lambda a: a.update(J_regressor=a["J_regressor"].T), r"J_regressor: expected shape \(24, 40\)"),
    "posedirs": (lambda a: a.update(posedirs=a["posedirs"][..., :9]), r"posedirs: expected shape \(40, 3, 207\)"),
    "joints": (lambda a: a.update(kintree_table=a["kintree_table"][:, :17]), "expected 24 .* joints, found 17"),
    "tree": (lambda a: a["kintree_table"].__setitem__((0, 3), 5), "must name an earlier joint"),
    "face": (lambda a: a["f"].__setitem__((0, 0), 40), "face indices must lie in 0 to 39"),
    "empty": (lambda a: a.update(f=np.zeros((0, 3), np.uint32)), r"f: expected shape \(any, 3\), got \(0, 3\)"),
    "nan": (lambda a: a["v_template"].__setitem__((0, 0), np.nan), "v_template: has NaN or infinite"),
    "text": (lambda a: a.update(weights=np.full((40, 24), "x")), "weights: expected numbers"),
}


@pytest.mark.parametrize("suffix", ["npz", "pkl"])
@pytest.mark.parametrize("kind", BROKEN)
def test_wrong_content(tmp_path, arrays, kind, suffix):
    damage, match = BROKEN[kind]
    damage(arrays)
    path = tmp_path / f"wrong.{suffix}"
    if suffix == "npz":
        np.savez(path, **arrays)
    else:
        path.write_bytes(pickle.dumps(arrays, 2))
    refused(path, match)


def test_objects_in_needed_arrays(tmp_path, arrays):
    arrays["weights"] = np.array([Runs(tmp_path / "victim")], dtype=object)
    np.savez(tmp_path / "o.npz", **arrays)
    refused(tmp_path / "o.npz", "'weights' cannot be read: holds Python objects")
    arrays["weights"] = np.array([1, "a"], dtype=object)
    (tmp_path / "o.pkl").write_bytes(pickle.dumps(arrays))
    refused(tmp_path / "o.pkl", "weights: array of Python objects")
    assert not (tmp_path / "victim").exists()


def test_npz_that_claims_more_than_it_carries(tmp_path, arrays):
    path = tmp_path / "claims.npz"
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (%d, 3), }" % MUCH
    header = header.ljust(117) + b"\n"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("v_template.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + b"\0" * 24)
    refused(path, "claims shape .* but carries 24 bytes")


def test_zip_bomb(tmp_path, arrays, monkeypatch):
    monkeypatch.setattr(safe_npz, "MAX_BYTES", 1 << 20)
    np.savez_compressed(tmp_path / "bomb.npz", v_template=np.zeros((1 << 20, 3)))
    refused(tmp_path / "bomb.npz", "unpacks to .* bytes, more than the .* that are read")


def test_damaged_npz(tmp_path, arrays):
    whole = tmp_path / "whole.npz"
    np.savez_compressed(whole, **arrays)
    data = whole.read_bytes()
    path = tmp_path / "cut.npz"
    for length in np.linspace(0, len(data) - 1, 10).astype(int):
        path.write_bytes(data[:length])
        refused(path, "not a .npz file")
    middle = data.find(b"v_template.npy") + 60
    path.write_bytes(data[:middle] + b"\xff" * 40 + data[middle + 40 :])
    refused(path, "'v_template' cannot be read")


def test_names_and_paths(tmp_path):
    with pytest.raises(ValueError, match="no body 'any': it is neither one of anny, anny-lite nor a file"):
        ip.load_body("any")
    with pytest.raises(ValueError, match="nor a file"):
        ip.load_body(tmp_path)
    (tmp_path / "mesh.obj").write_text("v 0 0 0\n")
    with pytest.raises(ValueError, match=r"a body model is a .npz or a .pkl file, not '.obj'"):
        ip.load_body(tmp_path / "mesh.obj")
    np.savez(tmp_path / "amass.npz", poses=np.zeros((5, 156)), trans=np.zeros((5, 3)))
    with pytest.raises(ValueError, match="no array 'v_template' in it .it has poses, trans.*not a motion"):
        ip.load_body(tmp_path / "amass.npz")
