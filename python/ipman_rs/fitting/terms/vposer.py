"""VPoser v2 as a pose prior: ‖z‖², z the mean of its encoder's distribution for the pose. The checkpoint (V02_05) is
read from a file: it is not included and has a licence of its own.

Layout of the weights: an encoder of 21 rotation vectors (63 numbers), `encoder_net` or `vp_model.encoder_net`,

    1 batch norm · 2 linear · leaky ReLU (slope 0.01) · 4 batch norm · 6 linear · 7 linear · 8.mu linear

with the batch norms' running figures (ε = 1e-5) and no dropout, as in evaluation. All but the ReLU is affine, so that
z = A leaky(C θ + d) + b with two matrices multiplied out beforehand in float64.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import torch
from torch import Tensor
from torch.nn.functional import leaky_relu

from ipman_rs.body import joints
from ipman_rs.files import regular_file

from ..candidate import Candidate
from ..problem import Problem
from ..variables import pose_joints
from .term import LeastSquares

JOINTS = joints.BODY[1:]
SLOPE = 0.01
EPSILON = 1e-5


class VPoser(LeastSquares):
    """path: the checkpoint; only tensors are loaded from it, nothing in it is executed."""

    def __init__(self, problem: Problem, path: str | os.PathLike[str]):
        super().__init__(problem)
        names = pose_joints(problem.body.body)
        missing = [name for name in JOINTS if name not in names]
        if missing:
            raise ValueError(f"vposer: expected a body with SMPL's joints, this one has no {', '.join(missing)}")
        self.joints = [names.index(name) for name in JOINTS]
        first, second = load(Path(path))
        like = problem.body.v_template
        self.first, self.second = first.to(like), second.to(like)

    def residuals(self, candidate: Candidate) -> Tensor:
        pose = candidate.variables["pose"][:, self.joints].flatten(1)
        return affine(self.second, leaky_relu(affine(self.first, pose), SLOPE))


def affine(map: Tensor, rows: Tensor) -> Tensor:
    """Rows (B, n) through a map (m, n + 1), its last column the offset; a body at a time, so that no batch size changes
    a bit."""
    return (map[:, :-1] * rows[:, None]).sum(dim=-1) + map[:, -1]


def load(path: Path) -> tuple[Tensor, Tensor]:
    """The encoder's two affine maps, (512, 64) and (32, 513). ValueError if the file is not such a checkpoint."""
    regular_file(path)
    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # damaged bytes can fail in any way
        raise ValueError(
            f"{path}: cannot be read as a file of tensors, and nothing else is loaded. If it is a VPoser v2 checkpoint "
            "with more in it, save its `state_dict` by itself where you trust it: torch.save({'state_dict': ...})"
        ) from error
    state = content.get("state_dict", content) if isinstance(content, dict) else {}
    state = state if isinstance(state, dict) else {}
    encoder = {
        str(name).partition("encoder_net.")[2]: value
        for name, value in state.items()
        if "encoder_net." in str(name) and isinstance(value, Tensor)
    }
    try:
        encoder = {name: value.double() for name, value in encoder.items()}
        first = _after_norm(_linear(encoder, "2"), encoder, "1")
        second = _after_norm(_linear(encoder, "6"), encoder, "4")
        for layer in ("7", "8.mu"):
            second = _linear(encoder, layer) @ second
    except Exception as error:  # tensors that are missing, sparse, or of other shapes
        raise ValueError(
            f"{path}: expected the encoder of VPoser v2 (batch norm, linear, batch norm, three linear), got "
            f"{', '.join(encoder) or 'no encoder_net'}: {error}"
        ) from error
    if first.shape[1] != 3 * len(JOINTS) + 1 or second.shape[1] != first.shape[0]:
        raise ValueError(f"{path}: expected an encoder of {3 * len(JOINTS)} numbers, got one of {first.shape[1] - 1}")
    return first[:-1], second[:-1]


def _linear(encoder: dict[str, Any], layer: str) -> Tensor:
    """(m + 1, n + 1): homogeneous, so that layers multiply."""
    weight, bias = encoder[f"{layer}.weight"], encoder[f"{layer}.bias"]
    return torch.cat([torch.cat([weight, bias[:, None]], dim=1), _last_row(weight.shape[1] + 1)])


def _after_norm(map: Tensor, encoder: dict[str, Any], layer: str) -> Tensor:
    """`map` of rows that a batch norm has scaled and shifted."""
    scale = encoder[f"{layer}.weight"] / (encoder[f"{layer}.running_var"] + EPSILON).sqrt()
    shift = encoder[f"{layer}.bias"] - scale * encoder[f"{layer}.running_mean"]
    return map @ torch.cat([torch.cat([scale.diag(), shift[:, None]], dim=1), _last_row(len(scale) + 1)])


def _last_row(size: int) -> Tensor:
    return torch.eye(size, dtype=torch.float64)[-1:]
