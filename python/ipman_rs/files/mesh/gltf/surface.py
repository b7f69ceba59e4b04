"""From the meshes of a glTF scene to one surface: morph targets first, then the skin or else the node's transform."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import text
from ..repair import Mesh
from . import nodes
from .document import DRACO, Document, check_entries

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

TRIANGLES, STRIP, FAN = 4, 5, 6
MOST = 2_000_000  # vertices and corners that nodes may repeat out of a smaller file


def parse(content: bytes, folder: Path) -> Mesh:
    """The scene's meshes joined, in metres. ValueError for damage and for what is not read."""
    return _Scene(Document(content, folder)).mesh()


class _Scene:
    def __init__(self, document: Document) -> None:
        self.document = document
        self.world = nodes.world_matrices(document)
        self.vertices: list[Array] = []
        self.faces: list[Indices] = []
        self.count = 0  # of vertices so far
        self.total = 0  # of vertices and corners so far
        self.names: list[str] = []
        self.morphs: dict[str, float] = {}
        self.idle = 0  # morph targets of weight 0
        self.joints: set[int] = set()
        self.lines = 0  # primitives without faces
        self.unskinned: list[str] = []

    def mesh(self) -> Mesh:
        shown = [index for index in nodes.in_scene(self.document) if "mesh" in self.document.one("nodes", index)]
        for index in shown:
            self._add(index)
        vertices = np.concatenate(self.vertices) if self.vertices else np.empty((0, 3))
        faces = np.concatenate(self.faces) if self.faces else np.empty((0, 3), np.int64)
        return Mesh(vertices, faces, notes=tuple(self._notes(shown)))

    def _add(self, index: int) -> None:
        """The mesh of a node, with what the node does to it."""
        node = self.document.one("nodes", index)
        mesh = self.document.one("meshes", node["mesh"])
        name = str(mesh.get("name") or node.get("name") or f"mesh {node['mesh']}")
        self.names.append(name)
        weights = node.get("weights", mesh.get("weights", []))
        starts: dict[str, int] = {}  # primitives may share their vertices
        for primitive in check_entries("primitives", mesh["primitives"]):
            mode = primitive.get("mode", TRIANGLES)
            if mode not in (TRIANGLES, STRIP, FAN):
                self.lines += 1
                continue
            attributes = primitive["attributes"]
            key = json.dumps([attributes, primitive.get("targets")], sort_keys=True)
            positions = self._positions(primitive)
            corners = self._corners(primitive, len(positions))
            self.total += len(corners) + (0 if key in starts else len(positions))
            if self.total > max(MOST, self.document.size):
                raise ValueError(f"its nodes repeat meshes to over {MOST} vertices; export one person")
            if key not in starts:
                starts[key] = self.count
                points = self._morphed(positions, primitive, weights, mesh)
                self.vertices.append(self._placed(points, attributes, index, name))
                self.count += len(points)
            faces = _triangles(corners, mode)
            if "skin" not in node and np.linalg.det(self.world[index][:3, :3]) < 0:
                faces = faces[:, ::-1]  # mirrored: the specification turns the winding
            self.faces.append(faces + starts[key])

    def _positions(self, primitive: dict[str, Any]) -> Array:
        accessors = [primitive["attributes"].get("POSITION"), primitive.get("indices")]
        if DRACO in primitive.get("extensions", {}) and any(
            one is not None and "bufferView" not in self.document.one("accessors", one) for one in accessors
        ):
            raise ValueError("it is compressed with Draco; export it without compression")
        return _of_width(self.document.array(accessors[0]), 3, "POSITION").astype(np.float64)

    def _corners(self, primitive: dict[str, Any], count: int) -> Indices:
        """The vertex of each corner."""
        if "indices" not in primitive:
            return np.arange(count)
        corners = _of_width(self.document.array(primitive["indices"]), 1, "indices")[:, 0]
        if corners.dtype.kind != "i" or corners.min() < 0 or corners.max() >= count:
            raise ValueError(f"a face names a vertex outside of its mesh's {count}")
        return corners

    def _morphed(self, points: Array, primitive: dict[str, Any], weights: list[float], mesh: dict[str, Any]) -> Array:
        """With the morph targets added by their weights."""
        targets = check_entries("targets", primitive.get("targets", []))
        if targets and len(weights) not in (0, len(targets)):
            raise ValueError(f"it has {len(weights)} weights for {len(targets)} morph targets")
        extras = mesh.get("extras")
        names = extras.get("targetNames") if isinstance(extras, dict) else None
        names = names if isinstance(names, list) else []  # free text of programs, which is no reason to refuse a mesh
        for k, target in enumerate(targets):
            weight = float(weights[k]) if weights else 0.0
            if not np.isfinite(weight):
                raise ValueError(f"the weight of morph target {k} is {weight}; expected a finite number")
            if weight == 0.0:
                self.idle += 1
            elif "POSITION" in target:
                points = points + weight * _like(self.document.array(target["POSITION"]), points, "a morph target")
                self.morphs[str(names[k]) if k < len(names) else f"target {k}"] = weight
        return points

    def _placed(self, points: Array, attributes: dict[str, int], index: int, name: str) -> Array:
        """In the world: by the joints of the node's skin, which leave the node's own transform out, or by the node."""
        skin = self.document.one("nodes", index).get("skin")
        if skin is None or "JOINTS_0" not in attributes:
            if skin is not None or "JOINTS_0" in attributes:
                self.unskinned.append(name)
            return nodes.transform(points, self.world[index])
        return self._skinned(points, attributes, self.document.one("skins", skin))

    def _skinned(self, points: Array, attributes: dict[str, int], skin: dict[str, Any]) -> Array:
        """Σ w · (joint's world matrix · its inverse bind matrix) · point, the weights scaled to a sum of one."""
        joints = skin["joints"]
        matrices = np.stack([self._world(joint) for joint in joints])
        if "inverseBindMatrices" in skin:
            inverse = _of_width(self.document.array(skin["inverseBindMatrices"]), 16, "inverseBindMatrices")
            if len(inverse) < len(joints):
                raise ValueError(f"its skin has {len(inverse)} inverse bind matrices for {len(joints)} joints")
            matrices = matrices @ inverse[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
        self.joints.update(joints)
        blended, total = np.zeros((len(points), 3, 4)), np.zeros(len(points))
        for k in range(sum(key.startswith("JOINTS_") for key in attributes)):
            numbers = _of_width(self.document.array(attributes[f"JOINTS_{k}"]), 4, f"JOINTS_{k}")
            weights = _of_width(self.document.array(attributes[f"WEIGHTS_{k}"]), 4, f"WEIGHTS_{k}")
            if not len(numbers) == len(weights) == len(points) or weights.dtype.kind != "f":
                raise ValueError("its skin weights do not fit its vertices")
            used = np.where(weights != 0, numbers, 0).astype(np.int64)
            if used.min() < 0 or used.max() >= len(joints):
                raise ValueError(f"a vertex names joint {used.max()} of its skin's {len(joints)}")
            for column in range(4):
                blended += weights[:, column, None, None] * matrices[used[:, column], :3]
                total += weights[:, column]
        if not (total > 0).all():
            loose = text.count_of(int((~(total > 0)).sum()), "vertex has", "vertices have")
            raise ValueError(f"{loose} no skin weights; weight them, or export the posed mesh without its skin")
        return nodes.transform(points, blended / total[:, None, None])

    def _world(self, joint: Any) -> Array:
        self.document.one("nodes", joint)
        return self.world[joint]

    def _notes(self, shown: list[int]) -> list[str]:
        """What was joined, applied and left out."""
        document, notes = self.document, []
        if len(self.names) > 1:
            notes.append(f"{len(self.names)} meshes are joined: {text.list_names(self.names)}")
        if self.joints:
            notes.append(f"skin: posed by {text.count_of(len(self.joints), 'joint')} of the file")
        if self.morphs:
            weights = [f"{name} {weight:g}" for name, weight in self.morphs.items()]
            notes.append(f"morph targets applied: {text.list_names(weights)}")
        if self.idle:
            notes.append(f"{text.count_of(self.idle, 'morph target')} of weight 0")
        if self.unskinned:
            notes.append(f"without a whole skin, so placed by the node alone: {text.list_names(self.unskinned)}")
        if self.lines:
            notes.append(f"{text.count_of(self.lines, 'primitive')} of points or lines left out")
        hidden = {node["mesh"] for node in document.all("nodes") if "mesh" in node} - {
            document.one("nodes", index)["mesh"] for index in shown
        }
        if hidden:
            names = [document.one("meshes", mesh).get("name", f"mesh {mesh}") for mesh in sorted(hidden)]
            notes.append(f"outside of the scene and left out: {text.list_names(names)}")
        if len(document.all("scenes")) > 1:
            notes.append(f"one of {len(document.all('scenes'))} scenes is read")
        animations = [one.get("name", f"animation {k}") for k, one in enumerate(document.all("animations"))]
        if animations:
            notes.append(f"the pose of the nodes is read; animations left out: {text.list_names(animations)}")
        if any("EXT_mesh_gpu_instancing" in node.get("extensions", {}) for node in document.all("nodes")):
            notes.append("instances by EXT_mesh_gpu_instancing left out")
        return notes


def _triangles(corners: Indices, mode: int) -> Indices:
    """(F, 3) of a list, strip or fan of triangles."""
    if mode == TRIANGLES:
        if len(corners) % 3:
            raise ValueError(f"it has {len(corners)} corners, which are no whole triangles")
        return corners.reshape(-1, 3)
    k = np.arange(max(len(corners) - 2, 0))
    if mode == STRIP:
        return corners[np.stack([k, k + 1 + k % 2, k + 2 - k % 2], axis=1)]
    return corners[np.stack([k + 1, k + 2, 0 * k], axis=1)]


def _of_width(values: NDArray[Any], width: int, name: str) -> NDArray[Any]:
    if values.shape[1] != width:
        raise ValueError(f"{name} has {values.shape[1]} numbers for each; expected {width}")
    return values


def _like(values: NDArray[Any], points: Array, name: str) -> NDArray[Any]:
    if values.shape != points.shape:
        raise ValueError(f"{name} has {len(values)} vertices for {len(points)}")
    return values
