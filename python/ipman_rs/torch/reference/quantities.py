"""From a quantity's name to its formula: the one list that a new quantity joins."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor

from ipman_rs.quantities import TERMS as DESCRIBED

from ..ground import Ground
from .balance import balance_cost
from .closing_volume import part_volumes
from .ground import ground_loss
from .mass import center_of_mass, mass_properties
from .posed import Posed
from .pressure import center_of_pressure, pressure
from .sampling import sample_surface
from .stability import stability_loss
from .support import support_margin
from .topology import topology

if TYPE_CHECKING:
    from ipman_rs import BodyTemplate
    from ipman_rs.quantities import Quantity

Formula = Callable[..., Tensor]


def evaluate(template: BodyTemplate, quantity: Quantity, vertices: Tensor, normal: Tensor, height: Tensor) -> Tensor:
    """`quantity` of each body by plain torch: vertices (B, V, 3), normal (B, 3), height (B,) -> (B, K).

    A body with a non-finite vertex gives NaN with gradient 0 and leaves the others alone.
    """
    formula = FORMULAS[quantity.name]
    finite = vertices.isfinite().all(dim=-1).all(dim=-1)
    rest = topology(template, vertices.device).rest_vertices.to(vertices.dtype)
    body = Posed(torch.where(finite[:, None, None], vertices, rest), template)
    # Autocast would turn the sums of products below into half precision.
    with torch.autocast(vertices.device.type, enabled=False):
        values = formula(body, Ground.of_unit(normal, height), quantity.options, *quantity.modes)
    return torch.where(finite[:, None], values, torch.nan)


def _column(formula: Formula, *args: Any) -> Tensor:
    """One number a body as (B, 1)."""
    return formula(*args)[:, None]


def _pull_and_push(*args: Any) -> Tensor:
    return torch.stack(ground_loss(*args), dim=-1)


FORMULAS: dict[str, Formula] = {
    "part_volumes": lambda body, _, __: part_volumes(body),
    "mass_properties": lambda body, _, density: mass_properties(body, density).flatten(1),
    "sample_surface": lambda body, _, __: sample_surface(body).flatten(1),
    "center_of_mass": lambda body, _, __, method: center_of_mass(body, method),
    "pressure": lambda body, plane, o: pressure(body, plane, *o),
    "center_of_pressure": lambda body, plane, o: center_of_pressure(body, plane, *o),
    "support_margin": lambda body, plane, o, contact, method: _column(support_margin, body, plane, *o, method, contact),
    "stability_loss": lambda body, plane, o, method: _column(stability_loss, body, plane, *o, method),
    "ground_loss": lambda body, plane, o, points, curve: _pull_and_push(body, plane, *o, points, curve),
    "balance_cost": lambda body, plane, o, wrap, method: _column(balance_cost, body, plane, *o, wrap, method),
    "terms": lambda body, plane, o, *words: _terms(body, plane, o, words),
}

# Of each term that `IntuitivePhysicsLoss` may have, its numbers (B, K).
TERMS: dict[str, Formula] = {
    "stability": FORMULAS["stability_loss"],
    "balance": FORMULAS["balance_cost"],
    "ground": FORMULAS["ground_loss"],
}


def _terms(body: Posed, ground: Ground, options: tuple[float, ...], words: tuple[str, ...]) -> Tensor:
    """The numbers of all terms side by side. `words` are each term's name, followed by its modes."""
    columns = []
    while words:
        name, words = words[0], words[1:]
        modes, constants = len(DESCRIBED[name].modes), len(DESCRIBED[name].options)
        columns.append(TERMS[name](body, ground, options[:constants], *words[:modes]))
        words, options = words[modes:], options[constants:]
    return torch.cat(columns, dim=-1)
