"""Read untrusted XML: no document types, so no entities, neither bombs nor files and addresses from outside."""

from __future__ import annotations

import os
from typing import Any, NoReturn
from xml.etree import ElementTree
from xml.parsers import expat

from ipman_rs.files import read_bytes

MAX_BYTES = 1 << 29  # the longest recording of MoYo has a tenth of that
MAX_DEPTH = 64
MAX_ATTRIBUTES = 100  # of one element


def read(path: str | os.PathLike[str]) -> ElementTree.Element:
    """The root of a document. ValueError, naming the file, if it is missing, damaged, too large, or has a DOCTYPE."""
    data = read_bytes(path, MAX_BYTES)
    builder, depth = ElementTree.TreeBuilder(), 0

    def begin(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > MAX_DEPTH:
            raise ValueError(f"elements nested more than {MAX_DEPTH} deep")
        if len(attributes) > MAX_ATTRIBUTES:
            raise ValueError(f"an element of {len(attributes)} attributes, more than {MAX_ATTRIBUTES}")
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def refuse(*_: Any) -> NoReturn:
        raise ValueError("has a document type (DOCTYPE), which can hold entities; no file of a data set has one")

    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = begin, end, builder.data
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = parser.ExternalEntityRefHandler = refuse
    try:
        parser.Parse(data, True)
    except MemoryError:
        raise ValueError(f"{path}: needs more memory than there is") from None
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise ValueError(f"{path}: cannot be read as XML: {error}; is the download complete?") from None
    return builder.close()


def text(element: ElementTree.Element, path: str, source: str | os.PathLike[str]) -> str:
    """The text of the first element at `path` ("clip/cell_size/x"). ValueError, naming the file, if there is none."""
    child = element.find(path)
    if child is None or not (child.text or "").strip():
        raise ValueError(
            f"{source}: expected <{path.removeprefix('.//').replace('/', '><')}> with text in it, got none"
        )
    return (child.text or "").strip()


def number(element: ElementTree.Element, path: str, source: str | os.PathLike[str]) -> float:
    """The number at `path`; raises as `text`."""
    content = text(element, path, source)
    try:
        return float(content)
    except ValueError:
        raise ValueError(f"{source}: {path.removeprefix('.//')}: expected a number, got {content[:40]!r}") from None
