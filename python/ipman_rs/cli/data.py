"""`ipman data`: data sets, read and made. Heavy imports wait until a command runs."""

from __future__ import annotations

import click

from .render import render


@click.group()
def data() -> None:
    """Data sets of people with ground and cameras."""


data.add_command(render)
