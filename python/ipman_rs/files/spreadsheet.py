"""Text in tables that spreadsheets open."""

from __future__ import annotations

_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")


def cell(text: str) -> str:
    """Text for a cell of a CSV file. Spreadsheets run a cell that begins like a formula: an apostrophe before it says
    that it is text."""
    return f"'{text}" if text.startswith(_FORMULA) else text
