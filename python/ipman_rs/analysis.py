"""All quantities of a body, or of many, in one call."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs import presets
from ipman_rs.arrays import Bodies
from ipman_rs.ground import Ground
from ipman_rs.losses import balance_cost, ground_loss, stability_loss
from ipman_rs.mass import center_of_mass
from ipman_rs.plain import plain
from ipman_rs.pressure import center_of_pressure, pressure
from ipman_rs.status import Status, body_status, status_names, warn_odd_size
from ipman_rs.support import BaseOfSupport, base_of_support
from ipman_rs.template import BodyTemplate
from ipman_rs.volume import mass_properties, part_volumes


@dataclass(frozen=True, eq=False)
class Analysis:
    """Every figure of a batch of bodies; shapes start with the batch's. Metres, kilograms, m³.

    center_of_mass is the paper's pCoM, or the exact one for a body of one part (`com_method` says which). stability,
    pull, push and balance are the unweighted losses of the preset; `status` holds the bits of `ipman_rs.Status`.
    """

    preset: str
    part_names: tuple[str, ...]
    com_method: Literal["pcom", "exact"]
    status: NDArray[np.int64]
    part_volumes: NDArray[Any]
    volume: NDArray[Any]
    mass: NDArray[Any]
    inertia: NDArray[Any]
    center_of_mass: NDArray[Any]
    center_of_mass_exact: NDArray[Any]
    pressure: NDArray[Any]
    center_of_pressure: NDArray[Any]
    base_of_support: BaseOfSupport
    bose: NDArray[np.bool_]
    stability: NDArray[Any]
    pull: NDArray[Any]
    push: NDArray[Any]
    balance: NDArray[Any]

    def to_json(self) -> str:
        """Strict JSON: the fields by name, nested as the batch, status as names; what is not finite becomes null.

        Of the pressure only its sum and its largest value are kept.
        """
        values = {name: value for name, value in vars(self).items() if name not in {"pressure", "status"}}
        values["base_of_support"] = vars(self.base_of_support)
        values["status"] = status_names(self.status)
        values["pressure_sum"] = self.pressure.sum(axis=-1)
        values["pressure_max"] = self.pressure.max(axis=-1)
        return json.dumps(plain(values), allow_nan=False)


def analyze(
    vertices: ArrayLike, template: BodyTemplate, ground: Ground, preset: str = "paper-r", density: float = 985.0
) -> Analysis:
    """Every quantity of each body with the constants of a preset (see `ipman_rs.presets`).

    Args:
        vertices: (..., V, 3) m.
        density: kg/m³, one number or one a part.

    Warns:
        UnitsWarning: a body is too large or too small for metres.
    """
    constants = presets.get(preset)
    bodies = Bodies(vertices, template)
    vertices = bodies.vertices.reshape(*bodies.shape, *bodies.vertices.shape[1:])
    com_method: Literal["pcom", "exact"] = "exact" if template.num_parts == 1 else "pcom"
    status = body_status(vertices, template, ground, constants.threshold, constants.contact)
    _warn_units(bodies, status)
    curve = {"alpha": constants.alpha, "gamma": constants.gamma}
    solid = mass_properties(vertices, template, density)
    support = base_of_support(vertices, template, ground, constants.threshold, com_method, constants.contact)
    pull, push = ground_loss(
        vertices, template, ground, constants.alpha1, constants.alpha2, constants.beta1, constants.beta2
    )
    return Analysis(
        preset=preset,
        part_names=template.part_names,
        com_method=com_method,
        status=status,
        part_volumes=part_volumes(vertices, template),
        volume=solid.volume,
        mass=solid.mass,
        inertia=solid.inertia,
        center_of_mass=center_of_mass(vertices, template, com_method),
        center_of_mass_exact=center_of_mass(vertices, template, "exact"),
        pressure=pressure(vertices, template, ground, **curve),
        center_of_pressure=center_of_pressure(vertices, template, ground, **curve, epsilon=constants.epsilon),
        base_of_support=support,
        bose=support.inside,
        stability=stability_loss(vertices, template, ground, **curve, epsilon=constants.epsilon, method=com_method),
        pull=pull,
        push=push,
        balance=balance_cost(
            vertices, template, ground, constants.alpha, constants.balance_gamma, constants.sigma, method=com_method
        ),
    )


def _warn_units(bodies: Bodies, status: NDArray[np.int64]) -> None:
    odd = np.flatnonzero(status & Status.ODD_SIZE)
    if odd.size:
        warn_odd_size(float(np.ptp(bodies.vertices[odd[0]], axis=0).max()), f"body {odd[0]}")
