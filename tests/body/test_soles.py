"""The soles of a body, by its parts, against the same by its skinning."""

from __future__ import annotations

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs.body.soles import sole_vertices


@pytest.mark.parametrize("name", ["anny", "anny-lite"])
def test_soles_are_the_lowest_skin_of_the_feet(name):
    body = ip.load_body(name)
    feet = [k for k, joint in enumerate(body.joint_names) if joint.endswith(("_foot", "_ankle"))]
    height = np.where(np.isin(body.weights.argmax(axis=1), feet), body().vertices[:, 1], np.inf)
    for within in (0.02, 0.03):
        expected = np.flatnonzero(height < height.min() + within)
        np.testing.assert_array_equal(sole_vertices(body.template, within), expected)
    sides = body.template.vertices[expected, 0]
    assert (sides > 0).sum() == pytest.approx((sides < 0).sum(), rel=0.1)


def test_a_body_without_legs_has_no_soles():
    body = ip.load_body("anny-lite")
    torso = ip.BodyTemplate(body.v_template, body.faces, [0] * len(body.faces), ["torso"])
    with pytest.raises(ValueError, match="no part 'left_lower_leg'; it has torso"):
        sole_vertices(torso, 0.03)
