"""Rotations beside SciPy's and roma's."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from ipman_rs.fitting.rotations import matrix, nearest, quaternion, vector


@pytest.fixture(scope="module")
def turns() -> torch.Tensor:
    """Rotation vectors of all lengths up to π, tiny ones, and none."""
    draw = np.random.default_rng(0)
    axes = draw.standard_normal((3000, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angles = np.concatenate([
        draw.uniform(0, np.pi, 1500), 10 ** draw.uniform(-12, -1, 1000), np.pi - 10 ** draw.uniform(-9, -2, 499), [0],
    ])  # fmt: skip
    return torch.from_numpy(axes * angles[:, None])


def test_against_scipy(turns):
    expected = Rotation.from_rotvec(turns.numpy())
    np.testing.assert_allclose(matrix(turns).numpy(), expected.as_matrix(), rtol=0, atol=4e-15)
    np.testing.assert_allclose(quaternion(turns).numpy(), expected.as_quat(), rtol=0, atol=1e-15)
    # Near π the matrix knows the axis to its own precision alone.
    np.testing.assert_allclose(vector(matrix(turns)).numpy(), turns.numpy(), rtol=0, atol=1e-14)


def test_gradients(turns):
    some = turns[[0, 700, 1499, 1500, 1700, 2400, 2999]].clone()
    assert torch.autograd.gradcheck(matrix, some.requires_grad_())
    assert torch.autograd.gradcheck(quaternion, some)
    assert torch.autograd.gradcheck(lambda v: vector(matrix(v)), some)


def test_the_nearest_rotation():
    roma = pytest.importorskip("roma")
    matrices = torch.randn(500, 3, 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    expected = roma.procrustes(matrices, force_rotation=True)
    torch.testing.assert_close(nearest(matrices), expected, rtol=0, atol=1e-12)
    torch.testing.assert_close(torch.linalg.det(nearest(matrices)), torch.ones(500).double(), rtol=0, atol=1e-12)


def test_fitting_loads_neither_the_compiler_nor_roma():
    code = "import ipman_rs.fitting.fit, sys; print(sorted({'torch._dynamo', 'roma'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
