"""Bodies in static contact, to which the balance and ground terms apply; jumping or tipping ones are exempt."""

from __future__ import annotations

from torch import Tensor

import ipman_rs.torch as ipt
from ipman_rs import BodyTemplate

REACH = 0.10  # m: a body whose lowest point is higher than this above the ground is in the air
LEAN = 0.15  # m: a body whose centre of mass is further than this outside its base of support is falling


def static_mask(
    vertices: Tensor,
    template: BodyTemplate,
    ground: ipt.Ground,
    reach: float = REACH,
    lean: float = LEAN,
) -> Tensor:
    """Whether each body is in static contact, and not in the air or falling: vertices (B, V, 3) -> bool (B,).

    A body that begins inside the ground is judged as if it had been lifted out: depth from one photo is that uncertain.
    A body with a vertex that is not finite counts as not static.
    """
    vertices = vertices.detach()
    batch = vertices.shape[:1]
    lowest = ground.signed_height(vertices).amin(dim=-1)
    level = ground.height.to(vertices).expand(batch) + lowest.clamp(max=0).nan_to_num()
    lifted = ipt.Ground.of_unit(ground.normal.to(vertices).expand(*batch, 3), level)
    margin = ipt.support_margin(vertices, template, lifted)
    return (lowest <= reach) & (margin >= -lean)
