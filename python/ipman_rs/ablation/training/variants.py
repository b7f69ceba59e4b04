"""The variants compared, read from `settings.yaml`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from ipman_rs import BodyTemplate

from ...training.losses import PhysicsLoss
from ...training.train_loop import TrainingPlan
from .task import Plan

BASELINE = "HMR*"
OURS = "balanced"
CONTROL = f"{OURS}, shuffled camera"


@dataclass(frozen=True)
class TrainingVariant:
    """One row of the table: fine-tuning with the terms of a preset, or with none. weights: λ unlike the preset's.
    shuffled: the physics terms see the cameras of other images."""

    name: str
    preset: str | None = None
    weights: Mapping[str, float] = field(default_factory=dict)
    shuffled: bool = False

    def physics(self, template: BodyTemplate) -> PhysicsLoss | None:
        return None if self.preset is None else PhysicsLoss(template, self.preset, self.weights)


@dataclass(frozen=True)
class Ablation:
    """The variants compared on one task, and the plan by which each is trained."""

    plan: Plan
    rows: tuple[TrainingVariant, ...]


@cache
def ablation_of(task: str) -> Ablation:
    import yaml

    content = yaml.safe_load((Path(__file__).parent / "settings.yaml").read_text())
    stages = {name: TrainingPlan(**stage) for name, stage in content["plans"][task].items()}
    own = content["weights"][task]  # of presets
    rows = (
        TrainingVariant(**{**row, "weights": own.get(row.get("preset"), {}) | row.get("weights", {})})
        for row in content["rows"]
    )
    return Ablation(Plan(**stages), tuple(rows))
