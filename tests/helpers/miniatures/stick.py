"""A person of sticks in metres, a camera, and its pixels, in plain loops: what the miniature files are filled with."""

from __future__ import annotations

import math

FIGURE = {  # right, up, forward from the point between the feet, m; the person's left is at -right
    "ankle": (0.12, 0.08, 0.0), "knee": (0.12, 0.50, 0.03), "hip": (0.10, 0.92, 0.0), "wrist": (0.45, 0.85, 0.15),
    "elbow": (0.38, 1.12, 0.02), "shoulder": (0.20, 1.42, 0.0), "eye": (0.03, 1.64, 0.10), "ear": (0.08, 1.62, 0.0),
    "foot": (0.13, 0.03, 0.12), "collar": (0.08, 1.38, 0.0), "hand": (0.47, 0.78, 0.20),
}  # fmt: skip
MIDDLE = {
    "neck": (0.0, 1.48, 0.0), "head_top": (0.0, 1.75, 0.0), "pelvis": (0.0, 0.95, 0.0), "thorax": (0.0, 1.40, 0.0),
    "spine": (0.0, 1.15, 0.0), "jaw": (0.0, 1.52, 0.06), "head": (0.0, 1.65, 0.02), "nose": (0.0, 1.60, 0.12),
    "spine1": (0.0, 1.05, 0.0), "spine2": (0.0, 1.18, 0.0), "spine3": (0.0, 1.25, 0.0),
}  # fmt: skip


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    length = math.sqrt(sum(x * x for x in a))
    return [x / length for x in a]


def axes(up, heading):
    """Right, up and forward of a person who stands along `up` and is turned by `heading` radians about it."""
    start = [1.0, 0.0, 0.0] if abs(up[0]) < 0.5 else [0.0, 1.0, 0.0]
    side = unit(cross(start, up))
    front = cross(up, side)
    forward = [math.cos(heading) * s + math.sin(heading) * f for s, f in zip(side, front, strict=True)]
    return cross(forward, up), list(up), forward


def joint(name, feet, up, heading):
    """Where the joint of that name is, in the world, of a person whose feet stand at `feet`."""
    side, _, part = name.partition("_")
    if name in MIDDLE:
        x, y, z = MIDDLE[name]
    else:
        x, y, z = FIGURE[part]
        x = x if side == "right" else -x
    right, upward, forward = axes(up, heading)
    return [feet[i] + x * right[i] + y * upward[i] + z * forward[i] for i in range(3)]


def camera(eye, target, up):
    """R, rows right, down and forward, and t of X_c = R X_w + t, of a camera at `eye` that looks at `target`."""
    forward = unit([b - a for a, b in zip(eye, target, strict=True)])
    right = unit(cross(forward, up))
    down = cross(forward, right)
    rotation = [right, down, forward]
    return rotation, [-sum(row[i] * eye[i] for i in range(3)) for row in rotation]


def seen(point, rotation, translation):
    """The point in the camera's axes."""
    return [sum(rotation[i][j] * point[j] for j in range(3)) + translation[i] for i in range(3)]


def pixel(point, rotation, translation, focal, centre):
    """Where a pinhole of that focal length sees the point, in pixels."""
    x, y, z = seen(point, rotation, translation)
    return [focal * x / z + centre[0], focal * y / z + centre[1]]


def box(points, factor=1.2):
    """Centre, and side / 200, of the square about the points."""
    low = [min(p[i] for p in points) for i in range(2)]
    high = [max(p[i] for p in points) for i in range(2)]
    return [(low[i] + high[i]) / 2 for i in range(2)], factor * max(high[i] - low[i] for i in range(2)) / 200


def root(up, heading):
    """The rotation vector that turns SMPL's rest (y up, facing z, its left at x) into that stance."""
    from scipy.spatial.transform import Rotation

    right, upward, forward = axes(up, heading)
    matrix = [[-right[i], upward[i], forward[i]] for i in range(3)]
    return Rotation.from_matrix(matrix).as_rotvec().tolist()
