"""glTF files written by hand, as their specification has them."""

from __future__ import annotations

import base64
import json
import struct
from typing import Any

import numpy as np

KINDS = {"b": 5120, "B": 5121, "h": 5122, "H": 5123, "I": 5125, "f": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Gltf:
    """A scene of node 0; `json` may be changed before it is written."""

    def __init__(self, nodes: list[dict[str, Any]], **rest: Any) -> None:
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes,
            "accessors": [], "bufferViews": [], **rest,
        }  # fmt: skip
        self.buffer = b""

    def view(self, content: bytes, **rest: Any) -> int:
        self.buffer += b"\0" * (-len(self.buffer) % 4)
        self.json["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(content), **rest}
        )
        self.buffer += content
        return len(self.json["bufferViews"]) - 1

    def array(self, values: Any, kind: str = "f", padding: int = 0, **rest: Any) -> int:
        """An accessor of rows; `padding` bytes behind each row make its stride."""
        rows = np.asarray(values)
        rows = rows.reshape(len(rows), -1)
        packed = [row.astype(f"<{np.dtype(kind).str[1:]}").tobytes() + b"\xee" * padding for row in rows]
        stride = {"byteStride": len(packed[0])} if padding else {}
        view = self.view(b"".join(packed), **stride)
        return self.accessor(len(rows), kind, rows.shape[1], bufferView=view, **rest)

    def accessor(self, count: int, kind: str, width: int, **rest: Any) -> int:
        self.json["accessors"].append({"componentType": KINDS[kind], "count": count, "type": TYPES[width], **rest})
        return len(self.json["accessors"]) - 1

    def sparse(self, rows: Any, values: Any, count: int) -> int:
        """An accessor of zeros but for some rows."""
        indices, content = self.view(np.asarray(rows, "<u2").tobytes()), self.view(np.asarray(values, "<f4").tobytes())
        where, what = {"bufferView": indices, "componentType": 5123}, {"bufferView": content}
        return self.accessor(count, "f", 3, sparse={"count": len(rows), "indices": where, "values": what})

    def glb(self) -> bytes:
        document = {"buffers": [{"byteLength": len(self.buffer)}], **self.json}
        words = json.dumps(document).encode()
        words += b" " * (-len(words) % 4)
        binary = self.buffer + b"\0" * (-len(self.buffer) % 4)
        chunks = (
            struct.pack("<II", len(words), 0x4E4F534A) + words + struct.pack("<II", len(binary), 0x004E4942) + binary
        )
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def gltf(self, uri: str | None = None) -> bytes:
        uri = uri or "data:application/octet-stream;base64," + base64.b64encode(self.buffer).decode()
        return json.dumps({**self.json, "buffers": [{"byteLength": len(self.buffer), "uri": uri}]}).encode()


def of(vertices: np.ndarray, faces: np.ndarray, node: dict[str, Any] | None = None, **primitive: Any) -> Gltf:
    """One mesh in one node; more of its primitive by name."""
    file = Gltf([{"mesh": 0, **(node or {})}])
    attributes = {"POSITION": file.array(vertices)}
    corners = file.array(np.asarray(faces).reshape(-1), "I")
    file.json["meshes"] = [
        {"name": "body", "primitives": [{"attributes": attributes, "indices": corners, **primitive}]}
    ]
    return file
