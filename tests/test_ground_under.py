"""The ground plane of numpy."""

import numpy as np
import pytest

import ipman_rs as ip


def test_the_ground_lies_under_the_lowest_vertex_of_each_body():
    """A cube of side 2 m around (0, 0, 0), raised by 5 m and turned on a corner: what geometry says."""
    cube = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), axis=-1).reshape(8, 3)
    ground = ip.Ground.under(np.stack([cube, cube + [7, 5, 0]]))
    np.testing.assert_array_equal(ground.height, [-1, 4])
    np.testing.assert_array_equal(ground.normal, [[0, 1, 0], [0, 1, 0]])
    on_a_corner = ip.Ground.under(cube, (1, 1, 1))  # the diagonal of the cube is 2 √3 m long
    np.testing.assert_allclose(on_a_corner.height, -np.sqrt(3), rtol=1e-15)
    assert on_a_corner.normal.shape == (3,)
    each = ip.Ground.under(np.stack([cube, cube]), [[0, 0, 2], [1, 1, 1]])
    np.testing.assert_allclose(each.height, [-1, -np.sqrt(3)], rtol=1e-15)


def test_the_ground_of_a_body_that_is_not_finite_is_finite():
    bodies = np.ones((3, 4, 3))
    bodies[1, 2, 0], bodies[2, 0, 1] = np.nan, -np.inf
    np.testing.assert_array_equal(ip.Ground.under(bodies).height, [1, 0, 0])


def test_no_ground_lies_under_no_vertices():
    with pytest.raises(ValueError, match="V > 0"):
        ip.Ground.under(np.zeros((2, 0, 3)))
    with pytest.raises(ValueError, match="V > 0"):
        ip.Ground.under(np.zeros(3))
    with pytest.raises(ValueError, match="ground normal"):
        ip.Ground.under(np.zeros((1, 3)), (0, 0, 0))
