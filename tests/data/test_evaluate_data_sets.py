"""`ipman evaluate` on miniatures of the data sets: frames are found by name, joints that nobody knows do not count."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner
from miniatures import human36m, rich_ipman

import ipman_rs as ip
from ipman_rs import data
from ipman_rs.body import joints
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
    points = np.nan_to_num(frames.joints)
    points[:, names == "left_wrist", 0] += 0.03
    order = np.arange(len(frames))[::-1]
    guess = tmp_path / "guess.npz"
    np.savez(guess, names=frames.names[order], joints=points[order], joint_names=names)
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


def smplx(path):
    """The light embedded body as an SMPL-X file: its 22 body joints, and hands and a face that move nothing."""
    body = ip.load_body("anny-lite")
    weights = np.zeros((body.num_vertices, 55))
    for j, name in enumerate(body.joint_names):
        weights[:, joints.SMPLX.index(name.replace("hand", "index1"))] += body.weights[:, j]
    regressor = np.zeros((55, body.num_vertices))
    regressor[np.arange(55), np.arange(55) * 20] = 1
    parents = np.array([-1, *joints.SMPL_PARENTS[1:22], *[15] * 3, *[20] * 15, *[21] * 15])
    np.savez(
        path,
        v_template=body().vertices,
        shapedirs=np.zeros((body.num_vertices, 3, 20)),
        posedirs=np.zeros((body.num_vertices, 3, 9 * 54)),
        J_regressor=regressor,
        weights=weights,
        f=body.faces.astype(np.uint32),
        kintree_table=np.stack([parents, np.arange(55)]).astype(np.uint32),
        **{f"hands_mean{side}": np.zeros(45) for side in "lr"},
        **{f"hands_components{side}": np.eye(45) for side in "lr"},
    )


@pytest.mark.parametrize("table", ["biomech", "com"])
def test_the_paper_s_biomechanics(table, tmp_path):
    """MoYo's own bodies against its mat and its centre of mass; the paper's figures stand above."""
    pytest.importorskip("ezc3d", reason="ezc3d is the extra c3d")
    from miniatures import moyo

    moyo.write(tmp_path / "moyo")
    (tmp_path / "models").mkdir()
    for gender in ("FEMALE", "NEUTRAL"):
        smplx(tmp_path / "models" / f"SMPLX_{gender}.npz")
    where = "--path", tmp_path / "moyo", "--models", tmp_path / "models"
    evaluate("truth", "--table", table, *where, "-o", tmp_path / "out")
    record = json.loads((tmp_path / "out" / "evaluation.json").read_text())
    found = record["methods"]["truth"]["figures"]
    frames = data.open("moyo", tmp_path / "moyo")
    measured = np.isfinite(frames[:].center_of_mass).all(axis=1).sum()
    assert {name: each["frames"] for name, each in found.items() if name.startswith("com_error")} == dict.fromkeys(
        ("com_error", "com_error_exact", "com_error_vertex_mean", "com_error_sample_mean", "com_error_face_area"),
        measured,
    )
    assert 0 < measured < len(frames)
    assert found["com_error"]["missing"] == {"not measured": len(frames) - measured}
    assert found["cop_error"]["frames"] == len(frames)
    assert found["pressure_iou"]["frames"] == len(frames)
    assert found["cop_error_chosen"]["mean"] <= found["cop_error"]["mean"]
    page = (tmp_path / "out" / "evaluation.md").read_text()
    assert ("| paper (printed) | – | 0.320 | – | 57.3 | 53.3 |" in page) == (table == "biomech")
    assert ("| CoM samples, mm | 68.5 |" in page) == (table == "com")
