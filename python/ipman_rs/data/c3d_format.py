"""The bytes of a C3D file: its header, its parameters and its frames, as the format's manual (c3d.org) has them.

The file's own statements are not trusted: every length, count and offset is compared with the file's size before it is
used, so that a damaged file gives an error and never a crash, invented frames or an endless loop.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Parameters = dict[str, dict[str, list[Any]]]  # values by group and name, both upper case, in the file's order

BLOCK = 512  # bytes; a file's parts begin at blocks
KEY = 0x50  # the second byte of every C3D file
DEC, MIPS = 85, 86  # processors whose numbers are written otherwise than 84, Intel's
WIDTHS = {-1: 1, 1: 1, 2: 2, 4: 4}  # bytes of a character, byte, integer or real number
MOST_DIMENSIONS = 7
MOST_RECORDS = 20_000  # of parameters; files have hundreds
NEARLY = 1e-3  # of a rate: that far the analogue one may be from a multiple of the points'
UNLIKE = 0.01  # of a rate: that far two that mean the same may be from each other
LARGEST_COUNT = 0xFFFF  # of two bytes: files with as many frames or more say elsewhere how many


@dataclass(frozen=True, eq=False)
class Content:
    """P points in T frames, and A analogue channels with n samples a frame."""

    points: Array  # (T, P, 3) in the file's unit; NaN where a point was not seen
    analogs: Array  # (T * n, A), scaled
    first: int  # number of the first frame, from 0
    parameters: Parameters
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Layout:
    """How a frame is stored."""

    points: int
    analogs: int  # numbers: channels times samples
    real: bool  # 4 bytes a number, otherwise 2

    @property
    def size(self) -> int:
        return (4 * self.points + self.analogs) * (4 if self.real else 2)


def content(data: bytes) -> Content:
    """The content of a file of these bytes. ValueError, saying what is wrong, if it is no C3D file, cut or damaged."""
    if len(data) < BLOCK or data[1] != KEY:
        raise ValueError("expected a C3D file, got something else")
    begin = (data[0] - 1) * BLOCK
    if data[0] == 0 or len(data) < begin + BLOCK:
        raise ValueError("expected a C3D file: it ends before its parameters; is the download complete?")
    numbers = _Numbers(data, data[begin + 3])
    header = [int(word) & 0xFFFF for word in numbers.integers(0, BLOCK // 2)]
    notes: list[str] = []
    parameters = _parameters(numbers, begin, header[8], notes)
    start, layout = _layout(numbers, header, parameters, notes)
    _compare_rates(float(numbers.reals(20, 1)[0]), header, parameters, notes)
    frames = _frames(len(data) - start, layout, header, parameters, notes)
    count = frames * layout.size // (4 if layout.real else 2)
    stored = numbers.reals(start, count) if layout.real else numbers.integers(start, count)
    rows = stored.reshape(frames, 4 * layout.points + layout.analogs)
    return Content(
        _points(rows[:, : 4 * layout.points], layout, _scale(numbers, parameters)),
        _analogs(rows[:, 4 * layout.points :], layout, header, parameters, notes),
        max(header[3], 1) - 1,
        parameters,
        tuple(notes),
    )


@dataclass(frozen=True)
class _Numbers:
    """Numbers of a file as its processor writes them; `place` and counts must lie inside the file."""

    data: bytes
    processor: int

    def integers(self, place: int, count: int) -> NDArray[np.int16]:
        return np.frombuffer(self.data, ">i2" if self.processor == MIPS else "<i2", count, place)

    def reals(self, place: int, count: int) -> Array:
        if self.processor != DEC:
            kind = ">f4" if self.processor == MIPS else "<f4"
            with np.errstate(invalid="ignore"):  # NaN that signals
                return np.frombuffer(self.data, kind, count, place).astype(np.float64)
        words = np.frombuffer(self.data, "<u2", 2 * count, place).reshape(-1, 2).astype(np.uint32)
        bits = (words[:, 0] << 16) | words[:, 1]  # the halves change places, and the exponent is larger by 2
        with np.errstate(invalid="ignore"):
            return np.where(bits & 0x7F800000, bits.view(np.float32).astype(np.float64) / 4, 0.0)

    def count(self, place: int) -> int:
        """A number of two bytes that is never negative."""
        return int(self.integers(place, 1)[0]) & 0xFFFF


def _parameters(numbers: _Numbers, begin: int, data_block: int, notes: list[str]) -> Parameters:
    blocks = max(numbers.data[begin + 2], data_block - 1 - begin // BLOCK)  # one byte counts no more than 255 of them
    end = min(begin + blocks * BLOCK, len(numbers.data))
    groups: dict[int, str] = {}
    records: list[tuple[int, str, list[Any]]] = []
    for number, name, value in _records(numbers, begin + 4, end, notes):
        if value is None:
            groups[-number] = name
        else:
            records.append((number, name, value))
    parameters: Parameters = {name: {} for name in groups.values()}
    for number, name, value in records:
        if number in groups:
            parameters[groups[number]][name] = value
    if "POINT" not in parameters:
        raise ValueError("expected a C3D file: its parameters have no group POINT")
    return parameters


def _records(numbers: _Numbers, place: int, end: int, notes: list[str]) -> Iterator[tuple[int, str, list[Any] | None]]:
    """Number, name and values of each parameter; minus the number, the name and None of each group."""
    for _ in range(MOST_RECORDS):
        if place + 2 > end or numbers.data[place] == 0:
            return
        length, number = (int(byte) for byte in np.frombuffer(numbers.data, np.int8, 2, place))
        after = place + 2 + abs(length)  # of the name; negative lengths are those of locked parameters
        if after + 3 > end or number == 0:
            raise ValueError(f"expected a C3D file: its parameters are damaged (at byte {place})")
        name = _text(numbers.data[place + 2 : after]).upper()
        value, stop = (None, after + 3 + numbers.data[after + 2]) if number < 0 else _value(numbers, after, end, name)
        yield number, name, value
        offset = numbers.count(after)
        if offset == 0:
            return
        place = after + offset
        if stop > place or (_begins(numbers.data, stop, end) and not _begins(numbers.data, place, end)):
            notes.append(f"the parameter {name} says wrongly where the next one is; read one after the other")
            place = stop
    raise ValueError(f"expected a C3D file: more than {MOST_RECORDS} parameters")


def _begins(data: bytes, place: int, end: int) -> bool:
    """Whether a parameter can begin here: with the length of a readable name."""
    if place >= end or data[place] == 0:
        return False
    length = data[place] if data[place] < 128 else 256 - data[place]
    name = data[place + 2 : place + 2 + length]
    return place + 2 + length < end and all(32 < byte < 127 for byte in name)


def _value(numbers: _Numbers, after: int, end: int, name: str) -> tuple[list[Any], int]:
    """The values of the parameter whose name ends at `after`, and where it ends itself."""
    data, place = numbers.data, after + 4
    kind = data[after + 2] - 256 if data[after + 2] > 127 else data[after + 2]
    count = data[after + 3] if after + 3 < end else MOST_DIMENSIONS + 1
    if kind not in WIDTHS or count > MOST_DIMENSIONS or place + count > end:
        raise ValueError(f"expected a C3D file: its parameter {name} is damaged")
    sizes, place = [*data[place : place + count]], place + count
    total = math.prod(sizes)
    stop = place + total * WIDTHS[kind]
    if stop > end:
        raise ValueError(f"expected a C3D file: its parameter {name} has {total} values, more than there are")
    if kind == -1:
        width = sizes[0] if sizes else 1
        value = [_text(data[at : at + width]) for at in range(place, stop, max(width, 1))]
    elif kind == 1:
        value = [*data[place:stop]]
    else:
        value = (numbers.integers if kind == 2 else numbers.reals)(place, total).tolist()
    return value, stop + 1 + (data[stop] if stop < end else 0)


def _text(data: bytes) -> str:
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return text.replace("\0", " ").strip()


def _layout(numbers: _Numbers, header: list[int], parameters: Parameters, notes: list[str]) -> tuple[int, _Layout]:
    """Where the frames begin, and how they are stored: as the parameters say, or else as the header does.

    ValueError where the two disagree and the file's size does not tell which of them is right.
    """
    blocks = [block for block in (header[8], _count(parameters, "POINT", "DATA_START")) if block]
    starts = [(block - 1) * BLOCK for block in dict.fromkeys(blocks)]
    if not starts or min(starts) < BLOCK or min(starts) > len(numbers.data):
        raise ValueError("expected a C3D file: it ends before its frames; is the download complete?")
    scale, real = _first(parameters, "POINT", "SCALE"), bool(np.signbit(numbers.reals(12, 1)[0]))
    used = _count(parameters, "POINT", "USED")
    points, counts = header[1] if used is None else used, _analog_counts(header, parameters)
    by_parameters = [_Layout(points, count, real if scale is None else scale < 0) for count in counts]
    by_header = [_Layout(header[1], count, real) for count in counts]
    possible = [(start, each) for each in dict.fromkeys(by_parameters + by_header) for start in starts]
    if len(possible) == 1:
        return possible[0]
    frames = max(_said_frames(header, parameters), default=0)
    filled = [  # the last block is filled up
        (start, each) for start, each in possible if 0 <= len(numbers.data) - start - frames * each.size < BLOCK
    ]
    if len(filled) != 1 and len(starts) == 1 and by_parameters[0] == by_header[0] and _of_used(header, parameters):
        filled = [(starts[0], by_parameters[0])]  # the rates alone say otherwise, and the size does not tell
    if len(filled) != 1:
        raise ValueError(
            f"expected a C3D file: its header has {header[1]} points and {header[2]} analogue samples a frame from "
            f"block {header[8]} on, its parameters have {points} and {_or(counts)} from block {blocks[-1]} on"
        )
    start, each = filled[0]
    notes.append(f"header and parameters disagree; it is read with {each.points} points and {each.analogs} samples")
    return start, each


def _analog_counts(header: list[int], parameters: Parameters) -> list[int]:
    """How many analogue numbers a frame may have: as the header says, and as channels times samples a frame are."""
    channels = _count(parameters, "ANALOG", "USED")
    if channels is None:
        return [header[2]]
    return list(dict.fromkeys([header[2], *(channels * samples for samples in _samples(header, parameters))]))


def _of_used(header: list[int], parameters: Parameters) -> bool:
    """Whether the header's samples a frame, times the channels that are used, are its analogue numbers."""
    return _count(parameters, "ANALOG", "USED") == header[2] / max(header[9], 1)


def _samples(header: list[int], parameters: Parameters) -> list[int]:
    """How many samples of a channel a frame may have: as the header says, and as the two rates do.

    A header without a number says nothing where the rates do.
    """
    points, analogs = _first(parameters, "POINT", "RATE"), _first(parameters, "ANALOG", "RATE")
    ratio = analogs / points if points and analogs and points > 0 and analogs > 0 else 0.0
    whole = round(ratio) if math.isfinite(ratio) else 0
    by_rates = [whole] if whole > 0 and abs(ratio - whole) < NEARLY * ratio else []
    return list(dict.fromkeys([*([header[9]] if header[9] or not by_rates else []), *by_rates]))


def _or(counts: list[int]) -> str:
    return " or ".join(map(str, counts))


def _compare_rates(of_header: float, header: list[int], parameters: Parameters, notes: list[str]) -> None:
    """Notes of rates of the points that are not POINT:RATE, which is believed."""
    rate, analogs = _first(parameters, "POINT", "RATE"), _first(parameters, "ANALOG", "RATE")
    if not rate or not math.isfinite(rate) or rate <= 0:
        return
    others = [("its header says", of_header)]
    if analogs and header[9] and header[2]:
        others.append((f"ANALOG:RATE and {header[9]} samples a frame say", analogs / header[9]))
    for what, other in others:
        if math.isfinite(other) and other > 0 and abs(other / rate - 1) > UNLIKE:
            notes.append(f"{what} {other:.4g} Hz, POINT:RATE says {rate:.4g} Hz, which is believed (`rate`)")


def _said_frames(header: list[int], parameters: Parameters) -> list[int]:
    """The numbers of frames that header and parameters say."""
    first, last = header[3], header[4]
    counts = [last - first + 1] if last >= first and last > 0 else []
    count = _count(parameters, "POINT", "FRAMES")
    more = _more_frames(parameters)
    if more and LARGEST_COUNT in (last, count):  # two bytes are not enough for it
        return [more]
    return counts + ([count] if count else [])


def _more_frames(parameters: Parameters) -> int | None:
    """The number of frames where it is written in more than two bytes."""
    words = [parameters.get("TRIAL", {}).get(f"ACTUAL_{name}_FIELD", []) for name in ("START", "END")]
    if all(len(each) == 2 for each in words):  # the low and the high half of the first and the last one's number
        begin, end = ((int(low) & 0xFFFF) + ((int(high) & 0xFFFF) << 16) for low, high in words)
        if end >= begin:
            return end - begin + 1
    return _count(parameters, "POINT", "LONG_FRAMES")


def _frames(available: int, layout: _Layout, header: list[int], parameters: Parameters, notes: list[str]) -> int:
    """How many frames there are. ValueError for frames that the file says it has and that are not there."""
    if layout.size == 0:
        raise ValueError("expected points or analogue samples, it has none")
    counts, capacity = _said_frames(header, parameters), available // layout.size
    if max(counts, default=0) > capacity:
        raise ValueError(
            f"expected {max(counts)} frames as it says, {capacity} at most fit in: is the download complete?"
        )
    if not counts:
        raise ValueError("expected a C3D file: it does not say how many frames it has")
    if LARGEST_COUNT - header[3] < max(counts) <= LARGEST_COUNT == header[4] and not _more_frames(parameters):
        notes.append(f"the first {max(counts)} frames are read: it does not say how many more there are")
    elif min(counts) < max(counts):
        notes.append(f"it says {min(counts)} and {max(counts)} frames; {max(counts)} are read")
    elif available - max(counts) * layout.size >= BLOCK:  # the last block is filled up
        notes.append(
            f"the last {available - max(counts) * layout.size} bytes, behind its {max(counts)} frames, are not read"
        )
    return max(counts)


def _scale(numbers: _Numbers, parameters: Parameters) -> float:
    """What makes the points' unit of integers."""
    scale = _first(parameters, "POINT", "SCALE")
    return abs(float(numbers.reals(12, 1)[0]) if scale is None else scale)


def _points(stored: NDArray[Any], layout: _Layout, scale: float) -> Array:
    """Points (T, P, 3) of x, y, z and a residual each, which is negative where the point was not seen."""
    values = stored.reshape(len(stored), layout.points, 4)
    if not layout.real and not (np.isfinite(scale) and scale > 0):
        raise ValueError(f"expected a C3D file: POINT:SCALE is {scale:g}, so its integers are no lengths")
    places = values[..., :3].astype(np.float64) * (1.0 if layout.real else scale)
    places[values[..., 3] < 0] = np.nan
    return places


def _channels(analogs: int, header: list[int], parameters: Parameters, notes: list[str]) -> int:
    """Of how many channels a frame's analogue numbers are.

    ValueError where the number of channels and that of their samples do not make that of all.
    """
    used, samples = _count(parameters, "ANALOG", "USED"), _samples(header, parameters)
    if analogs == 0 or used == 0:
        return 0
    if not used:
        return analogs // max(header[9], 1)
    if analogs in [used * each for each in samples] or (samples in ([0], [1]) and analogs % used == 0):
        return used
    if len(samples) == 1 and samples[0] > 0 and analogs % samples[0] == 0:  # header and rates say the same
        notes.append(f"ANALOG:USED says {used} channels; it is read with {analogs // samples[0]}, as its frames have")
        return analogs // samples[0]
    raise ValueError(
        f"expected a C3D file: {used} channels of {_or(samples)} samples a frame cannot be {analogs} numbers a frame"
    )


def _analogs(
    stored: NDArray[Any], layout: _Layout, header: list[int], parameters: Parameters, notes: list[str]
) -> Array:
    """Channels (T * n, A): (number - offset) times the channel's scale and the general one."""
    channels = _channels(layout.analogs, header, parameters, notes)
    if channels == 0:
        return np.zeros((0, 0))
    about = parameters.get("ANALOG", {})
    unsigned = not layout.real and "".join(map(str, about.get("FORMAT", []))).upper().startswith("UNSIGNED")
    values = stored.reshape(-1, channels).astype(np.float64)
    offset = _each(about, "OFFSET", channels, 0.0)
    if unsigned:
        values, offset = values % 65536, offset % 65536
    general = _first(parameters, "ANALOG", "GEN_SCALE")
    with np.errstate(over="ignore", invalid="ignore"):  # reals of a damaged file; whoever uses them looks at them
        return (values - offset) * _each(about, "SCALE", channels, 1.0) * (1.0 if general is None else general)


def _each(about: dict[str, list[Any]], name: str, channels: int, lacking: float) -> Array:
    """A number of each channel; a parameter holds up to 255 of them, the next has a 2 behind its name."""
    values = parameter_values(about, name)
    numbers = [float(value) for value in values[:channels] if isinstance(value, (int, float))]
    return np.array(numbers + [lacking] * (channels - len(numbers)))


def parameter_values(about: dict[str, list[Any]], name: str) -> list[Any]:
    """The values of a parameter and its continuations: LABELS, LABELS2, LABELS3, …"""
    values, more = list(about.get(name, [])), 2
    while f"{name}{more}" in about:
        values += about[f"{name}{more}"]
        more += 1
    return values


def _first(parameters: Parameters, group: str, name: str) -> float | None:
    value = parameters.get(group, {}).get(name, [])[:1]
    return float(value[0]) if value and isinstance(value[0], (int, float)) else None


def _count(parameters: Parameters, group: str, name: str) -> int | None:
    """A number that is never negative: integers of two bytes go up to 65535."""
    value = _first(parameters, group, name)
    if value is None or not math.isfinite(value):
        return None
    return int(value) + (65536 if value < 0 else 0)
