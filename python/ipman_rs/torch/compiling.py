"""Marks for torch.compile that do not load it: that takes two seconds, which only those who compile should pay."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable[..., Any])


def assume_constant_result(function: Function) -> Function:
    """As `torch.compiler.assume_constant_result`, which sets this very attribute (a test compares)."""
    function._dynamo_marked_constant = True  # type: ignore[attr-defined]
    return function
