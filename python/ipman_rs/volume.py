"""Volume: each part closed, translated and filled with tetrahedra; exact mass properties of the solid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs.arrays import Bodies
from ipman_rs.checks import LARGEST, SMALLEST, body_template, real_array
from ipman_rs.ground import Ground
from ipman_rs.template import BodyTemplate

_ANYWHERE = Ground()


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Exact integrals over a solid: volume (...,) m³, mass (...,) kg, center (..., 3) m, inertia (..., 3, 3) kg m²
    about the centre. `parts` holds the same for each part, with an axis P behind the batch's; signed, so an inverted
    part has a negative volume."""

    volume: NDArray[Any]
    mass: NDArray[Any]
    center: NDArray[Any]
    inertia: NDArray[Any]
    parts: MassProperties | None = None


def part_volumes(vertices: ArrayLike, template: BodyTemplate) -> NDArray[Any]:
    """vol^P, the volume of each closed part (paper, section 3.2), (..., P) m³. vertices (..., V, 3) m."""
    return Bodies(vertices, template).evaluate("part_volumes", [], _ANYWHERE, template.num_parts)


def mass_properties(vertices: ArrayLike, template: BodyTemplate, density: ArrayLike = 985.0) -> MassProperties:
    """Exact volume, mass, centre of mass and inertia of the whole body and of each part.

    Args:
        vertices: (..., V, 3) m.
        density: kg/m³, one for all parts or (P,).
    """
    rows = Bodies(vertices, template).evaluate(
        "mass_properties", densities(density, template), _ANYWHERE, 1 + template.num_parts, 14
    )
    return unpack_mass_properties(rows)


def densities(density: ArrayLike, template: BodyTemplate) -> list[float]:
    """One density or one a part, checked."""
    body_template(template)
    with np.errstate(over="ignore"):
        values = real_array("density", density).astype(np.float64)
    if values.shape not in {(), (1,), (template.num_parts,)}:
        raise ValueError(f"density: expected one number or ({template.num_parts},), got {values.shape}")
    if not ((values >= SMALLEST).all() and (values <= LARGEST).all()):
        raise ValueError("density: expected positive kg/m³")
    return [float(value) for value in values.reshape(-1)]


def unpack_mass_properties(rows: Any) -> MassProperties:
    """From the core's rows (..., 1 + P, 14): the whole body first, then its parts. Arrays or tensors."""

    def unpack(row: Any, parts: MassProperties | None = None) -> MassProperties:
        inertia = row[..., 5:].reshape(*row.shape[:-1], 3, 3)
        return MassProperties(row[..., 0], row[..., 1], row[..., 2:5], inertia, parts)

    return unpack(rows[..., 0, :], unpack(rows[..., 1:, :]))
