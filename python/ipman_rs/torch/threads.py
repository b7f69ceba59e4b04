"""As many threads as torch: the two take turns on the same cores, so more would only make them wait for each other."""

from __future__ import annotations

import torch

from ipman_rs import _core


def follow_torch() -> None:
    """Before every call of the core: torch's number may have changed, as it does in a DataLoader's workers.

    `ipman_rs.set_num_threads` and RAYON_NUM_THREADS go before it.
    """
    _core.follow_threads(torch.get_num_threads())
