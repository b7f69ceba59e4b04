"""A killed command, run again, ends with the files of one that was not. Twenty kills of each: tools/kill_tests.py."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))

import kill_tests


@pytest.mark.slow
@pytest.mark.parametrize(("command", "needs"), [("evaluate", "pyarrow"), ("render", "embreex")])
def test_a_killed_command_goes_on_to_the_same_files(command, needs):
    pytest.importorskip(needs, reason=f"{needs} is an extra")
    assert kill_tests.kills(command, 1, seed=0) == []
