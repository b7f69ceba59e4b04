"""TRC files in the dialects of the programs that write them."""

from __future__ import annotations

import time

import numpy as np
import pytest

from ipman_rs.data import trc

NAMES = ("C7", "L.ASIS", "R.ASIS")
ROWS = np.arange(1, 28).reshape(3, 3, 3) * 10.0  # 3 frames of 3 markers, mm


def text(rows, names=NAMES, units="mm", tab="\t", rate="100", frames=None, markers=None, blank=True, axes=True):
    """A file whose columns `tab` parts; `rows` are texts, or (T, M, 3) numbers at 100 Hz."""
    if not isinstance(rows[0], str):
        rows = [
            tab.join([str(number + 1), f"{number / 100:g}", *(f"{value:g}" for value in np.ravel(points))])
            for number, points in enumerate(rows)
        ]
    fields = [
        "DataRate",
        "CameraRate",
        "NumFrames",
        "NumMarkers",
        "Units",
        "OrigDataRate",
        "OrigDataStartFrame",
        "OrigNumFrames",
    ]
    values = [rate, rate, str(frames or len(rows)), str(markers or len(names)), units, rate, "1", str(len(rows))]
    between = "\t\t\t" if tab == "\t" else tab
    lines = ["PathFileType\t4\t(X/Y/Z)\tx.trc", tab.join(fields), tab.join(values)]
    lines.append(f"Frame#{tab}Time{tab}" + between.join(names) + ("\t\t" if tab == "\t" else ""))
    if axes:
        lines.append(f"{tab}{tab}" + tab.join(f"{axis}{number + 1}" for number in range(len(names)) for axis in "XYZ"))
    return "\n".join([*lines, *([""] if blank else []), *rows, ""])


@pytest.fixture
def read(tmp_path):
    def reading(content, encoding="utf-8", **options):
        (tmp_path / "a.trc").write_bytes(content.encode(encoding))
        return trc.read(tmp_path / "a.trc", **options)

    return reading


def same(found, names=NAMES, points=ROWS):
    assert found.names == tuple(names)
    np.testing.assert_allclose(found.points, points / 1000, rtol=1e-15)
    np.testing.assert_array_equal(found.confidence, 1)
    np.testing.assert_allclose(found.times, np.arange(len(points)) / 100)


@pytest.mark.parametrize("tab", ["\t", "\t\t", "\t \t", "  ", " ", "\t  "])
@pytest.mark.parametrize("blank", [True, False])
def test_whatever_parts_the_columns(read, tab, blank):
    same(read(text(ROWS, tab=tab, blank=blank)))


@pytest.mark.parametrize("mark", [",", ";"])
def test_columns_of_spreadsheets(read, mark):
    same(read(text(ROWS).replace("\t", mark)))
    gap = read(text(["1\t0\t\t\t\t10\t20\t30\t1\t2\t3"]).replace("\t", mark))
    np.testing.assert_array_equal(gap.confidence, [[0, 1, 1]])


def test_no_marker_has_a_name(read):
    with pytest.raises(ValueError, match="expected markers with names, none of its 3 points has one: label them"):
        read(text(ROWS, names=("*1", "*2", "*3")))


def test_doubled_tabs_in_the_values_alone(read):
    """As OpenSim's example markers_walk.trc."""
    lines = text(ROWS).split("\n")
    lines[2] = "  100.0\t\t  100.0\t\t    3\t\t     3\t\t mm\t  100.0\t      1\t    3"
    same(read("\n".join(lines)))
    lines[2] = lines[2].replace("mm", "  ")
    found = read("\n".join(lines))
    same(found)  # nobody is 250 m long
    assert found.notes == ("its unit of length is not given: taken as mm (`units`)",)


def test_doubled_tabs_in_the_rows_alone(read):
    lines = text(ROWS).split("\n")
    same(read("\n".join([*lines[:6], *(line.replace("\t", "\t\t") for line in lines[6:])])))
    same(read("\n".join([*lines[:6], *(line.replace("\t", "  ") for line in lines[6:])])))


def test_an_empty_column_is_a_gap_where_tabs_are_single(read):
    found = read(text(["1\t0\t\t\t\t10\t20\t30\t \t \t ", "2\t0.01\t1\t2\t3\t\t\t\t4\t5\t6"]))
    np.testing.assert_array_equal(found.confidence, [[0, 1, 0], [1, 0, 1]])
    np.testing.assert_allclose(found.points[0, 1], [0.01, 0.02, 0.03])
    np.testing.assert_allclose(found.points[1, 2], [0.004, 0.005, 0.006])
    assert found.notes == ()


@pytest.mark.parametrize("gap", [[""] * 3, ["5", "", "6"]])
@pytest.mark.parametrize("marker", [0, 1, 2])
def test_an_empty_column_is_a_gap_where_tabs_are_doubled(read, gap, marker):
    """Eleven columns have ten pairs of tabs between them, whatever is in them."""
    cells = ["1", "2", "3", "4", "5", "6", "7", "8", "9"]
    cells[3 * marker : 3 * marker + 3] = gap
    whole = "2\t\t0.01\t\t" + "\t\t".join("987654321")
    found = read(text(["\t\t".join(["1", "0", *cells]), whole], tab="\t\t"))
    expected = np.ones((2, 3))
    expected[0, marker] = 0
    np.testing.assert_array_equal(found.confidence, expected)
    np.testing.assert_allclose(found.points[1], np.arange(9, 0, -1).reshape(3, 3) / 1000)
    np.testing.assert_allclose(found.points[0, marker - 1], np.arange(1, 10).reshape(3, 3)[marker - 1] / 1000)


def test_gaps_never_shift_columns_where_markers_without_a_name_follow(read):
    """Ten words for the first row would be as many as the names need, without the gap."""
    rows = ["1\t0\t\t\t\t10\t20\t30\t40\t50\t60\t7\t8\t9", "2\t0.01\t1\t2\t3\t4\t5\t6\t7\t8\t9\t7\t8\t9"]
    found = read(text(rows))
    np.testing.assert_array_equal(found.confidence, [[0, 1, 1], [1, 1, 1]])
    np.testing.assert_allclose(found.points[0, 2], [0.04, 0.05, 0.06])
    assert found.notes == ("1 marker without a name behind the named ones left out",)


def test_markers_without_a_name(read):
    behind = np.concatenate([ROWS, ROWS[:, :2]], axis=1)
    lines = text(behind, names=NAMES, markers=5).split("\n")
    same(read("\n".join(lines)))
    assert read("\n".join(lines)).notes == ("2 markers without a name behind the named ones left out",)
    among = read(text(ROWS, names=("C7", "", "R.ASIS")))
    same(among, ("C7", "R.ASIS"), ROWS[:, [0, 2]])
    assert among.notes == ("1 point without a name left out",)
    starred = read(text(ROWS, names=("C7", "*1", "*1")))
    same(starred, ("C7",), ROWS[:, :1])
    twice = read(text(ROWS, names=("C7", "C7", "R.ASIS")))
    same(twice, ("C7", "R.ASIS"), ROWS[:, [0, 2]])
    assert "more than one marker is called C7" in twice.notes[0]


@pytest.mark.parametrize("headings", ["\tTime", "Frame#\t", "\t", "Frame No.\tTime (s)", "Bild\tZeit"])
def test_headings_that_are_missing_or_called_otherwise(read, headings):
    """Each marker keeps its own coordinates, also without a name for frames and times."""
    content = text(ROWS)
    same(read(content.replace("Frame#\tTime", headings)))
    if headings.strip():
        same(read(text(ROWS, axes=False).replace("Frame#\tTime", headings)))
    if headings != "\t":
        same(read(content.replace("Frame#\tTime", headings.strip())))  # its tab is missing as well
        if "Zeit" not in headings:
            same(read(text(ROWS, tab=" ").replace("Frame# Time", headings.replace("\t", " "))))
    same(read(content.replace("Frame#\tTime", headings).replace("\tC7\t", "\t\t")), NAMES[1:], ROWS[:, 1:])


def test_names_with_their_persons(read):
    same(read(text(ROWS, names=[f"S01:{name}" for name in NAMES])))
    names = ("S1:C7", "S2:C7", "S2:L.ASIS")
    with pytest.raises(ValueError, match=r"two people in it, S1 \(1 marker\) and S2 \(2 markers\): say which one"):
        read(text(ROWS, names=names))
    same(read(text(ROWS, names=names), subject="S2"), ("C7", "L.ASIS"), ROWS[:, 1:])


def test_two_people_who_share_no_name(read):
    """Each was recorded with markers of their own: half a person each would be nobody."""
    rows = np.arange(1.0, 1 + 2 * 12 * 3).reshape(2, 12, 3)
    names = [f"{('Al', 'Bob')[number % 2]}:M{number}" for number in range(12)]
    with pytest.raises(ValueError, match=r"two people in it, Al \(6 markers\) and Bob \(6 markers\): say which one"):
        read(text(rows, names=names, markers=12))
    same(read(text(rows, names=names, markers=12), subject="Al"), [f"M{k}" for k in range(0, 12, 2)], rows[:, ::2])
    wand = read(
        text(rows[:, :11], names=[*[f"Al:M{k}" for k in range(6)], *[f"Wand:{k}" for k in range(5)]], markers=11)
    )
    assert wand.names[-1] == "4"
    assert wand.notes == ("the markers of Al, Wand are taken as one person's (`subject`: those of one)",)


def test_two_people_of_whom_one_has_no_name(read):
    points = np.concatenate([ROWS, ROWS + 700], axis=1)
    content = text(points, names=[*NAMES, *(f"B:{name}" for name in NAMES)])
    with pytest.raises(ValueError, match=r"two people in it, \"\" \(without.*\) \(3 markers\) and B .*`subject='B'`\)"):
        read(content)
    same(read(content, subject="b"), NAMES, points[:, 3:])
    same(read(content, subject=""), NAMES, ROWS)
    alone = read(text(ROWS, names=("C7", "B:L.ASIS", "B:R.ASIS")))
    same(alone)  # nothing of one is twice there
    same(read(text(ROWS, names=("C7", "B:L.ASIS", "B:R.ASIS")), subject="B"))


def test_five_thousand_subjects_at_once(read):
    begun = time.perf_counter()
    with pytest.raises(ValueError, match="two people in it"):
        read(text(np.ones((1, 5000, 3)), names=[f"S{number}:C7" for number in range(5000)]))
    read(text(np.ones((1, 5000, 3)), names=[f"S{number}:C{number}" for number in range(5000)]))
    assert time.perf_counter() - begun < 4


@pytest.mark.parametrize(
    "gap",
    ["9999.99", "-9999.99", "9999.990000", "999999", "99999.9", "9999999", "9.999999e+06",
     "999999.99", "99999.999999", "-3.697314e28", "-3.69731E+28", "1e20", "NaN",
     "nan(snan)", "-nan(ind)", "-1.#IND00", "1.#QNAN0", "-", "null", "0", "0.000"],
)  # fmt: skip
def test_what_stands_for_a_gap(read, gap):
    rows = [f"1\t0\t1\t2\t3\t{gap}\t{gap}\t{gap}\t7\t8\t9", "2\t0.01\t1\t2\t3\t4\t5\t6\t7\t8\t9"]
    found = read(text(rows))
    np.testing.assert_array_equal(found.confidence, [[1, 0, 1], [1, 1, 1]])
    np.testing.assert_array_equal(found.points[0, 1], 0)
    if gap != "-" and gap.strip("-0123456789.e+E") == "" and float(gap):
        assert found.notes == (f"{float(gap):.7g} is taken as not seen (L.ASIS)",)
    elif gap.strip("0.") == "":
        assert found.notes == ("0, 0, 0 is taken as not seen (L.ASIS)",)
    else:
        assert found.notes == ()


@pytest.mark.parametrize("place", [(-1, -1, -1), (-500, -500, 2)])
def test_one_place_again_and_again_is_a_gap(read, place):
    points = 1000 + 10 * np.random.default_rng(0).normal(size=(20, 3, 3))
    points[[3, 4, 9], 0] = points[[6, 7, 8], 2] = place
    found = read(text(points))
    lost = (points == place).all(-1)
    np.testing.assert_array_equal(found.confidence, ~lost)
    said = ", ".join(map(str, place))
    assert found.notes == (f"{said} is taken as not seen (C7, R.ASIS)",)


def test_places_that_are_held_are_no_gap(read):
    """All markers stand still, one of them at a round place; one is held for a while; one has two names."""
    still = np.repeat(ROWS[:1], 20, axis=0)
    still[:, 1] = 500
    assert read(text(still)).confidence.all()
    points = 1000 + 10 * np.random.default_rng(0).normal(size=(20, 3, 3))
    points[5:12, 0] = points[5, 0]
    points[:, 2] = points[:, 0]
    assert read(text(points)).confidence.all()


def test_what_stands_for_no_gap(read):
    """A marker ten metres away; one at a round place."""
    rows = ["1\t0\t9990\t9999.5\t3\t999\t1000\t999\t1000\t1000\t1000"]
    found = read(text(rows))
    np.testing.assert_array_equal(found.confidence, 1)
    assert found.notes == ()


@pytest.mark.parametrize(
    ("units", "metres"),
    [("mm", 1e-3), ("MM", 1e-3), ("millimeters", 1e-3), ("Millimetres", 1e-3), ("mill", 1e-3), ("mete", 1.0),
     ("m", 1.0), ("meter", 1.0), ("Meters", 1.0), ("cm", 0.01), ("centimeters", 0.01), ("inches", 0.0254),
     ("(mm)", 1e-3)],
)  # fmt: skip
def test_spellings_of_units(read, units, metres):
    np.testing.assert_allclose(read(text(ROWS, units=units)).points, ROWS * metres, rtol=1e-12)


def test_times(read):
    row = "\t1\t2\t3\t4\t5\t6\t7\t8\t9"
    with pytest.raises(ValueError, match=r"line 8: expected seconds in the column Time, it is blank or no number"):
        read(text([f"1\t0{row}", f"2\t{row}"]))
    with pytest.raises(ValueError, match=r"a.trc: line 8: expected times that increase, got 0.01 s"):
        read(text([f"1\t0.02{row}", f"2\t0.01{row}"]))
    with pytest.raises(ValueError, match=r"line 8: expected times that increase, all are 0 s"):
        read(text([f"1\t0{row}", f"2\t0{row}"]))
    rounded = read(text([f"{n}\t{n / 150:.3f}{row}" for n in range(301)], rate="150"))
    assert rounded.rate == pytest.approx(150, abs=1e-9)  # the median of their differences says 143
    assert rounded.notes == ()
    coarse = read(text([f"{n}\t{n / 240:.2f}{row}" for n in range(241)], rate="240"))
    assert coarse.rate == pytest.approx(240)
    np.testing.assert_allclose(coarse.times, np.arange(241) / 240, atol=1e-12)
    assert coarse.notes == ("some times are equal: they are taken as evenly spaced from the first to the last",)


def test_times_with_a_gap(read):
    """The rate is that of the frames on both sides of it."""
    row = "\t1\t2\t3\t4\t5\t6\t7\t8\t9"
    found = read(text([f"{n}\t{n / 100 + 5 * (n > 20):g}{row}" for n in range(50)]))
    assert found.rate == pytest.approx(100)
    said = "its times have a gap, at t = 0.2 s (of 5.01 s): the frames before and after are taken as neighbours"
    assert found.notes == (said,)
    lost = read(text([f"{n}\t{n / 100:g}{row}" for n in range(50) if n != 20]))
    assert lost.rate == pytest.approx(100, rel=0.03)


def test_a_header_that_says_otherwise(read):
    found = read(text(ROWS, rate="60", frames=238))
    assert found.notes == (
        "its header says 238 frames, it has 3",
        "its header says 60 Hz, its times say 100 Hz; the times are believed",
    )


def test_encodings_and_line_ends(read):
    content = text(ROWS)
    for encoding in ("utf-8-sig", "utf-16"):
        same(read(content, encoding))
    same(read(content.replace("\n", "\r\n")))
    same(read(content.replace("\n", "\r")))
    same(read(content.replace("C7", "Tête"), "latin-1"), ("T\ufffdte", *NAMES[1:]))


def test_rows_that_end_early(read):
    found = read(text(["1\t0\t1\t2\t3\t4\t5\t6\t7\t8\t9", "2\t0.01\t1\t2\t3\t4\t5"]))
    np.testing.assert_array_equal(found.confidence, [[1, 1, 1], [1, 0, 0]])
    assert found.notes == ("1 rows end before the last marker; what they lack is taken as not seen",)


FULL = "1\t0\t1\t2\t3\t4\t5\t6\t7\t8\t9"


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (["1\t0\t1\t2\t3\t4\t5\t6\t7\t8\t9\t10"], "line 7: expected 11 columns for 3 markers, got 12"),
        (["1\t0\t1\t2\t3\t4\t5\t6"], "line 7: expected 14 columns for 4 markers, got 8"),
        (["1 0 1 2 3 4 5 6 7"], "line 7: expected 11 columns for 3 markers, got 9"),
        ([FULL, f"{FULL}\t1\t2\t3"], "line 7: expected 11 columns for 3 markers, got 11"),
        (["1\t0\t1\t2\t3\t4\t5\t6\t7\t8\tx"], "line 7: expected numbers: 'x' is none"),
        (["1\t0\t1\t2\t3\t4\t5\t6\t7\t8\t9,5"], "line 7: expected numbers: '9,5' is none; decimals need a point"),
    ],
)  # fmt: skip
def test_rows_that_cannot_be(read, rows, message):
    names = (*NAMES, "X") if "14" in message else NAMES
    with pytest.raises(ValueError, match=f"a.trc: {message}"):
        read(text(rows, names=names, markers=2 if "14" in message else None))


def test_special_files(tmp_path):
    with pytest.raises(ValueError, match="/dev/zero: is a device, not an ordinary file"):
        trc.read("/dev/zero")
    with pytest.raises(ValueError, match="is a folder"):
        trc.read(tmp_path)
