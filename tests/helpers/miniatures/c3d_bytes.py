"""C3D files byte by byte, after the format's manual: for what no writer writes, and for each processor's numbers."""

from __future__ import annotations

import struct

import numpy as np

INTEL, DEC, MIPS = 84, 85, 86


def real(value, processor):
    """Four bytes of a real number."""
    if processor != DEC:
        return struct.pack(">f" if processor == MIPS else "<f", value)
    raw = struct.pack(">f", value * 4)  # the exponent is larger by 2, and the halves change places
    return raw[1::-1] + raw[:1:-1]


def whole(value, processor):
    return struct.pack(">H" if processor == MIPS else "<H", int(value) & 0xFFFF)


def parameter(group, name, value, processor=INTEL, offset=None, kind=None, sizes=None):
    """A parameter's record: texts, whole or real numbers; `kind` and `sizes` say otherwise what it is."""
    value = np.array(value)
    if value.dtype.kind in "US":
        width = max((len(text.encode()) for text in value.ravel()), default=0)
        data = b"".join(text.encode().ljust(width) for text in value.ravel())
        kind, sizes = kind or -1, sizes or [width, *value.shape]
    else:
        write = real if value.dtype.kind == "f" else whole
        data = b"".join(write(number, processor) for number in value.ravel())
        kind, sizes = kind or (4 if value.dtype.kind == "f" else 2), sizes or [*value.shape[::-1]]
    body = struct.pack("bB", kind, len(sizes)) + bytes(sizes) + data + b"\0"
    after = 2 + len(body) if offset is None else offset
    return struct.pack("bb", len(name), group) + name.encode() + whole(after, processor) + body


def group(number, name, processor=INTEL):
    return struct.pack("bb", len(name), -number) + name.encode() + whole(3, processor) + b"\0"


def points_of(count=3, frames=4):
    """(frames, count, 3) whole numbers, so that every way to write them is exact."""
    return (np.arange(frames * count * 3).reshape(frames, count, 3) * 7 % 1000 + 1).astype(float)


def c3d(
    points=None,
    analogs=None,
    *,
    names=None,
    processor=INTEL,
    reals=True,
    scale=1.0,
    samples=2,
    unit="mm",
    up="+Z",
    first=1,
    header=None,
    more=(),
    point=None,
    missing=(),
    rate=100.0,
):
    """The bytes of a file.

    `points` (T, P, 3) and `analogs` (T * samples, A) as stored numbers. `header` {word from 1: number} and `point`
    {parameter: value, None to leave it out} change what the file says of itself; `more` records of parameters go behind
    the usual ones; `missing` (frame, point) were not seen.
    """
    points = points_of() if points is None else np.asarray(points, float)
    frames, count = points.shape[:2]
    analogs = np.zeros((frames * samples, 0)) if analogs is None else np.asarray(analogs, float)
    channels = analogs.shape[1]
    names = [f"P{number}" for number in range(count)] if names is None else names
    said = {
        "USED": count,
        "FRAMES": frames,
        "SCALE": -scale if reals else scale,
        "RATE": rate,
        "UNITS": [unit],
        "LABELS": names[:255],
        "DATA_START": 0,
    }
    if len(names) > 255:
        said["LABELS2"] = names[255:]
    if up:
        said["Y_SCREEN"] = [up]
    said |= point or {}
    about = {"USED": channels, "RATE": rate * samples, "GEN_SCALE": 1.0}

    def records(start):
        values = {**said, "DATA_START": start} if said.get("DATA_START") is not None else said
        yield group(1, "POINT", processor)
        yield from (parameter(1, name, value, processor) for name, value in values.items() if value is not None)
        yield group(2, "ANALOG", processor)
        yield from (parameter(2, name, value, processor) for name, value in about.items())
        yield from more

    size = 4 + sum(map(len, records(1))) + 1
    blocks = -(-size // 512)
    start = 2 + blocks
    head = bytes([1, 0x50, blocks & 0xFF, processor]) + b"".join(records(start))
    words = {2: count, 3: channels * samples, 4: first, 5: first + frames - 1, 6: 0, 9: start, 10: samples}
    words |= header or {}
    page = bytearray(512)
    page[0], page[1] = 2, 0x50
    for word, value in words.items():
        page[2 * word - 2 : 2 * word] = whole(value, processor)
    page[12:16] = real(-scale if reals else scale, processor)
    page[20:24] = real(rate, processor)
    write = real if reals else whole
    seen = np.zeros((frames, count))
    for frame, number in missing:
        seen[frame, number] = -1
    data = bytearray()
    for frame in range(frames):
        for number in range(count):
            data += b"".join(write(value, processor) for value in (*points[frame, number], seen[frame, number]))
        for row in analogs[frame * samples : (frame + 1) * samples]:
            data += b"".join(write(value, processor) for value in row)
    return bytes(page) + head.ljust(blocks * 512, b"\0") + bytes(data).ljust(-(-len(data) // 512) * 512, b"\0")
