"""The colours of every picture: CoM pink, CoP green, base of support yellow, pressure from skin grey to dark red."""

from __future__ import annotations

import numpy as np

COM = "#ff4fa3"
COP = "#16b364"
SUPPORT = "#ffd21f"
SUPPORT_EDGE = "#e0a800"
INK = "#24272d"
MUTED = "#767c86"
GRID = "#c9ced6"
SKIN = "#d8d3cd"

# Luminance falls from left to right, so that the map also reads in grey and to colour-blind eyes.
_HEAT_STOPS = ("#d8d3cd", "#f0c48c", "#f08a4b", "#dc4a3d", "#a81e4a", "#5d1049")

# One colour a body part, in the order of the part names; repeated where a body has more parts.
PART_COLORS = (
    "#8fb8de", "#e6a57e", "#9bc995", "#d7a6cf", "#efd27a", "#7fc6c0", "#d98f8f", "#a9a6dc", "#b9cf73", "#c9b299",
)  # fmt: skip


def rgb(color: str) -> np.ndarray:
    """(3,) in [0, 1] of a colour written ``#rrggbb``."""
    return np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0


def heat_table(size: int = 256) -> np.ndarray:
    """(size, 3) colours of the pressure map, from none to the top of the scale."""
    stops = np.array([rgb(color) for color in _HEAT_STOPS])
    at = np.linspace(0.0, 1.0, len(stops))
    ask = np.linspace(0.0, 1.0, size)
    return np.stack([np.interp(ask, at, stops[:, k]) for k in range(3)], axis=-1)


def heat(pressure: np.ndarray, top: float) -> np.ndarray:
    """(..., 3) colours of relative pressures, 0 to ``top``; larger ones take the last colour."""
    table = heat_table()
    index = np.clip(np.nan_to_num(pressure) / top * (len(table) - 1), 0, len(table) - 1)
    return table[index.astype(int)]


def shade(color: str, towards: str, amount: float) -> np.ndarray:
    """(3,) mix of two colours, ``amount`` of the second."""
    return rgb(color) * (1.0 - amount) + rgb(towards) * amount
