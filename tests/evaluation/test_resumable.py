"""Work in pieces: what is kept, what is done again, and what is refused."""

from __future__ import annotations

import hashlib
import json

import numpy as np
import pytest

from ipman_rs.evaluation.tables.resumable import Resumable


class Squares(Resumable):
    def __init__(self, folder, **manifest):
        self.folder, self.options = folder, manifest

    @property
    def pieces_folder(self):
        return self.folder

    @property
    def manifest(self):
        return self.options


def test_a_piece_is_kept_by_those_who_make_the_same(tmp_path):
    work, same, other = Squares(tmp_path, power=2), Squares(tmp_path, power=2), Squares(tmp_path, power=3)
    assert not work.done(1)
    work.save(1, {"values": np.arange(4) ** 2})
    assert work.done(1)
    assert same.done(1)
    assert not other.done(1)
    assert list(work.result(1)) == ["values"]
    np.testing.assert_array_equal(same.result(1)["values"], [0, 1, 4, 9])
    with np.load(tmp_path / "000001.npz") as stored:
        assert str(stored["key"]) == hashlib.sha256(json.dumps({"power": 2}).encode()).hexdigest()
    work.file(1).write_bytes(work.file(1).read_bytes()[:-40])
    assert not work.done(1)


def test_a_folder_of_something_else_is_refused(tmp_path):
    Squares(tmp_path, power=2, piece=4).check_folder(tmp_path, "squares")  # nothing is there yet
    Squares(tmp_path, power=2, piece=4).mark_folder(tmp_path)
    Squares(tmp_path, power=2, piece=4).check_folder(tmp_path, "squares")
    with pytest.raises(ValueError, match=r"holds squares \(piece, new differ\); choose another folder"):
        Squares(tmp_path, power=2, piece=5, new=1).check_folder(tmp_path, "squares")
    with pytest.raises(ValueError, match=r"holds squares \(piece differ\)"):
        Squares(tmp_path, power=2).check_folder(tmp_path, "squares")
