"""Estimated beside measured pressure, on a made-up recording of a mat of springs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs import data, evaluation, paper_figures
from ipman_rs.evaluation.tables.models import Models
from ipman_rs.paper_figures import pressure as made

pytest.importorskip("ezc3d", reason="ezc3d writes and judges C3D files")
from tests.helpers import spring_mat


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return spring_mat.write(tmp_path_factory.mktemp("made-up"))


@pytest.mark.slow
def test_the_numbers(figure, recording, contents):
    path, models = recording
    said = figure("pressure", "--path", path, "--models", models)
    assert said.code == 0, said.err
    numbers = said.numbers
    with np.load(said.folder / "pressure.npz") as stored:
        maps = dict(stored)
    # The drawn maps are those of the protocol, whose IoU was found in its own way.
    assert numbers["iou"] == pytest.approx(evaluation.pressure_iou(maps["estimated"], maps["measured"]))
    assert 0.3 < numbers["iou"] < 1
    pressed = made.of_data_set("moyo", data.open("moyo", path), 0, Models(models))
    center = ip.center_of_pressure(pressed.vertices, pressed.model.template, pressed.ground)
    np.testing.assert_allclose(numbers["center_of_pressure"]["estimated"], center, atol=1e-9)
    aside = np.linalg.norm((center - pressed.center)[:2])
    assert numbers["cop_error_m"] == pytest.approx(aside, abs=1e-9)
    assert numbers["best_of_the_grid"]["iou"] >= numbers["iou"] - 0.05
    # The springs carry the moments of the exact centre of mass.
    exact = ip.center_of_mass(pressed.vertices, pressed.model.template, "exact")
    np.testing.assert_allclose(numbers["center_of_pressure"]["measured"][:2], exact[:2], atol=1e-3)
    again = figure("pressure", "--path", path, "--models", models, "--frame", f"{spring_mat.NAME}/00000", out="again")
    assert contents(said.folder) == contents(again.folder)


@pytest.mark.slow
@pytest.mark.parametrize(("pose", "aside"), [("standing", 0.9), ("lying", 0.0)])
def test_the_picture(pose, aside, tmp_path):
    """The windows of both maps hold all centres, also of a body beside the mat, whose empty map says so; of a map along
    the mat, which fills the height, the title keeps off the panels' titles."""
    path, models = spring_mat.write(tmp_path, pose)
    pressed = made.of_data_set("moyo", data.open("moyo", path), 0, Models(models))
    drawn = made.pressure(replace(pressed, vertices=pressed.vertices + (aside, 0.0, 0.0)))
    paper_figures.write(drawn, tmp_path / "out")
    _, left, right, _ = drawn.picture.axes
    assert ("nothing on\nthe mat" in [text.get_text() for text in left.texts]) is (aside > 0)
    assert not right.texts
    mat = pressed.measured
    for axes in (left, right):
        for kind in ("mass", "pressure"):
            for center in drawn.numbers[f"center_of_{kind}"].values():
                if np.isfinite(center).all():
                    x, y = 100 * float((center - mat.origin) @ mat.e2), 100 * float((center - mat.origin) @ mat.e1)
                    assert axes.get_xlim()[0] < x < axes.get_xlim()[1]
                    assert axes.get_ylim()[1] < y < axes.get_ylim()[0]
    above = drawn.picture.get_suptitle()
    title = next(text for text in drawn.picture.texts if text.get_text() == above)
    gap = title.get_window_extent().y0 - left.title.get_window_extent().y1
    assert gap / drawn.picture.dpi > 0.125  # inches: a line of words


def test_the_recording_s_stability(figure, recording):
    """L_stability of a data set whose bodies need a model file, z up."""
    path, models = recording
    said = figure("stability", "--data", "moyo", "--path", path, "--models", models, "--every", 2)
    assert said.code == 0, said.err
    (about,) = said.numbers["data"]
    pressed = made.of_data_set("moyo", data.open("moyo", path), 0, Models(models))
    loss = ip.stability_loss(pressed.vertices, pressed.model.template, pressed.ground)
    assert about["bodies"] == 2
    assert about["median_m"] == pytest.approx(float(loss), abs=1e-9)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--frame", "9"), "has 3 frames, from 0; there is no frame 9"),
        (("--frame", "who"), "no frame is called 'who'"),
        (("--models", "/nowhere"), "/nowhere"),
        (("--option", "frame=camera"), "moyo: "),
    ],
)
def test_bad_input(more, words, figure, recording):
    path, models = recording
    said = figure("pressure", "--path", path, "--models", models, *more)
    assert said.code == 1
    assert said.err.count("\n") == 1
    assert words in said.err


def test_a_data_set_without_a_mat(figure, tmp_path):
    from tests.helpers.miniatures import amass

    amass.tree(tmp_path)
    said = figure("pressure", "--data", "amass", "--path", tmp_path)
    assert said.code == 1
    assert "has no pressure maps" in said.err
