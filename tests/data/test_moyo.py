"""MoYo: bodies, the mat's maps in the world, centres of mass, cameras; and what can be wrong with its files."""

from __future__ import annotations

import contextlib
import json
import pickle
import tracemalloc

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

pytest.importorskip("ezc3d", reason="ezc3d writes and judges C3D files")

import ipman_rs.data as data
from ipman_rs.data import moyo
from ipman_rs.files import safe_pickle
from tests.helpers.miniatures import moyo as miniature

NAME = miniature.names()[0]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    root = tmp_path_factory.mktemp("MOYO")
    return root, miniature.write(root)


@pytest.fixture
def one(tmp_path):
    """A session with one sequence of 24 frames: its folder, its files by name, its truth."""
    truth = miniature.sequence(tmp_path, NAME, with_com=True)
    pressure = tmp_path / "pressure" / "train"
    files = {
        "mosh": tmp_path / "mosh" / "train" / f"{NAME}_stageii.pkl",
        "xml": pressure / "xml" / f"{NAME}.xml",
        "csv": pressure / "single_csv" / f"{NAME}.csv",
        "corners": pressure / "pressure_mat_c3d" / f"{NAME}.c3d",
        "com": tmp_path / "com" / "train" / f"{NAME}.c3d",
    }
    return tmp_path, files, truth


def refused(root, match):
    """Reading the sequence raises, and `check` tells the same."""
    with pytest.raises(ValueError, match=match) as caught:
        data.open("moyo", root)[:]
    wrong = [each.what for each in moyo.check(root) if each.level == "wrong"]
    assert any(what == str(caught.value) or str(caught.value).startswith(what) for what in wrong), wrong


def test_the_miniature_in_the_common_form(whole):
    root, truth = whole
    found = data.open("moyo", root)
    frames = found[:]
    order = [name for day in ("220923", "221004") for name in miniature.names(day)]
    counts = [len(truth[name]["pose"]) for name in order]
    assert len(found) == sum(counts) == 2 * (20 + 22 + 24)
    np.testing.assert_array_equal(frames.sequences, np.repeat(order, counts))
    assert frames.names[21] == f"{order[1]}/00001"
    assert frames.frame_rate == 60
    assert frames.body == "smplx"
    assert set(frames.genders) == {"female"}
    np.testing.assert_array_equal(frames.ground.normal, [0, 0, 1])
    assert frames.ground.height == 0
    every = {
        key: np.concatenate([truth[name][key] for name in order])
        for key in ("pose", "trans", "force", "center", "maps")
    }
    np.testing.assert_array_equal(frames.pose.reshape(len(frames), 165), every["pose"])
    np.testing.assert_array_equal(frames.transl, every["trans"])
    assert frames.betas.shape == (len(frames), 300)
    np.testing.assert_allclose(frames.pressure.values, every["maps"], atol=1e-6)
    np.testing.assert_allclose(frames.forces[:, 0, 2], every["force"], atol=1e-4)  # written with four digits
    # Markers of 32 bits in mm, and a centre of pressure with a tenth of a micrometre.
    np.testing.assert_allclose(frames.center_of_pressure[:, :2], every["center"], atol=1e-6)
    np.testing.assert_allclose(frames.center_of_pressure[:, 2], 0.004, atol=1e-6)
    assert np.isnan(frames.center_of_mass[:66]).all()
    com = np.concatenate([truth[name]["com"] for name in order[3:]])
    np.testing.assert_allclose(frames.center_of_mass[66:], com, atol=1e-6)


def test_the_maps_are_where_the_mat_lies(whole):
    """The centre of each map, from its cells' places in the world, is the centre of pressure."""
    root, truth = whole
    found = data.open("moyo", root / miniature.HANDS)
    for frames in (found[:], found[30:40]):
        maps = frames.pressure
        rows, columns = np.indices(maps.values.shape[1:])
        origin, e1, e2 = (np.broadcast_to(part, (len(frames), 3)) for part in (maps.origin, maps.e1, maps.e2))
        for frame in range(len(frames)):
            cells = (
                origin[frame]
                + ((rows[..., None] + 0.5) * e1[frame] + (columns[..., None] + 0.5) * e2[frame]) * maps.cell
            )
            weights = maps.values[frame].astype(float)
            center = (weights[..., None] * cells).sum(axis=(0, 1)) / weights.sum()
            np.testing.assert_allclose(center, frames.center_of_pressure[frame], atol=1e-6)
    assert found[:].pressure.origin.shape == (66, 3)
    assert found[30:40].pressure.origin.shape == (3,)  # one place
    maps = found[:3].pressure
    np.testing.assert_allclose(maps.e1, [0, -1, 0], atol=1e-6)
    np.testing.assert_allclose(maps.e2, [-1, 0, 0], atol=1e-6)
    assert maps.cell == 0.0127
    middle = maps.origin + (110 * maps.e1 + 37 * maps.e2) / 2 * maps.cell
    np.testing.assert_allclose(middle[:2], truth[NAME]["middle"], atol=1e-6)


def test_the_corners_in_any_order(tmp_path):
    for order in ((0, 1, 2, 3), (3, 1, 0, 2)):
        miniature.corners(tmp_path / "a.c3d", 3, (0.3, 0.1), 0.02, order)
        found = moyo.corners(tmp_path / "a.c3d")
        assert (found[:, 0] > 0.3).tolist() == [True, True, False, False]
        assert (found[:, 1] > 0.1).tolist() == [True, False, False, True]


def test_splits_and_rows(whole):
    root, _ = whole
    assert len(data.open("moyo", root, split="train")) == 2 * 42
    assert set(data.open("moyo", root / miniature.COM, split="val")[:].sequences) == {miniature.names("221004")[2]}
    found = data.open("moyo", root)
    some = found[np.array([131, 0, 70, 1])]
    assert some.names.tolist() == found[:].names[[131, 0, 70, 1]].tolist()
    np.testing.assert_array_equal(some.pose, found[:].pose[[131, 0, 70, 1]])
    assert found[:0].names.shape == (0,)
    assert sum(len(part) for part in data.pieces(found, 50)) == len(found)
    with pytest.raises(ValueError, match="split: expected one of train, val, got 'test'"):
        data.open("moyo", root, split="test")


def test_images_and_cameras(whole):
    root, truth = whole
    found = data.open("moyo", root, split="train", camera=1)
    frames = found[:]
    assert len(frames) == 10
    assert frames.frame_rate == 30
    assert frames.names[:5].tolist() == [f"{NAME}/{2 * number:05d}" for number in range(3, 8)]
    assert frames.images[0].endswith(f"YOGI_Cam_01/{NAME}_YOGI_Cam_01_0003.jpg")
    np.testing.assert_array_equal(frames.transl[:5], truth[NAME]["trans"][6:15:2])
    focal, center, rotation, position = miniature.camera(1)
    point = np.array([0.1, 0.2, 1.0])
    seen = rotation @ (point - position)
    pixel = 0.5 * (focal * seen[:2] / seen[2] + center)  # released images have half the size
    cameras = frames.cameras
    ours = cameras.intrinsics[3] @ (cameras.rotation[3] @ point + cameras.translation[3])
    np.testing.assert_allclose(ours[:2] / ours[2], pixel, atol=1e-9)
    with pytest.raises(ValueError, match="no frame at all"):
        data.open("moyo", root, camera=5)


def test_check_of_what_is_whole(whole):
    findings = moyo.check(whole[0])
    assert [each for each in findings if each.level == "wrong"] == []
    missing = [each.what for each in findings if each.level == "missing"]
    assert missing == [f"{miniature.HANDS}: no centres of mass (com/)"]
    assert any("20221004_with_com: 3 sequences (2 in train, 1 in val)" in each.what for each in findings)


def test_a_sequence_without_pressure_or_centre_of_mass(whole, tmp_path):
    miniature.sequence(tmp_path, NAME, with_com=True)
    other = miniature.names()[1]
    miniature.body(tmp_path / "mosh" / "train" / f"{other}_stageii.pkl", 9)
    frames = data.open("moyo", tmp_path)[:]
    lacking = frames.sequences == other
    assert np.isnan(frames.center_of_mass[lacking]).all()
    assert np.isnan(frames.pressure.values[lacking]).all()
    assert np.isnan(frames.forces[lacking]).all()
    assert np.isfinite(frames.pressure.values[~lacking]).all()
    missing = [each.what for each in moyo.check(tmp_path) if each.level == "missing" and "no such file" in each.what]
    assert len(missing) == 4  # three of the mat, one of the centre of mass
    (tmp_path / "bare" / "mosh" / "val").mkdir(parents=True)
    miniature.body(tmp_path / "bare" / "mosh" / "val" / f"{other}_stageii.pkl", 9)
    frames = data.open("moyo", tmp_path / "bare")[:]
    assert frames.pressure is None
    assert frames.center_of_mass is None


def test_the_mat_that_was_broken(tmp_path):
    name = "220923_yogi_body_hands_03596_Cow_Face_Pose_or_Gomukhasana_-c"
    miniature.sequence(tmp_path / "first", name)
    miniature.sequence(tmp_path / "second", name.replace("yogi_", "yogi_nexus_"))
    assert np.isnan(data.open("moyo", tmp_path / "first")[:].pressure.values).all()
    assert np.isfinite(data.open("moyo", tmp_path / "second")[:].pressure.values).all()


def test_lengths_that_differ(one):
    root, files, truth = one
    for count, there in ((22, 22), (23, 23), (25, 24), (26, 24)):  # an image's time at the end is let go
        force, maps, _ = miniature.pressed(count, (0, 0))
        miniature.xml(files["xml"], maps)
        miniature.csv(files["csv"], force, maps)
        miniature.com(files["com"], count)
        frames = data.open("moyo", root)[:]
        assert len(frames) == 24
        for values in (frames.center_of_mass, frames.center_of_pressure, frames.forces, frames.pressure.values):
            assert np.isfinite(values[:there]).all()
            assert np.isnan(values[there:]).all()
    miniature.com(files["com"], 30)
    refused(root, rf"com/train/{NAME}.c3d: expected 24 frames, as many as the body has, give or take 2, got 30")
    miniature.com(files["com"], 24)
    force, maps, _ = miniature.pressed(18, (0, 0))
    miniature.xml(files["xml"], maps)
    miniature.csv(files["csv"], force, maps)
    refused(root, rf"{NAME}.csv: expected 24 rows, .* got 18")
    miniature.csv(files["csv"], force, maps, before=9)
    refused(root, rf"{NAME}.csv: expected times of the 25 maps of {NAME}.xml at 60 Hz, got maps 9 to 26")


def test_no_load_and_lost_frames(one):
    root, files, _ = one
    _, maps, _ = miniature.pressed(24, (0, 0))
    maps[5] = 0
    miniature.xml(files["xml"], maps)
    miniature.csv(files["csv"], maps.sum(axis=(1, 2)) * 1.6129, maps)
    miniature.com(files["com"], 24, lost=[3])
    frames = data.open("moyo", root)[:]
    assert np.isnan(frames.center_of_pressure[5]).all()
    assert frames.forces[5, 0, 2] == 0
    assert (frames.pressure.values[5] == 0).all()
    assert np.isnan(frames.center_of_mass[3]).all()
    assert np.isfinite(np.delete(frames.center_of_mass, 3, axis=0)).all()
    assert [each for each in moyo.check(root) if each.level == "wrong"] == []


def test_a_body_of_nan_in_a_frame(one):
    root, files, truth = one
    pose = truth["pose"].copy()
    pose[4] = np.nan
    miniature.body(files["mosh"], 24, fullpose=pose)
    frames = data.open("moyo", root)[:]
    assert np.isnan(frames.pose[4]).all()
    np.testing.assert_array_equal(np.delete(frames.pose, 4, 0).reshape(23, 165), np.delete(truth["pose"], 4, 0))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"fullpose": np.zeros((24, 156))}, r"fullpose: expected numbers \(any, 165\), got float64 \(24, 156\)"),
        ({"trans": np.zeros((23, 3))}, r"trans: expected numbers \(24, 3\), got float64 \(23, 3\)"),
        ({"fullpose": np.zeros((0, 165))}, "expected frames, the sequence is empty"),
        ({"betas": None}, "no betas in it"),
        ({"betas": "ten"}, "betas: expected an array"),
        ({"scale": 1000.0}, "transl: looks like millimetres: 125[0-9] from the origin"),
    ],
)
def test_bodies_that_cannot_be(one, changes, message):
    root, files, _ = one
    miniature.body(files["mosh"], 24, **changes)
    refused(root, f"{NAME}_stageii.pkl: {message}".replace("(", r"(") if "(" not in NAME else message)


def test_y_up_instead_of_z_up(tmp_path):
    for number in range(8):
        miniature.body(tmp_path / "mosh" / "train" / f"{number}_stageii.pkl", 5, up="y")
    with pytest.raises(ValueError, match=r"pose: looks like \+y up"):
        data.open("moyo", tmp_path)
    assert any("looks like +y up" in each.what for each in moyo.check(tmp_path) if each.level == "wrong")


def test_somebody_who_lies_is_right(tmp_path):
    miniature.body(tmp_path / "mosh" / "train" / "Corpse_Pose_-a_stageii.pkl", 5, lies=True)
    assert len(data.open("moyo", tmp_path)) == 5


def test_measurements_in_other_axes_and_units(one):
    root, files, _ = one
    miniature.com(files["com"], 24, up="y")
    refused(root, "c3d: looks like y up: CentreOfMassFloor is expected under CentreOfMass, on z = 0")
    miniature.com(files["com"], 24)
    miniature.corners(files["corners"], 24, up="y")
    refused(root, r"c3d: expected the mat's corners on the floor z = 0, .*; looks like y up")
    miniature.corners(files["corners"], 24)
    content = files["xml"].read_text()
    files["xml"].write_text(content.replace("12.7", "0.0127"))
    refused(root, r"xml: cell_size: expected square cells, in millimetres, got 0.0127 × 0.0127; looks like metres")
    files["xml"].write_text(content.replace("N/cm2", "kPa"))
    refused(root, "xml: units: expected N/cm2, got 'kPa'")
    files["xml"].write_text(content.replace("12.7", "20.0"))
    refused(root, r"c3d: expected the mat's corners 2.200 × 0.740 m apart, as its cells are, got 1.422 × 0.495 m")


def test_check_sees_maps_in_other_units_or_turned(one):
    root, files, truth = one
    miniature.xml(files["xml"], 0.1 * truth["maps"])
    wrong = [each.what for each in moyo.check(root) if each.level == "wrong"]
    assert any("the maps add up to 0.1" in what for what in wrong)
    miniature.xml(files["xml"], truth["maps"][:, ::-1])
    wrong = [each.what for each in moyo.check(root) if each.level == "wrong"]
    assert any("mm from the centre of pressure in the median" in what for what in wrong)


BOMB = """<!DOCTYPE bomb [<!ENTITY a "ha"> <!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;"> <!ENTITY d "&c;&c;&c;&c;&c;&c;&c;&c;&c;&c;">]>\n"""
OUTSIDE = '<!DOCTYPE x [<!ENTITY d SYSTEM "file:///etc/passwd">]>\n'
PARAMETERS = '<!DOCTYPE x [<!ENTITY % p SYSTEM "http://127.0.0.1:9/x.dtd"> %p;]>\n'


@pytest.mark.parametrize(
    ("doctype", "entity"), [(BOMB, "&d;"), (OUTSIDE, "&d;"), (PARAMETERS, ""), ("<!DOCTYPE x>\n", "")]
)
def test_bombs_and_entities_in_xml(one, doctype, entity):
    root, files, truth = one
    miniature.xml(files["xml"], truth["maps"], doctype=doctype, entity=entity)
    refused(root, r"xml: cannot be read as XML: has a document type \(DOCTYPE\)")


def test_entities_without_a_document_type(one):
    root, files, truth = one
    miniature.xml(files["xml"], truth["maps"], entity="&d;")
    refused(root, "xml: cannot be read as XML: undefined entity")
    files["xml"].write_text("<a>" * 100_000)
    refused(root, "xml: cannot be read as XML: elements nested more than 64 deep")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<count>31</count>", "<count>40</count>", "expected 40 maps by its count, got 31: is the file complete"),
        ("<count>31</count>", "<count></count>", "expected <count> with text in it"),
        ("<count>31</count>", "<count>x</count>", "count: expected a number, got 'x'"),
        ("<x>37</x>", "<x>37.5</x>", "cell_count: expected whole numbers"),
        ("<x>37</x>", "<x>100000</x>", "cell_count: expected a mat of some thousand cells"),
        ("<cells>\n\t\t", "<cells>\n\t\t1.0 ", r"map 0: expected 0 cells, got|map 7: expected 160 cells, got 161"),
        ("<cells>\n\t\t", "<cells>\n\t\tx", r"map 7: expected numbers"),
        ("<cells>\n\t\t", "<cells>\n\t\t-", r"map 7: expected pressures of 0 or more"),
        ("<clip>", "<clop>", "cannot be read as XML: mismatched tag"),
        (
            "<x>10</x><y>40</y>",
            "<x>36</x><y>40</y>",
            r"map 7: expected cells of a mat of 37 × 110, got 8 × 20 from \(36, 40\)",
        ),
    ],
)
def test_maps_that_cannot_be(one, old, new, message):
    root, files, _ = one
    text = files["xml"].read_text()
    assert old in text
    files["xml"].write_text(text.replace(old, new))
    refused(root, f"xml: ({message})")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("frequency", "rate", "no column 'frequency'"),
        (",60,", ",120,", "frequency: expected 60 Hz, got 120"),
        (",24,mixed", ",30,mixed", "expected 30 rows by its count, got 24: is the file complete"),
        ("Force (N)", "Force (kN)", r"no column 'Force \(N\)'"),
        ("center-x (mm)", "center-x (m)", r"no column 'Pressure, .* center-x \(mm\)'"),
        ("0.150000,", "0.152000,", None),
        ("0.150000,", "0.250000,", "time: expected steps of 1/60 s, without a gap"),
        ("0.150000,", "1e308,", "time: expected steps of 1/60 s, without a gap"),
        ("0.150000,", "soon,", "row 2: expected a number, got 'soon'"),
    ],
)
def test_traces_that_cannot_be(one, old, new, message):
    root, files, _ = one
    text = files["csv"].read_text(encoding="utf-8-sig")
    assert old in text
    files["csv"].write_text(text.replace(old, new))
    if message is None:
        assert len(data.open("moyo", root)[:]) == 24
    else:
        refused(root, f"csv: {message}")


@pytest.mark.parametrize("which", ["mosh", "xml", "csv", "corners", "com"])
def test_half_written_files(one, which):
    root, files, _ = one
    content = files[which].read_bytes()
    files[which].write_bytes(content[: len(content) // 2])
    refused(root, files[which].name.replace("(", r"\("))
    files[which].write_bytes(b"")
    refused(root, files[which].name)


def test_missing_files(one, tmp_path):
    root, files, _ = one
    for which in ("csv", "corners"):
        content = files[which].read_bytes()
        files[which].unlink()
        with pytest.raises(ValueError, match=rf"{files[which].name}: .*[Nn]o such file"):
            data.open("moyo", root)[:]
        assert any(str(files[which]) in each.what for each in moyo.check(root) if each.level == "missing")
        files[which].write_bytes(content)
    with pytest.raises(ValueError, match=r"expected a folder with mosh/train/\*_stageii.pkl in it, no such folder"):
        data.open("moyo", tmp_path / "nothing")
    (tmp_path / "empty" / "mosh" / "train").mkdir(parents=True)
    with pytest.raises(ValueError, match=r"expected sequences \(mosh/train/\*_stageii.pkl\), found none"):
        data.open("moyo", tmp_path / "empty")
    assert moyo.check(tmp_path / "empty")[0].level == "missing"


class Runs:
    def __init__(self, victim):
        self.victim = victim

    def __reduce__(self):
        return exec, (f"open({str(self.victim)!r}, 'w')",)


@pytest.mark.parametrize("protocol", range(6))
def test_a_hostile_pickle(one, protocol):
    root, files, truth = one
    victim = root / "victim"
    content = {"fullpose": truth["pose"], "trans": truth["trans"], "betas": np.zeros(10), "x": Runs(victim)}
    files["mosh"].write_bytes(pickle.dumps(content, protocol))
    refused(root, r"names (builtins|__builtin__)\.exec, which no body of MoYo needs; it is refused")
    assert not victim.exists()


@pytest.mark.parametrize(
    ("name", "refusal"),
    [("os.system", True), ("posix.system", True), ("subprocess.Popen", True), ("builtins.getattr", True),
     ("operator.attrgetter", True), ("importlib.import_module", True), ("runpy.run_path", True),
     ("numpy.load", False), ("torch.load", False), ("omegaconf.x.Y", False), ("typing.Any", False)],
)  # fmt: skip
def test_names_in_a_tolerant_pickle(tmp_path, name, refusal):
    """Functions of the standard library are refused; other programs' become records that do nothing."""
    module, _, attribute = name.rpartition(".")
    path = tmp_path / "a.pkl"
    path.write_bytes(f"(dS'a'\nc{module}\n{attribute}\n(S'x'\ntRs.".encode())
    if refusal:
        with pytest.raises(ValueError, match=name.replace(".", r"\.")):
            safe_pickle.read(path, tolerant=True)
    else:
        assert isinstance(safe_pickle.read(path, tolerant=True)["a"], safe_pickle.ForeignObject)


def test_strangers_swallow_what_is_put_into_them(tmp_path):
    module = "(dS'a'\ncpandas\nDataFrame\n(tR(S'x'\nI1\nu(I1\nI2\neI3\nas."
    (tmp_path / "a.pkl").write_bytes(module.encode())
    found = safe_pickle.read(tmp_path / "a.pkl", tolerant=True)
    assert isinstance(found["a"], safe_pickle.ForeignObject)


@pytest.mark.parametrize(
    "data_",
    [
        b"\x80\x04\x8e" + (1 << 31).to_bytes(8, "little") + b"x.",  # bytes that are not there
        b"\x80\x02Nr" + (1 << 31).to_bytes(4, "little") + b".",  # a memo index
        b"ctorch\nTensor\n(J\xff\xff\xff\x7ftR.",  # a stranger of two billion elements
        b"\x80\x02}(X\x01\x00\x00\x00acnumpy.core.multiarray\nscalar\n(I1\nI2\ntRu.",
        b"\x80\x02cpandas\nX\n(K\x01\x85" + b"\x85" * 100_000 + b"e.",  # nested, put into a class
    ],
    ids=["bytes", "memo", "stranger", "scalar", "nested"],
)
def test_small_hostile_pickles_that_are_read_tolerantly(tmp_path, data_):
    path = tmp_path / "a.pkl"
    path.write_bytes(data_)
    tracemalloc.start()
    with pytest.raises(ValueError, match=r"a\.pkl|number without its type"):
        safe_pickle.as_array(safe_pickle.read(path, tolerant=True)["a"])
    assert tracemalloc.get_traced_memory()[1] < 20 << 20
    tracemalloc.stop()


@pytest.mark.slow
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(cuts=st.lists(st.tuples(st.integers(0, 3000), st.binary(max_size=6)), min_size=1, max_size=4))
def test_damaged_bytes_are_read_or_refused(tmp_path, cuts):
    miniature.body(tmp_path / "a.pkl", 1, fullpose=np.zeros((1, 3)), betas=np.zeros(2))
    content = bytearray((tmp_path / "a.pkl").read_bytes())
    for place, new in cuts:
        place %= len(content)
        content[place : place + len(new)] = new
    (tmp_path / "a.pkl").write_bytes(bytes(content))
    with contextlib.suppress(ValueError):  # and nothing else
        assert isinstance(safe_pickle.read(tmp_path / "a.pkl", tolerant=True), dict)


def test_cameras_that_cannot_be(whole, tmp_path):
    miniature.sequence(tmp_path, NAME)
    miniature.images(tmp_path, NAME, range(3, 8))
    with pytest.raises(ValueError, match=r"expected one cameras/\*\*/220923\*/\*\*/cameras_param.json, got 0"):
        data.open("moyo", tmp_path, camera=1)
    miniature.cameras(tmp_path, "220923", scale=1.0)
    with pytest.raises(ValueError, match="cameras_param.json: position: looks like metres"):
        data.open("moyo", tmp_path, camera=1)
    path = next(tmp_path.glob("cameras/**/*.json"))
    path.write_text(json.dumps({"cam_2": {}}))
    with pytest.raises(ValueError, match="expected cam_1 with focal, princpt, rotation, position"):
        data.open("moyo", tmp_path, camera=1)
