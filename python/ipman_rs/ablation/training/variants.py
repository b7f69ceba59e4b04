"""What is compared, read from `settings.yaml`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from ipman_rs import BodyTemplate

from ...training.losses import Physics
from ...training.train_loop import Drill
from .task import Plan

BASELINE = "HMR*"
OURS = "balanced"
CONTROL = f"{OURS}, shuffled camera"


@dataclass(frozen=True)
class Row:
    """Fine-tuning with the terms of a preset, none if it is None. weights: λ that differ from the preset's.
    shuffled: the physics terms see the cameras of other images."""

    name: str
    preset: str | None = None
    weights: Mapping[str, float] = field(default_factory=dict)
    shuffled: bool = False

    def physics(self, template: BodyTemplate) -> Physics | None:
        return None if self.preset is None else Physics(template, self.preset, self.weights)


@dataclass(frozen=True)
class Settings:
    """Of one task."""

    plan: Plan
    rows: tuple[Row, ...]


@cache
def settings(task: str) -> Settings:
    import yaml

    told = yaml.safe_load((Path(__file__).parent / "settings.yaml").read_text())
    stages = {name: Drill(**stage) for name, stage in told["plans"][task].items()}
    own = told["weights"][task]  # of presets
    rows = (Row(**{**row, "weights": own.get(row.get("preset"), {}) | row.get("weights", {})}) for row in told["rows"])
    return Settings(Plan(**stages), tuple(rows))
