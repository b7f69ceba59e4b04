"""A study: one body, its frames and everything measured on them, ready to be written and drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

# Frames analysed at once: large enough to fill the threads, small enough for a progress bar and for memory.
_CHUNK = 16
# Frames of a long sequence that are drawn and whose pressure samples are stored.
MAX_KEY_FRAMES = 48
_KEY_FRAME_VERTICES = 700_000

_ROOMS = (
    "status", "volume", "mass", "part_volumes", "center_of_mass", "center_of_mass_exact", "inertia",
    "center_of_pressure", "bose", "stability", "pull", "push", "balance",
)  # fmt: skip
_SUPPORT = ("area", "margin", "inside", "has_contact", "num_contacts")


@dataclass(frozen=True)
class Study:
    """One body over T frames.

    ``vertices`` (T, V, 3) in metres; ``numbers`` has a column (T, ...) for every quantity of ``ip.analyze``, plus
    ``com_cop_distance`` and ``lowest`` (signed height of the lowest vertex), both in metres; ``polygons`` the base of
    support of each frame, (K, 3); ``pressure`` (K, S) at the samples of the frames ``key_frames`` (K,).
    """

    name: str
    vertices: np.ndarray
    template: Any
    ground: Any
    preset: Any
    numbers: dict[str, np.ndarray]
    polygons: list[np.ndarray]
    pressure: np.ndarray
    key_frames: np.ndarray
    com_method: str
    labels: tuple[str, ...] = ()
    seconds: np.ndarray | None = None
    source: str = ""
    notes: tuple[str, ...] = field(default=())

    @property
    def num_frames(self) -> int:
        return len(self.vertices)

    def label(self, frame: int) -> str:
        """What a frame is called: its own name, its time, or its number."""
        if self.labels:
            return self.labels[frame]
        if self.seconds is not None:
            return f"{self.seconds[frame]:.2f} s"
        return f"frame {frame}" if self.num_frames > 1 else self.name


def study(
    name: str,
    vertices: np.ndarray,
    template: Any,
    ground: Any,
    preset: str = "paper-r",
    *,
    labels: Sequence[str] = (),
    seconds: np.ndarray | None = None,
    source: str = "",
    notes: Sequence[str] = (),
    progress: Callable[[int], None] = lambda done: None,
) -> Study:
    """Analyse the frames ``vertices`` (T, V, 3), or one body (V, 3), on one ground.

    ``progress`` is called with the number of frames done. Raises what ``ip.analyze`` raises.
    """
    import ipman_rs as ip

    vertices = np.asarray(vertices)
    if vertices.ndim == 2:
        vertices = vertices[None]
    keys = key_frames(len(vertices), vertices.shape[1])
    columns: dict[str, list[np.ndarray]] = {key: [] for key in (*_ROOMS, *_SUPPORT)}
    polygons: list[np.ndarray] = []
    pressure: list[np.ndarray] = []
    com_method = "pcom"
    for start in range(0, len(vertices), _CHUNK):
        chunk = vertices[start : start + _CHUNK]
        result = ip.analyze(chunk, template, ground, preset)
        com_method = result.com_method
        for key in _ROOMS:
            columns[key].append(np.asarray(getattr(result, key)))
        for key in _SUPPORT:
            columns[key].append(np.asarray(getattr(result.base_of_support, key)))
        polygons.extend(np.asarray(polygon).reshape(-1, 3) for polygon in result.base_of_support.polygon)
        pressure.append(result.pressure[keys[(keys >= start) & (keys < start + len(chunk))] - start])
        progress(start + len(chunk))
    numbers = {key: np.concatenate(parts) for key, parts in columns.items()}
    com, cop = numbers["center_of_mass"], numbers["center_of_pressure"]
    numbers["com_cop_distance"] = np.linalg.norm(ground.project(com) - ground.project(cop), axis=-1)
    numbers["lowest"] = np.array([ground.signed_height(body).min() for body in vertices])
    return Study(
        name=name,
        vertices=vertices,
        template=template,
        ground=ground,
        preset=ip.presets.get(preset),
        numbers=numbers,
        polygons=polygons,
        pressure=np.concatenate(pressure),
        key_frames=keys,
        com_method=com_method,
        labels=tuple(labels),
        seconds=seconds,
        source=source,
        notes=tuple(notes),
    )


def key_frames(num_frames: int, num_vertices: int) -> np.ndarray:
    """Which frames are drawn: all of a short sequence, evenly spaced ones of a long one, first and last included."""
    most = min(MAX_KEY_FRAMES, max(1, _KEY_FRAME_VERTICES // max(num_vertices, 1)))
    if num_frames <= most:
        return np.arange(num_frames)
    return np.unique(np.linspace(0, num_frames - 1, most).round().astype(np.int64))
