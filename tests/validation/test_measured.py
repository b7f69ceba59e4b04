"""Forces and centres of mass, made up and real, as they come to a comparison: y up, at its times."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from ipman_rs.validation import measured


@pytest.fixture
def real():
    root = os.environ.get("IPMAN_SHARED_DATA") or Path(__file__).resolve().parents[3] / "shared" / "data"
    if not (Path(root) / "c3d").is_dir():
        pytest.skip(f"measured data are not at {root}: set IPMAN_SHARED_DATA")
    return Path(root)


def table(tmp_path, text, name="com.csv"):
    path = tmp_path / name
    path.write_text(text)
    return path


def test_columns_in_any_order(tmp_path):
    path = table(tmp_path, "com_y_m,time_s,note,com_x_m,com_z_m\n0.9,0,a,0,1\n1.1,0.1,b,2,-1\n")
    assert measured.kind_of(path)[0] == "com"
    found = measured.center_of_mass(path, np.array([0.0, 0.025, 0.1, 0.14, 0.2]))
    np.testing.assert_allclose(found[:3], [[0, 0.9, 1], [0.5, 0.95, 0.5], [2, 1.1, -1]], atol=1e-15)
    assert np.isfinite(found[3]).all()  # files round their times
    assert np.isnan(found[4]).all()


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        ("", "expected rows of numbers, got none"),
        ("0,1,2,3\n0.1,1,2\n", "line 3: expected 4 columns, got 3: is the file complete?"),
        ("0,1,2,x\n", "expected numbers: .*x"),
        ("0,1,2,3\n0,1,2,3\n", "expected times that increase"),
    ],
)
def test_bad_tables(tmp_path, rows, told):
    path = table(tmp_path, f"# time_s,com_x_m,com_y_m,com_z_m (y up)\n{rows}")
    with pytest.raises(ValueError, match=f"com.csv: {told}".replace("?", r"\?")):
        measured.kind_of(path)


def test_tables_of_something_else(tmp_path):
    assert measured.kind_of(table(tmp_path, "a,b\n1,2\n"))[0] is None
    assert measured.kind_of(table(tmp_path, "k\nendheader\ntime\tknee_angle\n0\t1\n", "ik.mot"))[0] is None
    assert not measured.has_plates(table(tmp_path, "nonsense", "walk.c3d"))


@pytest.mark.parametrize(
    ("title", "name", "what"),
    [
        ("Position", "a_BodyKinematics_pos_global.sto", "com"),
        ("Positions", "a_acc.sto", "com"),  # the first line goes before the name
        ("a", "a_pos_global.sto", "com"),
        ("a", "vela.sto", "com"),
        ("Velocity", "a.sto", "it has velocities; the positions are compared"),
        ("Accelerations", "a_pos.sto", "it has accelerations; the positions are compared"),
        ("a", "a_BodyKinematics_vel_global.sto", "it has velocities; the positions are compared"),
        ("a", "acc_a.sto", "it has accelerations; the positions are compared"),
    ],
)
@pytest.mark.parametrize("degrees", ["yes", "no"])
def test_the_positions_of_body_kinematics(tmp_path, title, name, what, degrees):
    """Its three files have the same columns; angles that are in degrees do not matter to a centre of mass."""
    text = f"{title}\nversion=1\nnRows=1\nnColumns=4\ninDegrees={degrees}\nendheader\n"
    path = table(tmp_path, f"{text}time\tcenter_of_mass_X\tcenter_of_mass_Y\tcenter_of_mass_Z\n0\t1\t2\t3\n", name)
    kind, why = measured.kind_of(path)
    assert (kind or why) == what


def test_kinds_of_real_files(real):
    assert measured.kind_of(real / "squat_forceplates" / "squats1_grf.mot")[0] == "forces"
    assert measured.kind_of(real / "gait2354" / "g2354_bodykin.sto")[0] == "com"


def test_plates_of_a_laboratory_with_z_up(real):
    """walking2.c3d in y up, (x, z, −y) of the file's, against its reference in mm, where a foot is on the plate."""
    pytest.importorskip("ezc3d", reason="ezc3d writes and judges C3D files")
    assert measured.has_plates(real / "c3d" / "walking2.c3d")
    found = measured.plates(real / "c3d" / "walking2.c3d")
    lines = (real / "c3d" / "std_cop_walking2_grfs.sto").read_text().splitlines()
    head = next(row for row, line in enumerate(lines) if line.strip() == "endheader") + 1
    reference = dict(
        zip(lines[head].split(), np.array([line.split() for line in lines[head + 1 :]], float).T, strict=True)
    )
    at = found.at(reference["time"])
    for plate in range(2):
        x, y = (1e-3 * reference[f"p{plate + 1}_{axis}"] for axis in (1, 2))
        loaded = reference[f"f{plate + 1}_3"] > 50
        assert loaded.sum() > 5
        wanted = np.stack([x, 0 * x, -y], axis=1)[loaded]
        np.testing.assert_allclose(at.points[loaded, plate], wanted, atol=2e-3)
        np.testing.assert_allclose(at.forces[loaded, plate, 1], reference[f"f{plate + 1}_3"][loaded], atol=1)
