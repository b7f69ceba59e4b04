"""What is compared, read from `settings.yaml`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from ipman_rs import BodyTemplate

from ..drill import Drill
from ..losses import Physics
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
    """plans: of each task, by its name."""

    plans: Mapping[str, Plan]
    rows: tuple[Row, ...]


@cache
def settings() -> Settings:
    import yaml

    told = yaml.safe_load((Path(__file__).parent / "settings.yaml").read_text())
    plans = {name: _plan(**plan) for name, plan in told["plans"].items()}
    return Settings(plans, tuple(Row(**row) for row in told["rows"]))


def _plan(base: dict[str, Any], fine: dict[str, Any], first: dict[str, Any] | None = None) -> Plan:
    return Plan(Drill(**first) if first else None, Drill(**base), Drill(**fine))
