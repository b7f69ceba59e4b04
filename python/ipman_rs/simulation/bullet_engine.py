"""The same fall in Bullet (`pybullet`)."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pybullet

from ..gravity import GRAVITY
from .drop import Array, UprightDrop

RADIUS = 1e-4  # m


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
    """Tiny balls at the corners: of a hull Bullet keeps four contacts at a time, and bodies tip over the corners that
    these cut off. Only a file may have so many, in short lines."""
    balls = "".join(
        f'<collision><origin xyz="{x!r} {y!r} {z!r}"/><geometry><sphere radius="{RADIUS}"/></geometry></collision>\n'
        for x, y, z in (drop.points @ principal).tolist()
    )
    x, y, z = moments.tolist()
    inertia = f'<inertia ixx="{x!r}" iyy="{y!r}" izz="{z!r}" ixy="0" ixz="0" iyz="0"/>'
    link = f'<link name="body">\n<inertial><mass value="{drop.mass!r}"/>{inertia}</inertial>\n{balls}</link>'
    start = drop.start + [0.0, 0.0, RADIUS]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "body.urdf"
        file.write_text(f'<robot name="body">\n{link}\n</robot>\n')
        body = pybullet.loadURDF(
            str(file), start.tolist(), _quaternion(principal), flags=pybullet.URDF_USE_INERTIA_FROM_FILE,
            physicsClientId=client,
        )  # fmt: skip
    pybullet.changeDynamics(
        body, -1, lateralFriction=friction, restitution=0, linearDamping=0, angularDamping=0,
        activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING, physicsClientId=client,
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
