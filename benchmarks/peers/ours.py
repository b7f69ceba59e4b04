"""(d) The compiled core, through the public torch API."""

from __future__ import annotations

import torch
from torch import Tensor

import ipman_rs.torch as ipt
from ipman_rs import BodyTemplate


class Ours:
    def __init__(self, template: BodyTemplate, preset: str = "paper-r") -> None:
        self.mean = ipt.IntuitivePhysicsLoss(template, preset)
        self.each = ipt.IntuitivePhysicsLoss(template, preset, reduction="none")
        self.ground = ipt.Ground.y_up()

    def terms(self, vertices: Tensor) -> Tensor:
        return torch.stack(list(self.each(vertices, self.ground).values()))

    def weighted(self, vertices: Tensor) -> Tensor:
        return self.mean.weighted(vertices, self.ground)[0]
