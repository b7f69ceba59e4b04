"""OpenSim's files: storages, markers, ground forces and centres of mass, real and miniature."""

from __future__ import annotations

import re
import time

import numpy as np
import pytest

import ipman_rs.data as data
from ipman_rs.data import external_loads, opensim
from tests.helpers.miniatures import opensim as miniature

COVERAGE = "sway.trc: no marker on trunk and arms was ever seen: there the body's mean is shown"
Z_UP = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]  # turns y up into z up


@pytest.fixture
def folder(tmp_path):
    miniature.trc(tmp_path / "sway.trc")
    miniature.forces(tmp_path / "sway_grf.mot")
    miniature.center_of_mass(tmp_path / "sway_com.sto")
    return tmp_path


def test_the_miniature_in_the_common_form(folder):
    points = miniature.trc(folder / "sway.trc", missing=[(3, 1)])
    loads, centers = miniature.forces(folder / "sway_grf.mot")
    times, com = miniature.center_of_mass(folder / "sway_com.sto")
    found = data.open("opensim", folder)
    frames = found[:]
    assert len(found) == len(frames) == 30
    assert frames.frame_rate == 60
    assert frames.joint_names == miniature.HEAD
    assert frames.names[7] == "sway/00007"
    assert set(frames.sequences) == {"sway"}
    np.testing.assert_array_equal(frames.ground.normal, [0, 1, 0])
    assert np.isnan(frames.joints[3, 1]).all()
    points[3, 1] = np.nan
    np.testing.assert_allclose(frames.joints, points, atol=1e-9)  # written with a thousandth of a micrometre
    inside = np.arange(30) / 60 <= 0.499
    at = np.round(np.arange(30)[inside] * 1000 / 60)  # the forces' samples, 1000 Hz, next to the markers' times
    near = at.astype(int)
    np.testing.assert_allclose(frames.forces[inside, :, 1], loads[near], atol=2)  # 0.5 ms apart at up to 1400 N/s
    both = (loads[near, :, None] * centers[near]).sum(axis=1) / loads[near].sum(axis=1, keepdims=True)
    np.testing.assert_allclose(frames.center_of_pressure[inside], both, atol=5e-4)
    begin = round(times[0] * 60)
    np.testing.assert_allclose(frames.center_of_mass[begin : begin + 20], com, atol=1e-6)
    assert np.isnan(frames.center_of_mass[: begin - 1]).all()
    some = found[np.array([9, 2, 9])]
    assert some.names.tolist() == ["sway/00009", "sway/00002", "sway/00009"]
    assert [each.what for each in opensim.check(folder) if each.level != "ok"] == [COVERAGE]


def test_forces_on_the_markers_times_exactly(folder):
    miniature.trc(folder / "sway.trc", rate=100.0)
    loads, centers = miniature.forces(folder / "sway_grf.mot")
    frames = data.open("opensim", folder)[:]
    np.testing.assert_allclose(frames.forces[:, :, 1], loads[:300:10], atol=1e-6)
    both = (loads[:300:10, :, None] * centers[:300:10]).sum(axis=1) / 700
    np.testing.assert_allclose(frames.center_of_pressure, both, atol=1e-7)


def test_recordings_that_measured_different_things(folder):
    miniature.trc(folder / "still.trc", names=miniature.HEAD[:4], unit="m")
    found = data.open("opensim", folder)
    frames = found[28:32]
    assert frames.names.tolist() == ["still/00028", "still/00029", "sway/00000", "sway/00001"]
    assert np.isnan(frames.forces[:2]).all()
    assert np.isfinite(frames.forces[2:]).all()
    assert np.isnan(frames.joints[0, 4]).all()
    missing = [each.what for each in opensim.check(folder) if each.level == "missing"]
    assert missing == ["still.trc: no forces", "still.trc: no centre of mass"]


def test_a_centre_of_mass_under_another_name_is_that_of_the_only_one_with_forces(folder):
    miniature.trc(folder / "still.trc")
    (folder / "sway_com.sto").rename(folder / "kinematics.sto")
    assert np.isfinite(data.open("opensim", folder)[30:].center_of_mass).any()


def test_real_squats(shared):
    frames = data.open("opensim", shared("squat_forceplates"))[:]
    assert frames.joints.shape == (1346 + 517, 55, 3)
    assert frames.forces.shape == (1863, 3, 3)
    standing = frames.sequences == "static1"
    weight = frames.forces[standing, :, 1].sum(axis=1).mean() / 9.80665
    assert weight == pytest.approx(60.05, abs=0.01)  # kg; the whole file's mean without the resampling is the same
    table = opensim.storage(shared("squat_forceplates") / "static1_grf.mot")
    assert weight == pytest.approx(sum(table.columns[f"ground_force_{n}_vy"] for n in (1, 2, 3)).mean() / 9.80665)
    np.testing.assert_allclose(np.nanmean(frames.center_of_pressure[standing], 0), [-0.2213, 0.006, -0.6044], atol=1e-4)
    assert np.isfinite(frames.center_of_pressure).all()
    assert [each.what for each in opensim.check(shared("squat_forceplates")) if each.level == "wrong"] == []


def test_real_walking(shared):
    folder = shared("gait2354")
    frames = data.open("opensim", folder)[:]
    assert frames.joints.shape == (300 + 151, 49, 3)
    assert frames.frame_rate == 60
    walking = frames[frames.sequences == "subject01_walk1"]  # OpenSim's CoM of the file g2354_bodykin
    com = walking.center_of_mass
    assert np.isfinite(com).all(axis=1).sum() == 16  # t 0.83 to 1.08 s
    assert 0.95 < np.nanmin(com[:, 1]) < np.nanmax(com[:, 1]) < 1.06
    table = opensim.storage(folder / "g2354_bodykin.sto")
    assert len(table) == 29
    assert table.in_degrees is False
    np.testing.assert_array_equal(
        opensim.center_of_mass(table)[0], [table.columns[f"center_of_mass_{x}"][0] for x in "XYZ"]
    )
    among = np.nanmean(walking.joints[np.isfinite(com).all(axis=1)], axis=1) - com[np.isfinite(com).all(axis=1)]
    assert np.abs(among[:, [0, 2]]).max() < 0.06  # most markers are on the legs
    plates = opensim.plates(opensim.storage(folder / "subject01_walk1_grf.mot"))
    assert plates.forces.shape == (1501, 2, 3)
    np.testing.assert_array_equal(plates.forces[0, 0], [101.5119767, 745.4661142, -47.44870554])
    np.testing.assert_array_equal(plates.points[0, 1], [0.81009656, -0.0075, -0.05354309])
    np.testing.assert_array_equal(plates.moments[0, 0], [0, 13.53783445, 0])


def test_the_old_header_of_simm(shared):
    table = opensim.storage(shared("c3d") / "std_cop_walking2_grfs.sto")
    assert len(table) == 101
    assert table.columns["f1_3"][0] == -14.20642757
    with pytest.raises(ValueError, match=r"looks like millimetres: centres of pressure 718.9 .* say unit='mm'"):
        opensim.plates(table)
    with pytest.raises(ValueError, match=r"looks like z up: loaded plates push along z .* `force_up='z'` if so"):
        opensim.plates(table, unit="mm")
    assert opensim.plates(table, "mm", "z").loads.max() == pytest.approx(948.3, abs=0.1)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected a storage of OpenSim, whose header ends with 'endheader', got another text"),
        ("hello\nendheader\n", "expected a line of column names after the header, the file ends there"),
        ("endheader\ntime\ta\n0\t1\n1\t\n2\t3\n", "line 4: expected 2 columns, got 1: is the file complete"),
        ("endheader\ntime\ta\tb\n0\t1\n", "line 3: expected 3 columns, got 2: is the file complete"),
        ("endheader\ntime\ta\n0\tx\n", "line 3: expected numbers: .*'x'"),
        ("endheader\ntime\ta\n", "expected rows of numbers, got none"),
        ("endheader\na\ttime\n0\t1\n", "line 2: expected the time first and different names, got 'a' first"),
        ("endheader\ntime\ta\ta\n0\t1\t2\n", "line 2: .*got the column 'a' twice"),
        ("endheader\ntime\ta\n1\t1\n1\t2\n", "line 4: expected times that increase, all are 1 s"),
        ("endheader\ntime\ta\n1\t1\n0\t2\n", "line 4: expected times that increase, got 0 s"),
        ("endheader\ntime\ta\n1\t1\nnan\t2\n", "line 4: expected seconds in the column Time, it is blank"),
        ("endheader\ntime\ta\n0\t1\n0.1\t1\n0.1\t1\n7\t1\n", "line 5: expected .*, got 0.1 s again, and the others"),
    ],
)
def test_storages_that_cannot_be(tmp_path, text, message):
    path = tmp_path / "a.mot"
    path.write_text(text)
    with pytest.raises(ValueError, match=f"a.mot: {message}"):
        opensim.storage(path)


def test_half_a_file_and_no_file(folder):
    path = folder / "sway_grf.mot"
    path.write_text(path.read_text()[: path.stat().st_size // 2])
    half = data.open("opensim", folder)[:].forces
    assert np.isfinite(half[0]).all()
    assert np.isnan(half[-1]).all()  # not measured, as far as it tells
    odd = [each.what for each in opensim.check(folder) if each.level == "odd"]
    assert any("sway_grf.mot: its header says" in what for what in odd)
    assert any("is cut short and left out: is the file complete?" in what for what in odd)
    path.unlink()
    assert data.open("opensim", folder)[:].forces is None
    miniature.trc(folder / "sway.trc", cut=3)
    with pytest.raises(ValueError, match="sway.trc: expected a header of 5 lines"):
        data.open("opensim", folder)
    miniature.trc(folder / "sway.trc", frames=0)
    with pytest.raises(ValueError, match="sway.trc: expected markers and samples, got 5 and 0"):
        data.open("opensim", folder)
    with pytest.raises(ValueError, match="expected a .trc file or a folder of them, not there"):
        data.open("opensim", folder / "other.trc")
    (folder / "sway.trc").unlink()
    with pytest.raises(ValueError, match="none in it"):
        data.open("opensim", folder)
    assert opensim.check(folder)[0].level == "missing"
    with pytest.raises(ValueError, match="split: recordings have none, got 'train'"):
        data.open("opensim", folder, split="train")


def test_markers_in_millimetres_that_are_said_to_be_metres(folder):
    text = (folder / "sway.trc").read_text().replace("\tmm\t", "\tm\t")
    (folder / "sway.trc").write_text(text)
    with pytest.raises(ValueError, match="looks like millimetres: a body spans 1[67][0-9]*, .*; divide by 1000"):
        data.open("opensim", folder / "sway.trc")
    (finding,) = (each for each in opensim.check(folder) if each.level == "wrong")
    assert finding.option == "`units='mm'`"
    assert re.match(r"sway.trc: markers: a body spans 1[67]\d\d, expected", finding.what)


def test_forces_and_centres_of_mass_in_other_units(folder):
    miniature.forces(folder / "sway_grf.mot", scale=1000.0)
    with pytest.raises(ValueError, match=r"sway_grf.mot: looks like millimetres: .* or unit='cm' for"):
        data.open("opensim", folder)
    miniature.forces(folder / "sway_grf.mot")
    miniature.center_of_mass(folder / "sway_com.sto", scale=1000.0)
    with pytest.raises(ValueError, match=r"sway_com.sto: looks like millimetres: a centre of mass 9[0-9]+ from"):
        data.open("opensim", folder)
    miniature.center_of_mass(folder / "sway_com.sto", scale=100.0)
    with pytest.raises(ValueError, match=r"sway_com.sto: looks like centimetres: a centre of mass 9[0-9]+"):
        data.open("opensim", folder)
    miniature.center_of_mass(folder / "sway_com.sto", scale=3.0)
    with pytest.raises(ValueError, match=r"sway_com.sto: the centre of mass is 1.15 m outside the markers of"):
        data.open("opensim", folder)


def test_z_up_instead_of_y_up(folder):
    miniature.forces(folder / "sway_grf.mot", turn=Z_UP)
    with pytest.raises(ValueError, match=r"sway_grf.mot: looks like z up: loaded plates push along z"):
        data.open("opensim", folder)
    miniature.trc(folder / "sway.trc", turn=Z_UP)
    (finding,) = (each for each in opensim.check(folder) if each.level == "wrong")
    assert finding.what.startswith("sway.trc: markers: looks like +z up")
    assert finding.option == "`up='z'`"


@pytest.mark.parametrize(
    ("change", "level", "what", "option"),
    [
        ({"turn": [[1, 0, 0], [0, -1, 0], [0, 0, -1]]}, "wrong", "markers: looks like -y up", "`up='-y'`"),
        ({"names": ("Top.Head", "a", "b", "c", "d")}, "wrong", "4 of 5 markers have names without a known place", ""),
        ({"rate": 0.06}, "odd", "0.06 frames a second", "`rate=HZ`"),
        ({"names": ("L.Knee.Lat", *miniature.HEAD[1:])}, "odd", "no marker above the pelvis was ever seen", ""),
        ({"names": ("Top.Head", *miniature.HEAD[1:4], "L.Heel")}, "odd", "more than one marker is called L.Heel", ""),
    ],
)
def test_check_asks_the_judge_of_a_fit(tmp_path, change, level, what, option):
    miniature.trc(tmp_path / "sway.trc", **change)
    found = [each for each in opensim.check(tmp_path) if each.what.startswith(f"sway.trc: {what}")]
    assert [(each.level, each.option) for each in found] == [(level, option)]


def test_check_of_markers_of_another_place(tmp_path):
    """500 m from the origin of the laboratory."""
    miniature.trc(tmp_path / "sway.trc", unit="m", offset=(500.0, 0.0, 0.0))
    (finding,) = (each for each in opensim.check(tmp_path) if each.level == "wrong")
    assert "sway.trc: markers: bodies of a person's size, 500 m from the origin" in finding.what
    assert "from the origin" in finding.what


def test_two_files_of_forces(folder):
    miniature.forces(folder / "sway_grf_filtered.mot")
    with pytest.raises(ValueError, match="expected one of its kind for sway.trc, got another beside it"):
        data.open("opensim", folder)


def test_columns_that_are_missing(folder):
    table = opensim.storage(folder / "sway_com.sto")
    with pytest.raises(ValueError, match=r"sway_com.sto: expected ground forces, .* it has pelvis_X"):
        opensim.plates(table)
    with pytest.raises(ValueError, match=r"sway_grf.mot: no column 'center_of_mass_X'"):
        opensim.center_of_mass(opensim.storage(folder / "sway_grf.mot"))
    with pytest.raises(ValueError, match="unit, up: expected"):
        opensim.plates(table, unit="furlong")


@pytest.mark.parametrize(
    ("header", "note"),
    [
        ("nRows=3\n", "its header says 3 rows, it has 2"),
        (f"nRows={'9' * 5000}\n", "its header says 999999999999… rows, it has 2"),
        ("datarows 1\n", "its header says 1 rows, it has 2"),
        ("nColumns=3\nnRows=2\n", "its header says 3 columns, it has 2"),
        ("nColumns=2\nnRows=2\n", None),
        ("", None),
    ],
)
def test_a_header_that_says_otherwise_is_a_note(tmp_path, header, note):
    """As OpenSim's own running example: OpenSim reads what is there."""
    (tmp_path / "a.mot").write_text(f"x\n{header}endheader\ntime\ta\n0\t1\n0.1\t2\n")
    found = opensim.storage(tmp_path / "a.mot")
    assert found.columns["a"].tolist() == [1, 2]
    assert found.notes == (() if note is None else (note,))


def test_times_rounded_until_they_are_equal(tmp_path):
    """Forces at 240 Hz with two decimals are those of the same instants."""
    rows = "".join(f"{number / 240:.2f}\t{number}\n" for number in range(241))
    (tmp_path / "a.mot").write_text(f"x\nendheader\ntime\ta\n{rows}")
    found = opensim.storage(tmp_path / "a.mot")
    np.testing.assert_allclose(found.times, np.arange(241) / 240, atol=1e-12)
    assert found.notes == ("some times are equal: they are taken as evenly spaced from the first to the last",)


@pytest.mark.parametrize("end", ["0.2\t5", "0.2\t5\t1e-", "0.2\t5\t1.5e"])
def test_a_last_line_that_is_cut_short(tmp_path, end):
    (tmp_path / "a.mot").write_text(f"x\nendheader\ntime\ta\tb\n0\t1\t2\n0.1\t3\t4\n{end}")
    found = opensim.storage(tmp_path / "a.mot")
    assert found.columns["b"].tolist() == [2, 4]
    assert found.notes == ("the last line, 6, is cut short and left out: is the file complete?",)


@pytest.mark.parametrize(
    "nan", ["nan", "NaN", "-nan", "-nan(ind)", "nan(snan)", "-1.#IND", "1.#QNAN", "1.#QNAN0000", "-1.#IND00", "NA"]
)
def test_spellings_of_nan(tmp_path, nan):
    (tmp_path / "a.mot").write_text(f"x\nendheader\ntime\ta\tb\n0\t{nan}\t1\n0.1\t2\t1.#INF\n")
    found = opensim.storage(tmp_path / "a.mot")
    assert np.isnan(found.columns["a"][0])
    np.testing.assert_array_equal(found.columns["b"], [1, np.inf])
    assert found.columns["a"][1] == 2


def test_forces_that_are_missing_for_a_while(tmp_path):
    """NaN are forces that were not measured, and no others'."""
    miniature.forces(tmp_path / "a.mot")
    lines = (tmp_path / "a.mot").read_text().split("\n")
    head = lines.index("endheader") + 2
    for row in range(head + 100, head + 200):
        cells = lines[row].split("\t")
        lines[row] = "\t".join([cells[0], *["-nan(ind)"] * (len(cells) - 1)])
    (tmp_path / "b.mot").write_text("\n".join(lines))
    whole, some = (opensim.plates(opensim.storage(tmp_path / f"{name}.mot")) for name in "ab")
    times = np.array([0.05, 0.15, 0.25])
    np.testing.assert_array_equal(some.at(times).center()[[0, 2]], whole.at(times).center()[[0, 2]])
    assert np.isnan(some.at(times).forces[1]).all()
    assert np.isnan(some.at(times).center()[1]).all()


def test_a_plate_whose_forces_are_no_numbers(folder):
    """Nobody stood on the third, so its columns are NaN; the second lacks some samples."""
    right = opensim.plates(opensim.storage(folder / "sway_grf.mot"))
    table = opensim.storage(folder / "sway_grf.mot")
    columns = {name: values.copy() for name, values in table.columns.items()}
    for axis in "xyz":
        columns[f"1_ground_force_v{axis}"][20:60] = np.nan
        columns |= {f"2_ground_force_{kind}{axis}": np.full(len(table), np.nan) for kind in "vp"}
    found = opensim.plates(opensim.Storage(table.times, columns, None, "three.mot"))
    assert found.notes == (
        "the forces of plate 3 are no numbers: it is left out",
        "the forces of plate 2 are no numbers in 40 of 500 samples",
    )
    np.testing.assert_array_equal(found.forces[60:], right.forces[60:])
    np.testing.assert_array_equal(found.forces[:, 0], right.forces[:, 0])


def test_many_columns_at_once(tmp_path):
    """60,000 columns took minutes when each name was looked for among the earlier ones."""
    labels = ["time", *(f"c{number}" for number in range(60_000))]
    (tmp_path / "a.sto").write_text("endheader\n" + "\t".join(labels) + "\n" + "\t".join(["0"] * len(labels)) + "\n")
    begun = time.perf_counter()
    found = opensim.storage(tmp_path / "a.sto")
    assert len(found.columns) == 60_000
    with pytest.raises(ValueError, match="it has c0, c1, c2, c3, c4, c5, c6, c7, …"):
        opensim.plates(found)
    (tmp_path / "a.sto").write_text("endheader\n" + "\t".join([*labels, "c7"]) + "\n")
    with pytest.raises(ValueError, match="the column 'c7' twice"):
        opensim.storage(tmp_path / "a.sto")
    assert time.perf_counter() - begun < 5


def test_many_markers_at_once(tmp_path):
    names = [f"M{number}" for number in range(20_000)]
    head = "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tNumMarkers\tUnits\n100\t20000\tm\nFrame#\tTime\t"
    (tmp_path / "a.trc").write_text(head + "\t\t\t".join(names) + "\n\n1\t0" + "\t1\t1.5\t2" * 20_000 + "\n")
    begun = time.perf_counter()
    opensim.check(tmp_path / "a.trc")
    assert time.perf_counter() - begun < 5


def test_names_with_blanks_in_them(tmp_path):
    (tmp_path / "a.sto").write_text("x\nendheader\ntime\tleft knee\ta\n0\t1\t2\n")
    assert [*opensim.storage(tmp_path / "a.sto").columns] == ["left knee", "a"]


def test_quiet_standing_of_bmclab(shared):
    """A table without a header; the file has the centre of pressure of both plates itself, to a micrometre."""
    table = opensim.storage(shared("motion") / "results" / "bmclab_PDS13OF1grf.txt")
    assert opensim.has_plates(table)
    found = opensim.plates(table)
    assert found.forces.shape == (6000, 2, 3)
    assert found.loads.sum(axis=1).mean() / 9.80665 == pytest.approx(66.34, abs=0.01)
    own = table.vectors(("COPNET_X", "COPNET_Y", "COPNET_Z"))
    np.testing.assert_allclose(found.center(), own, atol=3e-4)  # theirs is filtered after it was computed
    np.testing.assert_array_equal(found.moments[0], [[0, 1.277981, 0], [0, -0.70602, 0]])


def test_forces_of_another_clock_and_never_loaded(folder):
    """`check` says what `ipman validate` says before a fit."""

    def wrong():
        return [f"{each.what}; {each.advice}" for each in opensim.check(folder) if each.level == "wrong"]

    path = folder / "sway_grf.mot"
    table = opensim.storage(path)
    labels = ["time", *table.columns]
    rows = np.stack([table.times, *table.columns.values()], axis=1)
    miniature.storage(path, labels, rows + np.array([50.0, *[0.0] * (len(labels) - 1)]))
    assert wrong() == [
        "sway_grf.mot: times do not overlap: forces t 50.00 to 50.50 s, markers t 0.00 to 0.48 s; are both of one "
        "recording, with one clock?"
    ]
    miniature.storage(path, labels, rows * np.array([1000.0, *[1.0] * (len(labels) - 1)]))
    assert wrong() == [
        "sway_grf.mot: times look like milliseconds: forces t 0.00 to 499.00 s, markers t 0.00 to 0.48 s; expected "
        "seconds"
    ]
    miniature.storage(path, labels, rows * np.array([1.0, *[1e-3] * (len(labels) - 1)]))  # kilonewtons
    assert wrong() == [
        "sway_grf.mot: no frame has a loaded plate: the largest load is 1 N, expected over 20 N (forces t 0.00 to "
        "0.50 s, markers t 0.00 to 0.48 s); are these the recording's forces, in newtons?"
    ]


def test_forces_on_the_plates(folder):
    """One plate's forces are written as those on it: they are turned, and its centre of pressure stays."""
    path = folder / "sway_grf.mot"
    right = opensim.plates(opensim.storage(path))
    assert right.notes == ()
    table = opensim.storage(path)
    columns = {name: -v if name.startswith("1_ground_force_v") else v for name, v in table.columns.items()}
    miniature.storage(path, ["time", *columns], np.stack([table.times, *columns.values()], axis=1))
    found = opensim.plates(opensim.storage(path))
    np.testing.assert_array_equal(found.forces, right.forces)
    np.testing.assert_array_equal(found.points, right.points)
    assert found.notes == ("the forces of plate 2 point down, as those on the plates do; they were turned round",)
    odd = [each.what for each in opensim.check(folder) if each.level == "odd"]
    assert odd == [COVERAGE, f"sway_grf.mot: {found.notes[0]}"]
    np.testing.assert_allclose(data.open("opensim", folder)[:].forces[5, :, 1].sum(), 700, atol=1e-3)


def test_suffixes_in_capitals(folder):
    (folder / "sway.trc").rename(folder / "Walk01.TRC")
    (folder / "sway_grf.mot").rename(folder / "Walk01_grf.MOT")
    assert data.open("opensim", folder)[:].names[0] == "Walk01/00000"
    found = [each.what for each in opensim.check(folder)]
    assert found[0] == "1 .trc file"
    assert "Walk01.TRC: forces in Walk01_grf.MOT" in found


@pytest.mark.parametrize("plate", [0, 1])
def test_one_plate_of_two_that_carry_as_much_is_turned(plate):
    """One pushes up, the other down, and both to the left: the median of all says z, of the sizes y."""
    forces = np.tile([[[0.0, 350.0, 30.0], [0.0, 350.0, -30.0]]], (50, 1, 1))
    forces[:, 1 - plate, 2], forces[:, plate, 2] = 30.0, -30.0
    places = np.tile([[[0.0, 0.0, -0.1], [0.0, 0.0, 0.1]]], (50, 1, 1))
    written = forces * np.where(np.arange(2) == plate, -1.0, 1.0)[:, None]
    kinds = [(kind, vectors[:, k, axis], k, "xyz"[axis])
             for kind, vectors in (("v", written), ("p", places)) for k in range(2) for axis in range(3)]  # fmt: skip
    columns = {f"ground_force_{k + 1}_{kind}{axis}": values for kind, values, k, axis in kinds}
    found = opensim.plates(opensim.Storage(np.arange(50) / 100, columns, None, "turned.mot"))
    np.testing.assert_array_equal(found.forces, forces)
    (note,) = found.notes
    assert note.startswith(f"the forces of plate {plate + 1} point down")


def test_the_positions_of_body_kinematics(folder):
    """Velocities and accelerations have the same columns; they come first in the alphabet."""
    right = data.open("opensim", folder)[:].center_of_mass
    table = opensim.storage(folder / "sway_com.sto")
    rows = np.stack([table.times, *table.columns.values()], axis=1)
    (folder / "sway_com.sto").unlink()
    for kind, factor in (("acc", 0.1), ("pos", 1.0), ("vel", 0.3)):
        scale = np.array([1.0, *[factor] * len(table.columns)])
        miniature.storage(folder / f"sway_BodyKinematics_{kind}_global.sto", ["time", *table.columns], rows * scale)
    np.testing.assert_array_equal(data.open("opensim", folder)[:].center_of_mass, right)
    assert [each for each in opensim.check(folder) if each.level not in ("ok", "odd")] == []


def test_forces_of_another_place(folder):
    miniature.forces(folder / "sway_grf.mot")
    table = opensim.storage(folder / "sway_grf.mot")
    columns = {name: v + 3.0 if name.endswith("px") else v for name, v in table.columns.items()}
    rows = np.stack([table.times, *columns.values()], axis=1)
    miniature.storage(folder / "sway_grf.mot", ["time", *columns], rows)
    wrong = [each.what for each in opensim.check(folder) if each.level == "wrong"]
    assert len(wrong) == 1
    assert "sway_grf.mot: the centre of pressure is 2.9" in wrong[0]


def test_columns_of_external_loads(folder):
    table = opensim.storage(folder / "sway_grf.mot")
    right = opensim.plates(table)
    names = {name: name.replace("1_ground_force_", "FP2").replace("ground_force_", "FP1") for name in table.columns}
    renamed = opensim.Storage(table.times, {names[n]: v for n, v in table.columns.items()}, None, "renamed.mot")
    loads = external_loads.ExternalLoads(
        "renamed.mot", (external_loads.Load("FP1v", "FP1p", ""), external_loads.Load("FP2v", "FP2p", "")), "loads.xml"
    )
    found = opensim.plates(renamed, loads=loads)
    np.testing.assert_array_equal(found.forces, right.forces)
    np.testing.assert_array_equal(found.points, right.points)
    second = external_loads.Load("1_ground_force_v", "1_ground_force_p", "")
    one = external_loads.ExternalLoads("sway_grf.mot", (second,), "x")
    assert opensim.plates(table, loads=one).notes == ("forces that x does not name are left out: ground_force_vx",)
    gone = external_loads.ExternalLoads("renamed.mot", (external_loads.Load("FP3v", "FP1p", ""),), "loads.xml")
    with pytest.raises(
        ValueError, match="loads.xml: expected three columns that begin with 'FP3v'; renamed.mot has FP1vx"
    ):
        opensim.plates(renamed, loads=gone)
