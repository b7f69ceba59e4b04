"""Bodies that penetrate themselves: two balls pushed into each other, and people with an arm in their trunk."""

from __future__ import annotations

import numpy as np
import trimesh

import ipman_rs as ip

RADIUS = 0.4


def balls(subdivisions=1, radius=RADIUS):
    """Two balls that are 2 m apart at rest, as one template, and the number of vertices of each."""
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    one, faces = np.array(mesh.vertices), np.array(mesh.faces)
    vertices = np.vstack([one, one + [2.0, 0.0, 0.0]])
    return ip.BodyTemplate(vertices, np.vstack([faces, faces + len(one)]), num_samples=10), len(one)


def pushed_together(template, count, step=(-1.4, 0.03, 0.01)):
    """The balls with their centres 2 m + step apart."""
    vertices = template.vertices.copy()
    vertices[count:] += step
    return vertices


def arms_in_trunk(body, count=3):
    """(count, V, 3): standing, the arms bent more and more into the trunk and into each other."""
    pose = np.broadcast_to(ip.body.poses.pose("standing"), (count, 24, 3)).copy()
    turn = np.linspace(0.6, 1.0, count)
    pose[:, 18] += np.stack([0 * turn, -1.9 * turn, 0 * turn], axis=-1)
    pose[:, 19] += np.stack([0 * turn, 1.9 * turn, 0 * turn], axis=-1)
    pose[:, 16, 2] -= 0.5 * turn
    pose[:, 17, 2] += 0.5 * turn
    return body(pose).vertices
