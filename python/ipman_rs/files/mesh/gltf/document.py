"""The JSON of a glTF file, its buffers, and the arrays in them."""

from __future__ import annotations

import binascii
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from ipman_rs.files import parse_json, regular_file

from .. import text

TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
JSON, BIN = 0x4E4F534A, 0x004E4942
DRACO = "KHR_draco_mesh_compression"
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
# Required extensions that are read or refused where a mesh uses them, and those that leave the surface as it is.
SURFACE = ("KHR_mesh_quantization", DRACO, *MESHOPT)
# What entries of these names are in the lists of a file.
OBJECT, LIST, TEXT = (dict, "an object"), (list, "a list"), (str, "text")
ENTRIES = {
    "nodes": {"children": LIST, "weights": LIST, "extensions": OBJECT},
    "meshes": {"primitives": LIST, "weights": LIST},
    "primitives": {"attributes": OBJECT, "targets": LIST, "extensions": OBJECT},
    "skins": {"joints": LIST},
    "scenes": {"nodes": LIST},
    "accessors": {"type": TEXT, "sparse": OBJECT},
    "bufferViews": {"extensions": OBJECT},
    "buffers": {"uri": TEXT, "extensions": OBJECT},
}
LOOKS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_xmp")


class Document:
    """``json`` and the buffers that it names, which are read when an array needs them."""

    def __init__(self, content: bytes, folder: Path) -> None:
        self.json, self._binary = _chunks(content)
        self._folder = folder
        self._lists: dict[str, list[dict[str, Any]]] = {}
        self._buffers: dict[int, bytes] = {}
        self._arrays: dict[int, NDArray[Any]] = {}
        self.size = len(self._binary or b"")  # bytes of the buffers that have been read
        version = str(self.json.get("asset", {}).get("version", ""))
        if not version.startswith("2."):
            raise ValueError(f"it is glTF {text.list_names([version])}; export it as glTF 2.0")
        for name in self.json.get("extensionsRequired", []):
            if not str(name).startswith((*SURFACE, *LOOKS)):
                raise ValueError(
                    f"it needs the extension {text.list_names([name])}, which is not read; export it without"
                )

    def all(self, kind: str) -> list[dict[str, Any]]:
        if kind not in self._lists:
            self._lists[kind] = check_entries(kind, self.json.get(kind, []))
        return self._lists[kind]

    def one(self, kind: str, index: Any) -> dict[str, Any]:
        listed = self.all(kind)
        if type(index) is not int or not 0 <= index < len(listed):
            raise ValueError(f"it names {text.list_names([index])} of {len(listed)} {kind}")
        return listed[index]

    def array(self, index: Any) -> NDArray[Any]:
        """(count, components) of an accessor: float64, or whole numbers that are not normalised."""
        if index not in self._arrays:
            self._arrays[index] = self._decoded(self.one("accessors", index), f"accessor {index}")
        return self._arrays[index]

    def _decoded(self, accessor: dict[str, Any], name: str) -> NDArray[Any]:
        kind, width = TYPES.get(accessor.get("componentType", 0)), COMPONENTS.get(accessor.get("type", ""))
        count = accessor.get("count")
        if kind is None or width is None or type(count) is not int or count < 1:
            raise ValueError(f"its {name} has no known type and count")
        if "bufferView" in accessor:
            values = self._view(accessor["bufferView"], accessor.get("byteOffset", 0), kind, count, width, name)
        elif count > self.size:
            raise ValueError(f"its {name} claims {count} zeros, more than the file has bytes")
        else:
            values = np.zeros((count, width), kind)
        if "sparse" in accessor:
            values = self._sparse(values, accessor["sparse"], name)
        if np.dtype(kind).kind == "f":
            return values.astype(np.float64)
        if accessor.get("normalized") is True:
            return np.maximum(values / float(np.iinfo(kind).max), -1.0)
        return values.astype(np.int64)

    def _sparse(self, values: NDArray[Any], sparse: dict[str, Any], name: str) -> NDArray[Any]:
        """With the rows replaced that a sparse accessor lists."""
        where, what, count = sparse["indices"], sparse["values"], sparse["count"]
        index_kind = TYPES.get(where.get("componentType", 0), "")
        if type(count) is not int or not 0 < count <= len(values) or index_kind[1:2] != "u":
            raise ValueError(f"its {name} replaces {text.list_names([count])} of {len(values)} rows")
        rows = self._view(where["bufferView"], where.get("byteOffset", 0), index_kind, count, 1, name)[:, 0]
        if rows.max() >= len(values):
            raise ValueError(f"its {name} replaces row {rows.max()} of {len(values)}")
        values = values.copy()
        values[rows] = self._view(
            what["bufferView"], what.get("byteOffset", 0), values.dtype.str, count, values.shape[1], name
        )
        return values

    def _view(self, index: Any, offset: int, kind: str, count: int, width: int, name: str) -> NDArray[Any]:
        view = self.one("bufferViews", index)
        start, length = view.get("byteOffset", 0), view["byteLength"]
        size = np.dtype(kind).itemsize
        stride = view.get("byteStride") or size * width
        whole = self._buffer(view)
        if not all(type(number) is int and number >= 0 for number in (start, length, offset, stride)):
            raise ValueError(f"its {name} lies at no whole number of bytes")
        if start + length > len(whole) or offset + stride * (count - 1) + size * width > length:
            raise ValueError(f"its {name} lies outside of its {len(whole)} bytes; is the download complete?")
        return np.ndarray((count, width), kind, whole, start + offset, (stride, size))

    def _buffer(self, view: dict[str, Any]) -> bytes:
        index = view["buffer"]
        buffer = self.one("buffers", index)
        if any(name in view.get("extensions", {}) for name in MESHOPT):
            empty = "uri" not in buffer and (index or self._binary is None)
            if empty or any(buffer.get("extensions", {}).get(name, {}).get("fallback") for name in MESHOPT):
                raise ValueError("it is compressed with meshopt; export it without (gltfpack without -c)")
        if index not in self._buffers:
            self._buffers[index] = self._bytes(buffer, index)
        return self._buffers[index]

    def _bytes(self, buffer: dict[str, Any], index: int) -> bytes:
        uri = buffer.get("uri")
        if uri is None:
            if index or self._binary is None:
                raise ValueError(f"its buffer {index} is not in the file; is the download complete?")
            return self._binary
        if uri.startswith("data:"):
            head, _, body = uri.partition(",")
            if not head.endswith(";base64"):
                raise ValueError(f"its buffer {index} is text that is not base64")
            return self._counted(binascii.a2b_base64(body))
        name = unquote(uri)
        place = (self._folder / name).resolve()
        if ":" in name or "\\" in name or not place.is_relative_to(self._folder.resolve()):
            raise ValueError(
                f"its buffer '{text.list_names([name])}' lies outside of its folder; put it beside the file"
            )
        if not place.is_file():
            raise ValueError(
                f"there is no file '{text.list_names([name])}' beside it, which holds its buffer; copy it there"
            )
        return self._counted(regular_file(place).read_bytes())

    def _counted(self, content: bytes) -> bytes:
        self.size += len(content)
        return content


def check_entries(kind: str, listed: Any) -> list[dict[str, Any]]:
    """A list of objects whose entries are what glTF has there. ValueError where they are not."""
    if not isinstance(listed, list) or not all(isinstance(one, dict) for one in listed):
        raise ValueError(f"its {kind} are no list of objects")
    for name, (expected, kind_name) in ENTRIES.get(kind, {}).items():
        if any(name in one and not isinstance(one[name], expected) for one in listed):
            raise ValueError(f"the {name} of its {kind}: expected {kind_name}")
    return listed


def _chunks(content: bytes) -> tuple[dict[str, Any], bytes | None]:
    """The JSON and the binary chunk of a .glb, or the JSON of a .gltf."""
    binary = None
    words = content
    if content.startswith(b"glTF"):
        if len(content) < 12:
            raise ValueError("its header is cut; is the download complete?")
        version, length = struct.unpack_from("<II", content, 4)
        if version != 2:
            raise ValueError(f"it is glTF {version}; export it as glTF 2.0")
        if length > len(content):
            raise ValueError(f"it claims {length} bytes but has only {len(content)}; is the download complete?")
        chunks: dict[int, bytes] = {}
        place = 12
        while place + 8 <= length:
            size, kind = struct.unpack_from("<II", content, place)
            if place + 8 + size > length:
                raise ValueError(f"a chunk claims {size} bytes, more than follow; is the download complete?")
            chunks.setdefault(kind, content[place + 8 : place + 8 + size])
            place += 8 + size
        words, binary = chunks.get(JSON, b""), chunks.get(BIN)
    try:
        content_json = parse_json(words)
    except ValueError as error:
        raise ValueError(f"it holds no JSON of glTF ({text.list_names([error])})") from None
    if not isinstance(content_json, dict) or not isinstance(content_json.get("asset", {}), dict):
        raise ValueError("it holds no JSON of glTF")
    return content_json, binary
