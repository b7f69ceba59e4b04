"""Recordings: one shape for all frames, smoothness, and the solver that knows their structure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is an extra")

from ipman_rs.data.markers import Tracks  # noqa: E402
from ipman_rs.fitting import marker_fit, sequence, start  # noqa: E402
from ipman_rs.fitting.camera import Camera  # noqa: E402
from ipman_rs.fitting.candidate import Candidate  # noqa: E402
from ipman_rs.fitting.config import load  # noqa: E402
from ipman_rs.fitting.rotations import vector  # noqa: E402
from ipman_rs.fitting.solvers import ValueAndGradient  # noqa: E402
from ipman_rs.fitting.solvers.arrow import Arrow, solve  # noqa: E402
from ipman_rs.fitting.terms.smoothness import Smoothness  # noqa: E402
from tests.helpers.fit_terms_cases import body_model  # noqa: E402

SIDES = ("wrist", "elbow", "shoulder", "hip", "knee", "ankle", "foot", "hand")
NAMES = ["head", "spine2", *(f"{side}_{joint}" for joint in SIDES for side in ("left", "right"))]
MARKERS = load("markers")
STRONG = 30.0


def recording(frames: int = 6, noise: float = 0.005, seed: int = 4):
    """Points of a body that raises an arm and walks along x, and what is true of it."""
    generator = torch.Generator().manual_seed(seed)
    tracks = Tracks(
        tuple(NAMES), np.zeros((frames, len(NAMES), 3)), np.ones((frames, len(NAMES))), np.arange(frames), ""
    )
    problem = marker_fit.problem_of(body_model(), tracks, {name: name for name in NAMES})
    truth = start.neutral(problem)
    phase = torch.linspace(0, 1, frames, dtype=torch.float64)
    truth["pose"][:, 15, 2] += phase
    truth["transl"][:, 0] = phase
    truth["orient"][:, 1] = 2.8 + phase  # through 180°
    truth["betas"][:] = torch.randn(10, generator=generator, dtype=torch.float64)
    points = Candidate(problem, truth).landmarks
    points = points + noise * torch.randn(points.shape, generator=generator, dtype=torch.float64)
    return replace(problem, points_3d=points), truth


def fitted(problem, **options):
    return sequence.fit_sequence(problem, start.start_at_points(problem), MARKERS, **{"rate": 5.0, **options})


def jitter(fit) -> float:
    points = Smoothness(body_model(), fit.problem.num_bodies).linearised(fit.problem, fit.variables, ("transl",))[0]
    return float(np.square(np.diff(points, 2, axis=0)).mean() ** 0.5)


@pytest.fixture(scope="module")
def problem():
    return recording()[0]


@pytest.fixture(scope="module")
def smooth(problem):
    return fitted(problem, smoothness=STRONG)


@pytest.mark.slow
def test_one_shape_for_all_frames(smooth):
    assert smooth.converged.all()
    for name in ("betas", "log_focal"):
        assert torch.equal(smooth.variables[name], smooth.variables[name][:1].expand_as(smooth.variables[name]))
    poses = smooth.variables["pose"]
    assert not torch.equal(poses[0], poses[1])


def test_what_was_recorded_is_found():
    exact, truth = recording(noise=0)
    weights = {"points_3d": 1e4, "shape_prior": 1e-3, "pose_prior": 1e-4}
    near, stage = MARKERS.stages
    config = replace(MARKERS, stages=(near, replace(stage, weights=weights)))
    found = sequence.fit_sequence(exact, start.start_at_points(exact), config, smoothness=0)
    away = (found.candidate.landmarks - exact.points_3d).norm(dim=-1)
    assert away.max() < 0.002  # what the priors leave
    assert (found.variables["betas"][0] - truth["betas"][0]).abs()[:2].max() < 0.5


@pytest.mark.slow
def test_smoothness_takes_away_jitter(problem, smooth):
    rough = fitted(problem, smoothness=0)
    slow = fitted(problem, smoothness=STRONG, order=1)
    assert jitter(smooth) < 0.6 * jitter(rough)
    assert jitter(slow) < jitter(rough)
    away = [(fit.candidate.landmarks - problem.points_3d).norm(dim=-1).mean() for fit in (rough, smooth)]
    assert away[1] < away[0] + 0.005  # the noise


@pytest.mark.slow
def test_frames_side_by_side_and_threads_change_no_bit(problem, smooth, monkeypatch):
    monkeypatch.setattr(sequence, "CHUNK", 4)
    threads = torch.get_num_threads()
    torch.set_num_threads(3 - min(threads, 2))
    again = fitted(problem, smoothness=STRONG)
    torch.set_num_threads(threads)
    for name, value in smooth.variables.items():
        assert torch.equal(value, again.variables[name]), name


def test_frames_of_an_earlier_result_are_not_searched_again(problem, smooth, monkeypatch):
    monkeypatch.setattr(sequence, "run_stage", None)
    done = torch.tensor([True] * problem.num_bodies)
    heard = []
    once_more = sequence.fit_sequence(
        problem,
        smooth.variables,
        MARKERS,
        smoothness=STRONG,
        rate=5.0,
        done=done,
        progress=lambda *at: heard.append(at),
    )
    assert once_more.converged.all()
    assert heard[-1] == ("pose", problem.num_bodies)
    moved = (once_more.candidate.landmarks - smooth.candidate.landmarks).norm(dim=-1)
    assert moved.max() < 0.01


@pytest.mark.slow
def test_a_frame_that_is_no_number_follows_its_neighbours(problem, smooth):
    points = problem.points_3d.clone()
    points[2] = torch.nan
    found = fitted(replace(problem, points_3d=points), smoothness=STRONG)
    assert [reason == "not finite" for reason in found.stages[0].reasons] == [False, False, True, False, False, False]
    assert all(value.isfinite().all() for value in found.variables.values())
    away = (found.candidate.landmarks - smooth.candidate.landmarks).norm(dim=-1)
    assert away.max() < 0.1


@pytest.mark.slow
def test_a_frame_where_nothing_was_seen(problem, smooth):
    seen = torch.ones_like(problem.confidence_3d)
    seen[3] = 0
    found = fitted(replace(problem, confidence_3d=seen), smoothness=STRONG)
    away = (found.candidate.landmarks - smooth.candidate.landmarks).norm(dim=-1)
    assert away[3].max() < 0.15
    assert found.converged.all()


def test_short_recordings(problem):
    for frames in (1, 2):
        few = problem.rows(torch.arange(frames))
        assert fitted(few).converged.all()


def test_one_ground_for_all_frames():
    free, truth = recording(frames=3)
    free, truth = replace(free, ground=None), {**truth, "transl": truth["transl"].clone()}
    truth["transl"][2, 1] += 0.4  # a jump
    heights = sequence.on_one_ground(free, truth).ground.height
    lowest = Candidate(free, truth).vertices[..., 1].amin(dim=1)
    assert torch.equal(heights, lowest.median().expand(3))


def test_the_gradient_is_that_of_the_value(problem):
    """Against central differences, in own numbers of three frames and in shared ones."""
    values = {name: value + 0.1 for name, value in start.start_at_points(problem).items()}
    for name in ("betas", "log_focal"):
        values[name] = values[name][:1].expand_as(values[name]).clone()
    smooth = Smoothness(problem.body, problem.num_bodies, 5.0)
    together = sequence.SequenceObjective(problem, values, MARKERS.stages[0], MARKERS, smooth)
    look = together.evaluation(together.start)
    rng = np.random.default_rng(0)
    for place in [0, 4, together.size + 5, 5 * together.size + 70, -1, -8, *rng.integers(len(together.start), size=4)]:
        step = np.zeros_like(together.start)
        step[place] = 1e-5
        ends = [together.evaluation(together.start + sign * step).value for sign in (1, -1)]
        assert look.gradient[place] == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-6, abs=1e-4)


def test_smoothness_is_the_mean_acceleration():
    frames, rate = 5, 10.0
    problem, truth = recording(frames)
    smooth = Smoothness(problem.body, frames, rate)
    x, slopes = smooth.linearised(problem, truth, ("transl",))
    accelerations = np.diff(x, 2, axis=0).reshape(frames - 2, -1, 3) * rate**2
    assert smooth.cost(x) == pytest.approx(np.square(accelerations).sum(-1).mean(-1).sum(), rel=1e-9)
    assert slopes.shape == (frames, 3, x.shape[1])
    whole = np.zeros((frames, frames))
    for k, diagonal in enumerate(smooth.band):
        whole += np.diag(diagonal[: frames - k], k) + (np.diag(diagonal[: frames - k], -k) if k else 0)
    np.testing.assert_allclose(smooth.pull(x), whole @ x, rtol=1e-9, atol=1e-6)
    with pytest.raises(ValueError, match="order: expected 1 .velocity. or 2"):
        Smoothness(problem.body, 3, order=3)
    with pytest.raises(ValueError, match="rate: expected positive frames a second, got 0"):
        Smoothness(problem.body, 3, rate=0)


@pytest.mark.parametrize("shared", [0, 3])
@pytest.mark.parametrize("reach", [1, 3])
def test_the_arrow_is_solved_like_the_whole_matrix(reach, shared, rng):
    frames, size = 5, 4
    arrow = Arrow(
        rng.normal(size=(reach, frames, size, size)),
        rng.normal(size=(frames, size, shared)),
        rng.normal(size=(shared, shared)),
    )
    arrow.blocks[0] += arrow.blocks[0].swapaxes(1, 2)
    for k in range(1, reach):
        arrow.blocks[k, frames - k :] = 0
    arrow.corner[:] += arrow.corner.T
    whole = arrow.dense()
    np.testing.assert_array_equal(whole, whole.T)
    np.testing.assert_array_equal(whole.diagonal(), arrow.diagonal)
    stiff, right = rng.uniform(30, 60, len(whole)), rng.normal(size=len(whole))
    expected = np.linalg.solve(whole + np.diag(stiff), right)
    np.testing.assert_allclose(arrow.solve(stiff, right), expected, rtol=1e-12, atol=1e-14)


def test_the_promised_decrease_is_the_models(rng):
    root = rng.normal(size=(2, 3, 3))
    arrow = Arrow((root @ root.swapaxes(1, 2))[None], np.zeros((2, 3, 1)), np.ones((1, 1)))
    look = ValueAndGradient(1.0, rng.normal(size=7), arrow)
    step, promised = solve(look, 0.1)
    assert promised == pytest.approx(-look.gradient @ step - 0.5 * step @ arrow.dense() @ step)
    hopeless = replace(look, hessian=replace(arrow, corner=-np.ones((1, 1))))
    step, promised = solve(hopeless, 1e-3)
    assert not step.any()
    assert promised == 0
    with pytest.raises(TypeError, match="expected the Hessian of a recording, got ndarray"):
        solve(replace(look, hessian=np.eye(7)), 0.1)


def test_key_frames_come_first():
    steps = list(sequence.propagation_order(seed=4, frames=10, stride=3))
    assert steps == [[(7, 4)], [(1, 4)], [(0, 1), (2, 1), (3, 4), (5, 4), (6, 7), (8, 7), (9, 7)]]
    assert list(sequence.propagation_order(0, 3, 1)) == [[(1, 0)], [(2, 1)]]
    assert list(sequence.propagation_order(0, 1, 1)) == []


@pytest.mark.slow
def test_a_film_with_a_ground_that_is_found():
    """2D points, terms that look at the mesh, and a free focal length."""
    frames = 3
    known, truth = recording(frames, noise=0)
    truth["orient"][:, 1] -= 2.8  # faces the camera
    truth["transl"][:, 0] *= 0.2
    truth["transl"][:, 2] = -4.0
    truth["transl"][:, 1] = -1.0
    size = torch.full((frames, 2), 640.0, dtype=torch.float64)
    camera = Camera(size * 1.4, size / 2, start.level_camera().repeat(frames, 1, 1), truth["transl"] * 0)
    truth |= {"camera_orient": vector(camera.rotation), "camera_transl": camera.translation}
    film = replace(known, camera=camera, ground=None, points_3d=None, confidence_3d=None, image_size=size)
    points = Candidate(film, truth).projected
    film = replace(film, points=points, confidence=torch.ones_like(points[..., 0]))
    config = load("fast")
    stages = tuple(replace(stage, free=(*stage.free, "log_focal")) for stage in config.stages)
    found = sequence.fit_sequence(film, start.before_camera(film), replace(config, stages=stages), smoothness=1.0)
    heights = found.problem.ground.height
    assert torch.equal(heights, heights[:1].expand(frames))
    assert found.problem.static.all()
    lowest = found.candidate.vertices[..., 1].amin(dim=1)
    assert (lowest - heights).abs().max() < 0.03
    focal = found.variables["log_focal"]
    assert torch.equal(focal, focal[:1].expand(frames, 2))
    assert focal.any()
    away = (found.candidate.projected - points).norm(dim=-1)
    assert away.median() < 4.0  # pixels, of a person of some 370
