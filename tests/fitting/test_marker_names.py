"""What markers of other laboratories' sets mean, by their names; users' own names; findings about them."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("torch", reason="torch is an extra")

import ipman_rs as ip
from ipman_rs.data.markers import meanings, own, plausibility
from ipman_rs.data.markers.anatomy import Anatomy, harrington
from ipman_rs.data.markers.names import comparable, unmatched
from ipman_rs.data.markers.skin_distance import mean_distances, signed_distance
from ipman_rs.data.tracks import TO_Y_UP, Tracks, turn_up


@pytest.mark.parametrize(
    "name", ["L.ASIS", "L_ASIS", "lasis", "LASIS", "l asis", "ASIS_L", "Left ASIS", "left-asis", "S01:LASIS"]
)
def test_case_punctuation_and_the_place_of_the_side_do_not_count(name):
    assert meanings([name]) == {name: "left_asis"}


SETS = {
    "Rajagopal": {
        "R.Knee": "right_knee_lateral", "R.MKnee": "right_knee_medial", "R.Clavicle": "right_sternoclavicular",
        "R.TH1": None, "L.Biceps": "left_biceps", "R.MT5": "right_metatarsal_5", "S2": "sacrum", "R.Ankle":
        "right_malleolus_lateral", "R.MAnkle": "right_malleolus_medial", "R.Heel": "right_heel_marker",
        "R.MElbow": "right_elbow_medial",
    },
    "Camargo": {
        "L_Knee_Lat": "left_knee_lateral", "R_Toe_Tip": "right_toe_tip", "L_Ankle_Lat": "left_malleolus_lateral",
    },
    "ISB": {
        "RACR": "right_acromion", "RCM": "right_knee_medial", "RML": "right_malleolus_lateral",
        "RLEL": "right_elbow_lateral", "RMEL": "right_elbow_medial", "RASH": "right_shoulder_front",
    },
    "BMClab": {
        "R.Iliac.Crest": "right_iliac_crest", "L.GTR": "left_trochanter", "R.Knee.Medial": "right_knee_medial",
        "L.HF": "left_fibula_head", "R.TT": "right_tibial_tuberosity", "L.Ankle.Medial": "left_malleolus_medial",
        "R.Thigh.Top.Lateral": "right_thigh", "L.Shank.Bottom.Medial": "left_shank", "R.Heel.Top": "right_heel_marker",
        "L.MT1": "left_metatarsal_1",
    },
    "OpenCap": {
        "r_knee_study": "right_knee_lateral", "L_lelbow_study": "left_elbow_lateral", "L_calc_study":
        "left_heel_marker", "RHJC_study": "right_hip_centre", "r.PSIS_study": "right_psis", "C7_study": "c7",
        "r_5meta_study": "right_metatarsal_5", "L_mwrist_study": "left_ulna",
    },
    "Rizzoli": {"LLE": "left_knee_lateral", "LVM": "left_metatarsal_5", "RCA": "right_heel_marker"},
    "Qualisys": {
        "L_IAS": "left_asis", "R_FLE": "right_knee_lateral", "L_TAM": "left_malleolus_medial",
        "R_FCC": "right_heel_marker", "L_SAE": "left_acromion", "CV7": "c7", "WaistLFront": "left_asis",
        "LKneeOut": "left_knee_lateral", "RForefootIn": "right_metatarsal_1", "SpineTop": "c7",
    },
    "inner and outer": {"LKNEin": "left_knee_medial", "LANKin": "left_malleolus_medial"},
}  # fmt: skip


@pytest.mark.parametrize("named", SETS)
def test_sets(named):
    expected = SETS[named]
    found = meanings(list(expected))
    assert list(found) == list(expected)
    for name, place in expected.items():
        assert place is None or found[name] == place, name


def test_beginnings_and_ends_that_all_share_say_nothing():
    names = ["LASI", "RASI", "LKNE", "C7", "T10", "Box"]
    known = ["left_asis", "right_asis", "left_knee_lateral", "c7", "t10"]
    for pattern in ("Subject_{}", "S01:{}", "Trial 3-{}", "{}_augmented", "sub_01_{}_study"):
        assert list(meanings([pattern.format(name) for name in names]).values()) == known, pattern
    # An end that says where a marker is stays: these are joints, not skin.
    assert meanings([f"{name}_jc" for name in ("LASI", "RASI", "C7")]) == {}


@pytest.mark.parametrize("beginning", ["S01", "Sub12"])
def test_a_subject_without_a_mark_behind_it(beginning):
    names = ["LASI", "RASI", "LKNE", "RKNE", "C7", "LANK"]
    found = meanings([beginning + name for name in names])
    assert {name.removeprefix(beginning): meaning for name, meaning in found.items()} == meanings(names)
    assert len(found) == 6


def test_of_two_markers_of_one_name_the_plain_one_counts():
    found = meanings(["LASI_filt", "LASI", "RASI_filt", "RASI", "C7_filt", "C7"])
    assert list(found) == ["LASI", "RASI", "C7"]


def test_keypoints_of_cameras_are_joints_and_not_needed_beside_markers():
    points = ["Neck", "RShoulder", "RElbow", "RHip", "LHip", "RKnee", "LKnee", "RAnkle", "RBigToe", "RHeel"]
    found = meanings(points)
    assert found["RKnee"] == "right_knee"
    assert found["RHip"] == "right_hip"
    assert found["RHeel"] == "right_heel"
    markers = ["r.ASIS_study", "L.ASIS_study", "r_knee_study", "C7_study", "r_calc_study", "r_toe_study"]
    both = meanings([*points, *markers])
    assert list(both) == markers
    assert both["r_knee_study"] == "right_knee_lateral"


def test_own_names(tmp_path):
    body = ip.load_body("anny-lite")
    content = {"Hip bone 1": "left_asis", "P7": "LKNE", "Box": None, "K": "right knee"}
    (tmp_path / "a.json").write_text(json.dumps(content))
    (tmp_path / "a.yaml").write_text("Hip bone 1: left_asis\nP7: LKNE\nBox:\nK: right knee\n")
    (tmp_path / "a.csv").write_text("marker,place\nHip bone 1,left_asis\nP7,LKNE\nBox,\nK,right knee\n")
    expected = {"Hip bone 1": "left_asis", "P7": "left_knee_lateral", "Box": None, "K": "right_knee"}
    for ending in ("json", "yaml", "csv"):
        assert own.read(tmp_path / f"a.{ending}", body) == expected
    assert meanings(["hip_bone_1", "C7", "p7"], expected) == {
        "hip_bone_1": "left_asis", "C7": "c7", "p7": "left_knee_lateral"
    }  # fmt: skip
    assert meanings(["C7"], {"C7": None}) == {}
    assert unmatched(["S1:hip_bone_1", "C7"], expected) == ["P7", "Box", "K"]
    for mark in ";\t":
        commas = "marker,place\nHip bone 1,left_asis\nP7,LKNE\nBox,\nK,right knee\n"
        (tmp_path / "a.csv").write_text(commas.replace(",", mark))
        assert own.read(tmp_path / "a.csv", body) == expected
    for name, text in (("a.json", '{"A": "LASI", "A": "LASI"}'), ("a.csv", "A;LASI\na;LASI\n")):
        (tmp_path / name).write_text(text)
        assert set(own.read(tmp_path / name, body).values()) == {"left_asis"}  # twice the same


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        (
            "a.json",
            '{"A": "left_nose"}',
            "'A': expected a place on the body, such as left_asis or LASI, got",
        ),
        ("a.json", '{"A": "LASI", "A": "RASI"}', "'A': expected one place, got 'LASI' for 'A' and 'RASI'"),
        ("a.csv", "L_A,LASI\nA,LKNE\nl.a,RASI\n", "'l.a': expected one place, got 'LASI' for 'L_A' and 'RASI'"),
        ("a.yaml", "A: LASI\nA: RASI\n", "'A': expected one place, got the name twice"),
        ("a.json", "[1, 2]", "expected an object of marker names and places, got list"),
        ("a.json", "{", "is no JSON"),
        ("a.yaml", "a: [", "is no YAML"),
        ("a.csv", "A,left_asis,1\n", "row 1: expected a marker's name and its place, got 3 columns"),
        ("a.csv", "", "expected names of markers and their places, got none"),
        ("a.txt", "", r"expected a file of marker names \(.json"),
    ],
)
def test_what_is_wrong_in_own_names(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=f"{name}: {message}"):
        own.read(tmp_path / name, ip.load_body("anny-lite"))
    with pytest.raises(ValueError, match=r"none.json: there is no such file"):
        own.read(tmp_path / "none.json", ip.load_body("anny-lite"))


def test_harringtons_regression():
    """A pelvis 240 mm wide and 160 mm deep, level: the paper's equations (mm), worked by hand."""
    asis, psis = np.array([0.12, 1.0, 0.1]), np.array([0.05, 1.0, -0.06])
    mirror = np.array([-1, 1, 1])
    left, right = harrington(asis, asis * mirror, psis, psis * mirror)
    back, down, out = 0.24 * 160 + 9.9, 0.30 * 240 + 10.9, 0.33 * 240 + 7.3
    np.testing.assert_allclose(left * 1e3, [out, 1000 - down, 100 - back], atol=1e-9)
    np.testing.assert_allclose(right, left * mirror, atol=1e-12)


@pytest.mark.parametrize("name", ["anny-lite", "anny"])
def test_hip_centres_follow_the_shape(name):
    """The site moves with the betas as the regression of that body's own markers does, to first order."""
    import torch

    import ipman_rs.torch as ipt
    from ipman_rs.data.markers import sites
    from ipman_rs.fitting.landmarks import Landmarks

    body = ipt.BodyModel(name, torch.float64)
    named = ["LASI", "RASI", "LPSI", "RPSI", "LHJC", "RHJC"]
    landmarks = Landmarks(body, named, sites(body.body, named))
    betas = 0.02 * torch.randn(5, 10, generator=torch.Generator().manual_seed(3), dtype=torch.float64)
    betas[0] = 0
    points = landmarks(torch.zeros(5, body.body.num_joints, 3, dtype=torch.float64), betas).numpy()
    for row in points:
        left, right = harrington(*row[:4])
        np.testing.assert_allclose(row[4:], [left, right], atol=2e-5)  # of betas² × 5 cm
    assert np.linalg.norm(points[0, 4] - body.body().joints[1]) > 0.04  # the rig's hip is elsewhere
    turn = torch.zeros(1, body.body.num_joints, 3, dtype=torch.float64)
    turn[0, 1:3, 0] = -1.5  # sitting: the pelvis carries the centres, the thighs do not
    np.testing.assert_allclose(landmarks(turn, betas[:1]).numpy()[0, 4:], points[0, 4:], atol=1e-12)


def test_distance_from_a_box():
    import trimesh

    box = trimesh.creation.box((2, 2, 2))
    corners = np.asarray(box.triangles)
    points = [[0, 0, 1.5], [0, 0, 0.75], [2, 2, 0.3], [2, 2, 2], [-0.9, 0.1, 0.2], [1, 0, 0]]
    expected = [0.5, -0.25, np.sqrt(2), np.sqrt(3), -0.1, 0]
    found = [signed_distance(np.array(point, float), corners) for point in points]
    np.testing.assert_allclose(np.abs(found), np.abs(expected), atol=1e-12)
    np.testing.assert_array_equal(np.sign(found[:5]), np.sign(expected[:5]))
    rng = np.random.default_rng(1)
    some = rng.normal(size=(40, 3))
    ours = [signed_distance(point, corners) for point in some]
    beyond = np.abs(some) - 1
    truth = np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)
    np.testing.assert_allclose(ours, truth, atol=1e-12)


def test_mean_distances_are_of_the_frames_that_saw_a_marker():
    import trimesh

    box = trimesh.creation.box((2, 2, 2))
    vertices = np.stack([box.vertices, box.vertices + [1.0, 0, 0]])
    points = np.array([[[1.5, 0, 0], [3, 0, 0], [0, 0, 0]], [[1.5, 0, 0], [3, 0, 0], [0, 0, 0]]])
    seen = np.array([[1, 0, 0], [1, 1, 0]])
    found = mean_distances(vertices, box.faces, points, seen)
    np.testing.assert_allclose(found, [(0.5 - 0.5) / 2, 1.0, np.nan])


NAMES = ("LASI", "RASI", "LPSI", "RPSI", "C7", "CLAV", "LHEE", "RHEE", "LKNE", "RKNE")
STANDING = np.array(
    [[0.1, 1.0, 0.1], [-0.1, 1, 0.1], [0.05, 1, -0.1], [-0.05, 1, -0.1], [0, 1.5, -0.1], [0, 1.45, 0.1],
     [0.1, 0.05, -0.1], [-0.1, 0.05, -0.1], [0.15, 0.5, 0], [-0.15, 0.5, 0]]
)  # fmt: skip


def tracks(points=STANDING, names=NAMES, up="y", unit=1.0):
    points = np.repeat(np.asarray(points)[None], 4, axis=0)
    return Tracks(tuple(names), points, np.ones(points.shape[:2]), np.arange(4) / 100, "some.trc", (), up, unit)


def wrong(one, up_is_said=False):
    found = plausibility.check_points(one, meanings(one.names), up_is_said)
    return [finding for finding in found if finding.level == "wrong"]


def test_a_person_who_stands():
    assert wrong(tracks()) == []


@pytest.mark.parametrize("axis", ["x", "z"])
def test_another_axis_up_is_refused_and_mended(axis):
    other = tracks(STANDING @ TO_Y_UP[axis])  # y up said, and it is not
    (finding,) = wrong(other)
    assert finding.option == f"`up={axis!r}`"
    assert wrong(other, up_is_said=True) == []
    np.testing.assert_allclose(turn_up(other, np.eye(3)["xyz".index(axis)]).points[0], STANDING, atol=1e-15)


def test_the_axis_is_named_as_the_file_has_it():
    """A file that says z up, whose people stand along −y of the file."""
    raw = STANDING * [1, -1, -1]
    (finding,) = wrong(tracks(raw @ TO_Y_UP["z"].T, up="z"))
    assert finding.option == "`up='-y'`"
    np.testing.assert_allclose(turn_up(tracks(raw), (0, -1, 0)).points[0], STANDING, atol=1e-15)


def test_units_are_refused_and_mended():
    (finding,) = wrong(tracks(STANDING * 1000, unit=1.0))
    assert finding.option == "`units='mm'`"
    (finding,) = wrong(tracks(STANDING / 1000, unit=0.001))
    assert finding.option == "`units='m'`"
    (finding,) = wrong(tracks(STANDING * 0.0254, unit=0.01 * 0.0254))
    assert finding.option == "`units='cm'`"


def test_markers_below_the_floor():
    (finding,) = plausibility.check_floor(tracks(STANDING - [0, 1, 0]), meanings(NAMES))
    assert finding.what == "the lowest markers are 0.95 m below the floor in the median"
    assert finding.option == "`ground=HEIGHT`"
    assert plausibility.check_floor(tracks(STANDING - [0, 1, 0]), meanings(NAMES), ground=-1.0) == []
    assert plausibility.check_floor(tracks(), meanings(NAMES)) == []


SWAP = {"L": "R", "R": "L"}
WITH_FEET = (*NAMES, "LTOE", "RTOE", "LSHO", "RSHO")
STANDING_FEET = np.vstack([STANDING, [[0.12, 0.05, 0.1], [-0.12, 0.05, 0.1], [0.18, 1.4, 0], [-0.18, 1.4, 0]]])


@pytest.mark.parametrize("turn", [np.eye(3), TO_Y_UP["x"], TO_Y_UP["z"], np.diag([-1.0, 1.0, -1.0])])
def test_left_and_right_exchanged(turn):
    """Whichever way the person stands or lies."""
    points = STANDING_FEET @ turn
    swapped = [SWAP[name[0]] + name[1:] if name[0] in SWAP else name for name in WITH_FEET]
    assert wrong(tracks(points, WITH_FEET), up_is_said=True) == []
    (finding,) = wrong(tracks(points, swapped), up_is_said=True)
    assert finding.what == "left and right look swapped of pelvis and trunk and feet"
    mirrored = points * [1, 1, -1]
    assert [each.what for each in wrong(tracks(mirrored, WITH_FEET), up_is_said=True)] == [finding.what]


def test_left_and_right_exchanged_in_a_part():
    """Of the feet alone: names, or crossed legs."""
    swapped = [SWAP[name[0]] + name[1:] if name[1:] in ("HEE", "TOE") else name for name in WITH_FEET]
    one = tracks(STANDING_FEET, swapped)
    (finding,) = (each for each in plausibility.check_points(one, meanings(one.names)) if each.level != "ok")
    assert (finding.level, finding.what) == ("odd", "left and right look swapped of feet")


def test_what_the_markers_do_not_say():
    legs = [name for name in NAMES if name not in ("C7", "CLAV")]
    (finding,) = plausibility.check_coverage(legs, meanings(legs))
    assert finding.what.startswith("no marker above the pelvis was ever seen: trunk, arms, mass and centre of mass")
    (finding,) = plausibility.check_coverage(NAMES, meanings(NAMES))
    assert finding.what == "no marker on head and arms was ever seen: there the body's mean is shown"
    whole = [*NAMES, "LFHD", "LELB"]
    assert plausibility.check_coverage(whole, meanings(whole)) == []


def test_markers_off_the_skin_are_flagged():
    assert plausibility.check_skin({"C7": 0.01, "LASI": 0.03}) == []
    (finding,) = plausibility.check_skin({"C7": 0.01, "LKNE": -0.038, "RKNE": 0.06})
    assert finding.level == "odd"
    assert "2 of 3 markers are not on the skin of the fitted body (RKNE +60 mm, LKNE -38 mm;" in finding.what


def test_wands_are_no_markers_on_the_skin():
    found = meanings(["LTHI", "RTIB", "LTH1", "LHJC", "LKJC", "LKNE", "C7", "L_thigh1"])
    assert [name for name, place in found.items() if plausibility.on_skin(place)] == ["LKNE", "C7", "L_thigh1"]
    body = ip.load_body("anny-lite")
    anatomy = Anatomy(body)
    from ipman_rs.data.markers import sites
    from ipman_rs.fitting.marker_calibration import certainty

    weights = {name: certainty(site) for name, site in sites(body, found).items()}
    assert weights["LTHI"] == pytest.approx(0.04)  # (1 cm / 5 cm)²
    assert weights["LHJC"] == pytest.approx(0.25)
    assert weights["LKNE"] == weights["LKJC"] == 1
    assert anatomy.hip_centre("left").joint == "pelvis"


def test_names_compared():
    assert comparable("Left_Knee-Med.") == comparable("L.KneeMed") == "lkneemed"
    assert comparable("RIGHT") == "right"
    assert comparable("l") == "l"
