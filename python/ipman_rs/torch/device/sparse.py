"""A fixed sparse matrix times a batch, without atomics: the rows' entries are padded to rectangles and gathered.

The order of every sum is fixed by the table, shapes never depend on data, and nothing visits the host, so products are
reproducible and can be compiled or captured in a CUDA graph. A row longer than a group is summed in two steps.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import torch
from torch import Tensor

if TYPE_CHECKING:
    from scipy.sparse import csr_array

SHORT = 16


class SparseRows(NamedTuple):
    """`index` and `weight` (N, G): N groups of entries. `groups` (R, M): those of each row, None if row r is group r.

    Padding has weight 0; padding in `groups` names a group of padding.
    """

    index: Tensor
    weight: Tensor
    groups: Tensor | None


def product(rows: SparseRows, values: Tensor, dtype: torch.dtype) -> Tensor:
    """The matrix times (B, n) or (B, n, 3): (B, R) or (B, R, 3), summed in `dtype`."""
    batch, rest = values.shape[0], values.shape[2:]
    gathered = values.index_select(1, rows.index.flatten()).reshape(batch, *rows.index.shape, *rest)
    weight = rows.weight if values.ndim == 2 else rows.weight[..., None]
    sums = (gathered * weight).sum(dim=2, dtype=dtype)
    if rows.groups is None:
        return sums
    return sums.index_select(1, rows.groups.flatten()).reshape(batch, *rows.groups.shape, *rest).sum(dim=2)


def sparse_rows(matrix: csr_array, device: torch.device, dtype: torch.dtype, group: int = 8) -> SparseRows:
    """The table of a matrix: rows of up to SHORT entries are one group each, longer ones are cut into groups."""
    lengths = np.diff(matrix.indptr)
    longest = max(int(lengths.max(initial=0)), 1)
    if longest <= SHORT:
        group = longest
    counts = -(-lengths // group)
    firsts = np.concatenate([[1], 1 + np.cumsum(counts)])  # group 0 is all padding

    place = np.arange(matrix.nnz) - np.repeat(matrix.indptr[:-1], lengths)
    slot = np.repeat(firsts[:-1], lengths) * group + place
    index, weight = np.zeros(firsts[-1] * group, np.int64), np.zeros(firsts[-1] * group)
    index[slot], weight[slot] = matrix.indices, matrix.data
    index, weight = index.reshape(-1, group), weight.reshape(-1, group)

    column = np.arange(max(int(counts.max(initial=0)), 1))
    groups = np.where(column < counts[:, None], firsts[:-1, None] + column, 0)
    single = longest <= SHORT
    if single:
        index, weight = index[groups[:, 0]], weight[groups[:, 0]]
    return SparseRows(
        index=torch.tensor(index, device=device),
        weight=torch.tensor(weight, device=device, dtype=dtype),
        groups=None if single else torch.tensor(groups, device=device),
    )
