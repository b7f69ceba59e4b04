"""One way to refuse unknown names and meaningless numbers."""

from __future__ import annotations

from collections.abc import Sequence


def chosen(argument: str, value: str, choices: Sequence[str]) -> str:
    """`value`, if it is among the choices.

    Raises:
        ValueError: it is not; names the argument and the choices.
    """
    if value not in choices:
        raise ValueError(f"{argument}: expected one of {', '.join(choices)}, got {value!r}")
    return value


def positive(argument: str, metres: float) -> float:
    """`metres`, if it is above zero.

    Raises:
        ValueError: it is not.
    """
    if not metres > 0.0:
        raise ValueError(f"{argument}: expected positive metres, got {metres!r}")
    return float(metres)
