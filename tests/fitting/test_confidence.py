"""How sure a fitted body is, and why not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs.body import poses
from ipman_rs.fitting.candidate import Candidate
from ipman_rs.fitting.confidence import assess, measure_soles, turned_bones, unseen_limbs
from ipman_rs.fitting.hypotheses import Hypothesis
from tests.helpers import fit_terms_cases as cases

STANDS = [Hypothesis("feet", 10.0, 100.0), Hypothesis("feet", 20.0, 500.0)]


def standing(name: str = "standing", up: float = 0.0, **known) -> Candidate:
    """A body in a named pose, `up` metres above the floor y = 0, whose points were all seen where they are."""
    problem, given = cases.observed(1)
    values = {**cases.zeros(1), **{key: given[key] for key in ("camera_orient", "camera_transl", "log_focal")}}
    pose = torch.as_tensor(poses.pose_of(problem.body.body, name))[None].double()
    values |= {"orient": pose[:, 0], "pose": pose[:, 1:]}
    values["transl"][:, 1] = up - Candidate(problem, values).vertices[..., 1].amin(dim=1)
    ground = ipt.Ground.y_up()
    points = Candidate(problem, values).projected.detach()
    seen = {"points": points, "confidence": torch.ones_like(points[..., 0])}
    return Candidate(replace(problem, **{"ground": ground, **seen, **known}), values)


def test_nothing_to_say():
    sure = assess(standing(), 0.5, STANDS)
    assert (sure.level, sure.reasons) == ("green", [])
    assert sure.record()["support"] == "feet"
    assert sure.record()["camera_pitch_range"] == [10, 10]
    margin = ip.support_margin(
        standing().vertices.detach().numpy()[0], standing().problem.body.body.template, ip.Ground.y_up(), threshold=0.03
    )
    assert sure.record()["margin_mm"] == pytest.approx(1000 * margin)


@pytest.mark.parametrize(
    ("body", "error", "weighed", "level", "reason"),
    [
        ({}, 7.0, STANDS, "red", "fits poorly: median error 7.0 % of the person's height"),
        ({"name": "lean_past_toes"}, 0.5, STANDS, "red", "mm outside what it stands on"),
        ({"up": 0.5}, 0.5, STANDS, "red", "nothing of it touches the floor"),
        ({"up": 0.025}, 0.5, STANDS, "amber", "the left foot is 25 mm off the floor"),
        ({"name": "one_leg"}, 0.5, STANDS, "amber", "foot is"),
        ({"name": "chair"}, 0.5, [Hypothesis("seat", 0.0, 1.0)], "amber", "the seat is assumed"),
        ({"up": 0.5}, 0.5, [Hypothesis("nothing", 0.0, 1.0)], "amber", "balance and floor were not asked for"),
    ],
)
def test_reasons(body, error, weighed, level, reason):
    sure = assess(standing(**body), error, weighed)
    assert sure.level == level
    assert any(reason in each for each in sure.reasons), sure.reasons


def test_soles():
    body = standing("t_pose", up=0.03)
    for sole in measure_soles(body).values():
        assert sole["height_mm"] == pytest.approx(30, abs=0.5)
        assert sole["tilt_degrees"] == pytest.approx(0, abs=0.1)
    joint = body.problem.body.body.joint_names.index("left_ankle") - 1
    body.variables["pose"][0, joint] = torch.tensor([math.radians(20), 0, 0])
    tilted = measure_soles(Candidate(body.problem, body.variables))
    assert tilted["left"]["tilt_degrees"] == pytest.approx(20, abs=2)  # the heel is up
    assert tilted["right"]["tilt_degrees"] == pytest.approx(0, abs=0.1)


def test_limbs_that_were_not_seen():
    body = standing()
    confidence = body.problem.confidence.clone()
    confidence[0, body.problem.landmarks.names.index("left_knee")] = 0.3
    body = Candidate(replace(body.problem, confidence=confidence), body.variables)
    assert unseen_limbs(body) == ["left leg"]
    assert assess(body, 0.5, STANDS).reasons == ["not seen, and guessed: left leg"]


def test_bones_that_point_elsewhere():
    body = standing()
    own = body.camera.turn(body.landmarks[:, None])[:, 0].detach()
    sure = torch.ones_like(own[..., 0])
    assert (
        turned_bones(Candidate(replace(body.problem, relative_points=own, relative_confidence=sure), body.variables))
        == []
    )
    wrist = body.problem.landmarks.names.index("right_wrist")
    elbow = body.problem.landmarks.names.index("right_elbow")
    other = own.clone()
    other[:, wrist] = 2 * own[:, elbow] - own[:, wrist]
    turned = Candidate(replace(body.problem, relative_points=other, relative_confidence=sure), body.variables)
    assert turned_bones(turned) == ["right elbow to right wrist"]


def test_another_body_that_explains_as_much():
    close = [Hypothesis("feet", 10.0, 100.0), Hypothesis("seat", 20.0, 150.0), Hypothesis("feet", 20.0, 180.0)]
    same = assess(standing(), 0.5, close, standing())
    assert same.reasons == []
    assert same.measures["camera_pitch_range"] == [10, 20]
    other = assess(standing(), 0.5, close, standing("squat"))
    assert other.reasons == ["another body explains the image nearly as well (on a seat, seen from 20°)"]
    assert other.measures["runner_up"]["dearer"] == 50
    far = [close[0], replace(close[1], cost=300.0)]
    assert assess(standing(), 0.5, far, standing("squat")).reasons == []


def test_known_cameras_have_no_pitch():
    sure = assess(
        standing(), 0.5, [Hypothesis("feet", math.nan, 1.0), Hypothesis("seat", math.nan, np.inf)], standing()
    )
    assert "camera_pitch" not in sure.measures
    assert sure.measures["runner_up"]["camera_pitch"] is None
    assert sure.measures["runner_up"]["dearer"] is None
