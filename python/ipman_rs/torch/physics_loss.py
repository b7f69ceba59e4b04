"""Stability, pull and push as one module: reduced, weighted, with invalid and broken bodies left out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import torch
from torch import Tensor, nn

from ipman_rs import BodyTemplate, presets
from ipman_rs import Ground as NumpyGround
from ipman_rs.checks import body_template, choice, not_negative
from ipman_rs.losses import Curve, Points, Wrap
from ipman_rs.mass import Method

from . import one_pass
from .arrays import single_or_double
from .dispatch import Bodies, bodies, check, forced, values_of, weighted_values_of
from .ground import Ground

Reduction = Literal["mean", "sum", "none"]


class IntuitivePhysicsLoss(nn.Module):
    """The paper's loss terms (Eqs. 4, 6 and 7) over a batch of bodies on a ground.

    preset: a name of ipman_rs.presets; "balanced" has "balance" in place of "stability".
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
        preset: str = "paper-r",
        reduction: Reduction = "mean",
        weights: Mapping[str, float] | None = None,
        points: Points = "samples",
        curve: Curve = "tanh_squared",
        method: Method = "pcom",
        wrap: Wrap = "log",
    ) -> None:
        super().__init__()
        numbers = presets.get(preset)
        modes = f"{choice('method', method, Method)}.{choice('points', points, Points)}"
        modes = f"{modes}.{choice('curve', curve, Curve)}"
        if numbers.stability == "balance":
            self.terms = ("balance", "pull", "push")
            self._quantity = f"terms.balance.{choice('wrap', wrap, Wrap)}.{modes}"
            first = (numbers.alpha, numbers.balance_gamma, numbers.sigma)
        else:
            self.terms = ("stability", "pull", "push")
            self._quantity = f"terms.stability.{modes}"
            first = (numbers.alpha, numbers.gamma, numbers.epsilon)
        self._options = (*first, numbers.alpha1, numbers.alpha2, numbers.beta1, numbers.beta2)

        body_template(template)
        if weights is not None and not isinstance(weights, Mapping):
            raise TypeError(f"weights: expected numbers by the names of terms, got {type(weights).__name__}")
        given = dict(weights or {})
        unknown = sorted(set(given) - set(self.terms), key=str)
        if unknown:
            raise ValueError(
                f"weights: preset {preset!r} has the terms {', '.join(self.terms)}, got {', '.join(map(str, unknown))}"
            )
        self.weights = {
            term: not_negative(f"weights: {term}", given.get(term, numbers.weights[term])) for term in self.terms
        }
        self.template = template
        self.preset = preset
        self.reduction = choice("reduction", reduction, Reduction)

    def extra_repr(self) -> str:
        return f"preset={self.preset!r}, reduction={self.reduction!r}, weights={self.weights}"

    def forward(self, vertices: Tensor, ground: Ground | NumpyGround, valid: Tensor | None = None) -> dict[str, Tensor]:
        """Unweighted terms: vertices (..., V, 3), valid bool (...) -> {name: scalar}, or {name: (...)} unreduced."""
        if one_pass.serves(vertices) and not forced():
            return self._by_name(*self._in_one_pass(one_pass.Terms, vertices, ground, valid))
        batch = bodies(vertices, self.template, ground)
        values = values_of(batch, self.template, self._quantity, self._options)
        counted = _finite(values.detach())
        if valid is not None:
            counted = counted & _mask(batch.batch_shape, valid, vertices)
        return self._named(values, counted, _number(counted, values), batch)

    def weighted(
        self, vertices: Tensor, ground: Ground | NumpyGround, valid: Tensor | None = None
    ) -> tuple[Tensor, dict[str, Tensor]]:
        """Σ λ · term, differentiable, and the unweighted terms, detached: the trainer's path.

        Values and gradient come from one pass, so the backward only scales; it may be run once more with create_graph
        for second derivatives.
        """
        if one_pass.serves(vertices) and not forced():
            (total, terms), shape = self._in_one_pass(one_pass.WeightedTotal, vertices, ground, valid)
            return total.reshape(shape) if self.reduction == "none" else total, self._by_name(terms, shape)
        batch = bodies(vertices, self.template, ground)
        mask = None if valid is None else _mask(batch.batch_shape, valid, vertices)
        shares = self._shares(batch, mask)
        totals, values = weighted_values_of(batch, self.template, self._quantity, self._options, shares)

        # Broken bodies are known only by their NaN, after the shares of the mean were dealt out: put that right.
        finite = _finite(values)
        counted = finite if mask is None else finite & mask
        number = _number(counted, values)
        totals = torch.where(finite, totals, 0)
        if self.reduction == "none":
            total = totals.reshape(batch.batch_shape)
        elif self.reduction == "sum":
            total = totals.sum()
        else:
            dealt = len(values) if mask is None else mask.sum(dtype=values.dtype)
            total = totals.sum() * (dealt / number)
        return total, self._named(values, counted, number, batch)

    def _in_one_pass(
        self, function: Any, vertices: Tensor, ground: Ground | NumpyGround, valid: Tensor | None
    ) -> tuple[Any, torch.Size]:
        """A function of `one_pass` on checked arguments, and the batch shape."""
        shape, plane = check(vertices, self.template, ground)
        vertices = single_or_double(vertices)
        mask = None if valid is None else _mask(shape, valid, vertices)
        if len(shape) != 1:
            plane = Ground.of_unit(plane.normal.expand(*shape, 3), plane.height.expand(shape))
            vertices = vertices.reshape(-1, *vertices.shape[-2:])
        weights = tuple(self.weights[term] for term in self.terms)
        call = one_pass.Call(self.template, self._quantity, self._options, weights, self.reduction)
        return function.apply(vertices, plane, mask, call), shape

    def _by_name(self, terms: Tensor, shape: torch.Size) -> dict[str, Tensor]:
        """Terms (K,), or (B, K) of a batch shape, by their names."""
        if self.reduction == "none":
            terms = terms.reshape(*shape, len(self.terms))
        return dict(zip(self.terms, terms.unbind(dim=-1), strict=True))

    def _shares(self, batch: Bodies, mask: Tensor | None) -> Tensor:
        """What each term of each body weighs in the total: (B, K)."""
        vertices, weights = batch.vertices, [self.weights[term] for term in self.terms]
        if mask is None:
            if self.reduction == "mean":
                weights = [weight / max(len(vertices), 1) for weight in weights]
            return _row(vertices, weights).expand(len(vertices), len(weights))
        body = mask.to(vertices.dtype)
        if self.reduction == "mean":
            body = body / body.sum().clamp(min=1)
        return body[:, None] * _row(vertices, weights)

    def _named(self, values: Tensor, counted: Tensor, number: Tensor, batch: Bodies) -> dict[str, Tensor]:
        """Reduce values (B, K) over the bodies that count."""
        values = torch.where(counted[:, None], values, 0)
        if self.reduction == "mean":
            values = values.sum(dim=0) / number
        elif self.reduction == "sum":
            values = values.sum(dim=0)
        else:
            values = values.reshape(*batch.batch_shape, len(self.terms))
        return dict(zip(self.terms, values.unbind(dim=-1), strict=True))


def _row(like: Tensor, numbers: list[float]) -> Tensor:
    """Numbers beside a tensor, filled in by kernels on devices: a copy from the host waits, and stops a CUDA graph."""
    if like.device.type == "cpu":
        return torch.tensor(numbers, dtype=like.dtype)  # new_tensor fails beside negative views
    return torch.stack([like.new_full((), number) for number in numbers])


def _finite(values: Tensor) -> Tensor:
    """Bodies (B,) whose values (B, K) are numbers: a body with a broken vertex has NaN in all of them."""
    first = values[:, 0]
    return first == first


def _number(counted: Tensor, values: Tensor) -> Tensor:
    """How many bodies count, at least 1, as a scalar that divides values."""
    return counted.sum(dtype=values.dtype).clamp(min=1)


def _mask(batch_shape: torch.Size, valid: Tensor, vertices: Tensor) -> Tensor:
    """valid (...) as bool (B,) beside the vertices."""
    if not isinstance(valid, Tensor) or valid.is_nested or valid.layout != torch.strided or valid.is_meta:
        raise TypeError(f"valid: expected an ordinary bool tensor, got {type(valid).__name__}")
    if valid.dtype != torch.bool or valid.shape != batch_shape:
        raise ValueError(
            f"valid: expected a bool tensor of shape {tuple(batch_shape)}, one a body, "
            f"got {valid.dtype} of shape {tuple(valid.shape)}"
        )
    return valid.reshape(-1).to(vertices.device)
