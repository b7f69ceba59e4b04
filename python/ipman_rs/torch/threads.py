"""Threads of the core and of torch: as many in one as in the other, for the two take turns on the same cores."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from ipman_rs import _core


def follow_torch() -> None:
    """Before every call of the core: torch's number may have changed, as it does in a DataLoader's workers.

    `ipman_rs.set_num_threads` and RAYON_NUM_THREADS go before it.
    """
    _core.follow_threads(torch.get_num_threads())


@contextmanager
def one_thread() -> Iterator[None]:
    """Torch on one thread: a body's matrices are too small for more, and their bits must not depend on it."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
