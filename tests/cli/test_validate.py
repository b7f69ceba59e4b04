"""`ipman validate` on recordings that were made up from a body, so that what it must say is known; and on real ones."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("torch", reason="torch is an extra")

from click.testing import CliRunner

from ipman_rs.cli import main
from ipman_rs.fitting.jobs.recordings import FittedRecording
from ipman_rs.validation import run as validation_run
from tests.helpers import laboratory_files
from tests.helpers.laboratory_files import FRAMES, MASS, OFF, G, mot, moved, trc

pytestmark = pytest.mark.slow


@pytest.fixture
def run():
    def call(*arguments):
        result = CliRunner().invoke(main, ["validate", *map(str, arguments)])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return SimpleNamespace(code=result.exit_code, out=result.stdout, err=result.stderr)

    return call


@pytest.fixture(scope="module")
def person():
    return laboratory_files.person()


@pytest.fixture(scope="module")
def folder(tmp_path_factory, person):
    """Quiet standing, and being lifted up and down by 4 cm, with the forces of a person of 64 kg."""
    root = tmp_path_factory.mktemp("lab")
    omega = 2 * np.pi
    for name, height, scale, unit in (("static", 0.0, 1000.0, "mm"), ("lift", 0.04, 1.0, "m")):
        times, shift = moved(height)
        trc(root / f"{name}.trc", person, shift, scale, unit)
        cop = (person.com + OFF) * [1, 0, 1]
        mot(root / f"{name}_grf.mot", cop, lambda t, h=height: MASS * (G - h * omega**2 * np.sin(omega * t)))
    com = person.com + shift + [0, 0.03, 0]
    rows = "\n".join(f"{t},{x},{y},{z}" for t, (x, y, z) in zip(times, com, strict=True))
    (root / "lift_reference.csv").write_text(f"# time_s,com_x_m,com_y_m,com_z_m (y up)\n{rows}\n")
    return root


@pytest.fixture(scope="module")
def first(folder, tmp_path_factory):
    """The output of one command, and what it said."""
    output = tmp_path_factory.mktemp("out")
    result = CliRunner().invoke(main, ["validate", str(folder), "-o", str(output)])
    assert result.exit_code == 0, result.output
    return SimpleNamespace(folder=output, out=result.stdout, err=result.stderr)


def records(output):
    return {one["name"]: one for one in json.loads((output / "validation.json").read_text())["recordings"]}


def test_the_figures_are_those_that_were_made_up(first):
    told = records(first.folder)
    still, lift = told["static"], told["lift"]
    assert (still["kind"], lift["kind"]) == ("quiet standing", "movement in place")
    assert (still["fit"]["shape_from"], lift["fit"]["shape_from"]) == ("itself", "static")
    assert max(one["fit"]["markers"] for one in told.values()) < 1e-3
    assert still["mass"]["plates"] == pytest.approx(MASS, abs=0.2)  # the second plate's 1.5 N
    assert lift["mass"]["plates"] == pytest.approx(MASS, abs=0.3)
    assert lift["force"]["share"] < 0.01
    np.testing.assert_allclose(still["standing"]["offset"], -OFF[[2, 0]], atol=3e-3)  # forward is z, left x; of the fit
    np.testing.assert_allclose(lift["com"]["methods"]["exact"]["mean"], [0, 0, -0.03], atol=3e-3)
    assert still["com"] is None
    assert still["mass"]["standing"] is None
    assert lift["mass"]["standing"] == still["mass"]["plates"]  # the same person's, standing still
    assert still["flags"] == lift["flags"] == []


def test_what_is_written(first):
    assert "report:" in first.out
    page = (first.folder / "validation.md").read_text()
    for title in ("Weight", "Formulations of the centre of mass", "Quiet standing", "Centre of pressure"):
        assert f"## {title}\n" in page
    assert "| mean of the vertices |" in page
    assert "264.1" in page
    for name in ("static", "lift"):
        inside = first.folder / name
        for picture in ("pressure.png", "over_time.png", "bodies.png"):
            assert (inside / picture).read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
            assert f"]({name}/{picture})" in page
        with np.load(inside / "series.npz", allow_pickle=False) as series:
            assert series["cop_measured_m"].shape == (FRAMES, 3)
            rows = np.genfromtxt(inside / "series.csv", delimiter=",", names=True)
            np.testing.assert_allclose(rows["com_exact_y_m"], series["com_exact_m"][:, 1], rtol=1e-5)
            np.testing.assert_allclose(rows["loads_plate1_N"], series["loads_N"][:, 0], rtol=1e-5)


def test_fits_are_kept(run, folder, first):
    """The second command fits nothing; after a kill in the middle, only what is missing; --fresh everything."""
    kept = {name: (first.folder / name / "fit.json").stat().st_mtime_ns for name in ("static", "lift")}
    before = (first.folder / "validation.json").read_bytes()
    (first.folder / "validation.json").unlink()
    (first.folder / "lift" / "lift.npz").unlink()
    assert run(folder, "-o", first.folder).code == 0
    again = {name: (first.folder / name / "fit.json").stat().st_mtime_ns for name in kept}
    assert again["static"] == kept["static"]
    assert again["lift"] > kept["lift"]
    assert (first.folder / "validation.json").read_bytes() == before  # to the last digit


def test_everybody_their_own_shape(run, folder, tmp_path):
    assert run(folder, "-o", tmp_path, "--person", "none", "--rate", "10").code == 0
    told = records(tmp_path)
    assert {one["fit"]["shape_from"] for one in told.values()} == {"itself"}
    assert {one["frames"] for one in told.values()} == {FRAMES // 5}
    assert told["lift"]["cop"]["all"]["distance"]["moving: ZMP of the CoM"] is None  # 10 Hz are too few


def copied(folder, to, *names):
    for name in names or [path.name for path in folder.iterdir()]:
        (to / name).write_bytes((folder / name).read_bytes())
    return to


def test_a_bad_file_is_told_and_the_rest_goes_on(run, folder, tmp_path):
    (tmp_path / "lab").mkdir()
    lab = copied(folder, tmp_path / "lab")
    (lab / "static.trc").write_text("hello")
    cut(lab / "lift_reference.csv")
    said = run(lab, "-o", tmp_path / "out", "--rate", "10")
    assert said.code == 1
    assert "static.trc: line 1: expected PathFileType" in said.err
    assert re.search(r"lift_reference.csv: line \d+: expected 4 columns, got \d: is the file complete", said.err)
    assert "static could not be compared: the others found their shapes themselves" in said.out
    assert records(tmp_path / "out").keys() == {"lift"}
    assert (tmp_path / "out" / "validation.md").read_text().count("not compared: ") == 2


def test_a_recording_that_fails_for_no_known_reason_takes_no_other_with_it(folder, tmp_path, monkeypatch):
    (tmp_path / "lab").mkdir()
    plan = validation_run.plan(copied(folder, tmp_path / "lab"), tmp_path / "out", "anny-lite", "none", 10.0, True)

    def compared(_plan, one, *_):
        if one.trial.name == "static":
            raise AssertionError
        return {"name": one.trial.name}

    monkeypatch.setattr(validation_run, "_fit", lambda *_: FittedRecording(Path(), {}, {"notes": []}))
    monkeypatch.setattr(validation_run, "_compare", compared)
    monkeypatch.setattr(validation_run, "_gives_weight", lambda _: False)
    found, _, failures = validation_run.run(plan)
    assert [one["name"] for one in found] == ["lift"]
    assert [str(each) for each in failures] == [
        f"{tmp_path / 'lab' / 'static.trc'}: cannot be compared: AssertionError"
    ]


def cut(path):
    text = path.read_text()
    path.write_text(text[: text.rindex(",")])


def test_forces_in_millimetres(run, person, folder, tmp_path):
    (tmp_path / "lab").mkdir()
    lab = copied(folder, tmp_path / "lab", "static.trc")
    mot(lab / "static_grf.mot", (person.com + OFF) * [1, 0, 1], lambda _t: MASS * G, scale=1000.0)
    said = run(lab, "-o", tmp_path / "out", "--rate", "10")
    assert said.code == 1
    assert "static_grf.mot: looks like millimetres" in said.err


def written(path, person, **options):
    """The markers of somebody who stands still."""
    trc(path, person, moved()[1], **options)


def test_forces_that_tell_nothing_are_named_before_the_fit(run, person, folder, tmp_path):
    """On another clock, and never loaded: one line each, nothing is fitted for them, and the rest goes on."""
    lab = tmp_path / "lab"
    lab.mkdir()
    copied(folder, lab, "static.trc", "static_grf.mot")
    for name in ("late", "empty"):
        written(lab / f"{name}.trc", person)
    mot(lab / "empty_grf.mot", person.com, lambda _t: 0.0)
    mot(lab / "late_grf.mot", person.com, lambda _t: MASS * G, start=50.0)
    said = run(lab, "-o", tmp_path / "out", "--rate", "10")
    assert said.code == 1
    lines = [line for line in said.err.splitlines() if line]
    assert len(lines) == 2
    assert "empty_grf.mot: no frame has a loaded plate: the largest load is 2 N, expected over 20 N (" in lines[0]
    assert "late_grf.mot: times do not overlap: forces t 50.00 to 50.80 s, markers t 0.00 to 0.78 s" in lines[1]
    assert records(tmp_path / "out").keys() == {"static"}
    assert not (tmp_path / "out" / "late").exists()
    (lab / "static_grf.mot").unlink()
    again = run(lab, "-o", tmp_path / "nothing", "--rate", "10")
    assert again.code == 1
    assert not (tmp_path / "nothing").exists()  # nobody needs the shape of who stands still


def test_forces_in_other_axes_than_the_markers(person, tmp_path):
    """The file of forces has z up, the markers y: --up would turn both."""
    lab = tmp_path / "lab"
    lab.mkdir()
    written(lab / "walk.trc", person)
    x, y, z = (person.com + OFF) * [1, 0, 1]
    mot(lab / "walk_grf.mot", np.array([x, -z, y]), lambda _t: MASS * G, up="z")
    for up in (None, (0.0, 0.0, 1.0)):
        plan = validation_run.plan(lab, tmp_path / "out", "anny-lite", "none", 10.0, True, force_up=up)
        told = validation_run.RunLog()
        found = validation_run._read(plan, plan.trials[0], told)
        if up is None:
            assert "walk_grf.mot: looks like z up" in str(told.failures[0])
            assert "`force_up='z'` if so" in str(told.failures[0])
    assert told.failures == []
    np.testing.assert_allclose(found.plates.center(), np.tile([x, y, z], (len(found.plates), 1)), atol=1e-6)


def test_forces_on_the_plates_are_turned(run, person, tmp_path):
    (tmp_path / "lab").mkdir()
    written(tmp_path / "lab" / "markers.trc", person)
    mot(tmp_path / "lab" / "plates.mot", (person.com + OFF) * [1, 0, 1], lambda _t: -MASS * G)
    said = run(tmp_path / "lab", "-o", tmp_path / "out", "--rate", "10")
    assert said.code == 0, said.err
    found = records(tmp_path / "out")["markers"]
    assert found["flags"][0] == "the forces of plate 1 point down, as those on the plates do; they were turned round"
    assert [flag.partition(":")[0] for flag in found["flags"][1:]] == ["10 frames a second"]
    assert found["mass"]["plates"] == pytest.approx(MASS, abs=0.3)
    np.testing.assert_allclose(found["standing"]["offset"], -OFF[[2, 0]], atol=3e-3)


def test_columns_that_external_loads_name(run, person, tmp_path):
    (tmp_path / "MarkerData").mkdir()
    (tmp_path / "ForceData").mkdir()
    written(tmp_path / "MarkerData" / "trial1.trc", person)
    mot(tmp_path / "ForceData" / "kistler.mot", (person.com + OFF) * [1, 0, 1], lambda _t: MASS * G, rename=True)
    said = run(tmp_path, "-o", tmp_path / "out", "--rate", "10")
    assert said.code == 2
    assert "nothing to compare with" in said.err.replace("\n", " ")
    (tmp_path / "ForceData" / "trial1_loads.xml").write_text(
        "<OpenSimDocument><ExternalLoads><objects><ExternalForce><force_identifier>FP1_F</force_identifier>"
        "<point_identifier>FP1_COP</point_identifier><torque_identifier>FP1_M</torque_identifier></ExternalForce>"
        "</objects><datafile>D:\\data\\kistler.mot</datafile></ExternalLoads></OpenSimDocument>"
    )
    said = run(tmp_path, "-o", tmp_path / "out", "--rate", "10")
    assert said.code == 0, said.err
    assert records(tmp_path / "out")["trial1"]["mass"]["plates"] == pytest.approx(MASS, abs=0.3)


def test_markers_that_cannot_be_a_persons_are_refused_before_the_fit(run, person, tmp_path):
    """Millimetres that are said to be metres; and z up, which --up mends."""
    lab = tmp_path / "lab"
    lab.mkdir()
    written(lab / "big.trc", person, scale=1000.0)
    mot(lab / "big_grf.mot", person.com * [1, 0, 1], lambda _t: MASS * G)
    said = run(lab, "-o", tmp_path / "out", "--rate", "10")
    assert said.code == 1
    assert "big.trc: markers: " in said.err
    assert "a body spans 1" in said.err
    assert "--units mm if so" in said.err
    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    up = SimpleNamespace(names=person.names, points=person.points @ turn.T)
    trc(lab / "big.trc", up, 0 * moved()[1])
    said = run(lab, "-o", tmp_path / "out", "--rate", "10")
    assert "markers: looks like +z up" in said.err
    assert "--up z if so" in said.err
    assert not (tmp_path / "out").exists()
    mot(lab / "big_grf.mot", turn @ ((person.com + OFF) * [1, 0, 1]), lambda _t: MASS * G, up="z")
    said = run(lab, "-o", tmp_path / "out", "--rate", "10", "--up", "z")
    assert said.code == 0, said.err
    np.testing.assert_allclose(records(tmp_path / "out")["big"]["standing"]["offset"], -OFF[[2, 0]], atol=3e-3)


def test_who_stands_still_by_the_markers_gives_the_shape(run, person, folder, tmp_path):
    lab = tmp_path / "lab"
    lab.mkdir()
    copied(folder, lab, "lift.trc", "lift_grf.mot")
    written(lab / "z01.trc", person)
    said = run(lab, "-o", tmp_path / "out", "--rate", "10")
    assert said.code == 0, said.err
    assert "z01: its markers stand still, so its shape and places of markers are kept for the others" in said.out
    assert records(tmp_path / "out")["lift"]["fit"]["shape_from"] == "z01"


def test_wrong_usage(run, folder, tmp_path):
    for arguments, told in (
        ((tmp_path / "nowhere",), "expected a folder of recordings, not there"),
        ((tmp_path,), "expected files of markers (.trc, .c3d), got an empty folder"),
        ((folder, "--person", "stat"), "--person: expected auto, none or one of static, lift, got 'stat'"),
        ((folder, "--body", "nobody"), "nobody"),
        ((folder, "--rate", "0"), "--rate"),
    ):
        said = run(*arguments, "-o", tmp_path / "out")
        assert said.code == 2, said
        assert told in said.err.replace("\n", " ")
    assert not (tmp_path / "out").exists()


def test_somebody_walks(run, shared, tmp_path):
    """OpenSim's example on a treadmill, markers in mm at 60 Hz, plates in m at 600 Hz; its model weighs 72.6 kg."""
    said = run(shared("gait2354"), "-o", tmp_path, "--rate", "30")
    assert said.code == 0, said.err
    assert "g2354_bodykin.sto: taken as the centre of mass of subject01_walk1" in said.out
    walk = records(tmp_path)["subject01_walk1"]
    assert walk["kind"] == "walking"
    assert walk["mass"]["plates"] == pytest.approx(72.6, rel=0.01)
    assert walk["mass"]["volume_mean"] == pytest.approx(72.6, rel=0.10)
    assert walk["force"]["share"] < 0.03  # m (g + the fitted body's acceleration) is the force
    assert walk["com"]["methods"]["exact"]["distance"] < 0.05
    for phase in ("single support", "double support"):
        away = walk["cop"][phase]["distance"]
        assert away["at rest: g(CoM)"] > 0.1
        assert away["moving: ZMP of the parts"] < 0.035  # walking is no statics
