"""Presets: stages, weights and options in YAML files, the built-in ones in `presets/`."""

from __future__ import annotations

import inspect
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ipman_rs.files import read_yaml

from .hypotheses import PITCH_PRIOR, SUPPORTS, Hypotheses
from .solvers import SOLVERS, SolverOptions
from .terms import TERMS
from .variables import BLOCKS

FOLDER = Path(__file__).parent / "presets"
MOST = 1_000_000  # iterations of a stage
PRESETS = tuple(sorted(path.stem for path in FOLDER.glob("*.yaml")))


SEARCHES = ("body", "mean", "camera", "points")


@dataclass(frozen=True)
class Stage:
    """What is free, what counts how much, and which solver does it until when."""

    name: str
    free: tuple[str, ...]
    weights: Mapping[str, float]
    solver: str
    options: SolverOptions
    find_ground: bool = False  # lay the ground under the body before it, unless the ground is given
    keep: int = 1  # hypotheses of each body that go on after it, the cheapest
    terms: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)  # options that differ from the file's

    def term_options(self, terms: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
        """The options of each term in this stage, where the file has `terms`."""
        return {name: {**terms.get(name, {}), **self.terms.get(name, {})} for name in {**terms, **self.terms}}


@dataclass(frozen=True)
class FitConfig:
    """A fit: its stages, the options of its terms by their names, and what it weighs, if anything."""

    name: str
    stages: tuple[Stage, ...]
    terms: Mapping[str, Mapping[str, Any]]
    start: Mapping[str, Any]
    hypotheses: Hypotheses | None = None

    @property
    def moves_camera(self) -> bool:
        """Whether the body stays in the frame in which it is presented, and the camera is placed around it."""
        return self.start.get("search") == "camera"


def uses_terms(config: FitConfig, *terms: str) -> bool:
    """Whether any stage has a weight for any of these terms."""
    return any(stage.weights.get(name, 0) > 0 for stage in config.stages for name in terms)


def limit_iterations(config: FitConfig, iterations: int) -> FitConfig:
    """Copy of the configuration whose stages end after at most `iterations` iterations."""
    stages = (
        replace(stage, options=replace(stage.options, iterations=min(stage.options.iterations, iterations)))
        for stage in config.stages
    )
    return replace(config, stages=tuple(stages))


def load(name: str | Path) -> FitConfig:
    """A built-in preset by its name, or a YAML file by its path.

    Raises:
        ValueError: there is no such preset, or the file says something unknown; the message names it.
    """
    path = FOLDER / f"{name}.yaml" if str(name) in PRESETS else Path(name)
    if not os.path.lexists(path):
        raise ValueError(f"preset: expected one of {', '.join(PRESETS)}, or a YAML file, got {str(name)!r}")
    content = read_yaml(path)
    try:
        return _config(path.stem, content)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def search_of(start: Mapping[str, Any]) -> str:
    """The kind of search that a preset's `start` names. ValueError for an unknown one."""
    search_options(start)
    how = start.get("search", "body")
    if how not in SEARCHES:
        raise ValueError(f"start, search: expected one of {', '.join(SEARCHES)}, got {how!r}")
    return how


def search_options(start: Mapping[str, Any]) -> dict[str, Any]:
    """The `start` of a preset without its `search`. ValueError for an unknown option."""
    unknown = sorted(set(start) - {"search", "yaws", "iterations"})
    if unknown:
        raise ValueError(f"start: expected search, yaws or iterations, got {', '.join(unknown)}")
    return {name: int(value) for name, value in start.items() if name != "search"}


def _config(name: str, content: Any) -> FitConfig:
    _known("the file", content, ("description", "solver", "start", "stages", "terms", "tolerance", "hypotheses"))
    terms, start = _terms("terms", content.get("terms")), content.get("start") or {}
    _known("start", start, ("search", "yaws", "iterations"))
    _expect("start, search", start.get("search", ""), "str")
    for option in ("yaws", "iterations"):
        _whole(f"start, {option}", start.get(option, 1), 1)
    search_of(start)
    listed = content.get("stages") or ()
    if not listed or not isinstance(listed, (list, tuple)):
        raise ValueError(f"stages: expected a list of at least one, got {_short(listed)}")
    stages = tuple(_stage(number, stage, content) for number, stage in enumerate(listed))
    return FitConfig(
        name, stages, terms, start, _hypotheses(content.get("hypotheses"), [stage.name for stage in stages])
    )


def _hypotheses(content: Any, stages: list[str]) -> Hypotheses | None:
    """What a preset weighs."""
    if content is None:
        return None
    place = "hypotheses"
    _known(place, content, ("before", "pitches", "pitch", "prices"))
    before, pitches = content.get("before"), content.get("pitches")
    if before not in stages:
        raise ValueError(f"{place}, before: expected one of the stages {', '.join(stages)}, got {_short(before)}")
    if (
        not isinstance(pitches, list)
        or not pitches
        or not all(_is(each, "float") and abs(each) < 90 for each in pitches)
    ):
        raise ValueError(f"{place}, pitches: expected degrees between -90 and 90, got {_short(pitches)}")
    numbers = {}
    for name, given, known in (
        ("pitch", content.get("pitch"), PITCH_PRIOR),
        ("prices", content.get("prices"), SUPPORTS),
    ):
        _known(f"{place}, {name}", given, known)
        for key in known:
            least = {"mean": -90.0, "deviation": 1e-3}.get(key, 0.0)
            if not _is(given.get(key), "float") or given[key] < least:
                wanted = f"≥ {least:g}" if least <= 0 else "above 0"
                raise ValueError(f"{place}, {name}, {key}: expected a number {wanted}, got {_short(given.get(key))}")
        numbers[name] = {key: float(value) for key, value in given.items()}
    return Hypotheses(before, tuple(map(float, pitches)), prices=numbers["prices"], **numbers["pitch"])


def _stage(number: int, stage: Any, content: Mapping[str, Any]) -> Stage:
    place = f"stage {number}"
    _known(place, stage, ("name", "free", "weights", "solver", "iterations", "find_ground", "terms", "keep"))
    for needed in ("free", "weights"):
        if not stage.get(needed):
            raise ValueError(f"{place}, {needed}: expected at least one, got none")
    _known(f"{place}, weights", stage["weights"], TERMS)
    _expect(f"{place}, free", stage["free"], "Sequence[str]")
    _known(f"{place}, free", dict.fromkeys(stage["free"]), BLOCKS)
    solver = stage.get("solver", content.get("solver", "levenberg"))
    _expect(f"{place}, solver", solver, "str")
    _known(f"{place}, solver", {solver: None}, SOLVERS)
    weights = {term: _not_negative(f"{place}, weights, {term}", weight) for term, weight in stage["weights"].items()}
    tolerance = content.get("tolerance") or {}
    _known("tolerance", tolerance, ("gradient", "decrease"))
    ends = {name: _not_negative(f"tolerance, {name}", value) for name, value in tolerance.items()}
    options = SolverOptions(_whole(f"{place}, iterations", stage.get("iterations", 100), 0), **ends)
    find_ground = stage.get("find_ground", False)
    _expect(f"{place}, find_ground", find_ground, "bool")
    terms = _terms(f"{place}, terms", stage.get("terms"))
    keep = _whole(f"{place}, keep", stage.get("keep", 1), 1)
    name = str(stage.get("name", number))
    return Stage(name, tuple(stage["free"]), weights, solver, options, find_ground, keep, terms)


def _terms(place: str, given: Any) -> dict[str, Mapping[str, Any]]:
    """Options of terms by their names."""
    given = given or {}
    _known(place, given, TERMS)
    for name, options in given.items():
        known = _options(TERMS[name])
        _known(f"{place}, {name}", options, known)
        for option, value in options.items():
            _expect(f"{place}, {name}, {option}", value, known[option])
    return given


def _options(term: type) -> dict[str, str]:
    """What a term can be told, and of which type: the arguments of its class after the problem, and those that it hands
    on."""
    names: dict[str, str] = {}
    for each in inspect.getmro(term):
        if "__init__" not in vars(each):
            continue
        arguments = list(inspect.signature(each.__init__).parameters.values())[2:]
        names |= {each.name: str(each.annotation) for each in arguments if each.kind != each.VAR_KEYWORD}
        if all(argument.kind != argument.VAR_KEYWORD for argument in arguments):
            break
    return names


def _known(place: str, given: Any, known: Any) -> None:
    if not isinstance(given, Mapping):
        raise ValueError(f"{place}: expected names with values, got {_short(given)}")
    unknown = [str(key) for key in given if key not in known]
    if unknown:
        raise ValueError(f"{place}: expected some of {', '.join(known)}, got {_short(', '.join(unknown))}")


def _expect(place: str, value: Any, kind: str) -> None:
    """ValueError where a value is not of the type that a term writes behind its argument."""
    if not any(_is(value, one.strip()) for one in kind.split("|")):
        raise ValueError(f"{place}: expected {kind.replace(' | None', '')}, got {_short(value)}")


def _is(value: Any, kind: str) -> bool:
    if kind in ("float", "int"):
        whole = isinstance(value, int) and not isinstance(value, bool)
        return whole or (kind == "float" and isinstance(value, float) and math.isfinite(value))
    if kind == "Mapping[str, float]":
        return isinstance(value, Mapping) and all(_is(k, "str") and _is(v, "float") for k, v in value.items())
    if kind.startswith("Sequence["):
        return isinstance(value, (list, tuple)) and all(_is(each, kind[9:-1]) for each in value)
    return isinstance(value, {"str": str, "bool": bool, "None": type(None)}.get(kind, str))


def _not_negative(place: str, value: Any) -> float:
    if not _is(value, "float") or value < 0:
        raise ValueError(f"{place}: expected a number ≥ 0, got {_short(value)}")
    return float(value)


def _whole(place: str, value: Any, least: int) -> int:
    if not _is(value, "int") or not least <= value <= MOST:
        raise ValueError(f"{place}: expected a whole number from {least} to {MOST}, got {_short(value)}")
    return value


def _short(value: Any) -> str:
    text = str(value)
    return repr(value) if len(text) <= 60 else f"{text[:57]}..."
