"""Hessians of recordings: frames that touch their neighbours only, and a few numbers that all of them share.

    | A   B | own numbers of T frames, A a band of blocks
    | Bᵀ  C | shared numbers

Solved by Cholesky's factors of the band, block by block, and the Schur complement C − Bᵀ A⁻¹ B, so the time is linear
in the frames. In torch, whose one thread (`one_thread`) always gives the same bits; scipy's banded solver takes as many
threads as it finds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.linalg import cholesky, solve_triangular

from .outcome import ValueAndGradient, Vector


@dataclass(frozen=True)
class Arrow:
    """`blocks` (k + 1, T, p, p): [k, s] is A's block of frame s + k (rows) and frame s (columns); `border` B (T, p, q);
    `corner` C (q, q)."""

    blocks: Vector
    border: Vector
    corner: Vector

    @property
    def diagonal(self) -> Vector:
        """(T p + q,)"""
        return np.concatenate([self.blocks[0].diagonal(axis1=1, axis2=2).ravel(), self.corner.diagonal()])

    def dense(self) -> Vector:
        """The whole matrix, for small ones."""
        reach, frames, size = self.blocks.shape[:3]
        whole = np.zeros((frames * size + len(self.corner),) * 2)
        for k in range(reach):
            for s in range(frames - k):
                whole[(s + k) * size :, s * size :][:size, :size] = self.blocks[k, s]
        whole[frames * size :, : frames * size] = self.border.reshape(frames * size, -1).T
        whole[frames * size :, frames * size :] = self.corner
        return np.tril(whole) + np.tril(whole, -1).T

    def solve(self, stiff: Vector, right: Vector) -> Vector:
        """x of (H + diag stiff) x = right. RuntimeError if that matrix is not positive definite."""
        frames, size, shared = self.border.shape
        own = frames * size
        blocks = torch.from_numpy(self.blocks).clone()
        blocks[0].diagonal(dim1=1, dim2=2).add_(torch.from_numpy(stiff[:own]).reshape(frames, size))
        border = torch.from_numpy(self.border)
        right_own = torch.from_numpy(right[:own]).reshape(frames, size, 1)
        solved = _solve_band(_factored(blocks), torch.cat([right_own, border], dim=2)).reshape(own, -1)
        if not shared:
            return solved[:, 0].numpy()
        flat = border.reshape(own, shared)
        left = flat.T @ solved
        schur = torch.from_numpy(self.corner + np.diag(stiff[own:])) - left[:, 1:]
        rest = torch.from_numpy(right[own:])[:, None] - left[:, :1]
        factor = cholesky(schur)
        ours = solve_triangular(factor.T, solve_triangular(factor, rest, upper=False), upper=True)
        return torch.cat([solved[:, :1] - solved[:, 1:] @ ours, ours])[:, 0].numpy()


def _factored(blocks: Tensor) -> Tensor:
    """A's lower Cholesky factor in the layout of `Arrow.blocks`, in place."""
    reach, frames = blocks.shape[:2]
    for s in range(frames):
        for j in range(1, min(reach, s + 1)):  # what frame s − j has left of it
            for k in range(min(reach - j, frames - s)):
                blocks[k, s] -= blocks[k + j, s - j] @ blocks[j, s - j].T
        blocks[0, s] = cholesky(blocks[0, s])
        for k in range(1, min(reach, frames - s)):
            blocks[k, s] = solve_triangular(blocks[0, s], blocks[k, s].T, upper=False).T
    return blocks


def _solve_band(factor: Tensor, right: Tensor) -> Tensor:
    """x (T, p, n) of L Lᵀ x = right, forwards and then backwards."""
    reach, frames = factor.shape[:2]
    x = right.clone()
    for s in range(frames):
        for k in range(1, min(reach, s + 1)):
            x[s] -= factor[k, s - k] @ x[s - k]
        x[s] = solve_triangular(factor[0, s], x[s], upper=False)
    for s in range(frames - 1, -1, -1):
        for k in range(1, min(reach, frames - s)):
            x[s] -= factor[k, s].T @ x[s + k]
        x[s] = solve_triangular(factor[0, s].T, x[s], upper=True)
    return x


def solve(evaluation: ValueAndGradient, damping: float) -> tuple[Vector, float]:
    """(H + μ diag H) step = −gradient, and the decrease that the model promises, as `levenberg` does for a matrix."""
    arrow = evaluation.hessian
    if not isinstance(arrow, Arrow):
        raise TypeError(f"arrow.solve: expected the Hessian of a recording, got {type(arrow).__name__}")
    diagonal = arrow.diagonal
    stiff = damping * np.maximum(diagonal, 1e-6 * diagonal.max(initial=0) + 1e-12)
    try:
        step = arrow.solve(stiff, -evaluation.gradient)
    except RuntimeError:  # torch's LinAlgError: not positive definite: more damping
        return np.zeros_like(evaluation.gradient), 0.0
    return step, float(0.5 * (step * (stiff * step - evaluation.gradient)).sum())
