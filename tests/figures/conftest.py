"""The miniatures of data sets are those of tests/data."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from ipman_rs.cli import main

sys.path.append(str(Path(__file__).resolve().parents[1] / "data"))


@pytest.fixture
def figure():
    """`figure("pull", ...)` in this process: exit code, stdout and stderr."""

    def call(*arguments: object) -> SimpleNamespace:
        result = CliRunner().invoke(main, ["figure", *map(str, arguments)])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return SimpleNamespace(code=result.exit_code, out=result.stdout, err=result.stderr)

    return call
