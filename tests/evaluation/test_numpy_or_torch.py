"""Tensors in, tensors out, with the very bits that arrays give."""

from __future__ import annotations

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import ipman_rs as ip
import ipman_rs.evaluation as ev

torch = pytest.importorskip("torch")
ipt = pytest.importorskip("ipman_rs.torch")

DRAW = np.random.default_rng(8)
BODIES, TRUTHS = DRAW.standard_normal((2, 6, 24, 3)).astype(np.float32)
CENTERS = DRAW.standard_normal((2, 6, 3))
TURNS = np.linalg.qr(DRAW.standard_normal((2, 6, 3, 3)))[0]
MAPS = DRAW.random((2, 6, 5, 4))
MAT = SimpleNamespace(values=MAPS[0], origin=-np.ones(3), e1=np.eye(3)[0], e2=np.eye(3)[2], cell=0.4)

GROUND, GROUNDS = (0.1, 1.0, 0.2), (DRAW.standard_normal((6, 3)), DRAW.standard_normal(6))

METRICS = {
    "mpjpe": lambda to, ground: ev.mpjpe(to(BODIES), to(TRUTHS), root=2),
    "pa_mpjpe": lambda to, ground: ev.pa_mpjpe(to(BODIES), true=to(TRUTHS)),
    "pve": lambda to, ground: ev.pve(to(BODIES), to(TRUTHS)),
    "pve aligned": lambda to, ground: ev.pve(to(BODIES), to(TRUTHS), to(CENTERS[0]), true_root=to(CENTERS[1])),
    "aligned": lambda to, ground: ev.aligned(to(BODIES), to(TRUTHS)),
    "similarity": lambda to, ground: ev.similarity(to(BODIES), to(TRUTHS)),
    "com_error": lambda to, ground: ev.com_error(*to(CENTERS)),
    "cop_error": lambda to, ground: ev.cop_error(*to(CENTERS), ground(*GROUNDS)),
    "penetration": lambda to, ground: ev.penetration(to(BODIES), ground(GROUND)),
    "hover": lambda to, ground: ev.hover(to(BODIES), ground=ground(*GROUNDS)),
    "tilt": lambda to, ground: ev.tilt(to(BODIES), to(TRUTHS), ground(GROUND), ground(*GROUNDS)),
    "root_tilt": lambda to, ground: ev.root_tilt(*to(TURNS), ground(GROUND)),
    "foot_skating": lambda to, ground: ev.foot_skating(to(BODIES), ground(GROUND), ["a"] * 6, threshold=3.0),
    "pressure_iou": lambda to, ground: ev.pressure_iou(*to(MAPS)),
    "frame_difference": lambda to, ground: ev.frame_difference(*to(MAPS)),
    "pressure_map": lambda to, ground: ev.pressure_map(to(BODIES), to(BODIES[..., 0]), MAT),
    "moyo": lambda to, ground: ev.moyo(to(BODIES), ground(GROUND), MAT, to(CENTERS[0])),
}  # fmt: skip


def flat(found):
    return [leaf for part in found for leaf in flat(part)] if isinstance(found, tuple) else [found]


def assert_alike(tensors, arrays, tolerance=0.0):
    for tensor, array in zip(flat(tensors), flat(arrays), strict=True):
        assert isinstance(tensor, torch.Tensor)
        assert isinstance(array, (np.ndarray, np.floating))
        assert tensor.dtype == torch.float64
        assert array.dtype == np.float64
        np.testing.assert_allclose(tensor.numpy(), array, rtol=tolerance, atol=tolerance)
        assert not tensor.requires_grad


@pytest.mark.parametrize("name", METRICS)
@pytest.mark.parametrize("grad", [False, True])
def test_tensors_give_the_bits_of_arrays(name, grad):
    arrays = METRICS[name](lambda x: x, ip.Ground)
    assert_alike(METRICS[name](lambda x: torch.tensor(x, requires_grad=grad), ip.Ground), arrays)
    assert np.isfinite(flat(arrays)[0]).any()


@pytest.mark.parametrize("name", METRICS)
def test_grounds_of_tensors(name):
    """Their normal is made unit once more, which may turn its last bit."""
    arrays = METRICS[name](lambda x: x, ip.Ground)
    assert_alike(METRICS[name](torch.tensor, ipt.Ground), arrays, 1e-14)
    for found, expected in zip(flat(METRICS[name](lambda x: x, ipt.Ground)), flat(arrays), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("mode", ["paper", "released", "strict"])
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_bose(blob, bodies, mode, dtype):
    vertices = bodies.astype(str(dtype).split(".")[1])
    tensors = ev.bose(torch.tensor(vertices), blob, ipt.Ground.y_up(), mode)
    assert_alike(tensors, ev.bose(vertices, blob, ip.Ground.y_up(), mode))
    one = ev.bose(torch.tensor(vertices[0]), blob, ipt.Ground.y_up(), mode)
    assert one.shape == ()


def test_half_precision():
    for dtype in (torch.bfloat16, torch.float16):
        half = torch.tensor(BODIES).to(dtype)
        assert_alike(ev.mpjpe(half, torch.tensor(TRUTHS)), ev.mpjpe(half.float().numpy(), TRUTHS))


def test_results_go_into_an_accumulator():
    frames = [f"frame {i}" for i in range(6)]
    first, second = ev.Accumulator(), ev.Accumulator()
    first.add({"mpjpe": ev.mpjpe(torch.tensor(BODIES), torch.tensor(TRUTHS))}, frames, frames)
    second.add({"mpjpe": ev.mpjpe(BODIES, TRUTHS)}, frames, frames)
    assert first.summary() == second.summary()


def test_arrays_never_import_torch():
    code = (
        "import sys, numpy as np, ipman_rs as ip, ipman_rs.evaluation as ev\n"
        "ev.mpjpe(np.ones((2, 4, 3)), np.zeros((2, 4, 3))), ev.hover(np.ones((2, 4, 3)), ip.Ground())\n"
        "assert not {'torch', 'scipy'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
