"""How processes that share out work begin and end."""

from __future__ import annotations

import multiprocessing
import os
import threading


def end_with_parent() -> None:
    """A worker's beginning: it computes on one core, and ends when its parent does, even by a kill."""
    import ipman_rs as ip

    ip.set_num_threads(1)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
