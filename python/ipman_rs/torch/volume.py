"""Volumes of the closed parts, and exact mass properties of the solid."""

from __future__ import annotations

from collections.abc import Sequence

from torch import Tensor

from ipman_rs import BodyTemplate, MassProperties
from ipman_rs.checks import body_template
from ipman_rs.volume import densities, unpack_mass_properties

from .dispatch import evaluate


def part_volumes(vertices: Tensor, template: BodyTemplate) -> Tensor:
    """Volume of each closed part: vertices (..., V, 3) -> (..., P), m³."""
    return evaluate(vertices, template, None, "part_volumes", (), (body_template(template).num_parts,))


def mass_properties(
    vertices: Tensor, template: BodyTemplate, density: float | Sequence[float] = 985.0
) -> MassProperties:
    """Volume, mass, centre and inertia of the closed body and of its parts, by signed integrals: vertices (..., V, 3).

    The fields of the result are tensors. density: kg/m³, one for all parts or one a part.

    Raises:
        ValueError: as many densities as neither one nor the parts, or one that is not positive.
    """
    rows = evaluate(
        vertices, template, None, "mass_properties", densities(density, template), (1 + template.num_parts, 14)
    )
    return unpack_mass_properties(rows)
