"""Hessians of recordings: frames that touch their neighbours only, and a few numbers that all of them share.

    | A   B | own numbers of T frames, A a band of blocks
    | Bᵀ  C | shared numbers

Solved by the band's Cholesky factor and the Schur complement C − Bᵀ A⁻¹ B, so the time is linear in the frames.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from .outcome import Look, Vector


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
        """x of (H + diag stiff) x = right. LinAlgError if that matrix is not positive definite."""
        own = len(right) - len(self.corner)
        band = self.band()
        band[0] += stiff[:own]
        border = self.border.reshape(own, -1)
        solved = scipy.linalg.solveh_banded(band, np.column_stack([right[:own], border]), lower=True, overwrite_ab=True)
        if not len(self.corner):
            return solved[:, 0]
        schur = self.corner + np.diag(stiff[own:]) - border.T @ solved[:, 1:]
        shared = scipy.linalg.cho_solve(scipy.linalg.cho_factor(schur), right[own:] - border.T @ solved[:, 0])
        return np.concatenate([solved[:, 0] - solved[:, 1:] @ shared, shared])

    def band(self) -> Vector:
        """A's lower diagonals ((k + 1) p, T p): [d, j] = A[j + d, j]."""
        reach, frames, size = self.blocks.shape[:3]
        band = np.zeros((reach * size, frames, size))
        row, column = np.indices((size, size))
        for k in range(reach):
            below = k * size + row - column
            for b in range(size):
                kept = below[:, b] >= 0
                band[below[kept, b], : frames - k, b] = self.blocks[k, : frames - k, kept, b]
        return band.reshape(reach * size, frames * size)


def solve(look: Look, damping: float) -> tuple[Vector, float]:
    """(H + μ diag H) step = −gradient, and the decrease that the model promises, as `levenberg` does for a matrix."""
    arrow = look.hessian
    if not isinstance(arrow, Arrow):
        raise TypeError(f"arrow.solve: expected the Hessian of a recording, got {type(arrow).__name__}")
    diagonal = arrow.diagonal
    stiff = damping * np.maximum(diagonal, 1e-6 * diagonal.max(initial=0) + 1e-12)
    try:
        step = arrow.solve(stiff, -look.gradient)
    except np.linalg.LinAlgError:  # not positive definite: more damping
        return np.zeros_like(look.gradient), 0.0
    return step, float(0.5 * (-look.gradient @ step + step @ (stiff * step)))
