"""Every quantity of the paper for a body on the floor, with numpy alone.

Run:

    python examples/01_analyze_a_body.py [POSE]        (tree by default)
"""

from __future__ import annotations

import sys

import numpy as np

import ipman_rs as ip

name = sys.argv[1] if len(sys.argv) > 1 else "tree"
body = ip.load_body("anny")
template = body.template
vertices = ip.body.posed(body, name)  # (V, 3) metres, Y up, its lowest point on the floor
floor = ip.Ground.y_up()

# One call for everything ...
result = ip.analyze(vertices, template, floor, preset="paper-r")
print(f"{name}: {result.volume * 1e3:.1f} litres, {result.mass:.1f} kg at 985 kg/m3")
for part, volume in zip(result.part_names, result.part_volumes, strict=True):
    print(f"  {part:16}{volume * 1e3:6.2f} l")

# ... or one function for each quantity: vertices may have any batch dimensions in front.
com = ip.center_of_mass(vertices, template)
cop = ip.center_of_pressure(vertices, template, floor)
support = ip.base_of_support(vertices, template, floor)
print(f"centre of mass      {np.round(com, 3)} m (exact solid: {np.round(result.center_of_mass_exact, 3)})")
print(f"centre of pressure  {np.round(cop, 3)} m")
print(f"base of support     {support.area * 1e4:.0f} cm2, {len(support.polygon)} corners")
print(f"balanced (BoSE)     {bool(support.inside)}, margin {support.margin * 1e3:+.0f} mm")
print(f"losses              stability {result.stability:.4f} m, pull {result.pull:.4f}, push {result.push:.4f}")

# A batch: the same body leaning further and further forwards.
angles = np.radians(np.arange(0, 30, 5))
zero, one = np.zeros_like(angles), np.ones_like(angles)
turn = np.array([[one, zero, zero], [zero, np.cos(angles), -np.sin(angles)], [zero, np.sin(angles), np.cos(angles)]])
leaning = vertices @ turn.transpose(2, 1, 0)  # (6, V, 3)
leaning[..., 1] -= leaning[..., 1].min(axis=-1, keepdims=True)
margins = ip.support_margin(leaning, template, floor, threshold=0.03)
for angle, margin in zip(np.degrees(angles), margins, strict=True):
    print(f"leaning {angle:2.0f} degrees: margin {margin * 1e3:+5.0f} mm, {'stands' if margin >= 0 else 'falls'}")
