"""Which files of a folder belong together."""

from __future__ import annotations

import pytest

from ipman_rs.validation.folder import Kinds, find_trials


def kind_of(path):
    """As the files' columns would say."""
    return {"f": ("forces", ""), "c": ("com", ""), "n": (None, "it has neither forces nor a centre of mass")}[
        path.read_text()
    ]


@pytest.fixture
def found(tmp_path):
    """found(name=content, ...) of a folder with these files."""

    def call(plates=(), com=(), **files):
        for name, content in files.items():
            stem, _, ending = name.rpartition("__")
            (tmp_path / f"{stem}.{ending}").write_text(content)
        kinds = Kinds(kind_of, lambda path: path.name in plates, lambda path: path.name in com)
        trials, notes, unreadable = find_trials(tmp_path, kinds)
        told = [(t.name, t.forces and t.forces.name, t.com and t.com.name) for t in trials]
        assert not unreadable
        return told, notes

    return call


def test_by_the_longest_name(found):
    told, notes = found(
        walk__trc="", walk2__trc="", walk_grf__mot="f", walk2_grf__mot="f", my_walk2_com__csv="c", walk_com__sto="c"
    )
    assert told == [("walk", "walk_grf.mot", "walk_com.sto"), ("walk2", "walk2_grf.mot", "my_walk2_com.csv")]
    assert notes == []


def test_who_stands_still_is_first(found):
    told, _ = found(a_squat__trc="", z_Static1__trc="", a_squat__mot="f")
    assert [name for name, *_ in told] == ["z_Static1", "a_squat"]


def test_plates_of_a_c3d_come_first(found):
    told, notes = found(plates=["walk.c3d"], walk__c3d="", walk_grf__mot="f", walk_kinematics__sto="n")
    assert told == [("walk", "walk.c3d", None)]
    assert notes == [
        "walk_grf.mot: not used, for walk.c3d has forces of its own",
        "walk_kinematics.sto: not used, for it has neither forces nor a centre of mass",
    ]


def test_a_stranger_belongs_to_the_only_recording_with_forces(found):
    told, notes = found(static__trc="", run__trc="", run_grf__mot="f", bodykin__sto="c")
    assert told == [("static", None, None), ("run", "run_grf.mot", "bodykin.sto")]
    assert notes == ["bodykin.sto: taken as the centre of mass of run.trc, the only recording with forces"]


def test_a_stranger_of_nobody(found):
    told, notes = found(one__trc="", two__trc="", one__mot="f", two__mot="f", bodykin__sto="c", gym__mot="f")
    assert [com for *_, com in told] == [None, None]
    assert notes == [
        "gym.mot: not used, for its name has no recording's name in it; expected such as one_grf.mot",
        "bodykin.sto: not used, for its name has no recording's name in it; expected such as one_com.sto",
    ]


def test_bad_folders(tmp_path, found):
    def never(_path):
        raise AssertionError

    kinds = Kinds(never, never, never)
    with pytest.raises(ValueError, match="nowhere: expected a folder of recordings, not there"):
        find_trials(tmp_path / "nowhere", kinds)
    with pytest.raises(ValueError, match=r"expected files of markers \(.trc, .c3d\), got an empty folder"):
        find_trials(tmp_path, kinds)
    (tmp_path / "notes.txt").write_text("")
    with pytest.raises(ValueError, match="expected a folder of recordings, got a file"):
        find_trials(tmp_path / "notes.txt", kinds)
    with pytest.raises(ValueError, match=r"got notes.txt"):
        find_trials(tmp_path, kinds)
    with pytest.raises(ValueError, match=r"markers of hop, but nothing to compare with; .*such as hop_grf.mot"):
        found(hop__trc="")


def test_a_c3d_goes_before_the_trc_that_was_made_of_it(found):
    told, notes = found(plates=["hop.c3d"], com=["hop.c3d"], hop__c3d="", hop__trc="")
    assert told == [("hop", "hop.c3d", "hop.c3d")]
    assert notes == ["hop.trc: not used, for hop.c3d has the same name; take away one of them"]
