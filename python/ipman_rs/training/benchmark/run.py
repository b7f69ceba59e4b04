"""Training of all rows on all labels. What is done is kept in a folder, and not done again."""

from __future__ import annotations

import copy
import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import torch

from ipman_rs.fitting.fit import one_thread

from ..batch import Batch
from ..figures import Figures, figures
from ..lifting import bodies, views
from ..lifting.drill import drill, estimated
from ..lifting.network import lifter
from ..lifting.views import Lean
from ..losses import Loss
from ..model import HMR
from .rows import Row, Settings, settings

TRAINING = 31_000  # seeds: of the people that are trained on, and those whose figures are reported or tuned on
SPLITS = {"test": 33_000, "tune": 32_000}
VIEWS = 4  # of each person that is trained on
TILTS = (0.0, 4.0, 8.0, 12.0)


@dataclass(frozen=True)
class Result:
    """A row, and its figures for each seed."""

    row: Row
    figures: list[Figures]


@dataclass(frozen=True)
class Benchmark:
    """people: that are trained on. bodies: whose figures are taken, an image each. seeds: of weights and batches.
    part: of the settings' steps, for trials. lean: as in `lifting.views`."""

    folder: Path
    people: int = 3500
    bodies: int = 700
    seeds: int = 3
    split: str = "test"
    part: float = 1.0
    lean: Lean = "camera"

    def run(self, tilt: float, progress: Callable[[], None] = lambda: None) -> list[Result]:
        """All rows with labels that lean by `tilt` degrees; `progress` is called after each row of each seed."""
        found: dict[str, list[Figures]] = {row.name: [] for row in self.settings.rows}
        for seed in range(self.seeds):
            for row in self.settings.rows:
                place = self._place("figures", tilt, seed, row)
                if not place.exists():
                    with one_thread():
                        self._measured(tilt, seed, row).save(place)
                found[row.name].append(Figures.load(place))
                progress()
        return [Result(row, found[row.name]) for row in self.settings.rows]

    @cached_property
    def settings(self) -> Settings:
        told = settings()
        base, fine = (
            type(plan)(max(1, round(plan.steps * self.part)), plan.rate, plan.size) for plan in (told.base, told.fine)
        )
        return Settings(base, fine, told.rows)

    @cached_property
    def truth(self) -> Batch:
        seed = SPLITS[self.split]
        return views.views(self.drawn(seed, self.bodies), seed)

    def drawn(self, seed: int, count: int, progress: Callable[[int], None] | None = None) -> bodies.Bodies:
        """People of a seed; `progress` is told how many are drawn."""
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / f"people-{seed}-{count}.npz"
        if not path.exists():
            bodies.draw_bodies(count, seed, progress).save(path)
        return bodies.Bodies.load(path)

    def _measured(self, tilt: float, seed: int, row: Row) -> Figures:
        data, posing = self._data(tilt), views.posing()
        if row.shuffled:
            data = views.shuffled(data, TRAINING)
        model = self._base(tilt, seed)
        drill(model, Loss(posing, row.physics(posing.body.template)), data, self.settings.fine, 1000 + seed)
        return figures(estimated(model, self.truth, SPLITS[self.split]), self.truth, posing)

    def _base(self, tilt: float, seed: int) -> HMR:
        """The regressor that all rows go on from."""
        model, place = lifter(seed), self._place("base", tilt, seed)
        if not place.exists():
            trained = copy.deepcopy(model)
            drill(trained, Loss(views.posing()), self._data(tilt), self.settings.base, seed)
            torch.save(trained.state_dict(), place)
        model.load_state_dict(torch.load(place, weights_only=True))
        return model

    def _data(self, tilt: float) -> Batch:
        if tilt not in self._kept:
            self._kept.clear()
            self._kept[tilt] = views.views(self.drawn(TRAINING, self.people), TRAINING, VIEWS, tilt, self.lean)
        return self._kept[tilt]

    @cached_property
    def _kept(self) -> dict[float, Batch]:
        return {}

    def _place(self, kind: str, tilt: float, seed: int, row: Row | None = None) -> Path:
        """The file of a result: named by all that decides it."""
        told: list[Any] = [self.people, VIEWS, tilt, tilt and self.lean, seed, asdict(self.settings.base)]
        if row is not None:
            told += [self.split, self.bodies, asdict(self.settings.fine), row.preset, dict(row.weights), row.shuffled]
        key = hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:16]
        return self.folder / f"{kind}-{key}.{'pt' if row is None else 'npz'}"
