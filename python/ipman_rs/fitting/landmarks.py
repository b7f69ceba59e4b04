"""Named points of a body: its joints, points of its skin, and midpoints.

Posing them costs microseconds: a body model is cut down to the few vertices that are asked for.

Joints have the names of the body model (`left_knee`, `head`, `left_index1`, ...), points of the skin those of `surface`
and, optionally, of `sites` that the caller brings (markers). `mid_hip` and `mid_shoulder` are midpoints of joints;
keypoint sets call the latter "neck", which here is the joint of that name.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping

import numpy as np
import torch
from torch import Tensor

import ipman_rs.torch as ipt
from ipman_rs.body import BodyModel

from ..body.landmarks import FINGERTIPS, MIDPOINTS, SIDES, ends, skin_points
from ..body.sites import Inner, Point, Site

# Joints of fingers, their tips, and the knuckles of `surface`.
HAND_POINTS = frozenset(
    f"{side}_{finger}{end}" for side in SIDES for finger in FINGERTIPS for end in ("", "1", "2", "3", "_tip")
)


class Landmarks:
    """The points `names` of bodies of one model, all of `known(body)` if None.

    `sites`: further points by name, or other names for points. ValueError for a name that the body does not have.
    """

    def __init__(
        self,
        body: ipt.BodyModel,
        names: Iterable[str] | None = None,
        sites: Mapping[str, Point] | None = None,
    ):
        full, sites = body.body, sites or {}
        self.names = landmark_names(full, sites) if names is None else tuple(names)
        skin: dict[str, Site | Inner] = {
            name: Site(vertex) for name, vertex in skin_points(full).items() if name not in full.joint_names
        }
        skin |= {name: site for name, site in sites.items() if not isinstance(site, str)}
        meant = [site if isinstance(site := sites.get(name), str) else name for name in self.names]
        pairs = ends(meant, dict.fromkeys([*full.joint_names, *skin]), full.name)
        used = list(dict.fromkeys(name for pair in pairs for name in pair if name in skin))
        rows = {name: row for row, name in enumerate(used)}
        rows |= {name: max(len(used), 1) + j for j, name in enumerate(full.joint_names) if name not in rows}
        device = body.v_template.device
        self.num_betas = full.num_betas
        self.points = ipt.BodyModel(_cut(full, [skin[name] for name in used] or [Site(0)]), body.dtype).to(device)
        self.ends = [torch.tensor([rows[pair[end]] for pair in pairs], device=device) for end in (0, 1)]

    def __call__(
        self,
        full_pose: Tensor,
        betas: Tensor | None = None,
        transl: Tensor | None = None,
        expression: Tensor | None = None,
    ) -> Tensor:
        """The points (B, K, 3) m of bodies with `full_pose` (B, J, 3), `betas` (B, b), `transl` (B, 3) and `expression`
        (B, E)."""
        posed = self.points(full_pose, self._shape(betas, expression), transl)
        points = torch.cat([posed.vertices, posed.joints], dim=-2)
        return 0.5 * (points.index_select(-2, self.ends[0]) + points.index_select(-2, self.ends[1]))

    def jacobian(self, full_pose: Tensor, betas: Tensor, expression: Tensor | None = None) -> Tensor:
        """The points' derivatives (B, P, K, 3) by the rotation vectors (3 J), the betas and the expression; no
        gradient. That by the translation is the identity."""
        body, shape = self.points.body, self._shape(betas, expression)
        assert shape is not None
        bodies, angles = len(full_pose), full_pose[0].numel()
        jacobian = full_pose.new_empty(bodies, angles + shape.shape[1], body.num_vertices + body.num_joints, 3)
        skin = body._skin(np.float32 if full_pose.dtype == torch.float32 else np.float64)
        pose, shape = full_pose.detach().contiguous(), shape.detach().contiguous()
        skin.jacobian(bodies, (pose.numpy(), shape.numpy(), None, None), jacobian.numpy())
        if expression is not None:
            asked = [jacobian[:, : angles + betas.shape[1]], jacobian[:, angles + self.num_betas :]]
            jacobian = torch.cat(asked, dim=1)
        return 0.5 * (jacobian.index_select(-2, self.ends[0]) + jacobian.index_select(-2, self.ends[1]))

    def _shape(self, betas: Tensor | None, expression: Tensor | None) -> Tensor | None:
        """What moves the cut body's shape: the betas, all of them where expressions follow."""
        if expression is None:
            return betas
        betas = expression.new_zeros(len(expression), 0) if betas is None else betas
        return torch.cat([betas, betas.new_zeros(len(betas), self.num_betas - betas.shape[1]), expression], dim=1)


def landmark_names(body: BodyModel, sites: Iterable[str] = ()) -> tuple[str, ...]:
    """All names that a body has."""
    return tuple(dict.fromkeys([*body.joint_names, *MIDPOINTS, *skin_points(body), *sites]))


def _cut(body: BodyModel, points: list[Site | Inner]) -> BodyModel:
    """The body with these points for vertices, and no faces; its expressions are further betas."""
    rows = np.array([point.vertex if isinstance(point, Site) else 0 for point in points])
    template, shapedirs, weights = body.v_template[rows], body.shapedirs[rows], body.weights[rows]
    expressiondirs = body.expressiondirs[rows]
    posedirs = None if body.posedirs is None else body.posedirs[rows]
    for row, point in enumerate(points):
        if isinstance(point, Site):
            template[row] += point.shift
            continue
        template[row] = point.place
        shapedirs[row] = np.transpose(point.by_betas)
        expressiondirs[row] = 0
        weights[row] = np.array(body.joint_names) == point.joint
        if posedirs is not None:
            posedirs[row] = 0
    return dataclasses.replace(
        body,
        name=f"{body.name}, {len(rows)} points",
        v_template=template,
        shapedirs=np.concatenate([shapedirs, expressiondirs], axis=-1),
        expressiondirs=expressiondirs[..., :0],
        posedirs=posedirs,
        J_shapedirs=np.concatenate([body.J_shapedirs, body.J_expressiondirs], axis=-1),
        J_expressiondirs=body.J_expressiondirs[..., :0],
        weights=weights,
        faces=np.zeros((0, 3), np.int64),
    )
