"""Bodies fitted to real markers, against force plates and OpenSim; `tools/validate_recordings.py` says more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is an extra")

import ipman_rs.torch as ipt  # noqa: E402
from ipman_rs.data import markers  # noqa: E402
from ipman_rs.fitting import marker_fit, start  # noqa: E402
from ipman_rs.fitting.candidate import Candidate  # noqa: E402
from ipman_rs.fitting.rotations import matrix  # noqa: E402
from tests.helpers.fit_terms_cases import body_model  # noqa: E402

MASS = 60.03  # kg, by the force plates
EVERY = {"static1": 130, "squats1": 90}  # of 517 and 1346 frames: the squats at ten depths


@pytest.fixture(scope="module")
def body():
    return ipt.BodyModel("anny-lite")


@pytest.fixture(scope="module")
def standing(shared, body):
    tracks = markers.read(shared("squat_forceplates") / "static1.trc")
    return marker_fit.fit_tracks(body, tracks, every=EVERY["static1"])


@pytest.fixture(scope="module")
def squatting(shared, body, standing):
    tracks = markers.read(shared("squat_forceplates") / "squats1.trc")
    return marker_fit.fit_tracks(body, tracks, every=EVERY["squats1"], person=standing.person)


def solid(fit):
    with torch.no_grad():
        return ipt.mass_properties(fit.candidate.vertices, fit.problem.body.template)


@pytest.mark.slow
def test_standing_still(shared, standing):
    assert standing.fit.converged.all()
    assert standing.unknown == ()
    assert standing.fit.problem.mass is None  # nothing tells the weight
    assert np.nanmean(standing.errors) < 0.0015
    mass = solid(standing.fit).mass.numpy()
    np.testing.assert_allclose(mass, MASS, rtol=0.07)  # markers do not tell how heavy somebody is
    lines = (shared("squat_forceplates") / "static1_grf.mot").read_text().splitlines()
    columns = lines[6].split()
    forces = np.array([line.split() for line in lines[7:]], dtype=float)[:: EVERY["static1"]]
    first, second = (forces[:, columns.index(f"ground_force_{plate}_vx") :][:, :6] for plate in (1, 2))
    loads = first[:, [1]] + second[:, [1]]
    pressed = (first[:, [1]] * first[:, [3, 5]] + second[:, [1]] * second[:, [3, 5]]) / loads
    away = solid(standing.fit).center.numpy()[:, [0, 2]] - pressed
    assert np.linalg.norm(away, axis=1).max() < 0.03
    # Forwards, along x, on average: 16 mm where hip centres were markers of the rig's hips.
    assert abs(away[:, 0].mean()) < 0.009
    distances = standing.skin_distances
    assert len(distances) == 51  # but for the four hip centres
    assert 0.005 < np.median(list(distances.values())) < 0.015


@pytest.mark.slow
def test_squats(shared, squatting):
    assert squatting.fit.converged.all()
    assert np.nanmean(squatting.errors) < 0.015
    assert np.nanmean(squatting.errors, axis=1).max() < 0.025
    found = solid(squatting.fit)
    assert found.mass.numpy().mean() == pytest.approx(MASS, rel=0.05)
    opensim = shared("squat_forceplates") / "squats1_opensim_com_manually_scaled.csv"
    heights = np.loadtxt(opensim, delimiter=",")[:: EVERY["squats1"], 2]
    assert np.ptp(heights) > 0.2  # they are squats
    assert np.abs(found.center.numpy()[:, 1] - heights).max() < 0.02


@pytest.mark.slow
def test_the_shape_is_that_of_the_other_recording(standing, squatting):
    betas = squatting.fit.variables["betas"]
    assert torch.equal(betas, standing.fit.variables["betas"][:1].expand_as(betas))
    assert squatting.sites["C7"] == standing.sites["C7"]


@pytest.mark.slow
def test_markers_in_millimetres_of_another_person(shared, body):
    tracks = markers.read(shared("gait2354") / "subject01_static.trc")
    found = marker_fit.fit_tracks(body, tracks, every=150)
    assert np.nanmean(found.errors) < 0.010
    assert solid(found.fit).mass.numpy().mean() == pytest.approx(72.6, rel=0.10)


def some_tracks(names):
    shape = len(names), 3
    return markers.Tracks(tuple(names), np.ones((2, *shape)), np.ones((2, len(names))), np.arange(2.0), "some.trc")


def test_markers_that_nobody_knows(body):
    with pytest.raises(ValueError, match=r"some.trc: expected at least 6 markers with known places, got 1 of C7, X"):
        marker_fit.fit_tracks(body, some_tracks(["C7", "X"]))
    with pytest.raises(ValueError, match="every: expected 1 or more, got 0"):
        marker_fit.fit_tracks(body, some_tracks(["C7"]), every=0)


def test_the_start_lies_on_the_points():
    """However a body lies and turns, `at_points` finds it, and to the bit alone as in a batch."""
    names = ["head", "left_wrist", "right_hip", "left_ankle", "pelvis"]
    tracks = markers.Tracks(tuple(names), np.zeros((4, 5, 3)), np.ones((4, 5)), np.arange(4.0), "")
    problem = marker_fit.problem_of(body_model(), tracks, {name: name for name in names})
    truth = start.neutral(problem)
    generator = torch.Generator().manual_seed(2)
    truth["orient"] = 2 * torch.randn(4, 3, generator=generator, dtype=torch.float64)
    truth["transl"] = torch.randn(4, 3, generator=generator, dtype=torch.float64)
    points = Candidate(problem, truth).landmarks
    points[1, 3] = 9.0  # where it was not seen
    points[2, 0] = torch.nan
    seen = torch.ones(4, 5, dtype=torch.float64)
    seen[1, 3] = 0
    problem = replace(problem, points_3d=points, confidence_3d=seen)
    found = start.start_at_points(problem)
    torch.testing.assert_close(matrix(found["orient"]), matrix(truth["orient"]), atol=1e-6, rtol=0)
    torch.testing.assert_close(found["transl"], truth["transl"], atol=1e-6, rtol=0)
    for row in range(4):
        alone = start.start_at_points(problem.rows(torch.tensor([row])))
        assert all(torch.equal(alone[name][0], found[name][row]) for name in alone)
    nothing = start.start_at_points(replace(problem, confidence_3d=torch.zeros_like(seen)))
    assert all(value.isfinite().all() for value in nothing.values())
    with pytest.raises(ValueError, match="points_3d: expected points"):
        start.start_at_points(replace(problem, points_3d=None))
