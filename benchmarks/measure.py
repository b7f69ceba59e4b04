"""Times, errors and memory of peers: medians of interleaved runs in one process."""

from __future__ import annotations

import gc
import os
import platform
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch

import ipman_rs as ip
from ipman_rs import _core

MIN_TURNS = 5
TURN = 0.02  # seconds


@dataclass
class Row:
    """One peer in one case; errors are relative to the largest number of the float64 reference."""

    case: str  # weighted, terms, skinning, support, mass
    body: str
    preset: str
    batch: int
    threads: int
    peer: str
    microseconds: float  # a body, the median
    first: float  # the same of the first calls of the turns, which find the caches as the other peers left them
    calls: int
    value_error: float | None = None
    gradient_error: float | None = None


@dataclass
class Times:
    """Seconds of the first call of each turn, and of all the others."""

    first: list[float] = field(default_factory=list)
    further: list[float] = field(default_factory=list)

    def medians(self) -> tuple[float, float]:
        """Of the further calls, and of the first ones."""
        return statistics.median(self.further), statistics.median(self.first)


def interleaved(runs: Mapping[str, Callable[[], Any]], seconds: float, min_turns: int = MIN_TURNS) -> dict[str, Times]:
    """The peers take turns, so that a busy machine slows them alike. A turn is a first call, and calls for 20 ms.

    Each peer has two calls unmeasured before.
    """
    for run in runs.values():
        run()
        run()
    times = {name: Times() for name in runs}
    gc.collect()
    gc.disable()
    try:
        end = time.perf_counter() + seconds
        while time.perf_counter() < end or min(len(found.first) for found in times.values()) < min_turns:
            for name, run in runs.items():
                _turn(run, times[name])
    finally:
        gc.enable()
    return times


def _turn(run: Callable[[], Any], times: Times) -> None:
    times.first.append(_seconds(run))
    end = time.perf_counter() + TURN
    while True:
        times.further.append(_seconds(run))
        if time.perf_counter() >= end:
            return


def _seconds(run: Callable[[], Any]) -> float:
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def relative_error(got: Any, expected: Any) -> float:
    """max |got − expected| / max |expected|."""
    got, expected = (np.asarray(torch.as_tensor(x).detach(), dtype=np.float64) for x in (got, expected))
    return float(np.abs(got - expected).max() / np.abs(expected).max())


def use_threads(count: int) -> None:
    torch.set_num_threads(count)
    ip.set_num_threads(count)


def peak_megabytes(run: Callable[[], Any]) -> float:
    """The most resident memory that one run adds, in a process that has run it before. Linux only."""
    run()
    gc.collect()
    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")  # the high-water mark starts again from here
    before = _status("VmRSS")
    run()
    return (_status("VmHWM") - before) / 1024


def _status(field: str) -> int:
    with open("/proc/self/status") as file:
        return next(int(line.split()[1]) for line in file if line.startswith(field))


def machine() -> dict[str, str]:
    """What the numbers depend on."""
    level = next((str(getattr(_core, name)()) for name in ("simd_level", "simd") if hasattr(_core, name)), None)
    return {
        "CPU": _cpu(),
        "cores": str(os.cpu_count()),
        "lanes": level or "not reported",
        "IPMAN_SIMD": os.environ.get("IPMAN_SIMD", "not set"),
        "system": f"{platform.system()} {platform.release()}",
        "Python": platform.python_version(),
        "torch": torch.__version__,
        "numpy": np.__version__,
        "ipman_rs": ip.__version__,
    }


def _cpu() -> str:
    try:
        with open("/proc/cpuinfo") as file:
            return next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
