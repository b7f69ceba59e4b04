"""Force plates: the centre of pressure from raw channels, against OpenSim's and ezc3d's, and of known loads."""

from __future__ import annotations

import re

import numpy as np
import pytest

ezc3d = pytest.importorskip("ezc3d", reason="ezc3d writes and judges C3D files")

import ipman_rs.data as data  # noqa: E402
from ipman_rs.data import c3d, force_plates, opensim  # noqa: E402
from ipman_rs.data.tracks import TO_Y_UP  # noqa: E402
from ipman_rs.validation import measured  # noqa: E402
from tests.helpers.miniatures import c3d_bytes, c3d_file  # noqa: E402

T, RATE = 25, 100.0
N = T * c3d_file.SAMPLES


@pytest.fixture
def load(rng):
    """A step: force on the body (N, 3), where (N, 2) relative to a plate, free moment (N,)."""
    phase = np.linspace(0, 1, N)
    up = 700 * np.sin(np.pi * phase) ** 0.5
    force = np.stack([0.1 * up * np.cos(3 * phase), -0.05 * up, up], axis=1)
    return force, np.stack([0.2 * phase - 0.1, 0.05 * np.sin(5 * phase)], axis=1), 4 * np.sin(phase)


def markers():
    time = np.arange(T) / RATE
    walk = np.stack([time, np.zeros(T), np.zeros(T)], axis=1)
    return {name: walk + [0, 0, height] for name, height in (("head", 1.7), ("hip", 0.9), ("left_heel", 0.05))}


def where(middle, offset):
    return np.concatenate([np.asarray(middle)[:2] + offset, np.full((len(offset), 1), middle[2])], axis=1)


def test_walking_against_the_reference_of_opensim(shared):
    """The reference was made by OpenSim's own reader, every 100th sample, in mm and z up."""
    folder = shared("c3d")
    found = force_plates.read(folder / "walking2.c3d")
    told = opensim.plates(opensim.storage(folder / "std_cop_walking2_grfs.sto"), unit="mm", up="z")
    rows = np.round(told.times * 2000).astype(int)
    rows = rows[rows < len(found)]
    ours, theirs = found.points[rows], told.points[: len(rows)]
    loaded = told.loads[: len(rows)] > 50
    assert loaded.sum(axis=0).tolist() == [11, 9]
    off = np.linalg.norm(ours - theirs, axis=-1)[loaded]
    assert off.max() < 1e-9  # m; 2 mm are asked for, the file has eight digits of a millimetre
    np.testing.assert_allclose(found.forces[rows], told.forces[: len(rows)], atol=1e-7)
    np.testing.assert_allclose(found.moments[rows][loaded], told.moments[: len(rows)][loaded], atol=1e-8)
    center = np.linalg.norm(found.center(50)[rows] - told.center(50)[: len(rows)], axis=1)
    assert np.nanmax(center) < 1e-9
    assert np.isfinite(center).sum() == loaded.any(axis=1).sum()


@pytest.mark.slow
def test_walking_against_ezc3d(shared):
    path = shared("c3d") / "walking2.c3d"
    found = force_plates.read(path)
    platforms = ezc3d.c3d(str(path), extract_forceplat_data=True)["data"]["platform"]
    for plate, judge in enumerate(platforms):
        loaded = found.loads[:, plate] > 20
        assert loaded.sum() > 900
        np.testing.assert_allclose(found.forces[:, plate], judge["force"].T, atol=1e-9)
        points = judge["center_of_pressure"].T / 1000
        np.testing.assert_allclose(found.points[loaded, plate], points[loaded], atol=1e-12)
        np.testing.assert_allclose(found.corners[plate], judge["corners"].T / 1000, atol=1e-12)


def test_walking_in_the_common_form(shared):
    frames = data.open("force-plates", shared("c3d") / "walking2.c3d")[:]
    assert frames.frame_rate == 250
    assert frames.joints.shape == (1249, 44, 3)
    assert frames.forces.shape == (1249, 2, 3)
    np.testing.assert_array_equal(frames.ground.normal, [0, 0, 1])
    assert frames.ground.height == 0
    assert frames.names[423] == "walking2/00423"
    c7 = frames.joints[423, frames.joint_names.index("C7")]
    np.testing.assert_allclose(c7, [-1.276, 0.506, 1.495], atol=6e-4)
    loaded = np.isfinite(frames.center_of_pressure).all(axis=1)
    assert loaded.sum() == 249
    assert 1400 / 9.81 > frames.forces[..., 2].sum(axis=1).max() / 9.81 > 80
    # While somebody stands on the plates their centre of pressure lies under them.
    under = np.nanmean(frames.joints[loaded], axis=1) - frames.center_of_pressure[loaded]
    assert np.abs(under[:, :2]).max() < 0.5
    findings = force_plates.check(shared("c3d") / "walking2.c3d")
    assert [each.what for each in findings if each.level == "wrong"] == []
    assert any("2 force plates" in each.what for each in findings)


@pytest.mark.parametrize("reaction", [True, False])
@pytest.mark.parametrize(
    ("kind", "unit", "moments"),
    [(2, "mm", "Nmm"), (2, "m", "Nm"), (2, "mm", "Nm"), (2, "mm", ""), (3, "mm", ""), (3, "m", ""),
     (4, "mm", "Nmm"), (4, "m", "Nm")],
)  # fmt: skip
def test_a_load_whose_place_is_known(tmp_path, load, kind, unit, moments, reaction):
    force, offset, free = load
    middle = np.array([0.8, -0.3, 0.05])
    corners = c3d_file.plate(middle, turn=0.7)
    point = where(middle, offset)
    if kind == 3:
        free = np.zeros(N)
        channels = c3d_file.eight(corners, force, point) * (1 if reaction else -1)
    else:
        channels = c3d_file.six(corners, force, point, free, reaction)
    if kind == 4:
        scale = [1, 1, 1, *[{"mm": 1000.0, "m": 1.0}[unit]] * 3]  # the matrix gives moments in the points' unit
        channels = np.linalg.solve(c3d_file.MATRIX, (channels * scale).T).T / scale
    c3d_file.write(tmp_path / "a.c3d", markers(), RATE, unit, plates=[(kind, corners, channels)], moment_unit=moments)
    found = force_plates.read(tmp_path / "a.c3d")
    assert len(found) == N
    np.testing.assert_allclose(found.times[:2], [0, 1 / RATE / c3d_file.SAMPLES], atol=1e-9)
    # ezc3d writes numbers of 32 bits.
    np.testing.assert_allclose(found.forces[:, 0], force, atol=2e-4)
    loaded = force[:, 2] > 50
    np.testing.assert_allclose(found.points[loaded, 0], point[loaded], atol=2e-6)
    np.testing.assert_allclose(found.moments[loaded, 0], free[loaded, None] * [0, 0, 1], atol=2e-3)
    np.testing.assert_allclose(found.corners[0], corners, atol=1e-6)


def test_two_plates_together_and_between_samples(tmp_path, load):
    force, offset, free = load
    middles = np.array([[0.0, 0.0, 0.0], [0.7, 0.1, 0.0]])
    shares = np.stack([np.linspace(1, 0, N), np.linspace(0, 1, N)], axis=1)
    plates = []
    for middle, share in zip(middles, shares.T, strict=True):
        corners = c3d_file.plate(middle)
        values = c3d_file.six(corners, share[:, None] * force, where(middle, offset), share * free)
        plates.append((2, corners, values))
    c3d_file.write(tmp_path / "a.c3d", markers(), RATE, plates=plates)
    found = force_plates.read(tmp_path / "a.c3d")
    loads = shares * force[:, 2:]
    both = (loads > 20).all(axis=1)
    weighted = loads[:, :1] * where(middles[0], offset) + loads[:, 1:] * where(middles[1], offset)
    expected = weighted[both] / loads[both].sum(axis=1, keepdims=True)
    np.testing.assert_allclose(found.center()[both], expected, atol=5e-6)
    assert np.isnan(found.center()[[0, -1]]).all()  # nobody is on them
    only = (loads[:, 0] < 20) & (loads[:, 1] > 20)
    np.testing.assert_allclose(found.center()[only], where(middles[1], offset)[only], atol=5e-6)
    at = found.at(found.times[10:30:2])
    np.testing.assert_array_equal(at.forces, found.forces[10:30:2])
    np.testing.assert_allclose(at.center(), found.center()[10:30:2], atol=1e-12)
    between = found.at([(found.times[40] + found.times[41]) / 2])
    weights = found.loads[40:42, 0]
    np.testing.assert_allclose(between.points[0, 0], weights @ found.points[40:42, 0] / weights.sum(), atol=1e-12)
    assert np.isnan(found.at([-1.0, 99.0]).forces).all()
    turned = found.turned(TO_Y_UP["z"])
    np.testing.assert_allclose(turned.up, [0, 1, 0])
    np.testing.assert_allclose(turned.loads, found.loads)
    np.testing.assert_allclose(turned.points[both, 0, 1], found.points[both, 0, 2], atol=1e-12)
    frames = data.open("force-plates", tmp_path)[3:9]
    assert frames.forces.shape == (6, 2, 3)
    np.testing.assert_allclose(frames.forces, found.forces[12:36:4], atol=1e-9)
    np.testing.assert_allclose(frames.center_of_pressure, found.center()[12:36:4], atol=1e-9)


def test_recordings_with_and_without_plates(tmp_path, load):
    force, offset, free = load
    corners = c3d_file.plate((0, 0, 0))
    values = c3d_file.six(corners, force, where((0, 0, 0), offset), free)
    c3d_file.write(tmp_path / "a.c3d", markers(), RATE, plates=[(2, corners, values)])
    c3d_file.write(tmp_path / "b.c3d", {"hip": markers()["hip"], "head": markers()["head"]}, RATE)
    found = data.open("force-plates", tmp_path)
    assert len(found) == 2 * T
    frames = found[np.array([T + 1, 3])]
    assert frames.names.tolist() == ["b/00001", "a/00003"]
    assert np.isnan(frames.forces[0]).all()
    assert np.isfinite(frames.forces[1]).all()
    assert frames.joint_names == ("head", "hip", "left_heel")
    np.testing.assert_allclose(frames.joints[0, :2, 2], [1.7, 0.9], atol=1e-6)
    assert np.isnan(frames.joints[0, 2]).all()
    with pytest.raises(ValueError, match="b.c3d: expected force plates"):
        force_plates.read(tmp_path / "b.c3d")


def broken(tmp_path, load, **changes):
    force, offset, free = load
    corners = c3d_file.plate((0, 0, 0)) * changes.pop("size", 1)
    values = c3d_file.six(c3d_file.plate((0, 0, 0)), force, where((0, 0, 0), offset), free)
    c3d_file.write(tmp_path / "a.c3d", markers(), RATE, plates=[(changes.pop("kind", 2), corners, values)], **changes)
    return tmp_path / "a.c3d"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"kind": 7},
            "force plate 1: TYPE: expected one of 1, 2, 3, 4, got type 7 .a Kistler plate",
        ),
        ({"kind": 3}, "force plate 1: CHANNEL: expected 8 of the 6 channels, got 1, 2, 3, 4, 5, 6"),
        ({"force_unit": "V"}, "ANALOG:UNITS: expected N, got 'V': is the plate calibrated"),
        ({"size": 1000}, "CORNERS: expected a plate of a decimetre to two metres, got 600 × 400 m; looks like milli"),
        ({"size": 0}, "CORNERS: expected a plate of a decimetre to two metres, got 0 × 0 m"),
    ],
)
def test_plates_that_cannot_be(tmp_path, load, changes, message):
    with pytest.raises(ValueError, match=message):
        force_plates.read(broken(tmp_path, load, **changes))


def test_millimetres_that_are_said_to_be_metres(tmp_path, load):
    path = broken(tmp_path, load)
    content = ezc3d.c3d(str(path))
    content["parameters"]["POINT"]["UNITS"]["value"] = ["m"]
    content.write(str(path))
    with pytest.raises(ValueError, match="CORNERS: .*looks like millimetres"):
        force_plates.read(path)
    c3d_file.write(path, {name: 1000 * points for name, points in markers().items()}, RATE, "m")
    with pytest.raises(ValueError, match=r"a.c3d: joints: looks like millimetres: a body spans 1650, .*divide by 1000"):
        data.open("force-plates", path)


def test_a_unit_that_is_not_given(tmp_path, load):
    """The markers and the plates of a file without one are taken alike, and both say so."""
    path = broken(tmp_path, load)
    given, markers_given = force_plates.read(path), c3d.markers(path)
    content = ezc3d.c3d(str(path))
    content["parameters"]["POINT"]["UNITS"]["value"] = [""]
    content.write(str(path))
    found, of_markers = force_plates.read(path), c3d.markers(path)
    np.testing.assert_array_equal(found.points, given.points)
    np.testing.assert_array_equal(of_markers.points, markers_given.points)
    note = "its unit of length is not given: taken as mm (`units`)"
    assert note in found.notes
    assert note in of_markers.notes
    assert [each.what for each in force_plates.check(path)].count(f"a.c3d: {note}") == 1
    assert c3d.markers(path, unit=1e-3).notes == markers_given.notes


def test_the_unit_of_a_recording_is_that_of_all_its_lengths(tmp_path, load):
    """The file says metres and means millimetres: plates and centre of mass follow what the user says."""
    push, offset, free = load
    corners = c3d_file.plate((0.3, 0.2, 0))
    values = in_mm(c3d_file.six(corners, push, where((0.3, 0.2, 0), offset), free))
    points = np.stack(list(markers().values()), axis=1)
    found = {}
    for unit in ("mm", "m"):
        path = tmp_path / f"{unit}.c3d"
        path.write_bytes(
            bytes_of([(2, corners, values)], unit=unit, markers_at=points * 1000, names=["C7", "CentreOfMass", "heel"])
        )
        length = 0.001 if unit == "m" else None
        com = measured.center_of_mass(path, np.arange(T) / RATE, length=length)
        found[unit] = (measured.plates(path, length=length), com)
    right, mended = found["mm"], found["m"]
    np.testing.assert_allclose(right[1] @ TO_Y_UP["z"], points[:, 1], atol=1e-6)
    np.testing.assert_array_equal(mended[1], right[1])
    for name in ("forces", "points", "moments", "corners"):
        np.testing.assert_array_equal(getattr(mended[0], name), getattr(right[0], name))
    with pytest.raises(ValueError, match="CORNERS: .*looks like millimetres"):
        measured.plates(path)


def test_z_up_that_is_said_to_be_y_up(tmp_path, load):
    path = broken(tmp_path, load, up="+Y")
    wrong = [each.what for each in force_plates.check(path) if each.level == "wrong"]
    assert any("a.c3d: looks like z up: markers reach from 0.05 m along z over 1.65 m" in what for what in wrong)
    with pytest.raises(ValueError, match=r"a.c3d: looks like z up: that is where its force plates face, .* say up='z'"):
        data.open("force-plates", path)
    assert len(data.open("force-plates", path, up="z")) == T


def test_damaged_and_missing_files(tmp_path, load):
    path = broken(tmp_path, load)
    whole = path.read_bytes()
    for size in (0, 100, 700, len(whole) // 2, len(whole) - 600):
        path.write_bytes(whole[:size])
        with pytest.raises(ValueError, match=r"a\.c3d: expected"):
            c3d.read(path)
        with pytest.raises(ValueError, match=r"a\.c3d: expected"):
            data.open("force-plates", path)
        assert any(each.level == "wrong" and "a.c3d" in each.what for each in force_plates.check(path))
    path.write_bytes(b"no markers in here" * 100)
    with pytest.raises(ValueError, match="a.c3d: expected a C3D file"):
        c3d.read(path)
    with pytest.raises(ValueError, match="b.c3d: expected a .c3d file or a folder of them, not there"):
        data.open("force-plates", tmp_path / "b.c3d")
    (tmp_path / "empty").mkdir()
    with pytest.raises(ValueError, match="none in it"):
        data.open("force-plates", tmp_path / "empty")
    assert force_plates.check(tmp_path / "empty")[0].level == "missing"


def test_a_frame_of_nan(tmp_path, load):
    path = broken(tmp_path, load)
    points = markers()
    points["hip"][7] = np.nan
    c3d_file.write(path, points, RATE)
    frames = data.open("force-plates", path)[:]
    assert np.isnan(frames.joints[7, 1]).all()
    assert np.isfinite(np.delete(frames.joints, 7, axis=0)).all()


def bytes_of(plates, *, units=None, unit="mm", up="+Z", extra=(), scale=1000.0, markers_at=None, names=None):
    """A file of plates [(type, corners (4, 3) m, channels (N, n) in N and mm)], written byte by byte."""
    channels = np.concatenate([values for _, _, values in plates], axis=1)
    numbers = np.arange(1, channels.shape[1] + 1).reshape(len(plates), -1)
    more = [c3d_bytes.group(3, "FORCE_PLATFORM"), c3d_bytes.parameter(3, "USED", len(plates))]
    more += [c3d_bytes.parameter(3, "TYPE", [kind for kind, *_ in plates])]
    more += [c3d_bytes.parameter(3, "CORNERS", np.stack([corners for _, corners, _ in plates]) * scale)]
    more += [c3d_bytes.parameter(3, "ORIGIN", np.array([[0, 0, -c3d_file.DEPTH]] * len(plates)) * scale)]
    more += [c3d_bytes.parameter(3, "CHANNEL", numbers), *extra]
    if units:
        more += [c3d_bytes.parameter(2, "UNITS", units)]
    points = np.stack(list(markers().values()), axis=1) * 1000 if markers_at is None else markers_at
    names = names or [*markers()]
    return c3d_bytes.c3d(points, channels, names=names, samples=c3d_file.SAMPLES, unit=unit, up=up, more=more)


def in_mm(values):
    return values * [1, 1, 1, 1000, 1000, 1000]


@pytest.mark.parametrize(
    ("force", "moment"),
    [("nt", "ntmm"), ("N", "N-mm"), ("Newtons", "N·mm"), ("Newton", "Newton-millimeters"), ("n", "N mm"),
     ("nt", "nt.mm"), ("NT", "NTMM"), ("", ""), ("N", "")],
)  # fmt: skip
def test_spellings_of_units(tmp_path, load, force, moment):
    push, offset, free = load
    corners = c3d_file.plate((0, 0, 0))
    values = in_mm(c3d_file.six(corners, push, where((0, 0, 0), offset), free))
    (tmp_path / "a.c3d").write_bytes(bytes_of([(2, corners, values)], units=[force] * 3 + [moment] * 3))
    found = force_plates.read(tmp_path / "a.c3d")
    loaded = push[:, 2] > 50
    np.testing.assert_allclose(found.points[loaded, 0], where((0, 0, 0), offset)[loaded], atol=2e-6)
    np.testing.assert_allclose(found.moments[loaded, 0, 2], free[loaded], atol=2e-3)
    (tmp_path / "a.c3d").write_bytes(bytes_of([(2, corners, values / 1000)], units=["kN"] * 3 + ["N m"] * 3))
    np.testing.assert_allclose(force_plates.read(tmp_path / "a.c3d").forces[:, 0], push, atol=2e-4)


def test_moments_in_another_unit_than_the_file_says(tmp_path, load):
    """Numbers in N mm that are said to be N m put the centre of pressure a thousand times as far away."""
    push, offset, free = load
    corners = c3d_file.plate((0, 0, 0))
    wrong = in_mm(c3d_file.six(corners, push, where((0, 0, 0), offset), free))
    right, units = wrong / [1, 1, 1, 1000, 1000, 1000], ["N"] * 3 + ["N-m"] * 3
    (tmp_path / "a.c3d").write_bytes(bytes_of([(2, corners, wrong)], units=units))
    told = (
        r"force plate 1: its centre of pressure is \d+(\.\d)? m outside its corners: "
        "are its moments, by the file in 'N-m',"
    )
    with pytest.raises(ValueError, match=f"a.c3d: {told}"):
        force_plates.read(tmp_path / "a.c3d")
    (tmp_path / "a.c3d").write_bytes(bytes_of([(2, corners, wrong), (2, corners, right)], units=units * 2))
    found = force_plates.read(tmp_path / "a.c3d")
    assert found.forces.shape[1] == 1
    assert re.match(f"{told} in another unit.; left out$", found.notes[0])
    assert any(each.level == "odd" and "outside its corners" in each.what for each in force_plates.check(tmp_path))


def test_a_centre_of_pressure_beside_the_plate_and_a_load_of_nobody(tmp_path, load):
    push, offset, free = load
    corners = c3d_file.plate((0, 0, 0))
    values = c3d_file.six(corners, push, where((0, 0, 0), offset + [0.5, 0.0]), free)
    (tmp_path / "a.c3d").write_bytes(bytes_of([(2, corners, in_mm(values))]))
    (note,) = force_plates.read(tmp_path / "a.c3d").notes
    assert re.match(r"force plate 1: its centre of pressure is 0\.2\d* m outside its corners in the median", note)
    values = c3d_file.six(corners, 20 * push, where((0, 0, 0), offset), free)
    (tmp_path / "a.c3d").write_bytes(bytes_of([(2, corners, in_mm(values))]))
    (note,) = force_plates.read(tmp_path / "a.c3d").notes
    assert note.startswith(f"loads of up to {20 * push[:, 2].max():.0f} N, of a person expected up to 10000 N")


@pytest.mark.parametrize("reaction", [True, False])
@pytest.mark.parametrize("units", [["N"] * 6, ["N", "N", "N", "mm", "mm", "Nmm"], [""] * 6])
def test_a_plate_of_type_1(tmp_path, load, units, reaction):
    """Force, centre of pressure and free moment themselves, in the plate's axes; BTS gives all six the unit N."""
    push, offset, free = load
    corners = c3d_file.plate((0.8, -0.3, 0.05), turn=0.7)
    point = where((0.8, -0.3, 0.05), offset)
    x, y = corners[0] - corners[1], corners[1] - corners[2]
    axes = np.stack([x / np.linalg.norm(x), y / np.linalg.norm(y), [0.0, 0.0, -1.0]])
    sign = 1 if reaction else -1
    place = (point - corners.mean(axis=0)) @ axes.T * 1000
    values = np.column_stack([sign * push @ axes.T, place[:, :2], -sign * free * 1000])
    (tmp_path / "a.c3d").write_bytes(bytes_of([(1, corners, values)], units=units))
    found = force_plates.read(tmp_path / "a.c3d")
    np.testing.assert_allclose(found.forces[:, 0], push, atol=2e-4)
    np.testing.assert_allclose(found.points[:, 0], point, atol=1e-6)
    np.testing.assert_allclose(found.moments[:, 0], free[:, None] * [0, 0, 1], atol=1e-6)


def test_plates_that_are_left_out(tmp_path, load):
    push, offset, free = load
    corners = c3d_file.plate((0, 0, 0))
    values = in_mm(c3d_file.six(corners, push, where((0, 0, 0), offset), free))
    good = (2, corners, values)
    for other, why in (
        ((2, 0 * corners, values), "CORNERS: expected a plate of a decimetre to two metres, got 0 × 0 m"),
        ((2, np.nan * corners, values), "CORNERS: expected 12 numbers, got 0"),
        (
            (5, corners, values),
            r"TYPE: .* got type 5 \(eight channels with a matrix\); export its forces",
        ),
        ((21, corners, values), r"TYPE: .* got type 21 \(AMTI's stairs\)"),
        ((99, corners, values), "TYPE: .* got type 99; export"),
    ):
        (tmp_path / "a.c3d").write_bytes(bytes_of([other, good]))
        found = force_plates.read(tmp_path / "a.c3d")
        np.testing.assert_allclose(found.forces[:, 0], push, atol=2e-4)
        assert found.forces.shape[1] == 1
        assert len(found.notes) == 1
        assert re.match(f"force plate 1: {why}.*; left out$", found.notes[0])
        frames = data.open("force-plates", tmp_path / "a.c3d")[:]
        assert frames.forces.shape == (T, 1, 3)
        told = [each.what for each in force_plates.check(tmp_path / "a.c3d") if each.level == "odd"]
        assert told == [f"a.c3d: {found.notes[0]}"]
        (tmp_path / "a.c3d").write_bytes(bytes_of([other, other]))
        with pytest.raises(ValueError, match=f"a.c3d: force plate 1: {why}"):
            force_plates.read(tmp_path / "a.c3d")


def test_corners_in_millimetres_and_points_in_metres(tmp_path, load):
    push, offset, free = load
    corners = c3d_file.plate((0, 0, 0))
    values = in_mm(c3d_file.six(corners, push, where((0, 0, 0), offset), free))
    points = np.stack(list(markers().values()), axis=1)
    (tmp_path / "a.c3d").write_bytes(bytes_of([(2, corners, values)], unit="mete", markers_at=points))
    found = force_plates.read(tmp_path / "a.c3d")
    np.testing.assert_allclose(found.corners[0], corners, atol=1e-6)
    np.testing.assert_allclose(found.points[10, 0], where((0, 0, 0), offset)[10], atol=2e-6)
    assert found.notes == ("the corners of the force plates are in millimetres, its points in mete",)


def test_plates_say_which_axis_is_up_where_the_file_does_not(tmp_path, load):
    push, offset, free = load
    corners = c3d_file.plate((0, 0, 0))
    values = in_mm(c3d_file.six(corners, push, where((0, 0, 0), offset), free))
    turned = corners @ TO_Y_UP["z"].T
    (tmp_path / "a.c3d").write_bytes(bytes_of([(2, turned, values)], up=None))
    assert c3d.read(tmp_path / "a.c3d").up == "y"
    found = force_plates.read(tmp_path / "a.c3d")
    np.testing.assert_allclose(found.forces[:, 0], push @ TO_Y_UP["z"].T, atol=2e-4)


def test_outputs_of_models_and_names_twice_are_no_joints(tmp_path, load):
    push, offset, free = load
    corners = c3d_file.plate((0, 0, 0))
    six = c3d_file.six(corners, push, where((0, 0, 0), offset), free)
    points = markers()
    points |= {"LKneeAngles": 1000 * points["hip"], "CentreOfMass": points["hip"], "hip2": points["hip"] + 0.1}
    labels = ["head", "hip", "left_heel", "LKneeAngles", "CentreOfMass", "hip"]
    c3d_file.write(tmp_path / "a.c3d", points, RATE, plates=[(2, corners, six)], labels=labels)
    frames = data.open("force-plates", tmp_path / "a.c3d")[:]
    assert frames.joint_names == ("head", "hip", "left_heel")
    np.testing.assert_allclose(frames.joints[:, 1], points["hip"], atol=1e-6)
    findings = [(each.level, each.what) for each in force_plates.check(tmp_path / "a.c3d")]
    assert ("ok", "a.c3d: 2 outputs of a model are no markers, its centre of mass is a reference") in findings
    assert any(level == "odd" and "more than one marker is called hip" in what for level, what in findings)
    assert not any(level == "wrong" for level, _ in findings)


@pytest.mark.parametrize("name", ["type-2a", "type-4a", "Gait"])
def test_conformance_files_of_btk_against_ezc3d(shared, name):
    """Whole numbers of a DEC processor, plates of types 2 and 4 with matrices."""
    path = shared("motion") / "c3d_plates" / f"btk_{name}.c3d"
    found = force_plates.read(path)
    for plate, judge in enumerate(ezc3d.c3d(str(path), extract_forceplat_data=True)["data"]["platform"]):
        loaded = found.loads[:, plate] > 20
        assert loaded.sum() > 400
        np.testing.assert_allclose(found.forces[:, plate], judge["force"].T, atol=1e-9)
        points = judge["center_of_pressure"].T / 1000
        np.testing.assert_allclose(found.points[loaded, plate], points[loaded], atol=1e-12)


def test_the_same_steps_by_plates_of_types_2_and_4(shared):
    """BTK's pair of files, whose whole numbers of raw volts round more coarsely: 525 and 584 N at most."""
    two, four = (force_plates.read(shared("motion") / "c3d_plates" / f"btk_type-{kind}.c3d") for kind in ("2a", "4a"))
    np.testing.assert_allclose(np.linalg.norm(two.forces, axis=-1).max(axis=0), [525, 584], atol=0.5)
    np.testing.assert_allclose(np.linalg.norm(four.forces, axis=-1).max(axis=0), [525, 584], atol=1.2)
    loaded = two.loads > 100
    np.testing.assert_allclose(four.points[loaded], two.points[loaded], atol=5e-3)


def test_plates_of_other_laboratories(shared):
    gait = force_plates.read(shared("motion") / "c3d_plates" / "btk_Gait.c3d")
    np.testing.assert_allclose(gait.loads.max(axis=0), [798.7, 855.4], atol=0.1)
    bts = force_plates.read(shared("motion") / "c3d_plates" / "btk_type1.C3D")  # y up, but no word of it
    np.testing.assert_array_equal(bts.up, [0, 1, 0])
    assert bts.loads.max() == pytest.approx(731.7, abs=0.1)
    on = bts.points[bts.loads[:, 0] > 50, 0]
    low, high = bts.corners[0].min(axis=0), bts.corners[0].max(axis=0)
    assert ((on > low - 0.01) & (on < high + 0.01)).all()
    child = c3d.read(shared("motion") / "child_gait" / "HC036A10.c3d")
    np.testing.assert_allclose(child.center_of_mass()[0], [0.296441, 1.059984, 0.728468], atol=1e-6)
    assert {"LKneeAngles", "HEDA", "CentreOfMass", "LHJC"} <= set(child.outputs)
    assert {"LASI", "RASI", "C7"} <= set(child.markers().names)
    assert not set(child.outputs) & set(child.markers().names)
    standing = force_plates.read(shared("motion") / "child_gait" / "HC036A01.c3d")
    assert standing.loads.sum(axis=1).mean() / 9.80665 == pytest.approx(33.8, abs=0.5)
