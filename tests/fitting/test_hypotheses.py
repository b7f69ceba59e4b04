"""What a photo leaves open: pitches and supports, side by side, and what they cost."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs.body import poses
from ipman_rs.data.keypoints.detections import Detections
from ipman_rs.data.keypoints.mediapipe import NAMES
from ipman_rs.fitting import config, hypotheses, start
from ipman_rs.fitting.camera import level_camera
from ipman_rs.fitting.candidate import Candidate
from ipman_rs.fitting.detection_problem import problem_from_detections
from ipman_rs.fitting.fit import fit
from ipman_rs.fitting.hypotheses import Hypotheses, Rows
from ipman_rs.fitting.landmarks import Landmarks
from ipman_rs.fitting.result import fit_results

SEEN = tuple(name for name in NAMES if name is not None)
WEIGHING = Hypotheses(
    "weigh", (-10.0, 0.0, 20.0), 10.0, 5.0, 100.0, {"feet": 0, "seat": 20, "floor": 15, "nothing": 70}
)
FOCAL, SIZE = 1000.0, 1000.0


def photo_of(pose: np.ndarray, pitch: float, seed: int, lean: float = 0.0, height: float = 0.0) -> Detections:
    """A body that stands `height` above its floor, seen by a camera that looks down by `pitch` degrees from 4 m away,
    with the noise of a good detector; its trunk leans by `lean` degrees, legs and all."""
    draw = np.random.default_rng(seed)
    model = ipt.BodyModel("anny-lite")
    points = Landmarks(model, SEEN)(torch.as_tensor(pose)[None])[0].numpy()
    points[:, 1] += height - np.asarray(model.body(pose).vertices)[:, 1].min()
    turn, tilt = (math.radians(angle) for angle in (draw.uniform(-180, 180), lean))
    about_y = np.array([[math.cos(turn), 0, math.sin(turn)], [0, 1, 0], [-math.sin(turn), 0, math.cos(turn)]])
    about_x = np.array([[1, 0, 0], [0, math.cos(tilt), -math.sin(tilt)], [0, math.sin(tilt), math.cos(tilt)]])
    points = points @ (about_y @ about_x).T
    seen = (points - points.mean(axis=0)) @ level_camera(math.radians(pitch)).numpy().T + [0, 0, 4.0]
    pixels = FOCAL * seen[:, :2] / seen[:, 2:] + SIZE / 2 + 4 * draw.standard_normal((len(seen), 2))
    relative = seen - seen[0] + 0.02 * draw.standard_normal(seen.shape)
    sure, size = np.ones((1, len(SEEN))), np.array([[SIZE, SIZE]])
    return Detections(SEEN, pixels[None], sure, (f"{seed}",), size, relative[None], sure)


def results_of(detections: Detections):
    problem = problem_from_detections(ipt.BodyModel("anny-lite"), detections, focal=FOCAL)
    preset = config.load("fast")
    problem, variables = start.initial_state(problem, preset.start)
    return fit_results(fit(problem, variables, preset), preset, variables)


def joined(*parts: Detections) -> Detections:
    from ipman_rs.data.keypoints.detections import join

    return join(parts)


def pose_of(name: str) -> np.ndarray:
    return poses.pose_of(ip.load_body("anny-lite"), name)


@pytest.fixture(scope="module")
def standing():
    problem = problem_from_detections(ipt.BodyModel("anny-lite"), photo_of(pose_of("standing"), 0.0, 1), focal=FOCAL)
    return problem, start.initial_state(problem, {"search": "mean"})[1]


def test_a_turned_camera_moves_nothing_in_the_image(standing):
    problem, variables = standing
    expanded, turned, rows = hypotheses.expand(problem, variables, WEIGHING)
    with torch.no_grad():
        before = Candidate(problem, variables).projected
        after = Candidate(expanded, turned).projected
    torch.testing.assert_close(after, before.expand_as(after), rtol=0, atol=1e-7)
    sight = expanded.camera.rotation[:, 2].numpy()  # the camera's forward axis, in the world
    np.testing.assert_allclose(np.degrees(np.arcsin(-sight[:, 1])), rows.pitch, atol=1e-9)
    torch.testing.assert_close(
        Candidate(expanded, turned).camera.rotation, expanded.camera.rotation, rtol=0, atol=1e-12
    )


def test_every_pitch_with_every_support(standing):
    expanded, _, rows = hypotheses.expand(*standing, WEIGHING)
    assert sorted(zip(rows.support.tolist(), rows.pitch.tolist(), strict=True)) == sorted(
        [(s, p) for s in ("feet", "seat", "floor") for p in (-10.0, 0.0, 20.0)] + [("nothing", 0.0)]
    )
    assert expanded.static is not None
    assert expanded.seated is not None
    assert expanded.on_floor is not None
    assert expanded.static.tolist() == [support != "nothing" for support in rows.support]
    assert expanded.seated.tolist() == [support == "seat" for support in rows.support]
    assert expanded.on_floor.tolist() == [support == "floor" for support in rows.support]


def test_a_known_camera_leaves_the_supports(standing):
    problem, variables = standing
    known = replace(problem, pitch_known=True)
    expanded, same, rows = hypotheses.expand(known, variables, WEIGHING)
    assert rows.support.tolist() == ["feet", "seat", "floor", "nothing"]
    assert np.isnan(rows.pitch).all()
    assert torch.equal(same["orient"], variables["orient"].expand(4, 3))
    weighed = hypotheses.weigh({"a": np.zeros(4)}, rows, WEIGHING)
    assert [each.cost for _, each in weighed[0]] == [0, 15, 20, 70]  # no price of a pitch
    assert expanded.num_bodies == 4


def test_what_a_hypothesis_costs():
    people, supports = np.array([0, 0, 0, 1]), np.array(["feet", "seat", "nothing", "feet"])
    rows = Rows(people, supports, np.array([20.0, 10.0, 10.0, 5.0]), people)
    terms = {"reprojection": np.array([1.0, 2.0, np.inf, 7.0]), "balance": np.array([4.0, 0.5, 0.0, np.nan])}
    first, second = hypotheses.weigh(terms, rows, WEIGHING)
    assert [(row, each.support, each.cost) for row, each in first] == [
        (1, "seat", 22.5),  # 2 + 0.5 + its price 20
        (0, "feet", 405.0),  # 1 + 4 + 100 (10 / 5)²
        (2, "nothing", math.inf),
    ]
    assert second[0][1].cost == math.inf
    assert hypotheses.best([first, second], 2).tolist() == [0, 1, 3]


def test_ties_keep_their_order():
    rows = Rows(np.zeros(3, int), np.array(["feet"] * 3), np.full(3, 10.0), np.zeros(3, int))
    (own,) = hypotheses.weigh({"a": np.ones(3)}, rows, WEIGHING)
    assert [row for row, _ in own] == [0, 1, 2]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("before: nowhere", "hypotheses, before: expected one of the stages pose, got 'nowhere'"),
        ("pitches: [95]", "hypotheses, pitches: expected degrees between -90 and 90"),
        ("pitches: []", "hypotheses, pitches: expected degrees between -90 and 90"),
        ("prices: {feet: 0, seat: 1, floor: 1}", "hypotheses, prices, nothing: expected a number ≥ 0, got None"),
        ("prices: {feet: -1, seat: 1, floor: 1, nothing: 1}", "hypotheses, prices, feet: expected a number ≥ 0"),
        ("pitch: {mean: null, deviation: 1, weight: 1}", "hypotheses, pitch, mean: expected a number ≥ -90, got None"),
        ("pitch: [1, 2]", "hypotheses, pitch: expected names with values"),
        ("pitch: {mean: 1, deviation: 0, weight: 1}", "hypotheses, pitch, deviation: expected a number above 0"),
        ("sides: 3", "hypotheses: expected some of before"),
    ],
)
def test_presets_that_say_it_wrong(tmp_path, change, message):
    usual = {
        "before": "before: pose", "pitches": "pitches: [0]", "pitch": "pitch: {mean: 1, deviation: 2, weight: 3}",
        "prices": "prices: {feet: 0, seat: 1, floor: 1, nothing: 1}",
    }  # fmt: skip
    lines = [*{**usual, change.partition(":")[0]: change}.values()]
    stage = "stages: [{name: pose, free: [pose], weights: {pose_prior: 1}}]"
    path = tmp_path / "own.yaml"
    path.write_text("\n".join([stage, "hypotheses:", *(f"  {line}" for line in lines)]))
    with pytest.raises(ValueError, match="^" + str(path) + ": " + message.replace("(", r"\(")):
        config.load(path)


@pytest.mark.slow
def test_pitch_and_support_are_found():
    """Poses that feet hold up, from 0, 15 and 25° above: the pitch within 10° for most, on the floor, in balance."""
    names = [name for name in ("standing", "t_pose", "walking", "tree", "warrior", "lunge", "squat") for _ in range(3)]
    pitches = [0.0, 15.0, 25.0] * 7
    seen = [photo_of(pose_of(name), pitch, seed) for seed, (name, pitch) in enumerate(zip(names, pitches, strict=True))]
    results = results_of(joined(*seen))
    found = [result.confidence.measures for result in results]
    near = [abs(each["camera_pitch"] - pitch) <= 10 for each, pitch in zip(found, pitches, strict=True)]
    assert np.mean(near) >= 0.8
    assert np.mean([each["support"] in ("feet", "floor") for each in found]) >= 0.9
    margins = [each["margin_mm"] for each in found if each.get("margin_mm") is not None]
    assert np.mean(np.array(margins) > 0) >= 0.9
    lowest = [min(sole["height_mm"] for sole in each["soles"].values()) for each in found if "soles" in each]
    assert np.abs(lowest).max() < 20


@pytest.mark.slow
def test_seats_floors_and_flight():
    sitting = pose_of("standing")
    for joint, angle in (("hip", -90), ("knee", 90)):
        for side in ("left", "right"):
            sitting[ip.load_body("anny-lite").joint_names.index(f"{side}_{joint}")] = [math.radians(angle), 0, 0]
    seen = [
        photo_of(sitting, 10.0, 30),
        photo_of(pose_of("push_up"), 10.0, 31),
        photo_of(pose_of("walking"), 10.0, 32, lean=40.0),
    ]
    seat, floor, flight = results_of(joined(*seen))
    assert seat.confidence.measures["support"] == "seat"
    assert "the seat is assumed" in " ".join(seat.confidence.reasons)
    assert floor.confidence.measures["support"] == "floor"
    assert flight.confidence.measures["support"] == "nothing"
    assert flight.confidence.measures["physics"] is False
    assert flight.confidence.level == "amber"
    assert any("balance and floor were not asked for" in reason for reason in flight.flags())
    last = flight.stages[-1]["terms"]
    assert last["balance"] == last["flat_soles"] == last["seat"] == last["segment_balance"] == 0


@pytest.mark.slow
def test_a_body_knows_nothing_of_its_batch():
    seen = [photo_of(pose_of(name), 10.0, seed) for seed, name in enumerate(("standing", "lunge", "push_up"), 40)]
    together, reversed_ = results_of(joined(*seen)), results_of(joined(*seen[::-1]))
    for row, one in enumerate(seen):
        (alone,) = results_of(one)
        for other in (together[row], reversed_[2 - row]):
            assert alone.weighed == other.weighed
            for name, value in alone.arrays().items():
                assert np.array_equal(value, other.arrays()[name]), name


@pytest.mark.slow
def test_the_record_says_what_was_weighed():
    (result,) = results_of(photo_of(pose_of("standing"), 10.0, 50))
    record = result.record()
    assert record["confidence"]["support"] == record["hypotheses"][0]["support"] == "feet"
    assert {each["support"] for each in record["hypotheses"]} == {"feet", "seat", "nothing"}  # no hands on the floor
    assert len(record["hypotheses"]) == 11
    assert record["confidence"]["level"] == "green"
    assert record["confidence"]["reasons"] == []
    assert set(record["confidence"]["soles"]) == {"left", "right"}


def test_people_of_one_photo_share_a_pitch():
    """One of them alone would take 0°, and both together take 20°; whoever is in another photo takes their own."""
    people, pitches = np.repeat([0, 1, 2], 2), np.array([0.0, 20.0] * 3)
    rows = Rows(people, np.array(["feet"] * 6), pitches, np.array([0, 0, 0, 0, 1, 1]))
    level = replace(WEIGHING, mean=10.0)  # both pitches cost the same
    terms = {"all": np.array([1.0, 3.0, 9.0, 2.0, 1.0, 3.0])}
    chosen = [own[0][1] for own in hypotheses.weigh(terms, rows, level)]
    assert [each.pitch for each in chosen] == [20, 20, 0]
    price = float(level.pitch_cost(np.array(20.0)))
    assert [each.cost for each in chosen] == [5 + price, 5 + price, 1 + price]
    alone = replace(rows, image=np.arange(3).repeat(2))
    assert [own[0][1].pitch for own in hypotheses.weigh(terms, alone, level)] == [0, 20, 0]


@pytest.mark.slow
def test_two_people_before_one_camera():
    """Seen from 25°, one of whom is hard to tell: both take the same pitch, whichever comes first."""
    seen = [photo_of(pose_of(name), 25.0, seed) for seed, name in ((60, "standing"), (61, "lunge"), (62, "squat"))]
    for order in ([0, 1, 2], [2, 0, 1]):
        one = joined(*(seen[k] for k in order))
        problem = problem_from_detections(ipt.BodyModel("anny-lite"), one, focal=FOCAL)
        preset = config.load("fast")
        problem, variables = start.initial_state(
            replace(problem, image=torch.zeros(3, dtype=torch.int64)), preset.start
        )
        found = fit_results(fit(problem, variables, preset), preset, variables)
        assert len({result.confidence.measures["camera_pitch"] for result in found}) == 1
        assert abs(found[0].confidence.measures["camera_pitch"] - 25) <= 10
