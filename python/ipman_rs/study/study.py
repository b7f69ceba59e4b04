"""A study: one body, its frames and everything measured on them, ready to be written and drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .camera import ViewCamera

# Frames of a long sequence that are drawn and whose pressure samples are stored.
MAX_KEY_FRAMES = 48
_KEY_FRAME_VERTICES = 700_000
# Frames of a long sequence that report.json and the page list, and whose outlines are kept.
MAX_LISTED_FRAMES = 10_000

_ROOMS = (
    "status", "volume", "mass", "part_volumes", "center_of_mass", "center_of_mass_exact", "inertia",
    "center_of_pressure", "bose", "stability", "pull", "push", "balance", "lowest",
)  # fmt: skip
_SUPPORT = ("area", "margin", "inside", "has_contact", "num_contacts")


@dataclass(frozen=True)
class Fitted:
    """What a study of a fitted body knows more: its camera, its keypoints, the body before the physics terms.

    `camera` in pixels of the photo, whose width and height are `size`; `photo` its pixels (h, w, 3) uint8; `seen`
    (K, 3) x, y and confidence of the points that were detected, `projected` (K, 2) where the fitted body has them;
    `before` a study of one frame; `record` is shown in `report.json`.
    """

    camera: ViewCamera
    size: tuple[float, float]
    seen: np.ndarray
    projected: np.ndarray
    photo: np.ndarray | None = None
    before: Study | None = None
    pictured: bool = True
    record: dict[str, Any] = field(default_factory=dict)

    def pictures(self) -> tuple[tuple[str, str], ...]:
        """File names of the pictures that the page shows, and their titles. The side view is half of the pair."""
        if not self.pictured:
            return ()
        over = "Over the photo" if self.photo is not None else "Over the keypoints"
        side = ("side.png", "From the side")
        if self.before is not None:
            side = ("before_after.png", "Before and after the physics terms, from the side")
        return ("overlay.png", over), side, ("floor.png", "The floor from above")


@dataclass(frozen=True)
class Study:
    """One body over T frames.

    ``vertices`` (T, V, 3) in metres, or bodies that are posed when they are needed; ``numbers`` has a column (T, ...)
    for every quantity of ``ip.analyze``, plus ``com_cop_distance``, m; ``polygons`` the base of support of each frame,
    (K, 3), of a long sequence only those of the frames that are listed; ``pressure`` (K, S) at the samples of the
    frames ``key_frames`` (K,); ``frames`` (T,) the frames' numbers, where these are some of a longer sequence;
    ``fitted`` of a body that was fitted to an image; ``notes`` what was assumed, ``flags`` what is odd.
    """

    name: str
    vertices: Any
    template: Any
    ground: Any
    preset: Any
    numbers: dict[str, np.ndarray]
    polygons: Sequence[np.ndarray]
    pressure: np.ndarray
    key_frames: np.ndarray
    com_method: str
    labels: tuple[str, ...] = ()
    seconds: np.ndarray | None = None
    source: str = ""
    notes: tuple[str, ...] = field(default=())
    frames: np.ndarray | None = None
    fitted: Fitted | None = None
    flags: tuple[str, ...] = ()

    @property
    def num_frames(self) -> int:
        return len(self.vertices)

    def label(self, frame: int) -> str:
        """What a frame is called: its own name, its time, or its number."""
        if self.labels:
            return self.labels[frame]
        if self.seconds is not None:
            return f"{self.seconds[frame]:.2f} s"
        return f"frame {self.number(frame)}" if self.num_frames > 1 else self.name

    def number(self, frame: int) -> int:
        """Which one of the recording's frames it is."""
        return frame if self.frames is None else int(self.frames[frame])

    def pictured(self) -> list[int]:
        """The frames that get pictures: all named ones; of a recording the first, the last, the least stable ones."""
        if self.labels or self.num_frames == 1:
            return list(range(self.num_frames))
        return _pictured(self.numbers)

    def excerpt(self) -> Study:
        """The study of the listed frames: itself, if it is not long."""
        frames = listed_frames(self.numbers, self.key_frames)
        if len(frames) == self.num_frames:
            return self
        return replace(
            self,
            vertices=_Some(self.vertices, frames),
            numbers={key: column[frames] for key, column in self.numbers.items()},
            polygons=[self.polygons[frame] for frame in frames],
            key_frames=np.searchsorted(frames, self.key_frames),
            seconds=None if self.seconds is None else self.seconds[frames],
            notes=(
                *self.notes,
                f"frames: {len(frames):,} of {self.num_frames:,} are listed here; report.npz has the figures of all",
            ),
            frames=frames,
        )


@dataclass(frozen=True)
class _Some:
    """Some of the bodies of a sequence."""

    vertices: Any
    chosen: np.ndarray

    def __len__(self) -> int:
        return len(self.chosen)

    def __getitem__(self, index: Any) -> Any:
        return self.vertices[self.chosen[index]]


def study(
    name: str,
    vertices: Any,
    template: Any,
    ground: Any,
    preset: str = "paper-r",
    *,
    labels: Sequence[str] = (),
    seconds: np.ndarray | None = None,
    source: str = "",
    notes: Sequence[str] = (),
    flags: Sequence[str] = (),
    progress: Callable[[int], None] = lambda done: None,
) -> Study:
    """Analyse the frames ``vertices`` (T, V, 3), one body (V, 3), or a `PosedSequence`, on one ground.

    ``progress`` is called with the number of frames done. Raises what ``ip.analyze`` raises.
    """
    import ipman_rs as ip
    from ipman_rs.analysis import analyze_sequence

    if not hasattr(vertices, "pieces"):
        vertices = np.asarray(vertices)
        vertices = vertices[None] if vertices.ndim == 2 else vertices
    keys = key_frames(len(vertices), vertices.shape[1])
    table = _Table(len(vertices))
    for part in analyze_sequence(vertices, template, ground, preset):
        table.add(part)
        progress(table.done)
    numbers = table.numbers
    com, cop = numbers["center_of_mass"], numbers["center_of_pressure"]
    numbers["com_cop_distance"] = np.linalg.norm(ground.project(com) - ground.project(cop), axis=-1)
    drawn = np.union1d(keys, _pictured(numbers)) if len(vertices) > MAX_LISTED_FRAMES else np.array([], np.int64)
    for frame in drawn:
        table.outlines[int(frame)] = _outline(vertices[int(frame)], template, ground, preset)
    constants = ip.presets.get(preset)
    return Study(
        name=name,
        vertices=vertices,
        template=template,
        ground=ground,
        preset=constants,
        numbers=numbers,
        polygons=_Outlines(len(vertices), table.outlines, com.dtype),
        pressure=ip.pressure(vertices[keys], template, ground, constants.alpha, constants.gamma),
        key_frames=keys,
        com_method="exact" if template.num_parts == 1 else "pcom",
        labels=tuple(labels),
        seconds=seconds,
        source=source,
        notes=tuple(notes),
        flags=tuple(flags),
    )


class _Table:
    """The figures of all frames as columns, filled a piece at a time."""

    def __init__(self, num_frames: int) -> None:
        self.num_frames, self.done = num_frames, 0
        self.numbers: dict[str, np.ndarray] = {}
        self.outlines: dict[int, np.ndarray] = {}
        self._evenly = set(evenly_spaced_frames(num_frames).tolist())

    def add(self, part: Any) -> None:
        rows = slice(self.done, self.done + len(part.status))
        values = {key: getattr(part, key) for key in _ROOMS}
        values |= {key: getattr(part.base_of_support, key) for key in _SUPPORT}
        for key, value in values.items():
            column = self.numbers.setdefault(key, np.empty((self.num_frames, *value.shape[1:]), value.dtype))
            column[rows] = value
        for frame, outline in enumerate(part.base_of_support.polygon, self.done):
            if frame in self._evenly:
                self.outlines[frame] = outline.copy()
        self.done = rows.stop


@dataclass(frozen=True)
class _Outlines(Sequence):
    """The bases of support that are kept; those of other frames are empty."""

    num_frames: int
    kept: dict[int, np.ndarray]
    dtype: Any

    def __len__(self) -> int:
        return self.num_frames

    def __getitem__(self, frame: Any) -> Any:
        return self.kept.get(range(self.num_frames)[frame], np.zeros((0, 3), self.dtype))


def _outline(body: np.ndarray, template: Any, ground: Any, preset: str) -> np.ndarray:
    import ipman_rs as ip

    return ip.analyze(body, template, ground, preset, with_pressure=False).base_of_support.polygon


def evenly_spaced_frames(num_frames: int) -> np.ndarray:
    """All frames of a short sequence, else evenly spaced ones, first and last included."""
    if num_frames <= MAX_LISTED_FRAMES:
        return np.arange(num_frames)
    return np.unique(np.linspace(0, num_frames - 1, MAX_LISTED_FRAMES).round().astype(np.int64))


def listed_frames(numbers: dict[str, np.ndarray], keys: np.ndarray) -> np.ndarray:
    """The frames that report.json and the page list: evenly spaced ones, the drawn and the pictured ones."""
    num_frames = len(numbers["status"])
    chosen = evenly_spaced_frames(num_frames)
    return chosen if len(chosen) == num_frames else np.union1d(np.union1d(chosen, keys), _pictured(numbers))


def _pictured(numbers: dict[str, np.ndarray]) -> list[int]:
    chosen = {0, len(numbers["status"]) - 1}
    for key, worst in (("margin", np.nanargmin), ("com_cop_distance", np.nanargmax)):
        column = np.where(np.isfinite(numbers[key]), numbers[key], np.nan)
        if np.isfinite(column).any():
            chosen.add(int(worst(column)))
    return sorted(chosen)


def key_frames(num_frames: int, num_vertices: int) -> np.ndarray:
    """Which frames are drawn: all of a short sequence, evenly spaced ones of a long one, first and last included."""
    most = min(MAX_KEY_FRAMES, max(1, _KEY_FRAME_VERTICES // max(num_vertices, 1)))
    if num_frames <= most:
        return np.arange(num_frames)
    return np.unique(np.linspace(0, num_frames - 1, most).round().astype(np.int64))


def flagged_name(name: str, flags: Sequence[str]) -> str:
    """A name in a table, marked with ! if there are flags, which are listed below the table."""
    return f"{name} !" if flags else name
