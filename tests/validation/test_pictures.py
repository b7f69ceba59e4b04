"""Pictures of comparisons, also of those in which next to nothing was measured."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="matplotlib is an extra")

import ipman_rs as ip
from ipman_rs.data.force_plates import ForcePlates
from ipman_rs.validation import MeasuredComparison, computed, pictures
from ipman_rs.validation.pictures import Floor

FRAMES = 40
TIMES = np.arange(FRAMES) / 25.0


@pytest.fixture(scope="module")
def bodies(lite):
    return np.tile(np.asarray(ip.body.posed(lite, "standing"), float), (FRAMES, 1, 1))


def plates(load):
    forces = np.zeros((FRAMES, 1, 3))
    forces[..., 1] = load
    nothing = np.zeros_like(forces)
    return ForcePlates(TIMES, forces, nothing + [0.0, 0.0, 0.02], nothing, np.array([0.0, 1.0, 0.0]), "made up")


@pytest.mark.slow
@pytest.mark.parametrize("measured", ["all", "no load", "nothing", "unseen", "a reference without numbers"])
def test_whatever_was_measured(lite, bodies, measured):
    of = {"all": plates(600.0), "no load": plates(0.0), "unseen": plates(600.0)}.get(measured)
    reference = np.full((FRAMES, 3), np.nan) if measured.startswith("a reference") else None
    seen = np.zeros(FRAMES, bool) if measured == "unseen" else None
    one = MeasuredComparison("made up", TIMES, computed(bodies, lite.template, of), of, reference, seen)
    markers = np.full((FRAMES, 3, 3), np.nan)
    for drawn in (
        pictures.pressure_map(one, bodies, lite.template),
        pictures.over_time(one),
        pictures.people(one, bodies, lite.faces, markers),
    ):
        assert drawn[:8] == b"\x89PNG\r\n\x1a\n"


def legends(draw, monkeypatch):
    """The names in all legends of a picture, and how many panels it has."""
    found = []
    monkeypatch.setattr(pictures, "_png", lambda figure: found.append(figure) or b"")
    draw()
    (figure,) = found
    boxes = [*figure.legends, *(axis.get_legend() for axis in figure.axes if axis.get_legend())]
    return {text.get_text() for box in boxes for text in box.get_texts()}, len(figure.axes)


@pytest.mark.parametrize(
    ("load", "rate", "lacking", "panels"),
    [
        (600.0, 50.0, set(), 4),
        (600.0, 10.0, {"ZMP of the parts", "m (g + acceleration of the fitted CoM)"}, 4),
        (0.0, 50.0, {"measured CoP", "m (g + acceleration of the fitted CoM)"}, 4),
        (np.nan, 50.0, {"measured CoP", "m (g + acceleration of the fitted CoM)", "all plates"}, 3),
    ],
)
def test_legends_name_what_is_drawn(lite, bodies, monkeypatch, load, rate, lacking, panels):
    of = plates(load)
    one = MeasuredComparison("made up", np.arange(FRAMES) / rate, computed(bodies, lite.template, of), of)
    everything = {"measured CoP", "ZMP of the parts", "m (g + acceleration of the fitted CoM)", "all plates"}
    named, count = legends(lambda: pictures.over_time(one), monkeypatch)
    assert everything - named == lacking
    assert count == panels
    named, _ = legends(lambda: pictures.pressure_map(one, bodies, lite.template), monkeypatch)
    assert ("CoP of a plate, with its load" in named) == (load == 600.0)


def test_somebody_who_walks_without_plates(lite, bodies):
    """A centre of mass was measured, no force: there are no phases, and the middle frame is drawn."""
    one = MeasuredComparison("made up", TIMES, computed(bodies, lite.template), reference=np.full((FRAMES, 3), np.nan))
    vars(one)["kind"] = "walking"
    assert one.phases == {}
    assert pictures.moments(one) == {"all": FRAMES // 2}
    assert pictures.pressure_map(one, bodies, lite.template)[:8] == b"\x89PNG\r\n\x1a\n"


def test_the_floor_as_the_person_faces():
    """Somebody who faces x: forward is x, right is z."""
    floor = Floor(np.array([1.0, 0.0, 2.0]), np.array([1.0, 0.0, 0.0]))
    np.testing.assert_allclose(floor(np.array([[1.3, 5.0, 2.0], [1.0, 0.0, 2.2]])), [[0, 0.3], [0.2, 0]], atol=1e-15)


def test_pictures_turn_with_the_person(lite, bodies):
    """The same body in the same pressure, whichever way it stands in the laboratory."""
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    drawn = []
    for turned in (bodies, bodies @ turn.T + [3.0, 0.0, -1.0]):
        one = MeasuredComparison("made up", TIMES, computed(turned, lite.template))
        drawn.append(Floor.under(one, turned[5], lite.template, 5)(one.com[5]))
    np.testing.assert_allclose(drawn[0], drawn[1], atol=1e-6)
