"""Volumes of the closed parts, and exact mass properties of the solid."""

from __future__ import annotations

from collections.abc import Sequence

from torch import Tensor

from ipman_rs import BodyTemplate, MassProperties, quantities
from ipman_rs.volume import unpack_mass_properties

from .dispatch import evaluate


def part_volumes(vertices: Tensor, template: BodyTemplate) -> Tensor:
    """Volume of each closed part: vertices (..., V, 3) -> (..., P), m³.

    Raises:
        ValueError: wrong shape.
        TypeError: vertices is no ordinary floating-point tensor, or the template is none.
    """
    return evaluate(vertices, template, None, quantities.part_volumes(template))


def mass_properties(
    vertices: Tensor, template: BodyTemplate, density: float | Sequence[float] = 985.0
) -> MassProperties:
    """Volume, mass, centre and inertia of the closed body and of its parts, by signed integrals: vertices (..., V, 3).

    The fields of the result are tensors. density: kg/m³, one for all parts or one a part.

    Raises:
        ValueError: wrong shapes, or a density that is not positive.
        TypeError: vertices is no ordinary floating-point tensor, or an argument is of the wrong kind.
    """
    return unpack_mass_properties(evaluate(vertices, template, None, quantities.mass_properties(density, template)))
