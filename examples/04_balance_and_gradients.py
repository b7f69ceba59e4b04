"""Derivatives: which joint saves the balance; the paper's stability term beside the balance cost (needs torch).

Run: python examples/04_balance_and_gradients.py
"""

from __future__ import annotations

import torch

import ipman_rs as ip
import ipman_rs.torch as ipt

body = ipt.BodyModel("anny-lite", dtype=torch.float64)
floor = ipt.Ground.y_up()

# 1. The margin of stability by every joint's rotation: d margin / d pose, (24, 3), exact, through skinning and hull.
pose = torch.as_tensor(ip.body.poses.pose("one_leg"))
place = torch.tensor([0.0, -body(pose).vertices[:, 1].min(), 0.0], dtype=torch.float64)


def margin(pose: torch.Tensor) -> torch.Tensor:
    return ipt.support_margin(body(pose, transl=place).vertices, body.template, floor, threshold=0.03)


slope = torch.func.jacrev(margin)(pose)
print(f"one_leg: margin {margin(pose) * 1e3:+.1f} mm; what one degree at a joint can change:")
strength = torch.deg2rad(slope.norm(dim=-1)) * 1e3
for joint in strength.argsort(descending=True)[:5]:
    print(f"  {body.body.joint_names[joint]:14} {strength[joint]:.2f} mm")

# 2. One step uphill, predicted and done; a small one, for the margin jumps when a sample joins or leaves the contacts.
step = 1e-4 * slope / slope.norm()
predicted, done = (slope * step).sum(), margin(pose + step) - margin(pose)
print(f"a step of 1e-4 rad uphill: {predicted * 1e6:+.2f} um predicted, {done * 1e6:+.2f} um done")

# 3. A squat leans by (pitch, roll). The paper's term wants the CoM over the CoP, whose place assumes how the load is
#    shared; the balance cost only asks how implausible a load is that balances.
squat = torch.as_tensor(ip.body.posed(body.body, "squat"))


def leaning(angles: torch.Tensor) -> torch.Tensor:
    """The squat turned about the x axis, then the z axis, through a point on the floor: (..., 2) -> (..., V, 3)."""
    (sx, sz), (cx, cz) = angles.sin().unbind(-1), angles.cos().unbind(-1)
    zero, one = torch.zeros_like(sx), torch.ones_like(sx)
    about_x = torch.stack([one, zero, zero, zero, cx, -sx, zero, sx, cx], dim=-1).unflatten(-1, (3, 3))
    about_z = torch.stack([cz, -sz, zero, sz, cz, zero, zero, zero, one], dim=-1).unflatten(-1, (3, 3))
    return squat @ (about_z @ about_x).mT


pitch = torch.deg2rad(torch.arange(-12.0, 13.0, 4.0, dtype=torch.float64))
bodies = leaning(torch.stack([pitch, torch.zeros_like(pitch)], dim=-1))
figures = [f(bodies, body.template, floor) for f in (ipt.stability_loss, ipt.balance_cost, ipt.support_margin)]
for degrees, stability, cost, gap in zip(pitch.rad2deg(), *figures, strict=True):
    lengths = f"stability {stability * 1e3:4.1f} mm, margin {gap * 1e3:+4.0f} mm"
    print(f"pitch {degrees:+3.0f}: {lengths}, balance {cost:.3f} nats")

# 4. Second derivatives: how stiff the balance is against pitch and roll.
upright = torch.zeros(2, dtype=torch.float64)
hessian = torch.func.hessian(lambda angles: ipt.balance_cost(leaning(angles), body.template, floor))(upright)
print("Hessian of the balance cost by (pitch, roll), nats/rad2:", hessian.numpy().round(1).tolist())
