"""The same fall in MuJoCo, with its own collision of the convex hull and a plane."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from ..gravity import GRAVITY
from .drop import Array, UprightDrop

mj: Any = mujoco  # compiled, without types
SUBSTEPS = 4  # of a step: with whole ones of 1/240 s its soft contacts tip one in ten bodies near their limit


def run(drop: UprightDrop, looks: Sequence[int], step: float, friction: float) -> list[tuple[Array, Array]]:
    """Centre (3,) and rotation (3, 3) at the start and after `looks` steps."""
    model = _model(drop, step / SUBSTEPS, friction)
    state = mj.MjData(model)
    mj.mj_forward(model, state)
    places = [_place(state)]
    done = 0
    for look in looks:
        mj.mj_step(model, state, SUBSTEPS * (look - done))
        done = look
        places.append(_place(state))
    return places


def _place(state: Any) -> tuple[Array, Array]:
    rotation = np.empty(9)
    mj.mju_quat2Mat(rotation, state.qpos[3:7])
    return state.qpos[:3].copy(), rotation.reshape(3, 3)


def _model(drop: UprightDrop, step: float, friction: float) -> Any:
    spec = mj.MjSpec()
    spec.option.timestep = step
    spec.option.gravity = [0.0, 0.0, -GRAVITY]
    spec.option.integrator = mj.mjtIntegrator.mjINT_IMPLICITFAST
    surface = {"friction": [friction, 0.0, 0.0], "condim": 3, "solref": [4 * step, 1.0]}
    spec.worldbody.add_geom(type=mj.mjtGeom.mjGEOM_PLANE, size=[0.0, 0.0, 1.0], **surface)
    spec.add_mesh(name="hull", uservert=drop.points.ravel())
    i = drop.inertia
    body = spec.worldbody.add_body(
        pos=drop.start, mass=drop.mass, ipos=[0.0, 0.0, 0.0], explicitinertial=True,
        fullinertia=[i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]],
    )  # fmt: skip
    body.add_freejoint()
    body.add_geom(type=mj.mjtGeom.mjGEOM_MESH, meshname="hull", mass=0.0, **surface)
    return spec.compile()
