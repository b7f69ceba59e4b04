"""The nodes of a glTF file: where each lies in the world, and which the scene shows."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .document import Document

Array = NDArray[np.float64]


def in_scene(document: Document) -> list[int]:
    """The nodes of the file's scene, parents before children; of all where it has no scene."""
    scenes = document.all("scenes")
    roots = document.one("scenes", document.json.get("scene", 0)).get("nodes", []) if scenes else _roots(document)
    return _descendants(document, roots)


def world_matrices(document: Document) -> dict[int, Array]:
    """(4, 4) of each node, also of those outside the scene: joints may lie there."""
    nodes = document.all("nodes")
    world: dict[int, Array] = {}
    parents = {child: k for k, node in enumerate(nodes) for child in node.get("children", [])}
    for index in _descendants(document, _roots(document)):
        own = _matrix(nodes[index], index)
        world[index] = world[parents[index]] @ own if index in parents else own
    return world


def transform(points: Array, matrix: Array) -> Array:
    """(N, 3) by a matrix (4, 4), or one for each point (N, 3, 4), in the same sums: equal points stay equal."""
    columns = [matrix[..., :3, k] for k in range(4)]
    x, y, z = (points[:, k, None] for k in range(3))
    return x * columns[0] + y * columns[1] + z * columns[2] + columns[3]


def _roots(document: Document) -> list[int]:
    nodes = document.all("nodes")
    children = {child for node in nodes for child in node.get("children", [])}
    roots = [index for index in range(len(nodes)) if index not in children]
    if nodes and len(_descendants(document, roots)) < len(nodes):
        raise ValueError("its nodes form a circle")
    return roots


def _descendants(document: Document, roots: list[int]) -> list[int]:
    """Depth first, in the file's order. ValueError for a node that is reached twice."""
    order: list[int] = []
    visited: set[int] = set()
    stack = list(reversed(roots))
    while stack:
        index = stack.pop()
        node = document.one("nodes", index)
        if index in visited:
            raise ValueError(f"its node {index} has two parents or is its own")
        visited.add(index)
        order.append(index)
        stack.extend(reversed(node.get("children", [])))
    return order


def _matrix(node: dict[str, Any], index: int) -> Array:
    """(4, 4) of a node in its parent: its own matrix, or translation · rotation · scale."""
    if "matrix" in node:
        return _vector(node, "matrix", 16, index).reshape(4, 4).T
    matrix = np.eye(4)
    if "rotation" in node:
        quaternion = _vector(node, "rotation", 4, index)
        length = np.sqrt((quaternion**2).sum())
        if not 0.5 < length < 2.0:
            raise ValueError(f"the rotation of its node {index} is no unit quaternion")
        x, y, z, w = quaternion / length
        matrix[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    if "scale" in node:
        matrix[:3, :3] *= _vector(node, "scale", 3, index)
    if "translation" in node:
        matrix[:3, 3] = _vector(node, "translation", 3, index)
    return matrix


def _vector(node: dict[str, Any], name: str, size: int, index: int) -> Array:
    values = np.array(node[name], np.float64)
    if values.shape != (size,) or not np.isfinite(values).all():
        raise ValueError(f"the {name} of its node {index} are not {size} finite numbers")
    return values
