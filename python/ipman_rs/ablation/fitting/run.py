"""The fits of all rows of all blocks. Finished fits are saved in a folder and reused."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from ipman_rs.files import atomic_write
from ipman_rs.renamed import old_names

from ...fitting.config import FitConfig
from ...fitting.fit import Fit, StageReport, fit
from ...synthetic.at_rest import draw_people
from ...torch.threads import one_thread
from .metrics import FitMetrics, fit_metrics, snap_to_floor
from .observations import Observations, calibrated_observations, presented_observations, regressed_observations
from .truth import Truth
from .variants import CALIBRATED, PRESENTED, FittingVariant, config

__getattr__ = old_names(__name__, {"Benchmark": "FittingBenchmark"})

SPLITS = {"test": 40_000, "tune": 10_000}  # seeds of the people; those of 20_000 and 30_000 were looked at
CONTROLS = ("baseline", "both", "ours", "ours without physics")


@dataclass(frozen=True)
class Block:
    """People, their observations, and the rows. told: None (camera and floor), "regressed" (a start, too), or the
    degrees of noise of a presented pose."""

    name: str
    kind: str
    told: float | str | None
    rows: tuple[FittingVariant, ...]


def blocks() -> list[Block]:
    few = tuple(row for row in CALIBRATED if row.name in CONTROLS)
    few_presented = tuple(row for row in PRESENTED if row.name in CONTROLS)
    return [
        Block("calibrated", "balanced", None, tuple(CALIBRATED)),
        Block("presented, 3°", "balanced", 3.0, tuple(PRESENTED)),
        Block("presented, 10°", "balanced", 10.0, tuple(PRESENTED)),
        Block("calibrated, good start", "balanced", "regressed", tuple(CALIBRATED)),
        Block("calibrated, tipped", "tipped", None, few),
        Block("calibrated, jumping", "jumping", None, few),
        Block("presented, 3°, tipped", "tipped", 3.0, few_presented),
        Block("presented, 3°, jumping", "jumping", 3.0, few_presented),
    ]


@dataclass(frozen=True)
class FittingVariantResult:
    """One row of a block. seconds: on one processor core, per body."""

    row: FittingVariant
    figures: FitMetrics
    seconds: float


@dataclass(frozen=True)
class FittingBenchmark:
    """bodies: of the balanced blocks; the controls have `controls`. iterations: of the longest stage."""

    folder: Path
    bodies: int = 100
    controls: int = 40
    iterations: int = 100
    split: str = "test"

    def run(
        self, block: Block, progress: Callable[[], None] = lambda: None
    ) -> tuple[Truth, list[FittingVariantResult]]:
        """`progress` is called after each row."""
        truth = self.truth(block.kind)
        observed: Observations | None = None
        results = []
        for row in block.rows:
            preset = config(row, self.iterations)
            place = self.place(block, preset)
            observed = observed or self.observations(block, truth)
            if not place.exists():
                self.fit(observed, preset, place)
            bodies, seconds = load_fit(observed, place)
            results.append(
                FittingVariantResult(
                    row, fit_metrics(snap_to_floor(bodies) if row.snap else bodies, observed, truth), seconds
                )
            )
            progress()
        return truth, results

    def count(self, kind: str) -> int:
        return self.bodies if kind == "balanced" else self.controls

    def truth(self, kind: str, progress: Callable[[int], None] | None = None) -> Truth:
        """The people of a kind; `progress` is called with the number drawn so far."""
        self.folder.mkdir(parents=True, exist_ok=True)
        count = self.count(kind)
        path = self.folder / f"people-{self.split}-{kind}-{count}.npz"
        if not path.exists():
            Truth.of(draw_people(count, SPLITS[self.split], kind, progress)).save(path)
        return Truth.load(path)

    def observations(self, block: Block, truth: Truth) -> Observations:
        with one_thread():
            if block.told is None:
                return calibrated_observations(truth, SPLITS[self.split])
            if isinstance(block.told, str):
                return regressed_observations(truth, SPLITS[self.split])
            return presented_observations(truth, SPLITS[self.split], block.told)

    def fit(self, observed: Observations, preset: FitConfig, place: Path) -> None:
        begun = time.process_time()
        fitted = fit(observed.problem, observed.starts, preset)
        seconds = (time.process_time() - begun) / observed.problem.num_bodies
        reasons = np.array([stage.reasons for stage in fitted.stages])
        variables: dict[str, Any] = {name: value.numpy() for name, value in fitted.variables.items()}
        with atomic_write(place) as file:
            np.savez(file, seconds=seconds, reasons=reasons, **variables)

    def place(self, block: Block, preset: FitConfig) -> Path:
        """The file of a fit: named by all that decides it."""
        settings = [
            self.split,
            self.count(block.kind),
            block.kind,
            block.told,
            preset.terms,
            [asdict(stage) for stage in preset.stages],
            preset.hypotheses and asdict(preset.hypotheses),
        ]
        key = hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()[:16]
        return self.folder / f"fit-{key}.npz"


def load_fit(observed: Observations, place: Path) -> tuple[Fit, float]:
    """A fit from its file, and its seconds."""
    with np.load(place, allow_pickle=False) as stored:
        content: Mapping[str, np.ndarray] = dict(stored)
    variables = {name: torch.from_numpy(content[name]) for name in observed.starts}
    stages = [StageReport("", list(reasons), [], {}, variables) for reasons in content["reasons"]]
    return Fit(observed.problem, variables, stages), float(content["seconds"])
