"""Mixture of Gaussians over body poses, read from a file such as SMPLify's gmm_08.pkl (not included: it has a licence
of its own). The likeliest component counts:

    min_k ½ (θ − μ_k)ᵀ Σ_k⁻¹ (θ − μ_k) + c_k     c_k = −log(w_k |Σ_k|^(−½)) + log max_l(w_l |Σ_l|^(−½))

θ: rotation vectors of the 23 joints of SMPL after the root, radians. The second logarithm makes the smallest c_k 0, a
constant beside the negative log likelihood. Bodies with fingers have 21 of these joints; the last two count as 0.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ipman_rs.body import joints
from ipman_rs.files import safe_npz, safe_pickle

from ..candidate import Candidate
from ..problem import Problem
from ..variables import pose_joints
from .term import Term

JOINTS = joints.SMPL[1:]


class GaussianMixture(Term):
    """path: a .npz, or a pickle, with means (K, 69), covars (K, 69, 69) and weights (K,). Nothing in it is executed."""

    def __init__(self, problem: Problem, path: str | os.PathLike[str]):
        super().__init__(problem)
        names = pose_joints(problem.body.body)
        self.joints = [names.index(name) for name in JOINTS if name in names]
        missing = [name for name in joints.BODY[1:] if name not in names]
        if missing:
            raise ValueError(f"gmm_prior: expected a body with SMPL's joints, this one has no {', '.join(missing)}")
        self.absent = 3 * (len(JOINTS) - len(self.joints))
        means, factors, constants = load(Path(path))
        like = problem.body.v_template
        self.means, self.factors, self.constants = (torch.from_numpy(a).to(like) for a in (means, factors, constants))

    def cost(self, candidate: Candidate) -> Tensor:
        pose = candidate.variables["pose"][:, self.joints].flatten(1)
        pose = torch.cat([pose, pose.new_zeros(len(pose), self.absent)], dim=1)
        offset = pose[:, None] - self.means
        # multiplied and summed a body at a time, so that no batch size changes a bit
        normal = (self.factors * offset[:, :, None, :]).sum(dim=-1)
        return (0.5 * normal.square().sum(dim=-1) + self.constants).min(dim=-1).values


def load(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """means (K, 69), F (K, 69, 69) with F_kᵀ F_k = Σ_k⁻¹, and c (K,). ValueError if the file holds no such mixture."""
    means, covariances, weights = (_read(path, name) for name in ("means", "covars", "weights"))
    count, size = len(means), 3 * len(JOINTS)
    for name, array, shape in (
        ("means", means, (count, size)),
        ("covars", covariances, (count, size, size)),
        ("weights", weights, (count,)),
    ):
        if array.shape != shape:
            raise ValueError(f"{path}: {name}: expected shape {shape}, got {array.shape}")
        if not np.isfinite(array).all():
            raise ValueError(f"{path}: {name}: expected finite numbers")
    if count == 0 or not (weights > 0).all():
        raise ValueError(f"{path}: weights: expected positive numbers, one at least")
    try:
        lower = np.linalg.cholesky(covariances)
    except np.linalg.LinAlgError:
        raise ValueError(f"{path}: covars: expected symmetric positive definite matrices") from None
    logarithms = np.log(weights) - np.log(np.diagonal(lower, axis1=1, axis2=2)).sum(axis=1)
    factors = np.linalg.inv(lower).astype(np.float64)
    return means, factors, logarithms.max() - logarithms


def _read(path: Path, name: str) -> NDArray[np.float64]:
    if path.suffix == ".npz":
        return safe_npz.read(path, name).astype(np.float64)
    content = safe_pickle.read(path)
    if name not in content:
        raise ValueError(f"{path}: expected means, covars and weights, found {', '.join(map(str, content))}")
    return safe_pickle.as_array(content[name]).astype(np.float64)
