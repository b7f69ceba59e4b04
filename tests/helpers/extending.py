"""A page of docs/extending as what it tells its reader to do: files to write, lines to add, and commands to try."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_STEP = re.compile(r"^## \d+\. [^\n]*`([\w/.]+)`\n(.*?)(?=^## |\Z)", re.DOTALL | re.MULTILINE)
_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True)
class Page:
    """files: new ones, by their path. edits: changes of existing ones. tries: the blocks under "Try it"."""

    claim: tuple[int, int]  # new files and edited ones, as the page says
    files: dict[str, str]
    edits: dict[str, list[str]]
    tries: list[tuple[str, str]]

    @classmethod
    def read(cls, name: str) -> Page:
        text = (ROOT / "docs" / "extending" / name).read_text()
        said = re.search(r"(\d+) new files?\s+and\s+(\d+)\s+edits", text)
        assert said is not None, "the page says how many files it takes"
        files, edits = {}, {}
        for path, step in _STEP.findall(text):
            blocks = _BLOCK.findall(step)
            if [language for language, _ in blocks] in (["python"], ["rust"]):
                files[path] = blocks[0][1]
            else:
                assert {language for language, _ in blocks} == {"diff"}, path
                edits[path] = [block for _, block in blocks]
        tries = _BLOCK.findall(text.split("## Try it\n")[1].split("\n## ")[0])
        return cls((int(said[1]), int(said[2])), files, edits, tries)

    def carry_out(self, folder: Path) -> Path:
        """A copy of what the page changes, in `folder`, with its files and edits."""
        unwanted = shutil.ignore_patterns("__pycache__")
        for name in ("python", "tests/helpers"):
            shutil.copytree(ROOT / name, folder / name, ignore=unwanted, dirs_exist_ok=True)
        for name in ("pyproject.toml", "tests/__init__.py", "tests/conftest.py", *self.edits):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
        for path, content in self.files.items():
            assert not (ROOT / path).exists(), f"{path} is there"
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(content)
        for path, blocks in self.edits.items():
            text = (folder / path).read_text()
            for block in blocks:
                lines = block.splitlines(keepends=True)
                before = "".join(line[1:] for line in lines if line[0] in " -")
                assert text.count(before) == 1, f"{path} has these lines {text.count(before)} times:\n{before}"
                text = text.replace(before, "".join(line[1:] for line in lines if line[0] in " +"))
            (folder / path).write_text(text)
        return folder


def run(folder: Path, *words: str) -> str:
    """What a command prints that finds the package and the tests of a copy; fails if it does."""
    environment = {
        **os.environ, "PYTHONPATH": os.pathsep.join([str(folder / "python"), str(folder)]), "OMP_NUM_THREADS": "1",
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{words}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def ipman(folder: Path, line: str) -> str:
    """What `ipman …` prints, run by the copy."""
    command, *words = line.split("#")[0].split()
    assert command == "ipman"
    return run(folder, "-c", "from ipman_rs.cli import main; main()", *words)
