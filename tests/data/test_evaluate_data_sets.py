"""`ipman evaluate` on miniatures of the data sets: frames are found by name, joints that nobody knows do not count."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner
from miniatures import human36m, rich_ipman

from ipman_rs import data
from ipman_rs.cli import main


def evaluate(*arguments):
    done = CliRunner().invoke(main, ["evaluate", *map(str, arguments)])
    assert done.exit_code == 0, done.output
    return done.output


@pytest.mark.parametrize(
    ("table", "name", "module", "number"),
    [("h36m", "human36m", human36m, 17), ("rich", "rich-ipman", rich_ipman, 24)],
)
def test_a_table_of_the_paper(table, name, module, number, tmp_path):
    """Predictions that are the true joints, one of them 30 mm off: MPJPE is 30 mm over the number of known joints."""
    file, _ = module.write(tmp_path)
    frames = data.open(name, file)[:]
    known = np.isfinite(frames.joints).all(axis=(0, 2))
    assert known.sum() == number
    names = np.array(frames.joint_names)
    joints = np.nan_to_num(frames.joints)
    joints[:, names == "left_wrist", 0] += 0.03
    order = np.arange(len(frames))[::-1]
    guess = tmp_path / "guess.npz"
    np.savez(guess, names=frames.names[order], joints=joints[order], joint_names=names)
    said = evaluate(guess, "--table", table, "--path", file, "-o", tmp_path / "out")
    assert "IPMAN-R (printed)" in said
    found = json.loads((tmp_path / "out" / "evaluation.json").read_text())["methods"]["guess"]["figures"]
    assert found["mpjpe"]["mean"] == pytest.approx(0.03 / number, abs=1e-6)  # float32 joints
    assert found["mpjpe"]["frames"] == len(frames)
    assert 0 < found["pa_mpjpe"]["mean"] < 0.006  # the wrist's way is shared by all joints
    page = (tmp_path / "out" / "evaluation.md").read_text()
    assert "BoSE strict: not to be had without a body model for the predictions, and a ground" in page.replace(
        "BoSE, ", ""
    )
