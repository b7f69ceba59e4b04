"""The paths of the files of MoYo's sequences."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

SPLITS = ("train", "val")
SUFFIX = "_stageii.pkl"


@dataclass(frozen=True)
class SequenceFiles:
    """The files of a sequence; only that of the body must exist."""

    session: Path
    split: str
    name: str

    @property
    def mosh(self) -> Path:
        return self.session / "mosh" / self.split / f"{self.name}{SUFFIX}"

    @property
    def com(self) -> Path:
        return self.session / "com" / self.split / f"{self.name}.c3d"

    @property
    def mat(self) -> tuple[Path, Path, Path]:
        """Maps, centres of pressure, and corners."""
        folder = self.session / "pressure" / self.split
        parts = (("xml", ".xml"), ("single_csv", ".csv"), ("pressure_mat_c3d", ".c3d"))
        maps, centers, corners = (folder / part / f"{self.name}{ending}" for part, ending in parts)
        return maps, centers, corners

    def images(self, camera: int) -> Path:
        return self.session / "images" / self.split / self.name / f"YOGI_Cam_{camera:02d}"


def find_sequences(root: Path, split: str | None) -> list[SequenceFiles]:
    if split is not None and split not in SPLITS:
        raise ValueError(f"split: expected one of {', '.join(SPLITS)}, got {split!r}")
    if not root.is_dir():
        raise ValueError(f"{root}: expected a folder with mosh/train/*{SUFFIX} in it, {_what(root)}")
    sessions = [root] if (root / "mosh").is_dir() else sorted(each.parent for each in root.glob("*/mosh"))
    recordings = [
        SequenceFiles(session, part, file.name.removesuffix(SUFFIX))
        for session in sessions
        for part in (SPLITS if split is None else (split,))
        for file in sorted((session / "mosh" / part).glob(f"*{SUFFIX}"))
    ]
    if not recordings:
        raise ValueError(f"{root}: expected sequences (mosh/{split or 'train'}/*{SUFFIX}), found none")
    return recordings


def _what(path: Path) -> str:
    return "got a file" if path.exists() else "no such folder"
