"""Clusters of frames: frames of a sequence are correlated, so resampling is by sequence (cluster bootstrap)."""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import blake2b
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..numpy_or_torch import as_array

CLUSTERS = 4096  # the most that are kept apart; they determine a standard error to about a hundredth


def fingerprints(names: Sequence[str]) -> NDArray[np.uint64]:
    """A hash of 64 bits of each name, the same on every machine."""
    packed = b"".join(blake2b(name.encode(), digest_size=8).digest() for name in names)
    return np.frombuffer(packed, "<u8").astype(np.uint64)


def pooled_clusters(names: Sequence[str]) -> NDArray[np.int64]:
    """The cluster of each name, 0 … CLUSTERS − 1, if there are too many names: by a hash, so the same everywhere."""
    return (fingerprints(names) % np.uint64(CLUSTERS)).astype(np.int64)


def differences(
    values: ArrayLike, baseline: ArrayLike, sequences: ArrayLike | None
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """values (n,) − baseline (n,) where both are finite: the differences, and each cluster's sum (G,) and count (G,).

    Raises:
        ValueError: the shapes differ, or no value is finite in both.
    """
    first, second = (np.asarray(as_array(value), float) for value in (values, baseline))
    if first.shape != second.shape or first.ndim != 1 or not len(first):
        raise ValueError(f"values: expected two arrays (n,) of one length, got {first.shape} and {second.shape}")
    names = None if sequences is None else np.asarray(sequences)
    if names is not None and names.shape != first.shape:
        raise ValueError(f"sequences: expected a name per value, {first.shape}, got {names.shape}")
    finite = np.isfinite(first) & np.isfinite(second)
    if not finite.any():
        raise ValueError("values, baseline: expected a body where both are finite, got none")
    difference = (first - second)[finite]
    if names is None and len(difference) <= CLUSTERS:
        return difference, difference, np.ones(len(difference))
    labels = np.arange(len(difference)).astype(str) if names is None else names[finite].astype(str)
    clusters, rows = np.unique(labels, return_inverse=True)
    if len(clusters) > CLUSTERS:
        rows = np.unique(pooled_clusters(clusters.tolist())[rows], return_inverse=True)[1]
    return difference, np.bincount(rows, difference), np.bincount(rows).astype(np.float64)
