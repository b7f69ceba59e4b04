"""Which files belong together, by the names that laboratories and programs give them."""

from __future__ import annotations

from pathlib import Path

import pytest

from ipman_rs.data import external_loads, pairing

ROOT = Path("/lab")


def paired(*names, given=(), aliases=()):
    """Of files with these names: the pairs of forces, those of centres of mass, and what is said."""
    files = [ROOT / name for name in names]
    markers = [path for path in files if path.suffix in (".trc", ".c3d")]
    tables = {path: "com" if "com" in path.stem else "forces" for path in files if path.suffix in (".mot", ".sto")}
    found = pairing.pair(
        markers, tables, ROOT, [ROOT / name for name in given], {ROOT / a: ROOT / b for a, b in aliases}
    )
    forces, com = (
        {key.relative_to(ROOT).as_posix(): value.relative_to(ROOT).as_posix() for key, value in pairs.items()}
        for pairs in (found.forces, found.com)
    )
    return forces, com, found


@pytest.mark.parametrize(
    ("markers", "forces"),
    [
        ("markers.trc", "grf.mot"),
        ("markers_walk.trc", "grf_walk.mot"),
        ("walk.trc", "walk_grf.mot"),
        ("walk.trc", "WalkGRF.mot"),
        ("walk.trc", "walkgrf.mot"),
        ("Walk-1 markers.trc", "walk 1 forces.mot"),
        ("walk.trc", "my_walk_grf_filtered.mot"),
        ("walk_trimmed.trc", "walk_grf.mot"),
        ("MarkerData/walk.trc", "ForceData/walk_forces.mot"),
        ("MarkerData/walk.trc", "ID/walk_grf.mot"),
        ("markers/S1/walk.trc", "forces/S1/walk.mot"),
        ("trials/walk/markers.trc", "trials/walk/grf.mot"),
        ("MarkerData/walk.trc", "ForceData/walk/grf.mot"),
    ],
)
def test_by_their_names(markers, forces):
    """Beside another recording with forces, so that their number does not tell."""
    there, _, found = paired(markers, forces, "hop.trc", "hop_grf.mot")
    assert there == {markers: forces, "hop.trc": "hop_grf.mot"}
    assert not found.left
    assert not found.notes


@pytest.mark.parametrize(
    ("markers", "forces", "why"),
    [
        ("subject5.trc", "kistler.mot", "in its folder"),
        ("a/subject5.trc", "b/a_kistler.mot", None),
        ("MarkerData/subject5.trc", "ForceData/kistler.mot", "there is"),
    ],
)
def test_the_only_two(markers, forces, why):
    there, _, found = paired(markers, forces)
    if why is None:
        assert there == {}
    else:
        assert there == {markers: forces}
        assert found.notes == [f"{forces}: taken as the forces of {markers}, the only recording {why}"]


def test_the_forces_are_not_of_who_stands_still():
    there, _, found = paired("static.trc", "trial.trc", "kistler.mot")
    assert there == {"trial.trc": "kistler.mot"}
    assert found.notes[0].endswith("the only recording in which nobody stands still")
    assert paired("static.trc", "trial.trc", "kistler.mot", "amti.mot")[0] == {}


def test_numbers_are_not_the_same():
    there, _, found = paired("walk1.trc", "walk_2.trc", "walk10_grf.mot", "walk_20_grf.mot")
    assert there == {}
    assert [*found.left.values()] == [
        "its name has no recording's name in it; expected such as walk1_grf.mot",
    ] * 2


def test_what_can_belong_to_two_belongs_to_none():
    there, _, found = paired("walk_a.trc", "walk_b.trc", "walk_grf.mot")
    assert there == {}
    assert [*found.left.values()] == ["it can belong to walk_a.trc and walk_b.trc; give it the name of one of them"]


def test_two_for_one():
    there, _, found = paired("walk.trc", "walk_grf.mot", "walk_grf_filtered.mot", "walk_com.sto", "walk_com_old.sto")
    assert there == {"walk.trc": "walk_grf.mot"}  # of the same name
    assert found.left == {
        ROOT / "walk_grf_filtered.mot": "walk.trc has forces from walk_grf.mot",
        ROOT / "walk_com_old.sto": "walk.trc has a centre of mass from walk_com.sto",
    }
    assert set(found.rivals) == set(found.left)


def test_people_are_kept_apart():
    files = ["S1/MarkerData/walk.trc", "S2/MarkerData/walk.trc", "S1/ID/walk_grf.mot", "S2/ID/walk_grf.mot"]
    there, _, _ = paired(*files)
    assert there == {files[0]: files[2], files[1]: files[3]}
    assert paired(*files[:2], files[3])[0] == {files[1]: files[3]}
    assert pairing.names([ROOT / name for name in files[:2]], ROOT) == ["S1_walk", "S2_walk"]
    assert [pairing.ParsedPath.of(ROOT / name, ROOT).owner for name in files[:2]] == [("S1",), ("S2",)]


def test_names_of_recordings():
    def names(*files):
        return pairing.names([ROOT / name for name in files], ROOT)

    assert names("markers.trc") == ["markers"]
    assert names("trials/walk/markers.trc", "trials/run/markers.trc") == ["walk", "run"]
    assert names("S1/walk/markers.trc", "S2/walk/markers.trc") == ["S1_walk", "S2_walk"]
    assert names("a/walk.trc", "a/walk.c3d") == ["a_walk_trc", "a_walk_c3d"]


def test_words_that_say_whose_a_file_is():
    assert pairing.distinctive_words("grf_Walk-2") == ("walk", "2")
    assert (
        pairing.distinctive_words("MarkerData")
        == pairing.distinctive_words("ground reaction forces")
        == pairing.distinctive_words("OpenSimData")
        == ()
    )


LOADS = """<?xml version="1.0"?><OpenSimDocument Version="40000"><ExternalLoads name="x"><objects>
<ExternalForce name="a"><force_identifier>FP1_F</force_identifier><point_identifier>FP1_P</point_identifier>
<force_expressed_in_body>{0}</force_expressed_in_body></ExternalForce></objects>
<datafile>{1}</datafile></ExternalLoads></OpenSimDocument>"""


def test_external_loads(tmp_path):
    for name in ("kistler.mot", "walk.trc"):
        (tmp_path / name).write_text("")
    (tmp_path / "walk.xml").write_text(LOADS.format("ground", "C:\\lab\\Kistler.mot"))
    (tmp_path / "other.xml").write_text("<a/>")
    (tmp_path / "gone.xml").write_text(LOADS.format("ground", "gone.mot"))
    (tmp_path / "foot.xml").write_text(LOADS.format("calcn_r", "kistler.mot"))
    (tmp_path / "broken.xml").write_text("<a>")
    said, sources, wrong = external_loads.find(sorted(tmp_path.iterdir()))
    assert [*said] == [tmp_path / "kistler.mot"]
    assert said[tmp_path / "kistler.mot"].loads == (external_loads.Load("FP1_F", "FP1_P", ""),)
    assert sources == {tmp_path / "kistler.mot": tmp_path / "walk.xml"}
    assert "broken.xml: cannot be read as XML" in wrong[0]
    assert "foot.xml: force_expressed_in_body: expected ground, got 'calcn_r'" in wrong[1]
    assert "gone.xml: not used, for its file of forces, gone.mot, is not there" in wrong[2]


def test_the_name_of_the_external_loads_counts():
    there, _, _ = paired(
        "walk.trc", "run.trc", "k1.mot", "k2.mot", aliases=[("k1.mot", "run.xml"), ("k2.mot", "walk.xml")]
    )
    assert there == {"walk.trc": "k2.mot", "run.trc": "k1.mot"}
