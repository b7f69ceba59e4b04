"""The library's names of arguments, in its messages, as options of the command line."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator

import click

_ARGUMENT = re.compile(r"`([a-z_]+)(?:=([^`]*))?`")


def with_flags(text: str) -> str:
    """Text of the library with `units='mm'` as --units mm: by the running command's options, else by any command's."""
    context = click.get_current_context(silent=True)
    if context is None or "`" not in text:
        return text
    flags = {**_flags(context.find_root().command), **_flags(context.command)}

    def flag(found: re.Match[str]) -> str:
        name, value = found.groups()
        if name not in flags:
            return found[0]
        word = None if value is None else shlex.quote(value.strip("'"))
        return flags[name] if word is None else f"{flags[name]} {word}"

    return _ARGUMENT.sub(flag, text)


def usage(text: str, context: click.Context | None) -> str:
    """What is wrong with an argument, "units: ...", of the option that the command has for it, "--units: ..."."""
    flags = {} if context is None else _flags(context.command)
    name, colon, rest = text.partition(":")
    return f"{flags.get(name, name)}{colon}{rest}"


def _flags(command: click.Command) -> dict[str, str]:
    """The longest name of each option of a command, and of the commands in it."""
    return {
        str(option.name): max(option.opts, key=len)
        for each in _commands(command)
        for option in each.params
        if isinstance(option, click.Option)
    }


def _commands(command: click.Command) -> Iterator[click.Command]:
    yield command
    if isinstance(command, click.Group):
        for each in command.commands.values():
            yield from _commands(each)
