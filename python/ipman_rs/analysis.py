"""All quantities of a body, or of many, in one call."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs import _core, presets
from ipman_rs.arrays import Bodies, of_each
from ipman_rs.ground import Ground
from ipman_rs.jsonable import jsonable
from ipman_rs.pressure import pressure
from ipman_rs.quantities import densities
from ipman_rs.status import Status, status_names
from ipman_rs.support import BaseOfSupport, nest
from ipman_rs.template import BodyTemplate
from ipman_rs.units import warn_odd_size

if TYPE_CHECKING:
    from ipman_rs.body.model import BodyModel
    from ipman_rs.body.sequence import PosedSequence

# Bodies that are posed and analysed at a time: enough for the lanes of several threads, few enough for the cache.
PIECE = 128


@dataclass(frozen=True, eq=False)
class Analysis:
    """Every figure of a batch of bodies; shapes start with the batch's. Metres, kilograms, m³.

    center_of_mass is the paper's pCoM, or the exact one for a body of one part (`com_method` says which). stability,
    pull, push and balance are the unweighted losses of the preset; `status` holds the bits of `ipman_rs.Status`;
    `lowest` is the height of the lowest vertex above the ground. `pressure` of each sample is None where it was not
    asked for; its sum and its largest value are always there.
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
    pressure: NDArray[Any] | None
    pressure_sum: NDArray[Any]
    pressure_max: NDArray[Any]
    center_of_pressure: NDArray[Any]
    base_of_support: BaseOfSupport
    bose: NDArray[np.bool_]
    stability: NDArray[Any]
    pull: NDArray[Any]
    push: NDArray[Any]
    balance: NDArray[Any]
    lowest: NDArray[Any]

    def to_json(self) -> str:
        """Strict JSON: the fields by name, nested as the batch, status as names; what is not finite becomes null.

        Of the pressure only its sum and its largest value are kept.
        """
        values = {name: value for name, value in vars(self).items() if name not in {"pressure", "status"}}
        values["base_of_support"] = vars(self.base_of_support)
        values["status"] = status_names(self.status)
        return json.dumps(jsonable(values), allow_nan=False)

    @classmethod
    def concatenate(cls, parts: Iterable[Analysis]) -> Analysis:
        """One analysis of the bodies of several, along the first axis of their batches.

        Raises:
            ValueError: there are none.
        """
        parts = list(parts)
        if not parts:
            raise ValueError("parts: expected at least one analysis")
        return cls(**{field.name: _joined([getattr(part, field.name) for part in parts]) for field in fields(cls)})


def _joined(values: list[Any]) -> Any:
    if isinstance(values[0], np.ndarray):
        return np.concatenate(values)
    if isinstance(values[0], list):
        return [entry for value in values for entry in value]
    if isinstance(values[0], BaseOfSupport):
        columns = {field.name: [getattr(value, field.name) for value in values] for field in fields(BaseOfSupport)}
        return BaseOfSupport(**{name: _joined(column) for name, column in columns.items()})
    return values[0]


def analyze(
    vertices: ArrayLike,
    template: BodyTemplate,
    ground: Ground,
    preset: str = "paper-r",
    density: ArrayLike = 985.0,
    with_pressure: bool = True,
) -> Analysis:
    """Every quantity of each body with the constants of a preset (see `ipman_rs.presets`).

    Args:
        vertices: (..., V, 3) m.
        density: kg/m³, one number or one a part.
        with_pressure: keep the pressure of every sample.

    Warns:
        UnitsWarning: a body is too large or too small for metres.
    """
    bodies = Bodies(vertices, template)
    analysis = _analyze(bodies, ground, presets.get(preset), density, with_pressure)
    _warn_units(bodies.vertices, np.ravel(analysis.status))
    return analysis


def analyze_poses(
    body: BodyModel,
    pose: ArrayLike,
    ground: Ground,
    betas: ArrayLike | None = None,
    transl: ArrayLike | None = None,
    preset: str = "paper-r",
    density: ArrayLike = 985.0,
    template: BodyTemplate | None = None,
    with_pressure: bool = False,
    piece: int = PIECE,
) -> Iterator[Analysis]:
    """Every quantity of each posed body, a piece of the bodies at a time: memory does not grow with their number.

    The parts are those of `analyze` on all bodies, to the bit and for any piece; `Analysis.concatenate` joins them.

    Args:
        pose: (T, J, 3) axis-angle or (T, J, 6), as in `BodyModel.forward`. float32 throughout is the fast way.
        ground: one for all bodies.
        betas: (B,) of all bodies, or (T, B). transl: (3,) or (T, 3) m.
        template: another than `body.template`.
        with_pressure: keep the pressure of every sample.
        piece: bodies at a time.

    Warns:
        UnitsWarning: a body is too large or too small for metres; once, for the first.
    """
    from ipman_rs.body.sequence import PosedSequence

    return analyze_sequence(
        PosedSequence.of(body, pose, betas, transl), template or body.template, ground, preset, density, with_pressure,
        piece,
    )  # fmt: skip


def analyze_sequence(
    bodies: PosedSequence | NDArray[Any],
    template: BodyTemplate,
    ground: Ground,
    preset: str = "paper-r",
    density: ArrayLike = 985.0,
    with_pressure: bool = False,
    piece: int = PIECE,
) -> Iterator[Analysis]:
    """`analyze_poses` for bodies that are posed when they are needed, or vertices (T, V, 3)."""
    from ipman_rs.body.sequence import pieces

    if np.ndim(ground.height) or np.ndim(ground.normal) > 1:
        raise ValueError(f"ground: expected one for all bodies, got heights {ground.height.shape}")
    constants = presets.get(preset)
    warned, start = False, 0
    for vertices in pieces(bodies, piece):
        checked = Bodies(vertices, template)
        analysis = _analyze(checked, ground, constants, density, with_pressure)
        warned = warned or _warn_units(checked.vertices, analysis.status, start)
        start += len(vertices)
        yield analysis


def _analyze(
    bodies: Bodies, ground: Ground, constants: presets.Preset, density: ArrayLike, with_pressure: bool
) -> Analysis:
    template = bodies.template
    com_method: Literal["pcom", "exact"] = "exact" if template.num_parts == 1 else "pcom"
    options = [
        constants.alpha, constants.gamma, constants.epsilon, constants.alpha1, constants.alpha2, constants.beta1,
        constants.beta2, constants.threshold, constants.balance_gamma, constants.sigma,
    ]  # fmt: skip
    rows, corners, counts = _core.analysis(
        template._core, com_method, constants.contact, options, densities(density, template), *bodies.over(ground)
    )
    corners = corners.astype(rows.dtype, copy=False)
    value = _Figures(bodies, rows)
    status, contacts = (rows[:, _core.ANALYSIS_COLUMNS[name]] for name in ("status", "num_contacts"))
    finite = ~np.isnan(status)
    margin = value("margin")
    num_contacts = bodies.unfold(np.where(finite, contacts, 0).astype(np.int64))
    support = BaseOfSupport(
        polygon=nest(of_each(corners, counts), bodies.shape),
        area=value("area"),
        margin=margin,
        inside=margin >= 0.0,
        has_contact=num_contacts > 0,
        num_contacts=num_contacts,
    )
    curve = {"alpha": constants.alpha, "gamma": constants.gamma}
    vertices = bodies.vertices.reshape(*bodies.shape, *bodies.vertices.shape[1:])
    return Analysis(
        preset=constants.name,
        part_names=template.part_names,
        com_method=com_method,
        status=bodies.unfold(np.where(finite, status, Status.NON_FINITE).astype(np.int64)),
        part_volumes=value("part_volumes", template.num_parts),
        volume=value("volume"),
        mass=value("mass"),
        inertia=value("inertia", 3, 3),
        center_of_mass=value("center_of_mass", 3),
        center_of_mass_exact=value("center_of_mass_exact", 3),
        pressure=pressure(vertices, template, ground, **curve) if with_pressure else None,
        pressure_sum=value("pressure_sum"),
        pressure_max=value("pressure_max"),
        center_of_pressure=value("center_of_pressure", 3),
        base_of_support=support,
        bose=support.inside,
        stability=value("stability"),
        pull=value("pull"),
        push=value("push"),
        balance=value("balance"),
        lowest=value("lowest"),
    )


@dataclass(frozen=True)
class _Figures:
    """The columns of the core's rows, as owned arrays in the shape of the batch."""

    bodies: Bodies
    rows: NDArray[Any]

    def __call__(self, name: str, *shape: int) -> Any:
        start = _core.ANALYSIS_COLUMNS[name]
        size = int(np.prod(shape, dtype=int))
        return self.bodies.unfold(self.rows[:, start : start + size].copy(), *shape)


def _warn_units(vertices: NDArray[Any], status: NDArray[np.int64], start: int = 0) -> bool:
    odd = np.flatnonzero(status & Status.ODD_SIZE)
    if odd.size:
        with np.errstate(over="ignore", invalid="ignore"):
            size = float(np.ptp(vertices[odd[0]], axis=0).max())
        warn_odd_size(size, f"body {start + odd[0]}")
    return bool(odd.size)
