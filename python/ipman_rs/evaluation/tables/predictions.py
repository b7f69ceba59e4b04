"""Estimated bodies from an .npz or .parquet file, in the form of a data set.

| array | | |
|---|---|---|
| `names` | (F,) | names of the frames in the data set, in any order |
| `pose`, `betas`, `transl` | (F, J, 3) or (F, 3 J), (F, n), (F, 3) | rotation vectors, shape, metres |
| `body` | one word | the body model of `pose`: "smpl", "smplh", "smplx", "anny", "anny-lite" |
| `vertices`, `joints`, `joint_names` | (F, V, 3) m, (F, K, 3) m, (K,) | instead of parameters, or in addition |
| `ground` | (4,) or (F, 4) | normal and height, if they differ from the data set's |
| `sequences`, `frame_rate`, `genders` | (F,), Hz, (F,) | |
| `center_of_mass`, `center_of_pressure` | (F, 3) m | measured, in a data set of your own |
| `standing`, `contact` | (F,) | labelled, in a data set of your own |

`betas` and `ground` may be one row for all frames. In Parquet each array is a column of that name, one list per frame,
in which values for all frames are repeated. The data set "own" has the same form: `ipman evaluate estimated.npz --data
own --path true.npz`.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.data import check, plausibility
from ipman_rs.data.frames import Frames, Rows
from ipman_rs.files import regular_file, safe_npz
from ipman_rs.ground import Ground

from . import parquet
from .layout import FOR_ALL, LABELS, LENGTHS, NUMBERS, POINTS, TEXT
from .rows import RowsOnDisk, open_npz

LISTED = 12  # names of arrays


@dataclass(frozen=True)
class ReadOptions:
    """How a file's numbers are read.

    unit: metres per unit of length. degrees: rotations are in degrees. force: implausible people are accepted."""

    unit: float = 1.0
    degrees: bool = False
    force: bool = False


@dataclass(frozen=True, eq=False)
class Predictions:
    """Predictions as a `DataSet`: a length, and any of the frames."""

    path: Path
    columns: dict[str, RowsOnDisk]
    common: dict[str, Any]  # values that all frames share
    fingerprint: str  # of the file's bytes
    options: ReadOptions = ReadOptions()
    others: tuple[str, ...] = ()  # names of the file's arrays that are not used

    def __len__(self) -> int:
        return len(self.columns["names"])

    def __getitem__(self, rows: Rows) -> Frames:
        arrays: dict[str, Any] = {name: column[rows] for name, column in self.columns.items()}
        for name in POINTS:
            if name in arrays:
                arrays[name] = arrays[name].reshape(len(arrays[name]), int(np.prod(arrays[name].shape[1:])) // 3, 3)
        for name in arrays.keys() & set(NUMBERS):
            kind = arrays[name].dtype
            arrays[name] = arrays[name].astype(bool if name in LABELS else np.promote_types(kind, "f4"))
        if self.options.unit != 1.0:
            for name in arrays.keys() & {*LENGTHS}:
                arrays[name] = arrays[name] * self.options.unit
        if self.options.degrees and "pose" in arrays:
            arrays["pose"] = np.radians(arrays["pose"])
        if "betas" in self.common:
            arrays["betas"] = np.repeat(self.common["betas"], len(arrays["names"]), axis=0)
        if "ground" in arrays:
            arrays["ground"] = _ground(arrays["ground"])
        arrays.setdefault("sequences", arrays["names"])
        every = {**self.common, **arrays}
        if self.options.unit != 1.0 and "ground" in every:
            every["ground"] = Ground(every["ground"].normal, every["ground"].height * self.options.unit)
        return Frames(**every)

    @cached_property
    def flags(self) -> tuple[str, ...]:
        """What is unusual about a sample, in words. ValueError, naming the option to use, for what is wrong."""
        findings = [each for each in check.check_frames(check.sample(self)) if not each.what.startswith("lowest of")]
        return plausibility.admit(self.path, [*findings, *self.unused()], self.options.force)

    def unused(self) -> list[check.Finding]:
        """Findings about arrays that no metric uses."""
        findings = []
        beside = [name for name in ("pose", "betas", "transl") if name in self.columns or name in self.common]
        if "vertices" in self.columns and "pose" in beside:
            what = f"vertices are compared, not the bodies of {', '.join(beside)} beside them"
            findings.append(check.Finding("odd", what, "leave one of the two out"))
        if self.others:
            findings.append(check.Finding("odd", f"not used: {safe_npz.first_arrays(self.others, LISTED)}"))
        return findings

    @cached_property
    def index(self) -> NameIndex:
        return NameIndex.of(self)


def read(path: str | Path, unpacked: Path, options: ReadOptions | None = None) -> Predictions:
    """The frames of an .npz or .parquet file (see above).

    Args:
        unpacked: folder for arrays that cannot be read row by row in the file (compressed ones, Parquet).
        options: those of a command; errors then name the command's options.

    Raises:
        ValueError: the file (which is named) is missing or damaged, its arrays differ in length, or its units cannot be
            right.
    """
    path = Path(path)
    regular_file(path)
    if path.suffix.lower() not in (".npz", ".parquet"):
        raise ValueError(f"{path}: expected predictions in .npz or .parquet, got {path.suffix or 'no ending'}")
    content = fingerprint(path)
    unpacked = unpacked / content[:16]
    if path.suffix.lower() == ".parquet":
        columns, common, names = parquet.read(path, unpacked)
    else:
        columns, common, names = _read_npz(path, unpacked)
    others = tuple(sorted(names - {*TEXT, *NUMBERS, *FOR_ALL}))
    predictions = Predictions(path, *_check_arrays(path, columns, common), content, options or ReadOptions(), others)
    if options is not None:
        _ = predictions.flags
        return predictions
    check.raise_if_wrong(
        path, [each for each in check.check_frames(check.sample(predictions)) if not each.what.startswith("lowest of")]
    )
    return predictions


def fingerprint(path: Path) -> str:
    """A hash of a file's bytes, which identifies the predictions of a result."""
    digest = hashlib.sha256()
    with regular_file(path).open("rb") as file:
        while chunk := file.read(1 << 20):
            digest.update(chunk)
    return digest.hexdigest()


def _read_npz(path: Path, unpacked: Path) -> tuple[dict[str, RowsOnDisk], dict[str, Any], frozenset[str]]:
    names = frozenset(safe_npz.names(path))
    read = names & {*TEXT, *NUMBERS, *FOR_ALL}
    columns = {name: open_npz(path, name, unpacked) for name in sorted(read - {*FOR_ALL})}
    common = {name: safe_npz.read(path, name) for name in sorted(read & {*FOR_ALL})}
    return columns, common, names


def _check_arrays(
    path: Path, columns: dict[str, RowsOnDisk], common: dict[str, Any]
) -> tuple[dict[str, RowsOnDisk], dict[str, Any]]:
    """Columns with checked lengths and shapes, and the values that all frames share. ValueError for others."""
    if "names" not in columns:
        raise ValueError(f"{path}: expected names, the name of each frame in the data set; {_list_columns(columns)}")
    if not columns.keys() & {*POINTS}:
        raise ValueError(
            f"{path}: expected pose (with betas, transl and body), vertices or joints; {_list_columns(columns)}"
        )
    if "pose" in columns and "body" not in common and "vertices" not in columns:
        raise ValueError(f"{path}: pose without body: add body, one of smpl, smplh, smplx, anny, anny-lite")
    frames = len(columns["names"])
    common = {name: _word(name, value) for name, value in common.items()}
    for name in ("betas", "ground"):
        if name in columns and (len(columns[name].shape) == 1 or columns[name].shape[0] == 1 != frames):
            row = columns.pop(name)[:].reshape(1, -1)
            common[name] = row if name == "betas" else _ground(row[0])
    for name, column in columns.items():
        _check(f"{path}: {name}", name, column, frames)
    return columns, common


def _check(where: str, name: str, column: RowsOnDisk, frames: int) -> None:
    kinds, what = ("US", "text") if name in TEXT else ("fiub", "numbers")
    if column.dtype.kind not in kinds:
        raise ValueError(f"{where}: expected {what}, got {column.dtype}")
    if not column.shape or column.shape[0] != frames:
        raise ValueError(f"{where}: expected {frames} rows, one for each of names, got shape {column.shape}")
    row = column.shape[1:]
    if name in POINTS and not (
        len(row) in (1, 2) and row[-1] and (row[-1] == 3 or (len(row) == 1 and row[0] % 3 == 0))
    ):
        raise ValueError(f"{where}: expected ({frames}, n, 3) or ({frames}, 3 n), got {column.shape}")
    expected = {"betas": row[:1], "ground": (4,), "transl": (3,), "center_of_mass": (3,), "center_of_pressure": (3,)}
    if name not in POINTS and row != expected.get(name, ()):
        raise ValueError(f"{where}: expected {(frames, *(expected.get(name) or ('n',)))}, got {column.shape}")


def _word(name: str, value: NDArray[Any]) -> Any:
    if name == "frame_rate":
        return float(value)
    return tuple(np.asarray(value).astype(str).tolist()) if name == "joint_names" else str(value)


def _ground(rows: NDArray[Any]) -> Ground:
    return Ground(rows[..., :3], rows[..., 3])


def _list_columns(columns: dict[str, RowsOnDisk]) -> str:
    return f"it has {', '.join(sorted(columns)) or 'nothing of that'}"


@dataclass(frozen=True, eq=False)
class NameIndex:
    """The row of each frame's name in a file, in 16 bytes per name."""

    column: RowsOnDisk
    hashes: NDArray[np.uint64]  # sorted
    rows: NDArray[np.int64]

    @classmethod
    def of(cls, predictions: Predictions) -> NameIndex:
        """The index of all names. ValueError if a name occurs twice."""
        column = predictions.columns["names"]
        hashes = np.concatenate([_hashes(block) for block in column.blocks()] or [np.zeros(0, np.uint64)])
        rows = np.argsort(hashes, kind="stable")
        hashes = hashes[rows]
        twice = np.flatnonzero(hashes[1:] == hashes[:-1])
        if len(twice):
            name = column[rows[twice[:1]]][0]
            raise ValueError(
                f"{predictions.path}: names: {len(twice)} frames stand there more than once, such as {str(name)!r}"
            )
        return cls(column, hashes, rows)

    def find(self, names: NDArray[np.str_]) -> NDArray[np.int64]:
        """The row of each name, −1 if the file does not have it."""
        if not len(self.rows):
            return np.full(len(names), -1)
        wanted = _hashes(names)
        place = np.searchsorted(self.hashes, wanted).clip(max=len(self.hashes) - 1)
        return np.where(self.hashes[place] == wanted, self.rows[place], -1)


def _hashes(names: NDArray[Any]) -> NDArray[np.uint64]:
    """A hash of 64 bits of each name: two of a million names collide with a probability of 1 in 40 million."""
    texts = np.char.encode(names, "utf-8") if names.dtype.kind == "U" else names
    digests = b"".join(hashlib.blake2b(text, digest_size=8).digest() for text in texts.tolist())
    return np.frombuffer(digests, np.uint64)
