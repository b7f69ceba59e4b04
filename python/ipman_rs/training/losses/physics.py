"""The intuitive-physics terms on estimated bodies in the world: λ_s L_stability + λ_g L_ground of Eq. 8."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from torch import Tensor, nn

import ipman_rs.torch as ipt
from ipman_rs import BodyTemplate
from ipman_rs.checks import choice

from ..batch import Batch
from ..posed_estimate import Posed
from ..world import to_world

Counted = Literal["labelled", "world"]


class PhysicsLoss(nn.Module):
    """`ipt.IntuitivePhysicsLoss` of a preset, its weights changed where `weights` says so.

    counted: whose bodies count. "labelled", as the authors' code has it: labelled parameters, and labelled as balanced
    and as touching the ground. "world": all whose camera, hips and ground are known.
    """

    def __init__(
        self,
        template: BodyTemplate,
        preset: str = "paper-r",
        weights: Mapping[str, float] | None = None,
        counted: Counted = "labelled",
    ) -> None:
        super().__init__()
        self.loss = ipt.IntuitivePhysicsLoss(template, preset, weights=weights)
        self.counted = choice("counted", counted, Counted)

    def forward(self, posed: Posed, batch: Batch) -> tuple[Tensor, dict[str, Tensor]]:
        """Σ λ · term, and the terms, unweighted and detached."""
        valid = batch.has_world
        if self.counted == "labelled":
            valid = valid & batch.has_body & batch.standing & batch.contact
        vertices = to_world(posed.vertices, posed.hips(batch.regressed), batch)
        return self.loss.weighted(vertices, batch.ground, valid)
