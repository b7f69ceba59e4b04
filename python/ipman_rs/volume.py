"""Volume: each part closed, translated and filled with tetrahedra; exact mass properties of the solid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike, NDArray

from ipman_rs import quantities
from ipman_rs.arrays import Bodies
from ipman_rs.ground import ANYWHERE
from ipman_rs.template import BodyTemplate


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
    """vol^P, the volume of each closed part (paper, section 3.2), (..., P) m³. vertices (..., V, 3) m.

    Raises:
        ValueError: wrong shape.
        TypeError: an argument of the wrong kind, or masked vertices.
    """
    return Bodies(vertices, template).evaluate(quantities.part_volumes(template), ANYWHERE)


def mass_properties(vertices: ArrayLike, template: BodyTemplate, density: ArrayLike = 985.0) -> MassProperties:
    """Exact volume, mass, centre of mass and inertia of the whole body and of each part.

    Args:
        vertices: (..., V, 3) m.
        density: kg/m³, one for all parts or (P,).

    Raises:
        ValueError: wrong shapes, or a density that is not positive.
        TypeError: an argument of the wrong kind, or masked arrays.
    """
    rows = Bodies(vertices, template).evaluate(quantities.mass_properties(density, template), ANYWHERE)
    return unpack_mass_properties(rows)


def unpack_mass_properties(rows: Any) -> MassProperties:
    """From the core's rows (..., 1 + P, 14): the whole body first, then its parts. Arrays or tensors."""

    def unpack(row: Any, parts: MassProperties | None = None) -> MassProperties:
        inertia = row[..., 5:].reshape(*row.shape[:-1], 3, 3)
        return MassProperties(row[..., 0], row[..., 1], row[..., 2:5], inertia, parts)

    return unpack(rows[..., 0, :], unpack(rows[..., 1:, :]))
