"""OpenSim's ExternalLoads: which file has the forces, and in which of its columns they are."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from xml.etree.ElementTree import Element

from ..files import safe_xml


@dataclass(frozen=True)
class Load:
    """The columns of one force begin with these: its components, where it acts, and its moment there ("": none)."""

    force: str
    point: str
    torque: str


@dataclass(frozen=True)
class ExternalLoads:
    """What an ExternalLoads file says."""

    datafile: str  # its name, without a path: folders of other machines
    loads: tuple[Load, ...]
    source: str


def read(path: str | os.PathLike[str]) -> ExternalLoads | None:
    """The ExternalLoads of an XML file; None if it has none. ValueError, naming the file, if it is damaged, names no
    file of forces, or has forces in the axes of a part of the body."""
    root = safe_xml.read(path)
    element = next(root.iter("ExternalLoads"), None)
    if element is None:
        return None
    datafile = _text(element, ".//datafile") or _text(element, ".//data_source_name")
    if not datafile:
        raise ValueError(f"{path}: expected a <datafile> with the forces, got none")
    loads = []
    for force in element.iter("ExternalForce"):
        for what in ("force_expressed_in_body", "point_expressed_in_body"):
            axes = _text(force, what)
            if axes.rpartition("/")[2] not in ("", "ground", "Unassigned"):
                raise ValueError(
                    f"{path}: {what}: expected ground, got {axes!r}; write the forces in the ground's axes"
                )
        if _text(force, "force_identifier") and _text(force, "point_identifier"):
            names = (_text(force, f"{what}_identifier") for what in ("force", "point", "torque"))
            loads.append(Load(*names))
    return ExternalLoads(PureWindowsPath(datafile).name, tuple(loads), str(Path(path)))


def find(files: Iterable[Path]) -> tuple[dict[Path, ExternalLoads], dict[Path, Path], list[str]]:
    """By files of forces: what the ExternalLoads among `files` say of them, and the XML files that do.

    And what is wrong with those XML files that cannot be read, or whose forces are not there."""
    files = list(files)
    loads: dict[Path, ExternalLoads] = {}
    sources: dict[Path, Path] = {}
    wrong: list[str] = []
    for path in files:
        if path.suffix.lower() != ".xml":
            continue
        try:
            content = read(path)
        except ValueError as error:
            wrong.append(str(error))
            continue
        if content is None:
            continue
        named = [file for file in files if file.name.lower() == content.datafile.lower()]
        near = [file for file in named if file.parent == path.parent] or named
        if len(near) != 1:
            what = "is not there" if not near else f"is there {len(near)} times"
            wrong.append(f"{path}: not used, for its file of forces, {content.datafile}, {what}")
        elif near[0] not in loads:
            loads[near[0]], sources[near[0]] = content, path
    return loads, sources, wrong


def _text(element: Element, path: str) -> str:
    child = element.find(path)
    return "" if child is None else (child.text or "").strip()
