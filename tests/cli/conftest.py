"""Bodies and the runner for the tests of the command line."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from click.testing import CliRunner

import ipman_rs as ip
from ipman_rs.cli import main


@pytest.fixture(scope="session")
def lite_body():
    """The light twin of the embedded body: quick to draw."""
    return ip.load_body("anny-lite")


@pytest.fixture(scope="session")
def standing(lite_body):
    return ip.body.posed(lite_body, "standing")


@pytest.fixture
def run():
    """`run("analyze", ...)` in this process: exit code, stdout and stderr."""

    def call(*arguments: object) -> SimpleNamespace:
        result = CliRunner().invoke(main, [str(argument) for argument in arguments])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return SimpleNamespace(code=result.exit_code, out=result.stdout, err=result.stderr)

    return call
