"""A mesh as the bytes of a .glb (glTF 2.0, y up, metres) or .obj file. Importing trimesh would cost more than a fit."""

from __future__ import annotations

import json
import struct

import numpy as np

_FLOAT, _UINT = 5126, 5125
_VERTICES, _FACES = 34962, 34963
_JSON, _BIN = 0x4E4F534A, 0x004E4942


def glb(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    points, corners = vertices.astype("<f4"), faces.astype("<u4")
    body = points.tobytes() + corners.tobytes()
    document = {
        "asset": {"version": "2.0", "generator": "ipman_rs"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(body)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": points.nbytes, "target": _VERTICES},
            {"buffer": 0, "byteOffset": points.nbytes, "byteLength": corners.nbytes, "target": _FACES},
        ],
        "accessors": [
            {
                "bufferView": 0, "componentType": _FLOAT, "count": len(points), "type": "VEC3",
                "min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist(),
            },
            {"bufferView": 1, "componentType": _UINT, "count": corners.size, "type": "SCALAR"},
        ],
    }  # fmt: skip
    text = json.dumps(document, separators=(",", ":")).encode()
    chunks = _chunk(_JSON, text, b" ") + _chunk(_BIN, body, b"\0")
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _chunk(kind: int, content: bytes, padding: bytes) -> bytes:
    content += padding * (-len(content) % 4)
    return struct.pack("<II", len(content), kind) + content


def obj(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    lines = [f"v {x:.8f} {y:.8f} {z:.8f}" for x, y, z in vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
    return ("\n".join(lines) + "\n").encode()
