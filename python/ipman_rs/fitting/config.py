"""Presets: stages, weights and options in YAML files, the built-in ones in `presets/`."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from .solvers import SOLVERS, Options
from .start import search
from .terms import TERMS
from .variables import BLOCKS

FOLDER = Path(__file__).parent / "presets"
PRESETS = tuple(sorted(path.stem for path in FOLDER.glob("*.yaml")))


@dataclass(frozen=True)
class Stage:
    """What is free, what counts how much, and which solver does it until when."""

    name: str
    free: tuple[str, ...]
    weights: Mapping[str, float]
    solver: str
    options: Options
    find_ground: bool = False  # lay the ground under the body before it, unless the ground is given
    terms: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)  # options that differ from the file's

    def term_options(self, terms: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
        """The options of each term in this stage, where the file has `terms`."""
        return {name: {**terms.get(name, {}), **self.terms.get(name, {})} for name in {**terms, **self.terms}}


@dataclass(frozen=True)
class Config:
    """A fit: its stages, and the options of its terms by their names."""

    name: str
    stages: tuple[Stage, ...]
    terms: Mapping[str, Mapping[str, Any]]
    start: Mapping[str, Any]

    @property
    def moves_camera(self) -> bool:
        """Whether the body stays in the frame in which it is presented, and the camera is placed around it."""
        return self.start.get("search") == "camera"


def weighs(config: Config, *terms: str) -> bool:
    """Whether any stage has a weight for any of these terms."""
    return any(stage.weights.get(name, 0) > 0 for stage in config.stages for name in terms)


def capped(config: Config, iterations: int) -> Config:
    """The same with stages that end after so many iterations at most."""
    stages = (
        replace(stage, options=replace(stage.options, iterations=min(stage.options.iterations, iterations)))
        for stage in config.stages
    )
    return replace(config, stages=tuple(stages))


def load(name: str | Path) -> Config:
    """A built-in preset by its name, or a YAML file by its path.

    Raises:
        ValueError: there is no such preset, or the file says something unknown; the message names it.
    """
    import yaml

    path = FOLDER / f"{name}.yaml" if str(name) in PRESETS else Path(name)
    if not path.is_file():
        raise ValueError(f"preset: expected one of {', '.join(PRESETS)}, or a YAML file, got {str(name)!r}")
    try:
        return _config(path.stem, yaml.safe_load(path.read_text()))
    except yaml.YAMLError as error:
        raise ValueError(f"{path}: not YAML: {error}") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _config(name: str, content: Any) -> Config:
    _known("the file", content, ("description", "solver", "start", "stages", "terms", "tolerance"))
    terms = _terms("terms", content.get("terms"))
    search(content.get("start") or {})
    stages = tuple(_stage(number, stage, content) for number, stage in enumerate(content.get("stages") or ()))
    if not stages:
        raise ValueError("stages: expected at least one, got none")
    return Config(name, stages, terms, content.get("start") or {})


def _stage(number: int, stage: Any, content: Mapping[str, Any]) -> Stage:
    place = f"stage {number}"
    _known(place, stage, ("name", "free", "weights", "solver", "iterations", "find_ground", "terms"))
    _known(f"{place}, weights", stage.get("weights") or {}, TERMS)
    _known(f"{place}, free", dict.fromkeys(stage.get("free") or ()), BLOCKS)
    solver = stage.get("solver", content.get("solver", "levenberg"))
    _known(f"{place}, solver", {solver: None}, SOLVERS)
    weights = {}
    for term, weight in stage["weights"].items():
        if not isinstance(weight, (int, float)) or isinstance(weight, bool) or not weight >= 0:
            raise ValueError(f"{place}, weights, {term}: expected a number ≥ 0, got {weight!r}")
        weights[term] = float(weight)
    options = Options(**{"iterations": int(stage.get("iterations", 100)), **(content.get("tolerance") or {})})
    find_ground = bool(stage.get("find_ground", False))
    terms = _terms(f"{place}, terms", stage.get("terms"))
    return Stage(str(stage.get("name", number)), tuple(stage["free"]), weights, solver, options, find_ground, terms)


def _terms(place: str, given: Any) -> dict[str, Mapping[str, Any]]:
    """Options of terms by their names."""
    given = given or {}
    _known(place, given, TERMS)
    for name, options in given.items():
        _known(f"{place}, {name}", options, _options(TERMS[name]))
    return given


def _options(term: type) -> list[str]:
    """What a term can be told: the arguments of its class after the problem, and those that it hands on."""
    names: list[str] = []
    for each in inspect.getmro(term):
        if "__init__" not in vars(each):
            continue
        arguments = list(inspect.signature(each.__init__).parameters.values())[2:]
        names += [argument.name for argument in arguments if argument.kind != argument.VAR_KEYWORD]
        if all(argument.kind != argument.VAR_KEYWORD for argument in arguments):
            break
    return names


def _known(place: str, given: Any, known: Any) -> None:
    if not isinstance(given, Mapping):
        raise ValueError(f"{place}: expected names with values, got {given!r}")
    unknown = [str(key) for key in given if key not in known]
    if unknown:
        raise ValueError(f"{place}: expected some of {', '.join(known)}, got {', '.join(unknown)}")
