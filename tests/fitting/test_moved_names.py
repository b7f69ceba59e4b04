"""Modules that were in `ipman_rs.fitting` are still found there, with a warning."""

from __future__ import annotations

import pytest

import ipman_rs.data.keypoints
import ipman_rs.data.markers
from ipman_rs import fitting


@pytest.mark.parametrize(("name", "now"), [("keypoints", ipman_rs.data.keypoints), ("markers", ipman_rs.data.markers)])
def test_moved_modules(name, now):
    with pytest.warns(DeprecationWarning, match=f"fitting.{name} is now ipman_rs.data.{name}"):
        assert getattr(fitting, name) is now


def test_other_names_are_not_there():
    with pytest.raises(AttributeError, match="no attribute 'key_points'"):
        fitting.key_points  # noqa: B018
