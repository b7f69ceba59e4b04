"""The configuration of a training run: a YAML file, and entries on the command line, which take precedence."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_type_hints

from ipman_rs.files import parse_yaml, read_yaml
from ipman_rs.presets import PRESETS

from ..augment import AugmentConfig
from ..losses import Weights

SCHEDULES = ("constant", "cosine")


@dataclass(frozen=True)
class DataSettings:
    """One data set. name: of `ipman_rs.data`, or "people" (built ones, seen as keypoints; path is then their number).
    share: of the training samples. images: the folder in which the paths of images begin. options: of the data set,
    such as `split`."""

    name: str
    path: str
    share: float = 1.0
    images: str = ""
    options: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class PhysicsConfig:
    """preset: of `ipman_rs.presets`, or none. weights, counted: as in `losses.PhysicsLoss`."""

    preset: str = "none"
    weights: dict[str, float] = field(default_factory=dict)
    counted: str = "labelled"


@dataclass(frozen=True)
class Model:
    """backbone: as in `model.backbone`, or "keypoints". pretrained: with ImageNet's weights. size: of the crop, pixels.
    start: a checkpoint of `ipman train` to start from; spin: one in SPIN's format. mean: SPIN's file of mean
    parameters. regressor: SPIN's J_regressor_extra.npy, for hips and other joints as data sets label them. dropout: of
    the regressor of bodies."""

    backbone: str = "resnet50"
    pretrained: bool = False
    size: int = 224
    start: str = ""
    spin: str = ""
    mean: str = ""
    regressor: str = ""
    dropout: float = 0.5


@dataclass(frozen=True)
class TrainingConfig:
    """batch: of each process. rate: of Adam; schedule: "constant", or "cosine", which lets it fall to a tenth along
    half a cosine until the last step. clip: the largest norm of a gradient; usual ones are about a hundred, and one of
    2,500 was seen to throw a run off for good. devices, nodes, accelerator, precision: Lightning's. workers: processes
    that load data. validate, save, log: every so many steps; validate: 0 for never."""

    data: tuple[DataSettings, ...]
    validation: tuple[DataSettings, ...] = ()
    body: str = "anny-lite"
    model: Model = field(default_factory=Model)
    loss: Weights = field(default_factory=Weights)
    physics: PhysicsConfig = field(default_factory=PhysicsConfig)
    augment: AugmentConfig = field(default_factory=AugmentConfig)
    steps: int = 10_000
    batch: int = 64
    rate: float = 5e-5
    schedule: str = "constant"
    clip: float = 500.0
    seed: int = 0
    validate: int = 1000
    save: int = 500
    log: int = 10
    workers: int = 0
    devices: int = 1
    nodes: int = 1
    accelerator: str = "auto"
    precision: str = "32-true"


def load(path: Path, changes: Sequence[str] = ()) -> TrainingConfig:
    """A YAML file, changed by `name=value` or `group.name=value`.

    ValueError, naming the file and the entry, for what is unknown or of the wrong kind.
    """
    content = read_yaml(path)
    try:
        if not isinstance(content, dict):
            raise ValueError(f"expected names with values, got {content!r}")
        for change in changes:
            _change(content, change)
        return config_of(content)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def config_of(content: Mapping[str, Any]) -> TrainingConfig:
    """A configuration from plain dictionaries. ValueError as `load`."""
    made = _made(TrainingConfig, content, "")
    if not made.data:
        raise ValueError("data: expected at least one data set to train on, got none")
    if made.physics.preset != "none" and made.physics.preset not in PRESETS:
        raise ValueError(f"physics.preset: expected none or one of {', '.join(PRESETS)}, got {made.physics.preset!r}")
    if made.loss.keypoint_maps and made.model.backbone != "small":
        raise ValueError("loss.keypoint_maps: has maps with model.backbone: small alone")
    if made.loss.keypoint_maps and made.model.regressor:
        raise ValueError("loss.keypoint_maps: has no maps of the joints that model.regressor makes")
    if made.loss.keypoints_2d_count < 0:
        raise ValueError(f"loss.keypoints_2d_count: expected 0 or more, got {made.loss.keypoints_2d_count}")
    if made.schedule not in SCHEDULES:
        raise ValueError(f"schedule: expected one of {', '.join(SCHEDULES)}, got {made.schedule!r}")
    if made.model.regressor and made.model.backbone == "keypoints":
        raise ValueError("model.regressor: built people have the body's own joints; leave it out")
    if made.model.start and (made.model.spin or made.model.pretrained):
        raise ValueError("model.start: has all weights; leave out model.spin and model.pretrained")
    if not made.clip > 0:
        raise ValueError(f"clip: expected more than 0, got {made.clip}")
    for name in ("steps", "batch", "save", "log"):
        if getattr(made, name) < 1:
            raise ValueError(f"{name}: expected at least 1, got {getattr(made, name)}")
    return made


def as_dict(settings: TrainingConfig) -> dict[str, Any]:
    """The configuration as dictionaries and lists, for files."""
    content = dataclasses.asdict(settings)
    return {**content, "data": list(content["data"]), "validation": list(content["validation"])}


def _change(content: dict[str, Any], change: str) -> None:
    name, given, value = change.partition("=")
    if not given:
        raise ValueError(f"{change}: expected name=value")
    *groups, last = name.split(".")
    for group in groups:
        content = content.setdefault(group, {})
        if not isinstance(content, dict):
            raise ValueError(f"{name}: {group} has no entries")
    try:
        content[last] = parse_yaml(value)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def _made(kind: Any, content: Any, place: str) -> Any:
    """A dataclass from a dictionary, recursively."""
    if not isinstance(content, Mapping):
        raise ValueError(f"{place or 'the file'}: expected names with values, got {content!r}")
    hints = get_type_hints(kind)
    names = [entry.name for entry in dataclasses.fields(kind)]
    unknown = [str(name) for name in content if name not in names]
    if unknown:
        raise ValueError(f"{_at(place, unknown[0])}: unknown; expected some of {', '.join(names)}")
    for entry in dataclasses.fields(kind):
        needed = entry.default is dataclasses.MISSING and entry.default_factory is dataclasses.MISSING
        if needed and entry.name not in content:
            raise ValueError(f"{_at(place, entry.name)}: missing")
    return kind(**{name: _value(hints[name], value, _at(place, name)) for name, value in content.items()})


def _value(hint: Any, value: Any, place: str) -> Any:
    if dataclasses.is_dataclass(hint):
        return _made(hint, value, place)
    if hint == tuple[DataSettings, ...]:
        if not isinstance(value, (list, tuple)):
            raise ValueError(f"{place}: expected a list of data sets, got {value!r}")
        return tuple(_made(DataSettings, one, f"{place}[{number}]") for number, one in enumerate(value))
    if hint is float and isinstance(value, (int, float)) and not isinstance(value, bool):
        if math.isnan(value) or (math.isinf(value) and place != "clip"):  # a clip of infinity is none
            raise ValueError(f"{place}: expected a finite number, got {value!r}")
        return float(value)
    if hint is str and isinstance(value, (str, int)) and not isinstance(value, bool):
        return str(value)
    wanted = dict if getattr(hint, "__origin__", None) is dict else hint
    if not isinstance(value, wanted) or (isinstance(value, bool) and wanted is not bool):
        raise ValueError(f"{place}: expected {wanted.__name__}, got {value!r}")
    return value


def _at(place: str, name: str) -> str:
    return f"{place}.{name}" if place else name
