"""What is compared, read from `settings.yaml`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from ipman_rs import BodyTemplate

from ..lifting.drill import Drill
from ..losses import Physics

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
    base: Drill
    fine: Drill
    rows: tuple[Row, ...]


@cache
def settings() -> Settings:
    import yaml

    told = yaml.safe_load((Path(__file__).parent / "settings.yaml").read_text())
    base, fine = (Drill(size=told["batch"], **told[name]) for name in ("base", "fine"))
    return Settings(base, fine, tuple(Row(**row) for row in told["rows"]))
