"""Several files of one data set as one: frames one file after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.ground import Ground

from .frames import Cameras, DataSet, Frames, PressureMaps, Rows


class Joined:
    """The frames of `parts` (one or more) one after the other; each part is read when its frames are asked for."""

    def __init__(self, parts: Sequence[DataSet]) -> None:
        self.parts = parts
        self.ends = np.cumsum([len(part) for part in parts])

    def __len__(self) -> int:
        return int(self.ends[-1])

    def __getitem__(self, rows: Rows) -> Frames:
        wanted = np.arange(*rows.indices(len(self))) if isinstance(rows, slice) else np.asarray(rows)
        wanted = np.where(wanted < 0, wanted + len(self), wanted)
        if ((wanted < 0) | (wanted >= len(self))).any():
            raise IndexError(f"frames: expected numbers from 0 to {len(self) - 1}, got {rows}")
        part = np.searchsorted(self.ends, wanted, side="right")
        order = np.argsort(part, kind="stable")
        starts = np.append(0, self.ends)
        frames = concatenate(
            [self.parts[each][wanted[order][part[order] == each] - starts[each]] for each in np.unique(part)]
            or [self.parts[0][:0]]
        )
        return frames if (order == np.arange(len(order))).all() else frames[np.argsort(order, kind="stable")]


def concatenate(parts: Sequence[Frames]) -> Frames:
    """One after the other. What differs in length (betas) is filled up with zeros; what a part lacks is an error.

    A frame rate that is not the same in all parts is None. Raises ValueError naming the field for parts that have
    different things: bodies of other models, joints under other names, a field that only some have.
    """
    return Frames(
        **{
            field.name: _column(field.name, [getattr(part, field.name) for part in parts], parts)
            for field in fields(Frames)
        }
    )


def _column(name: str, values: list[Any], parts: Sequence[Frames]) -> Any:
    first = values[0]
    if len(values) == 1:
        return first
    if name == "frame_rate":
        return first if all(value == first for value in values) else None
    if any((value is None) != (first is None) for value in values):
        raise ValueError(f"{name}: some files have it and some do not; open them one by one")
    if isinstance(first, np.ndarray):
        return np.concatenate(_same_width(name, values))
    if isinstance(first, Cameras):
        return Cameras(*(np.concatenate([getattr(value, each.name) for value in values]) for each in fields(Cameras)))
    if isinstance(first, Ground):
        return _grounds(values, [len(part) for part in parts])
    if isinstance(first, PressureMaps):
        return _pressure(values)
    if any(value != first for value in values):
        raise ValueError(
            f"{name}: {first} in one file and {next(value for value in values if value != first)} in another"
        )
    return first


def _same_width(name: str, values: list[NDArray[Any]]) -> list[NDArray[Any]]:
    if name != "betas":
        return values
    width = max(value.shape[1] for value in values)
    return [np.pad(value, ((0, 0), (0, width - value.shape[1]))) for value in values]


def _grounds(grounds: list[Ground], counts: list[int]) -> Ground:
    first = grounds[0]
    same = [np.array_equal(each.normal, first.normal) and np.array_equal(each.height, first.height) for each in grounds]
    if all(same) and first.height.ndim == 0:
        return first
    normals = [np.broadcast_to(each.normal, (count, 3)) for each, count in zip(grounds, counts, strict=True)]
    heights = [np.broadcast_to(each.height, count) for each, count in zip(grounds, counts, strict=True)]
    return Ground(np.concatenate(normals), np.concatenate(heights))


def _pressure(maps: list[PressureMaps]) -> PressureMaps:
    first = maps[0]
    if any((each.cell, each.values.shape[1:]) != (first.cell, first.values.shape[1:]) for each in maps):
        raise ValueError("pressure: the mats have other cells; open the files one by one")
    origin, e1, e2 = (
        np.concatenate([np.broadcast_to(getattr(each, name), (len(each.values), 3)) for each in maps])
        for name in ("origin", "e1", "e2")
    )
    return PressureMaps(np.concatenate([each.values for each in maps]), origin, e1, e2, first.cell)[:]
