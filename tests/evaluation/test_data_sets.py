"""`ipman evaluate` on miniatures of the data sets: frames are found by name, joints that nobody knows do not count."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

from ipman_rs import data
from ipman_rs.cli import main
from tests.helpers.miniatures import human36m, models, rich_ipman


def evaluate(*arguments):
    done = CliRunner().invoke(main, ["evaluate", *map(str, arguments)])
    assert done.exit_code == 0, done.output
    return done.output


@pytest.mark.parametrize(
    ("table", "name", "module", "number"),
    [("h36m", "human36m", human36m, 17), ("rich", "rich-ipman", rich_ipman, 24)],
)
def test_joints_alone_are_compared_by_name(table, name, module, number, tmp_path):
    """Predictions that are the true joints, one of them 30 mm off: MPJPE is 30 mm over the number of known joints."""
    file, _ = module.write(tmp_path)
    frames = data.open(name, file)[:]
    known = np.isfinite(frames.joints).all(axis=(0, 2))
    assert known.sum() == number
    names = np.array(frames.joint_names)
    points = np.nan_to_num(frames.joints)
    points[:, names == "left_wrist", 0] += 0.03
    order = np.arange(len(frames))[::-1]
    guess = tmp_path / "guess.npz"
    np.savez(guess, names=frames.names[order], joints=points[order], joint_names=names)
    said = evaluate(guess, "--table", table, "--path", file, "-o", tmp_path / "out")
    assert "IPMAN-R" in said
    found = json.loads((tmp_path / "out" / "evaluation.json").read_text())["methods"]["guess"]["figures"]
    assert found["mpjpe"]["mean"] == pytest.approx(0.03 / number, abs=1e-6)  # float32 joints
    assert found["mpjpe"]["frames"] == len(frames)
    assert 0 < found["pa_mpjpe"]["mean"] < 0.006  # the wrist's way is shared by all joints
    page = (tmp_path / "out" / "evaluation.md").read_text()
    assert f"guess: {number} joints (right_ankle, " in page
    assert "truth by the joints that the data set gives, estimate by the joints that the predictions give;" in page
    assert "BoSE strict: not to be had without a body model for the predictions, and a ground" in page.replace(
        "BoSE, ", ""
    )


@pytest.mark.slow
@pytest.mark.parametrize("table", ["biomech", "com"])
def test_the_paper_s_biomechanics(table, tmp_path):
    """MoYo's own bodies against its mat and its centre of mass; the paper's figures stand above."""
    pytest.importorskip("ezc3d", reason="ezc3d writes and judges C3D files")
    from tests.helpers.miniatures import moyo

    moyo.write(tmp_path / "moyo")
    (tmp_path / "models").mkdir()
    for gender in ("FEMALE", "NEUTRAL"):
        models.smplx(tmp_path / "models" / f"SMPLX_{gender}.npz")
    where = "--path", tmp_path / "moyo", "--models", tmp_path / "models"
    evaluate("truth", "--table", table, *where, "-o", tmp_path / "out")
    record = json.loads((tmp_path / "out" / "evaluation.json").read_text())
    found = record["methods"]["truth"]["figures"]
    frames = data.open("moyo", tmp_path / "moyo", split="val", frames="selected")
    assert len(frames) == 2  # a still frame of each session's sequence
    measured = np.isfinite(frames[:].center_of_mass).all(axis=1).sum()
    assert {name: each["frames"] for name, each in found.items() if name.startswith("com_error")} == dict.fromkeys(
        ("com_error", "com_error_exact", "com_error_vertex_mean", "com_error_sample_mean", "com_error_face_area"),
        measured,
    )
    assert 0 < measured < len(frames)
    assert found["com_error"]["missing"] == {"not measured": len(frames) - measured}
    assert found["cop_error"]["frames"] == len(frames)
    assert found["pressure_iou"]["frames"] == len(frames)
    assert found["cop_error_chosen"]["mean"] <= found["cop_error"]["mean"] + 1e-12
    page = (tmp_path / "out" / "evaluation.md").read_text()
    assert ("| paper (printed) | – | 0.320 | – | 57.3 | 53.3 |" in page) == (table == "biomech")
    assert ("| CoM samples, mm | 68.5 |" in page) == (table == "com")
