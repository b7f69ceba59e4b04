"""C3D files by the format's manual: every processor's numbers, ezc3d's word for the same files, damage of all kinds."""

from __future__ import annotations

import random
import time

import numpy as np
import pytest

from ipman_rs.data import c3d, c3d_format, force_plates
from tests.helpers.miniatures import c3d_bytes as raw

SUBJECT = ("C7", "LASI", "RASI")


@pytest.fixture
def read(tmp_path):
    def reading(data, **options):
        (tmp_path / "a.c3d").write_bytes(data)
        return c3d.markers(tmp_path / "a.c3d", **options)

    return reading


@pytest.mark.parametrize("processor", [raw.INTEL, raw.DEC, raw.MIPS])
@pytest.mark.parametrize("reals", [True, False])
def test_the_numbers_of_every_processor(processor, reals):
    points = raw.points_of()
    points[1, 2] = -300.0
    analogs = np.arange(8 * 3).reshape(8, 3) - 5.0
    about = [
        raw.parameter(2, "SCALE", [0.5, 2.0, -1.0], processor),
        raw.parameter(2, "OFFSET", [1, 0, -2], processor),
        raw.group(3, "TRIAL", processor),
    ]
    data = raw.c3d(points, analogs, processor=processor, reals=reals, scale=0.25, more=about, missing=[(2, 1)], first=7)
    found = c3d_format.content(data)
    points[2, 1] = np.nan
    np.testing.assert_array_equal(found.points, points * (1 if reals else 0.25))
    np.testing.assert_array_equal(found.analogs, (analogs - [1, 0, -2]) * [0.5, 2.0, -1.0])
    assert found.first == 6
    assert found.notes == ()


def test_unsigned_channels():
    """A converter of 16 bits without a sign: 40000 is no negative number, and its zero lies at 32768."""
    about = [raw.parameter(2, "FORMAT", ["UNSIGNED"]), raw.parameter(2, "OFFSET", [32768])]
    found = c3d_format.content(raw.c3d(analogs=np.full((8, 1), 40000), reals=False, more=about))
    np.testing.assert_array_equal(found.analogs, 40000 - 32768)


@pytest.mark.slow
def test_more_than_255_points_and_more_frames_than_two_bytes_count(tmp_path):
    points = np.ones((3, 300, 3))
    (tmp_path / "a.c3d").write_bytes(raw.c3d(points))
    assert c3d.read(tmp_path / "a.c3d").names[254:257] == ("P254", "P255", "P256")
    points = np.broadcast_to(np.arange(70000.0)[:, None, None] % 30000, (70000, 1, 3))
    ends = [raw.group(3, "TRIAL"), raw.parameter(3, "ACTUAL_START_FIELD", [1, 0])]
    ends += [raw.parameter(3, "ACTUAL_END_FIELD", [70000 - 65536, 1])]
    for frames in (70000 - 65536, 65535):  # as some write it
        data = raw.c3d(points, reals=False, more=ends, header={5: 65535}, point={"FRAMES": frames})
        assert len(c3d_format.content(data).points) == 70000
    assert len(c3d_format.content(raw.c3d(points, reals=False, header={5: 65535}, point={"FRAMES": 7e4})).points) == 7e4
    found = c3d_format.content(raw.c3d(points, reals=False, header={5: 65535}, point={"FRAMES": 65535}))
    assert len(found.points) == 65535
    assert found.notes == ("the first 65535 frames are read: it does not say how many more there are",)


def test_real_files_as_ezc3d_reads_them(shared):
    """To the bit; not btk_type1.C3D, of whose analogue samples ezc3d knows nothing, so that it shifts the points."""
    ezc3d = pytest.importorskip("ezc3d", reason="ezc3d writes and judges C3D files")
    files = [shared("c3d") / "walking2.c3d", *shared("motion").glob("**/*.c3d")]
    assert len(files) == 6
    for path in files:
        ours, theirs = c3d.read(path), ezc3d.c3d(str(path))
        np.testing.assert_array_equal(ours.points, theirs["data"]["points"][:3].transpose(2, 1, 0))
        np.testing.assert_array_equal(ours.analogs, theirs["data"]["analogs"][0].T)
        about = theirs["parameters"]["POINT"]
        names = [name for more in ("", "2") if f"LABELS{more}" in about for name in about[f"LABELS{more}"]["value"]]
        assert list(ours.names) == names[: len(ours.names)]
        assert ours.notes == ()


def test_frames_that_are_not_there():
    """Neither zeros nor the next block: an error."""
    for said in ({"point": {"FRAMES": 10_000}}, {"header": {5: 2000}}, {"point": {"FRAMES": -1}}):
        with pytest.raises(
            ValueError, match=r"expected \d+ frames as it says, \d+ at most fit in: is the download complete"
        ):
            c3d_format.content(raw.c3d(**said))
    more = c3d_format.content(raw.c3d(raw.points_of(frames=5), header={5: 4}))
    assert len(more.points) == 5
    assert more.notes == ("it says 4 and 5 frames; 5 are read",)
    longer = c3d_format.content(raw.c3d() + bytes(1024))
    assert longer.notes == (f"the last {512 - 4 * 3 * 16 + 1024} bytes, behind its 4 frames, are not read",)
    with pytest.raises(ValueError, match="does not say how many frames it has"):
        c3d_format.content(raw.c3d(header={4: 0, 5: 0}, point={"FRAMES": None}))


def test_header_and_parameters_that_disagree():
    found = c3d_format.content(raw.c3d(raw.points_of(60, 5), header={2: 50}))
    np.testing.assert_array_equal(found.points, raw.points_of(60, 5))
    assert "disagree; it is read with 60 points" in found.notes[0]
    with pytest.raises(ValueError, match="its header has 2 points .* its parameters have 3"):
        c3d_format.content(raw.c3d(header={2: 2}))  # a block can be both
    with pytest.raises(ValueError, match="POINT:SCALE is 0, so its integers are no lengths"):
        c3d_format.content(raw.c3d(reals=False, scale=0.0))


@pytest.mark.parametrize(
    ("header", "used", "rate"),
    [({3: 30}, 6, 1000.0), ({3: 30, 10: 5}, 6, 1000.0), ({}, 3, 1000.0), ({}, 12, 1000.0), ({}, 6, 500.0)],
)
def test_analogue_samples_that_disagree(header, used, rate):
    """One wrong number of samples, of channels or of the rate: the file's size and the other two tell which it is."""
    analogs = np.arange(40 * 10 * 6).reshape(400, 6) % 997
    data = raw.c3d(raw.points_of(5, 40), analogs, samples=10, header=header)
    for name, usual, other in (("USED", 6, used), ("RATE", 1000.0, rate)):
        old = raw.parameter(2, name, usual)
        assert data.count(old) == 1
        data = data.replace(old, raw.parameter(2, name, other))
    found = c3d_format.content(data)
    np.testing.assert_array_equal(found.points, raw.points_of(5, 40))
    np.testing.assert_array_equal(found.analogs, analogs)
    assert "header and parameters disagree; it is read with 5 points and 60 samples" in found.notes


def test_analogue_samples_that_cannot_be():
    with pytest.raises(ValueError, match="its header has 3 points and 3 analogue samples .* have 3 and 3 or 6 from"):
        c3d_format.content(raw.c3d(analogs=np.ones((8, 3)), header={3: 3}))  # both end in the same block
    more = raw.c3d(raw.points_of(5, 40), np.ones((400, 6)), samples=10, header={10: 5})
    more = more.replace(raw.parameter(2, "USED", 6), raw.parameter(2, "USED", 7))
    with pytest.raises(ValueError, match="7 channels of 5 or 10 samples a frame cannot be 60 numbers a frame"):
        c3d_format.content(more)


def test_a_rate_that_the_header_says_otherwise():
    right = raw.c3d(raw.points_of(5, 40), np.ones((400, 6)), samples=10)
    assert c3d_format.content(right).notes == ()
    found = c3d_format.content(right.replace(raw.parameter(1, "RATE", 100.0), raw.parameter(1, "RATE", 50.0)))
    assert "its header says 100 Hz, POINT:RATE says 50 Hz, which is believed (`rate`)" in found.notes
    assert "ANALOG:RATE and 10 samples a frame say 100 Hz, POINT:RATE says 50 Hz, which is believed (`rate`)" in (
        found.notes
    )


def test_an_offset_that_is_wrong():
    """As badParameterOffset of BTK's conformance files: the next parameter is where this one ends."""
    for offset in (5, 90):
        more = [raw.group(3, "MANUFACTURER"), raw.parameter(3, "SOFTWARE", ["x"], offset=offset)]
        more += [raw.parameter(3, "VERSION", ["1.2"])]
        found = c3d_format.content(raw.c3d(more=more))
        assert found.parameters["MANUFACTURER"] == {"SOFTWARE": ["x"], "VERSION": ["1.2"]}
        assert found.notes == ("the parameter SOFTWARE says wrongly where the next one is; read one after the other",)


@pytest.mark.parametrize(
    ("record", "what"),
    [
        (raw.parameter(3, "ZERO", [1, 0], sizes=[2] * 255), "its parameter ZERO is damaged"),
        (raw.parameter(3, "ZERO", [1, 0], sizes=[2] * 8), "its parameter ZERO is damaged"),
        (raw.parameter(3, "ZERO", [1, 0], kind=9), "its parameter ZERO is damaged"),
        (raw.parameter(3, "ZERO", [1, 0], sizes=[255, 255, 255]), "its parameter ZERO has 16581375 values, more than"),
        (b"\x04\x00ZERO\x00\x00\x00", "its parameters are damaged"),
    ],
)
def test_parameters_that_cannot_be(tmp_path, record, what):
    (tmp_path / "a.c3d").write_bytes(raw.c3d(more=[raw.group(3, "FORCE_PLATFORM"), record]))
    with pytest.raises(ValueError, match=rf"a\.c3d: expected a C3D file: {what}.*; write it again with Mokka or"):
        c3d.read(tmp_path / "a.c3d")


def test_a_file_without_points():
    with pytest.raises(ValueError, match="its parameters have no group POINT"):
        c3d_format.content(raw.c3d().replace(b"POINT", b"PAINT"))


@pytest.mark.slow
def test_thousands_of_damaged_files(tmp_path):
    """Bytes changed, cut out, put in, cut off: an error that names the file, or a recording; at once, and no more."""
    chance = random.Random(17)
    analogs = np.ones((8, 12))
    plates = [raw.group(3, "FORCE_PLATFORM"), raw.parameter(3, "USED", 2), raw.parameter(3, "TYPE", [2, 4])]
    plates += [raw.parameter(3, "CORNERS", np.arange(24.0).reshape(2, 4, 3)), raw.parameter(3, "ZERO", [1, 0])]
    plates += [raw.parameter(3, "ORIGIN", np.zeros((2, 3))), raw.parameter(3, "CHANNEL", np.arange(12).reshape(2, 6))]
    plates += [raw.parameter(3, "CAL_MATRIX", np.zeros((2, 6, 6)))]
    whole = [raw.c3d(analogs=analogs, processor=each, more=plates) for each in (raw.INTEL, raw.INTEL, raw.MIPS)]
    path, slowest, refused = tmp_path / "a.c3d", 0.0, 0
    for _ in range(1500):
        data = bytearray(chance.choice(whole))
        place, length = chance.randrange(len(data)), chance.randrange(1, 300)
        kind = chance.randrange(6)
        if kind < 3:
            for _ in range(chance.choice([1, 1, 2, 10])):
                data[chance.randrange(len(data))] = chance.choice([0, 1, 127, 128, 255, chance.randrange(256)])
        elif kind == 3:
            del data[place : place + length]
        elif kind == 4:
            data[place:place] = data[chance.randrange(len(data)) :][:length]
        else:
            del data[place:]
        path.write_bytes(data)
        for reader in (c3d.markers, force_plates.read):
            begun = time.perf_counter()
            try:
                reader(path)
            except ValueError as error:
                assert str(error).startswith(f"{path}: ")  # noqa: PT017
                refused += 1
            slowest = max(slowest, time.perf_counter() - begun)
    assert slowest < 2
    assert 500 < refused < 2800


def test_subjects(read):
    names = [f"{who}:{name}" for who in ("Ann", "Bob") for name in SUBJECT]
    points = raw.points_of(6)
    with pytest.raises(
        ValueError, match=r"two people in it, Ann \(3 markers\) and Bob \(3 markers\): say which one .*`subject='Ann'`"
    ):
        read(raw.c3d(points, names=names))
    found = read(raw.c3d(points, names=names), subject="bob", up="y")
    assert found.names == SUBJECT
    np.testing.assert_allclose(found.points, points[:, 3:] / 1000)
    assert found.notes == ("the markers of Bob are taken, those of Ann left out (3)",)
    with pytest.raises(ValueError, match="subject: expected one of Ann, Bob, got 'Cy'"):
        read(raw.c3d(points, names=names), subject="Cy")
    alone = read(raw.c3d(points, names=names, missing=[(frame, p) for frame in range(4) for p in range(3)]))
    assert alone.names == SUBJECT  # who was never seen is not there
    np.testing.assert_array_equal(alone.confidence, 1)
    ball = read(raw.c3d(names=["Ann:C7", "Ann:LASI", "Ball:top"]))
    assert ball.names == ("C7", "LASI", "top")
    assert ball.notes == ("the markers of Ann, Ball are taken as one person's (`subject`: those of one)",)
    with pytest.raises(ValueError, match="subject: expected none, for no marker has one, got 'Ann'"):
        read(raw.c3d(), subject="Ann")


def test_points_without_a_name_and_two_of_one(read):
    points = raw.points_of(7)
    names = ["C7", "", "*", "*12", "Unlabeled 3", "C7", "LASI"]
    found = read(raw.c3d(points, names=names, missing=[(1, 0)]), up="y")
    assert found.names == ("C7", "LASI")
    np.testing.assert_allclose(found.points[:, 0], points[:, 5] / 1000)  # the one that was seen longer
    assert found.notes == (
        "4 points without a name left out",
        "more than one marker is called C7: of each the one that was seen the longest is taken",
    )
    fewer = read(raw.c3d(raw.points_of(3), names=["C7"]))
    assert fewer.names == ("C7",)
    assert fewer.notes == ("2 points without a name left out",)


def test_an_axis_that_is_none(read, tmp_path):
    found = read(raw.c3d(up="QQ"))
    assert found.up == "z"
    assert found.notes == ("its Y_SCREEN is 'QQ', which is no axis: taken as z up (`up`)",)
    assert not any("substring" in each.what for each in force_plates.check(tmp_path / "a.c3d"))


def test_what_a_model_computed(tmp_path):
    names = ["C7", "LASI", "Q1", "LKneeAngles", "CentreOfMass", "LFEO", "LFEA", "LFEL", "LFEP", "LHJC", "PELO"]
    points = raw.points_of(11)
    groups = {"ANGLES": ["Q1"], "MODELED_MARKERS": ["LHJC"]}
    (tmp_path / "a.c3d").write_bytes(raw.c3d(points, names=names, point=groups))
    found = c3d.read(tmp_path / "a.c3d")
    assert found.markers().names == ("C7", "LASI", "PELO")
    assert set(found.outputs) == {*names[2:10]}
    np.testing.assert_allclose(found.center_of_mass(), points[:, 4] / 1000)
    np.testing.assert_array_equal(found.outputs["LKneeAngles"], points[:, 3])
    tracks = c3d.markers(tmp_path / "a.c3d")
    assert tracks.names == ("C7", "LASI", "PELO")
    assert tracks.notes == ("8 outputs of a model are no markers: Q1, LKneeAngles, CentreOfMass, LFEO and 4 more",)
    (tmp_path / "a.c3d").write_bytes(raw.c3d())
    assert c3d.read(tmp_path / "a.c3d").center_of_mass() is None


def test_rotations_without_markers(tmp_path):
    data = raw.c3d(np.zeros((4, 0, 3)), np.ones((8, 1)), names=["x"], more=[raw.group(3, "ROTATION")])
    (tmp_path / "a.c3d").write_bytes(data)
    with pytest.raises(ValueError, match="expected markers, it has rotations of segments only, as Theia writes them"):
        c3d.markers(tmp_path / "a.c3d")


@pytest.mark.parametrize(
    ("unit", "metres"), [("mete", 1.0), ("MM", 1e-3), ("millimeters", 1e-3), ("mill", 1e-3), ("cm", 0.01), ("m", 1.0)]
)
def test_units_of_points(read, unit, metres):
    found = read(raw.c3d(unit=unit), up="y")
    np.testing.assert_allclose(found.points, raw.points_of() * metres, rtol=1e-15)
    with pytest.raises(ValueError, match="units: expected one of m, .* got 'furlong'"):
        read(raw.c3d(unit="furlong"))
