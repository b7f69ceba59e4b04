"""Polygon files .ply, as text or binary of either byte order: vertices and polygons of any number of corners.

A file is a header that names elements and their properties, then the rows of each element. A property is a number, or a
list: its length, then its entries.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import polygons, text
from .repair import Mesh

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float": "f4", "double": "f8", "float32": "f4", "float64": "f8",
}  # fmt: skip
ORDERS = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}
CORNERS = ("vertex_indices", "vertex_index")
STRIPS = ("tristrips", "tristrip")


@dataclass(frozen=True)
class Property:
    name: str
    kind: str  # of the number, or of the entries of a list
    length: str | None  # the kind of a list's length


@dataclass(frozen=True)
class Element:
    name: str
    count: int
    properties: tuple[Property, ...]

    def least(self, order: str | None) -> int:
        """The bytes that a row has at least."""
        if order is None:
            return 2 * len(self.properties)
        return sum(np.dtype(one.length or one.kind).itemsize for one in self.properties)


Columns = dict[str, Any]  # numbers (N,) of a property, or (entries, lengths (N,)) of a list


def parse(content: bytes) -> Mesh:
    """The vertices in the file's order, polygons cut into triangles. ValueError for damage."""
    order, elements, start = _header(content)
    for element in elements:
        if element.count * max(element.least(order), 1) > len(content) - start + 1:
            claim = f"claims {element.count} of {element.name}"
            raise ValueError(f"{claim} but has only {len(content)} bytes; is the download complete?")
    rows = _Text(content[start:]) if order is None else _Binary(content, start, order)
    stored: dict[str, Columns] = {}
    for element in elements:
        stored[element.name] = rows.read(element)
        if {"vertex", "face"} <= stored.keys():
            break  # what follows is not needed
    if not {"x", "y", "z"} <= stored.get("vertex", {}).keys():
        raise ValueError("it has no vertices with x, y and z")
    strips = next((one.name for one in elements if one.name in STRIPS and one.count), None)
    if strips and not any(one.name == "face" and one.count for one in elements):
        raise ValueError(f"its triangles are in strips ({strips}), which are not read; export faces")
    vertices = np.stack([_numbers(stored["vertex"], axis) for axis in "xyz"], axis=1)
    left_out = [one.name for one in elements if one.name not in ("vertex", "face", "material") and one.count]
    notes = (f"not used: {text.list_names(left_out)}",) if left_out else ()
    return Mesh(vertices, _faces(stored.get("face", {})), notes=notes)


def _numbers(columns: Columns, name: str) -> NDArray[np.float64]:
    if isinstance(columns[name], tuple):
        raise ValueError(f"{name} is a list; expected a number")
    return columns[name].astype(np.float64)


def _faces(columns: Columns) -> NDArray[np.int64]:
    name = next((name for name in CORNERS if name in columns), None)
    if name is None:
        if any(len(one) for one in columns.values()):
            raise ValueError(f"its faces have {text.list_names(list(columns))}; expected vertex_indices")
        return np.empty((0, 3), np.int64)
    if not isinstance(columns[name], tuple):
        raise ValueError(f"{name} is a number; expected a list")
    corners, counts = columns[name]
    if corners.dtype.kind == "f" and not (np.abs(corners) < 2**53).all() or (corners != np.floor(corners)).any():
        raise ValueError(f"{name}: expected whole numbers")
    return polygons.triangles(corners.astype(np.int64), counts)


def _header(content: bytes) -> tuple[str | None, list[Element], int]:
    """The byte order (None: text), the elements, and where their rows start."""
    if not content.startswith(b"ply"):
        raise ValueError("it does not begin with 'ply'")
    mark = content.find(b"end_header")
    if mark < 0:
        raise ValueError("its header has no end")
    ends = [end for end in (b"\r\n", b"\n", b"\r") if end in content[:mark]]
    start = mark + len(b"end_header")
    start += next((len(end) for end in ends if content.startswith(end, start)), 0)
    form, elements = "", []
    for line in content[:mark].decode("latin-1").replace("\r", "\n").split("\n"):
        words = line.split()
        if words[:1] == ["format"]:
            form = words[1] if len(words) > 1 else ""
        elif words[:1] == ["element"] and len(words) == 3 and words[2].isdecimal() and len(words[2]) < 16:
            elements.append(Element(words[1], int(words[2]), ()))
        elif words[:1] == ["property"] and elements:
            last = elements[-1]
            elements[-1] = Element(last.name, last.count, (*last.properties, _property(words[1:], line)))
        elif words and words[0] not in ("ply", "comment", "obj_info"):
            raise ValueError(f"its header says '{text.list_names([line])}', which is not known")
    if form not in ORDERS:
        raise ValueError(f"its format is '{text.list_names([form])}'; expected one of {', '.join(ORDERS)}")
    return ORDERS[form], elements, start


def _property(words: list[str], line: str) -> Property:
    kinds = [TYPES.get(word) for word in words[:-1]]
    if words[:1] == ["list"] and len(words) == 4 and kinds[1] and kinds[2] and kinds[1][0] != "f":
        return Property(words[3], kinds[2], kinds[1])
    if len(words) == 2 and kinds[0]:
        return Property(words[1], kinds[0], None)
    raise ValueError(f"its header says '{text.list_names([line])}'; expected a property of a known type")


class _Text:
    """Rows of words, one line each."""

    def __init__(self, content: bytes) -> None:
        self.lines = iter([line for line in text.lines(content) if line.strip()])

    def read(self, element: Element) -> Columns:
        values: list[list[float]] = [[] for _ in element.properties]
        lengths: list[list[int]] = [[] for _ in element.properties]
        for row in range(element.count):
            words = next(self.lines, b"").split()
            place = 0
            try:
                for k, one in enumerate(element.properties):
                    size = 1
                    if one.length:
                        size = int(words[place])
                        place += 1
                        lengths[k].append(size)
                    entries = words[place : place + size]
                    if size < 0 or len(entries) != size:
                        raise IndexError
                    values[k].extend(map(float, entries))
                    place += size
            except IndexError:
                raise ValueError(f"row {row} of {element.name} is cut; is the download complete?") from None
            except ValueError:
                shown = text.list_names([b" ".join(words).decode("latin-1")])
                raise ValueError(f"row {row} of {element.name}: expected numbers, got '{shown}'") from None
        return {
            one.name: (np.array(values[k]), np.array(lengths[k], np.int64)) if one.length else np.array(values[k])
            for k, one in enumerate(element.properties)
        }


class _Binary:
    """Rows of bytes."""

    def __init__(self, content: bytes, start: int, order: str) -> None:
        self.content, self.place, self.order = content, start, order

    def read(self, element: Element) -> Columns:
        if not element.count:
            return {
                one.name: (np.empty(0), np.empty(0, np.int64)) if one.length else np.empty(0)
                for one in element.properties
            }
        rows = self._alike(element)
        return self._each(element) if rows is None else rows

    def _alike(self, element: Element) -> Columns | None:
        """All rows at once where each list has the length that it has in the first row; None where they differ."""
        sizes = self._first(element)
        fields: list[tuple[str, Any]] = []
        for k, one in enumerate(element.properties):
            if one.length:
                fields.append((f"length {k}", self.order + one.length))
            fields.append((f"value {k}", (self.order + one.kind, sizes[k]) if one.length else self.order + one.kind))
        kind = np.dtype(fields)
        if self.place + kind.itemsize * element.count > len(self.content):
            if any(one.length for one in element.properties):
                return None
            raise ValueError(f"its {element.count} of {element.name} are cut; is the download complete?")
        rows = np.frombuffer(self.content, kind, element.count, self.place)
        columns: Columns = {}
        for k, one in enumerate(element.properties):
            values = rows[f"value {k}"]
            if one.length:
                lengths = rows[f"length {k}"].astype(np.int64)
                if (lengths != sizes[k]).any():
                    return None
                columns[one.name] = values.reshape(-1), lengths
            else:
                columns[one.name] = values
        self.place += kind.itemsize * element.count
        return columns

    def _first(self, element: Element) -> list[int]:
        """The lengths of the lists in the first row; 1 for a number."""
        place, sizes = self.place, []
        for one in element.properties:
            size = 1
            if one.length:
                size = self._length(element, one.length, place, 0)
                place += np.dtype(one.length).itemsize
            place += size * np.dtype(one.kind).itemsize
            sizes.append(size)
        return sizes

    def _length(self, element: Element, kind: str, place: int, row: int) -> int:
        width = np.dtype(kind).itemsize
        little = "little" if self.order == "<" else "big"
        size = int.from_bytes(self.content[place : place + width], little, signed=kind[0] == "i")
        if size < 0 or place + width + size > len(self.content):
            raise ValueError(f"row {row} of {element.name} is cut or damaged; is the download complete?")
        return size

    def _each(self, element: Element) -> Columns:
        """Row by row: where a row starts is known when the one before it has been read."""
        entries: list[list[bytes]] = [[] for _ in element.properties]
        lengths: list[list[int]] = [[] for _ in element.properties]
        plan = [
            (one.length, np.dtype(one.length or "u1").itemsize, np.dtype(one.kind).itemsize)
            for one in element.properties
        ]
        for row in range(element.count):
            for k, (length, ahead, width) in enumerate(plan):
                size = 1
                if length:
                    size = self._length(element, length, self.place, row)
                    lengths[k].append(size)
                    self.place += ahead
                entries[k].append(self.content[self.place : self.place + size * width])
                self.place += size * width
        if self.place > len(self.content):
            raise ValueError(f"its {element.count} of {element.name} are cut; is the download complete?")
        columns: Columns = {}
        for k, one in enumerate(element.properties):
            values = np.frombuffer(b"".join(entries[k]), self.order + one.kind)
            columns[one.name] = (values, np.array(lengths[k], np.int64)) if one.length else values
        return columns
