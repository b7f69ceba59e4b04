"""The same fall in Bullet (`pybullet`), with its own collision of the convex hull and a plane."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pybullet

from .cross_check import Array, UprightDrop
from .solids import GRAVITY

MARGIN = 0.001  # m, by which pybullet rounds the hulls that it is given


def run(drop: UprightDrop, looks: Sequence[int], step: float, friction: float) -> list[tuple[Array, Array]]:
    """Centre (3,) and rotation (3, 3) at the start and after `looks` steps."""
    client = pybullet.connect(pybullet.DIRECT)
    try:
        pybullet.setTimeStep(step, client)
        pybullet.setGravity(0, 0, -GRAVITY, client)
        ground = pybullet.createMultiBody(0, pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client),
                                          physicsClientId=client)  # fmt: skip
        pybullet.changeDynamics(ground, -1, lateralFriction=friction, restitution=0, physicsClientId=client)
        # A body's own axes are its principal ones, for Bullet takes three moments.
        moments, principal = np.linalg.eigh(drop.inertia)
        principal[:, 0] *= np.linalg.det(principal)
        body = _body(client, drop, principal, moments, friction)
        places = [_place(client, body, principal)]
        done = 0
        for look in looks:
            for _ in range(done, look):
                pybullet.stepSimulation(client)
            done = look
            places.append(_place(client, body, principal))
        return places
    finally:
        pybullet.disconnect(client)


def _body(client: int, drop: UprightDrop, principal: Array, moments: Array, friction: float) -> int:
    vertices = (drop.points @ principal).tolist()
    shape = pybullet.createCollisionShape(pybullet.GEOM_MESH, vertices=vertices, physicsClientId=client)
    start = drop.start + [0.0, 0.0, MARGIN]
    body = pybullet.createMultiBody(
        drop.mass, shape, basePosition=start.tolist(), baseOrientation=_quaternion(principal), physicsClientId=client
    )
    pybullet.changeDynamics(
        body, -1, localInertiaDiagonal=moments.tolist(), lateralFriction=friction, restitution=0, linearDamping=0,
        angularDamping=0, activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING, physicsClientId=client,
    )  # fmt: skip
    return body


def _place(client: int, body: int, principal: Array) -> tuple[Array, Array]:
    center, orientation = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
    turned = np.array(pybullet.getMatrixFromQuaternion(orientation)).reshape(3, 3)
    return np.array(center), turned @ principal.T


def _quaternion(rotation: Array) -> list[float]:
    """x, y, z, w."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(rotation).as_quat().tolist()
