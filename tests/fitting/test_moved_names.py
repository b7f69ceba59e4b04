"""Names that were changed or moved are still found, with a warning."""

from __future__ import annotations

import importlib

import pytest

import ipman_rs.data.keypoints
import ipman_rs.data.markers
from ipman_rs import fitting
from ipman_rs.fitting import detection_problem


@pytest.mark.parametrize(("name", "now"), [("keypoints", ipman_rs.data.keypoints), ("markers", ipman_rs.data.markers)])
def test_moved_modules(name, now):
    with pytest.warns(DeprecationWarning, match=f"fitting.{name} is now ipman_rs.data.{name}"):
        assert getattr(fitting, name) is now


@pytest.mark.parametrize(
    ("module", "old", "now"),
    [
        ("ipman_rs.fitting.detection_problem", "problem", "problem_from_detections"),
        ("ipman_rs.fitting.marker_fit", "Recorded", "MarkerFit"),
        ("ipman_rs.fitting.result", "results", "fit_results"),
        ("ipman_rs.fitting.start", "begin", "initial_state"),
        ("ipman_rs.simulation", "Comparison", "MethodComparison"),
        ("ipman_rs.study", "Camera", "ViewCamera"),
        ("ipman_rs.training.losses", "Physics", "PhysicsLoss"),
    ],
)
def test_changed_names(module, old, now):
    package = importlib.import_module(module)
    with pytest.warns(DeprecationWarning, match=f"{module}.{old} is now {module}.{now}"):
        assert getattr(package, old) is getattr(package, now)


def test_the_former_module_of_detections():
    with pytest.warns(DeprecationWarning, match="fitting.detected is now ipman_rs.fitting.detection_problem"):
        assert fitting.detected is detection_problem


def test_other_names_are_not_there():
    with pytest.raises(AttributeError, match="no attribute 'key_points'"):
        fitting.key_points  # noqa: B018
