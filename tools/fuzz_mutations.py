"""Damage that knows what it damages: bytes, JSON trees, numbers in text, members of archives, opcodes of pickles."""

from __future__ import annotations

import io
import json
import pickletools
import random
import re
import struct
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np

Mutation = Callable[[random.Random, bytes], bytes]

ODD_NUMBERS = (
    "nan", "inf", "-inf", "1e400", "-1e308", "1e-320", "9" * 310, "9" * 5000, "0", "-0", "-1", "1e9", "2147483648",
    "18446744073709551616", "0x10", "1,5", "1.2.3", "", "-nan(ind)", "1_000", "٣", "+", "e5", "null", "true",
)  # fmt: skip
ODD_VALUES = (
    None, True, -1, 0, 2**31, 2**63, 2**64, 10**400, 1e308, float("nan"), float("inf"), "", "x" * 1000, "\x00", "﷽",
    [], {}, [[]], [[1], [2, 3]], {"": {}}, [None], "nan", 0.5, [1e308] * 3,
)  # fmt: skip
ODD_WORDS = (0, 1, 2, 127, 128, 255, 256, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
ODD_ARRAYS: tuple[Callable[[np.ndarray], np.ndarray], ...] = (
    lambda a: np.full_like(a, np.nan, dtype=float), lambda a: np.full(a.shape, 1e308), lambda a: a.astype(complex,
    copy=True),
    lambda a: np.empty(a.shape, "datetime64[s]"), lambda a: a[..., None], lambda a: a.reshape(-1),
    lambda a: np.atleast_1d(a)[:0],
    lambda a: np.array("text"), lambda a: np.array(7), lambda a: np.zeros((0, 3)), lambda a: np.asfortranarray(a),
    lambda a: np.full(a.shape, -1), lambda a: np.full(a.shape, 2**63, np.uint64), lambda a: np.full(a.shape, "é"),
    lambda a: np.zeros(a.shape, [("x", "f4"), ("y", "i2")]), lambda a: np.full(a.shape, np.inf),
    lambda a: np.zeros(a.shape, bool),
    lambda a: np.zeros(a.shape, ">f8"), lambda a: np.zeros(a.shape, "f2"), lambda a: np.broadcast_to(a, (2, *a.shape)),
)  # fmt: skip


def of_bytes(draw: random.Random, content: bytes) -> bytes:
    """Some bytes changed, cut, doubled or put in."""
    data = bytearray(content)
    for _ in range(draw.choice((1, 1, 1, 2, 4, 16))):
        if not data:
            return bytes(data)
        place, kind = draw.randrange(len(data)), draw.randrange(7)
        if kind == 0:
            data[place] ^= 1 << draw.randrange(8)
        elif kind == 1:
            data[place] = draw.choice((0, 1, 0x20, 0x7F, 0x80, 0xFF, 0x5B, 0x7B))
        elif kind == 2:
            word = struct.pack(draw.choice("<>") + draw.choice("HI"), draw.choice(ODD_WORDS) & 0xFFFF)
            data[place : place + len(word)] = word
        elif kind == 3:
            del data[place : place + draw.choice((1, 4, 64, 512))]
        elif kind == 4:
            data[place:place] = data[place : place + draw.choice((1, 8, 256))] * draw.choice((1, 3, 50))
        elif kind == 5:
            data = data[: draw.choice((place, 0, 1, 512, len(data) - 1))]
        else:
            data[place:place] = draw.randbytes(draw.choice((1, 4, 32)))
    return bytes(data)


def of_first_bytes(draw: random.Random, content: bytes) -> bytes:
    """Only the first two kilobytes, where headers and parameters are."""
    return of_bytes(draw, content[:2048]) + content[2048:]


def of_text(draw: random.Random, content: bytes) -> bytes:
    """Numbers and words replaced, lines dropped, doubled, moved and joined."""
    text = content.decode("utf-8", "replace")
    for _ in range(draw.choice((1, 1, 2, 5))):
        numbers = list(re.finditer(r"[-+]?\d[\d.eE+-]*", text))
        kind = draw.randrange(6)
        if kind <= 2 and numbers:
            one = draw.choice(numbers)
            text = text[: one.start()] + draw.choice(ODD_NUMBERS) + text[one.end() :]
            continue
        lines = text.split("\n")
        place = draw.randrange(len(lines))
        if kind == 3:
            del lines[place : place + draw.choice((1, 2, 20))]
        elif kind == 4:
            lines[place:place] = [lines[draw.randrange(len(lines))]] * draw.choice((1, 2, 200))
        else:
            tokens = (
                "\t",
                " ",
                ":",
                "#",
                "&a ",
                "*a",
                "!!python/name:os.system",
                "[" * 500,
                "{",
                "\x00",
                "\ud7ff",
                "- ",
                "<<: ",
                "=1+1",
            )
            row = lines[place]
            cut = draw.randrange(len(row) + 1)
            lines[place] = row[:cut] + draw.choice(tokens) + row[cut + draw.choice((0, 1, 5)) :]
        text = "\n".join(lines)
    return text.encode("utf-8", "replace")


def of_json(draw: random.Random, content: bytes) -> bytes:
    """A node of the tree replaced, dropped, doubled, renamed or nested; now and then only bytes."""
    if draw.random() < 0.15:
        return of_bytes(draw, content)
    tree = json.loads(content)
    for _ in range(draw.choice((1, 1, 1, 3))):
        tree = _changed(draw, tree)
    if draw.random() < 0.03:
        return b"[" * 100_000
    return json.dumps(tree).encode()


def _changed(draw: random.Random, tree: Any) -> Any:
    """A copy with one node changed; deeper ones are more likely than their number says."""
    if not isinstance(tree, (dict, list)) or not tree or draw.random() < 0.2:
        value = draw.choice(ODD_VALUES)
        return [value] * draw.choice((1, 4)) if draw.random() < 0.1 else value
    key = draw.choice(list(tree) if isinstance(tree, dict) else list(range(len(tree))))
    fresh: Any = dict(tree) if isinstance(tree, dict) else list(tree)
    kind = draw.randrange(8)
    if kind == 0:
        del fresh[key]
    elif kind == 1 and isinstance(fresh, list):
        fresh[key:key] = [fresh[key]] * draw.choice((1, 3, 100))
    elif kind == 1 and isinstance(fresh, dict):
        fresh[draw.choice(("", "x", str(key).upper(), "=1"))] = fresh.pop(key)
    else:
        fresh[key] = _changed(draw, fresh[key])
    return fresh


def of_glb(draw: random.Random, content: bytes) -> bytes:
    """The JSON of a .glb as a tree, with its lengths put right; or the bytes."""
    if draw.random() < 0.3:
        return of_bytes(draw, content)
    size = struct.unpack("<I", content[12:16])[0]
    text = of_json(draw, content[20 : 20 + size])
    text += b" " * (-len(text) % 4)
    rest = content[20 + size :]
    whole = 20 + len(text) + len(rest)
    return content[:8] + struct.pack("<III", whole, len(text), 0x4E4F534A) + text + rest


def of_npz(draw: random.Random, content: bytes) -> bytes:
    """A member's array, header, name or packing changed; or the bytes of the archive."""
    if draw.random() < 0.25:
        return of_bytes(draw, content)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = draw.choice(list(members))
    kind = draw.randrange(6)
    if kind == 0:
        del members[name]
    elif kind == 1:
        members[draw.choice(("x", "vertices", "faces", "../a", "", "\udcff"[:0] + "é", name * 2)) + ".npy"] = (
            members.pop(name)
        )
    elif kind == 2:
        head = members[name][:128]
        members[name] = of_text(draw, head[10:]).join((head[:10], members[name][128:]))
    elif kind == 3:
        members[name] = of_bytes(draw, members[name])
    else:
        array = np.load(io.BytesIO(members[name]), allow_pickle=False)
        stream = io.BytesIO()
        np.save(stream, draw.choice(ODD_ARRAYS)(array) if array.dtype.kind in "fiub" else array[..., None])
        members[name] = stream.getvalue()
    out = io.BytesIO()
    packing = draw.choice((zipfile.ZIP_STORED, zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
    with zipfile.ZipFile(out, "w", packing) as archive:
        for each, data in members.items():
            archive.writestr(zipfile.ZipInfo(each), data, packing)
    return out.getvalue()


def of_npy(draw: random.Random, content: bytes) -> bytes:
    if draw.random() < 0.5:
        return of_bytes(draw, content)
    return content[:10] + of_text(draw, content[10:128]) + content[128:]


def of_pickle(draw: random.Random, content: bytes) -> bytes:
    """Opcodes replaced by others, dropped or doubled; or the bytes."""
    if draw.random() < 0.4:
        return of_bytes(draw, content)
    places = [place for _, _, place in pickletools.genops(content) if place is not None]
    data = bytearray(content)
    for _ in range(draw.choice((1, 1, 2, 4))):
        place = draw.choice(places)
        if place >= len(data):
            continue
        kind = draw.randrange(3)
        if kind == 0:
            data[place] = ord(draw.choice(pickletools.opcodes).code)
        elif kind == 1:
            del data[place]
        else:
            data[place:place] = draw.choice(
                (b"(", b"0", b"2", b"R", b"b", b"}", b"]", b".", b"\x81", b"cos\nsystem\n", b"N")
            )
    return bytes(data)
