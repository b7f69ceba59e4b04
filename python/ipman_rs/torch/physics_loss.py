"""The terms of a preset as one module: reduced, weighted, with invalid and broken bodies left out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor, nn

from ipman_rs import BodyTemplate, presets, quantities
from ipman_rs import Ground as NumpyGround
from ipman_rs.checks import body_template, choice, not_negative
from ipman_rs.presets import Preset
from ipman_rs.quantities import Curve, Method, Points, Wrap

from . import fused_loss
from .arrays import single_or_double
from .dispatch import bodies, check, forced, values_of, weighted_values_of
from .ground import Ground
from .reduction import Pool, Reduction, mask


class IntuitivePhysicsLoss(nn.Module):
    """The paper's loss terms (Eqs. 4, 6 and 7) over a batch of bodies on a ground.

    preset: a name of ipman_rs.presets, or a Preset. The loss has the terms that it weighs: "stability", "pull" and
        "push"; those of "balanced" are "balance", "pull" and "push".
    reduction: "mean" over the counted bodies, "sum", or "none" (one number a body, 0 for one that does not count).
    weights: {term: λ}; a term left out keeps its weight from the preset.
    points: where the ground terms are taken, "samples" or "vertices"; curve: "tanh_squared" or "tanh_of_square".
    method: centre of mass, as in `center_of_mass`; wrap: as in `balance_cost`.

    A body counts if `valid` says so (or is None) and all its vertices are finite; the others add nothing, to values and
    gradients. When none counts the result is 0 and still has a graph. Half-precision vertices give float32 losses.

    Raises:
        ValueError: unknown preset, reduction, points, curve, method, wrap; or a weight for a term that is not there,
            negative, or no finite number.
        TypeError: the template or a weight is none.
    """

    def __init__(
        self,
        template: BodyTemplate,
        preset: str | Preset = "paper-r",
        reduction: Reduction = "mean",
        weights: Mapping[str, float] | None = None,
        points: Points = "samples",
        curve: Curve = "tanh_squared",
        method: Method = "pcom",
        wrap: Wrap = "log",
    ) -> None:
        super().__init__()
        numbers = preset if isinstance(preset, Preset) else presets.get(preset)
        self._quantity = quantities.physics_terms(numbers, method, points, curve, wrap)
        self.terms = quantities.numbers_of(quantities.terms_of(numbers))
        self._quantity.of(body_template(template))  # which checks the options

        if weights is not None and not isinstance(weights, Mapping):
            raise TypeError(f"weights: expected numbers by the names of terms, got {type(weights).__name__}")
        given = dict(weights or {})
        unknown = sorted(set(given) - set(self.terms), key=str)
        if unknown:
            known = f"preset {numbers.name!r} has the terms {', '.join(self.terms)}"
            raise ValueError(f"weights: {known}, got {', '.join(map(str, unknown))}")
        self.weights = {
            term: not_negative(f"weights: {term}", given.get(term, numbers.weights[term])) for term in self.terms
        }
        self.template = template
        self.preset = numbers.name
        choice("reduction", reduction, Reduction)
        self.reduction: Reduction = reduction

    def extra_repr(self) -> str:
        return f"preset={self.preset!r}, reduction={self.reduction!r}, weights={self.weights}"

    def forward(self, vertices: Tensor, ground: Ground | NumpyGround, valid: Tensor | None = None) -> dict[str, Tensor]:
        """Unweighted terms: vertices (..., V, 3), valid bool (...) -> {name: scalar}, or {name: (...)} unreduced.

        Raises:
            ValueError: wrong shapes, or a ground that does not fit the batch or requires grad.
            TypeError: vertices or valid is no ordinary tensor of its kind, or ground is none.
        """
        if fused_loss.serves(vertices) and not forced():
            terms, shape = self._fused(fused_loss.Terms, vertices, ground, valid)
            return self._by_name(terms.reshape(*shape, len(self.terms)) if self.reduction == "none" else terms)
        batch = bodies(vertices, self.template, ground)
        pool = self._pool(batch.batch_shape, valid, vertices)
        values = values_of(batch, self.template, self._quantity)
        return self._by_name(pool.terms(values, pool.counted(values)))

    def weighted(
        self, vertices: Tensor, ground: Ground | NumpyGround, valid: Tensor | None = None
    ) -> tuple[Tensor, dict[str, Tensor]]:
        """Σ λ · term, differentiable, and the unweighted terms, detached: the trainer's path.

        Values and gradient come from one pass, so the backward only scales; it may be run once more with create_graph
        for second derivatives. Raises as `forward`.
        """
        if fused_loss.serves(vertices) and not forced():
            (total, terms), shape = self._fused(fused_loss.WeightedTotal, vertices, ground, valid)
            if self.reduction == "none":
                total, terms = total.reshape(shape), terms.reshape(*shape, len(self.terms))
            return total, self._by_name(terms)
        batch = bodies(vertices, self.template, ground)
        pool = self._pool(batch.batch_shape, valid, vertices)
        shares = pool.shares(batch.vertices, self._weights())
        totals, values = weighted_values_of(batch, self.template, self._quantity, shares)
        counted = pool.counted(values)
        return pool.total(totals, counted), self._by_name(pool.terms(values, counted))

    def _fused(
        self, function: Any, vertices: Tensor, ground: Ground | NumpyGround, valid: Tensor | None
    ) -> tuple[Any, torch.Size]:
        """A function of `fused_loss` on checked arguments, and the batch shape."""
        shape, plane = check(vertices, self.template, ground)
        vertices = single_or_double(vertices)
        pool = self._pool(shape, valid, vertices)
        if len(shape) != 1:
            plane = Ground.of_unit(plane.normal.expand(*shape, 3), plane.height.expand(shape))
            vertices = vertices.reshape(-1, *vertices.shape[-2:])
        call = fused_loss.Call(self.template, self._quantity, self._weights(), self.reduction)
        return function.apply(vertices, plane, pool.valid, call), shape

    def _pool(self, batch_shape: torch.Size, valid: Tensor | None, vertices: Tensor) -> Pool:
        return Pool(self.reduction, batch_shape, None if valid is None else mask(valid, batch_shape, vertices.device))

    def _weights(self) -> tuple[float, ...]:
        return tuple(self.weights[term] for term in self.terms)

    def _by_name(self, terms: Tensor) -> dict[str, Tensor]:
        """Terms (..., K) by their names."""
        return dict(zip(self.terms, terms.unbind(dim=-1), strict=True))
