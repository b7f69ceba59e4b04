"""`ipman data`: complete, incomplete and wrong folders."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from click.testing import CliRunner

from ipman_rs.cli import main
from ipman_rs.data import DATASETS, module
from tests.helpers.miniatures import bedlam, human36m, photos, spin, threedpw


def run(*arguments):
    result = CliRunner().invoke(main, ["data", *map(str, arguments)])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout


def test_complete_folder(tmp_path):
    for name in photos.KINDS:
        if "lsp" in name:
            photos.write(tmp_path, name)
    photos.write(tmp_path, "hr-lspet_train_eft.npz", eft=True)
    code, out = run("check", "lsp", tmp_path)
    assert code == 0
    assert "lsp: complete and right" in out
    assert "6 rows with imgname, center, scale, part, openpose, pose, shape" in out


def test_incomplete_folder(tmp_path):
    human36m.write(tmp_path, S=None)
    code, out = run("check", "human36m", tmp_path)
    assert code == 1
    assert "h36m_train_world.npz: not in the folder" in out
    assert "h36m_valid_protocol2.npz: S: no such array" in out
    assert "`ipman data layout human36m` says what is expected" in out


def test_wrong_file_as_json(tmp_path):
    file, _ = human36m.write(tmp_path)
    with np.load(file) as arrays:
        given = dict(arrays)
    spin.save(file, given | {"S_world": given["S_world"] * (1000, 1000, 1000, 1)})
    code, out = run("check", "human36m", file, "--json")
    record = json.loads(out)
    assert code == 1
    assert not record["complete"]
    wrong = [each for each in record["findings"] if each["level"] == "wrong"]
    assert any("looks like millimetres" in each["what"] and each["advice"] == "divide by 1000" for each in wrong)


def test_right_file_as_json(tmp_path):
    code, out = run("check", "human36m", human36m.write(tmp_path)[0], "--json")
    record = json.loads(out)
    assert code == 0
    assert record["complete"]
    assert {each["level"] for each in record["findings"]} == {"ok"}


def test_sequence_files_one_damaged(tmp_path):
    threedpw.write(tmp_path, sequence="a")
    file, _ = threedpw.write(tmp_path, sequence="b")
    file.write_bytes(file.read_bytes()[:1000])
    code, out = run("check", "3dpw", tmp_path)
    assert code == 1
    assert "a.pkl: 9 frames of 2 people" in out
    assert "b.pkl: cannot be read as a pickled sequence of 3DPW" in " ".join(out.split())
    assert "sequenceFiles/test: 2 of 24 sequences" in out


def test_bedlam(tmp_path):
    bedlam.write(tmp_path)
    assert run("check", "bedlam", tmp_path)[0] == 0
    bedlam.write(tmp_path, "broken_6fps.npz", trans_world=None)
    code, out = run("check", "bedlam", tmp_path)
    assert code == 1
    assert "no trans_world among its arrays" in " ".join(out.split())


@pytest.mark.parametrize("name", ["coco", "lsp", "3dpw", "bedlam", "rich-ipman"])
def test_nothing_there(tmp_path, name):
    code, out = run("check", name, tmp_path / "nowhere")
    assert code == 1
    assert "no such file or folder" in " ".join(out.split())
    assert run("check", name, tmp_path)[0] == 1


def test_unknown_name(tmp_path):
    result = CliRunner().invoke(main, ["data", "check", "h36m", str(tmp_path)])
    assert result.exit_code == 2
    assert "expected one of 3dpw, amass" in result.output


def test_every_data_set_says_what_it_expects():
    code, out = run("list")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == list(DATASETS)
    for name in DATASETS:
        assert name == module(name).NAME
        code, out = run("layout", name)
        assert code == 0
        assert len(out.splitlines()) > 5
        assert re.search(r"\bcomes? (from|with)\b", out)
