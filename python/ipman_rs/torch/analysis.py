"""All quantities of a body, or of many, in one call, and what is unusual about each body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

import ipman_rs as ip
from ipman_rs import BaseOfSupport, BodyTemplate, presets
from ipman_rs import Ground as NumpyGround
from ipman_rs.checks import body_template

from .arrays import as_array, memory, single_or_double
from .ground import Ground, as_numpy_ground
from .losses import balance_cost, ground_loss, stability_loss
from .mass import center_of_mass
from .pressure import center_of_pressure, pressure
from .support import base_of_support
from .volume import mass_properties, part_volumes


@dataclass(frozen=True, eq=False)
class Analysis(ip.Analysis):
    """`ipman_rs.Analysis` with tensors in its fields, differentiable in the vertices where the quantity is."""

    def numpy(self) -> ip.Analysis:
        """The same figures as arrays."""
        return ip.Analysis(**{name: _arrays(value) for name, value in vars(self).items()})

    def to_json(self) -> str:
        return self.numpy().to_json()


def body_status(
    vertices: Tensor,
    template: BodyTemplate,
    ground: Ground | NumpyGround,
    threshold: float = 0.1,
    contact: str = "paper",
) -> Tensor:
    """The `ipman_rs.Status` bits of each body: vertices (..., V, 3) -> int64 (...)."""
    bits = ip.body_status(as_array(vertices), template, as_numpy_ground(ground), threshold, contact)
    return torch.as_tensor(bits, device=vertices.device)


def analyze(
    vertices: Tensor,
    template: BodyTemplate,
    ground: Ground | NumpyGround,
    preset: str = "paper-r",
    density: float = 985.0,
) -> Analysis:
    """Every quantity of each body with the constants of a preset, as `ipman_rs.analyze`: vertices (..., V, 3)."""
    constants = presets.get(preset)
    body_template(template)
    method = "exact" if template.num_parts == 1 else "pcom"
    body, where = (vertices, template), (vertices, template, ground)
    curve = (constants.alpha, constants.gamma)
    solid = mass_properties(*body, density)
    support = base_of_support(*where, constants.threshold, method, constants.contact)
    # What has no gradient comes from the core at one look.
    plain = ip.analyze(as_array(vertices), template, as_numpy_ground(ground), preset, density, with_pressure=False)

    def tensor(array: Any) -> Tensor:
        return torch.as_tensor(array, device=vertices.device)

    pull, push = ground_loss(*where, constants.alpha1, constants.alpha2, constants.beta1, constants.beta2)
    figures: dict[str, Any] = {
        "preset": preset,
        "part_names": template.part_names,
        "com_method": method,
        "status": tensor(plain.status),
        "part_volumes": part_volumes(*body),
        "volume": solid.volume,
        "mass": solid.mass,
        "inertia": solid.inertia,
        "center_of_mass": center_of_mass(*body, method),
        "center_of_mass_exact": center_of_mass(*body, "exact"),
        "pressure": pressure(*where, *curve),
        "pressure_sum": tensor(plain.pressure_sum),
        "pressure_max": tensor(plain.pressure_max),
        "center_of_pressure": center_of_pressure(*where, *curve, constants.epsilon),
        "base_of_support": support,
        "bose": support.inside,
        "stability": stability_loss(*where, *curve, constants.epsilon, method),
        "pull": pull,
        "push": push,
        "balance": balance_cost(*where, constants.alpha, constants.balance_gamma, constants.sigma, method=method),
        "lowest": tensor(plain.lowest),
    }
    return Analysis(**figures)


def _arrays(value: Any) -> Any:
    if isinstance(value, Tensor):
        return memory(single_or_double(value) if value.is_floating_point() else value)
    if isinstance(value, BaseOfSupport):
        return BaseOfSupport(**{name: _arrays(field) for name, field in vars(value).items()})
    if isinstance(value, list):
        return [_arrays(entry) for entry in value]
    return value
