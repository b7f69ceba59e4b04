"""The runner for the tests of `ipman figure`."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from ipman_rs.cli import main


def _strict(path: Path):
    """Parse JSON that must not hold NaN or Infinity, which strict parsers refuse."""

    def refuse(word: str):
        raise AssertionError(f"{word} is no JSON")

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


@pytest.fixture
def figure(tmp_path):
    """`figure("pull", ...)` into tmp_path/out, in this process: exit code, stdout, stderr, folder and numbers."""

    def call(name: str, *arguments: object, out: str = "out") -> SimpleNamespace:
        folder = tmp_path / out
        words = ["figure", name, *map(str, arguments), "-o", str(folder)]
        result = CliRunner().invoke(main, words)
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        record = folder / f"{name}.json"
        return SimpleNamespace(
            code=result.exit_code, out=result.stdout, err=result.stderr, folder=folder,
            numbers=_strict(record) if record.is_file() else None,
        )  # fmt: skip

    return call


@pytest.fixture(scope="session")
def contents():
    """`contents(folder)` -> the bytes of its files by name."""
    return lambda folder: {path.name: path.read_bytes() for path in sorted(folder.iterdir())}
