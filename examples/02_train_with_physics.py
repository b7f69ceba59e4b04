"""The losses in an optimisation: a body that leans and floats comes down on the floor and upright (needs torch).

A trainer does the same with its network's output in place of `predict`. Run:

    python examples/02_train_with_physics.py
"""

from __future__ import annotations

import math

import torch

import ipman_rs as ip
import ipman_rs.torch as ipt

body = ipt.BodyModel("anny-lite")
floor = ipt.Ground.y_up()
standing = torch.as_tensor(ip.body.poses.pose("standing"), dtype=torch.float32)  # (24, 3), the pelvis first

# The pose of the limbs is right; orientation and place are not: 22 degrees off the vertical, 10 cm above the floor.
orientation = torch.tensor([math.radians(20), 0.0, math.radians(10)])
place = torch.tensor([0.0, 0.1 - body(standing).vertices[:, 1].min().item(), 0.0])


def predict() -> torch.Tensor:
    """Vertices (V, 3) of the present guess."""
    return body(torch.cat([orientation[None], standing[1:]]), transl=place).vertices


def report(step: int, terms: dict[str, torch.Tensor]) -> None:
    with torch.no_grad():
        vertices, joints = predict(), body(torch.cat([orientation[None], standing[1:]])).joints
        spine = joints[12] - joints[0]  # pelvis to neck
        tilt = math.degrees(torch.acos(spine[1] / spine.norm()))
        margin = ipt.support_margin(vertices, body.template, floor)
        numbers = ", ".join(f"{name} {value:.4f}" for name, value in terms.items())
        print(f"step {step:3d}: tilt {tilt:4.1f} degrees, lowest point {vertices[:, 1].min() * 1e3:+4.0f} mm, "
              f"margin {margin * 1e3:+4.0f} mm; {numbers}")  # fmt: skip


# The presets' weights fit beside the other losses of a trainer; alone, the three terms may weigh the same.
loss = ipt.IntuitivePhysicsLoss(body.template, "paper-r", weights={"stability": 1.0, "pull": 1.0, "push": 1.0})
optimizer = torch.optim.Adam([orientation.requires_grad_(), place.requires_grad_()], lr=0.01)
for step in range(101):
    total, terms = loss.weighted(predict(), floor)  # the terms are detached, for the log
    if step % 20 == 0:
        report(step, terms)
    optimizer.zero_grad()
    total.backward()
    optimizer.step()
