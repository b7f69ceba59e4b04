"""The quantities of a sequence over time, as one PNG."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from . import colors
from .picture import save

if TYPE_CHECKING:
    from ..study.study import Study

# Column, title, unit, factor to the unit, colour: the report's page shows the same ones.
SERIES = (
    ("com_cop_distance", "CoM–CoP distance", "mm", 1e3, colors.COM),
    ("margin", "support margin", "mm", 1e3, colors.SUPPORT_EDGE),
    ("area", "base of support", "cm²", 1e4, colors.SUPPORT_EDGE),
    ("lowest", "lowest point", "mm", 1e3, colors.INK),
    ("stability", "stability loss", "m", 1.0, colors.COM),
    ("pull", "ground pull", "", 1.0, colors.COP),
    ("push", "ground push", "", 1.0, colors.COP),
    ("balance", "balance cost", "nats", 1.0, colors.INK),
)


def draw_timeline(study: Study, path: Path) -> None:
    """Write the PNG of a sequence's curves; frames whose CoM lies outside its support are shaded."""
    from matplotlib.figure import Figure

    time = np.arange(study.num_frames) if study.seconds is None else study.seconds
    figure = Figure(figsize=(12, 11), facecolor="white", layout="constrained")
    figure.suptitle(study.name, x=0.01, ha="left", size=18, weight="bold", color=colors.INK, parse_math=False)
    for axes, (key, title, unit, factor, color) in zip(figure.subplots(4, 2, sharex=True).flat, SERIES, strict=True):
        values = np.where(np.isfinite(study.numbers[key]), study.numbers[key], np.nan) * factor
        axes.fill_between(
            time, 0, 1, where=~study.numbers["bose"].astype(bool), transform=axes.get_xaxis_transform(),
            color="#f3d9dc", linewidth=0, step="mid",
        )  # fmt: skip
        axes.plot(time, values, color=color, linewidth=1.8, marker="o" if len(time) < 40 else None, markersize=3)
        axes.set_title(f"{title} ({unit})" if unit else title, loc="left", size=12, color=colors.INK)
        axes.grid(color=colors.GRID, alpha=0.6, linewidth=0.8)
        axes.tick_params(colors=colors.MUTED)
        axes.spines[["top", "right"]].set_visible(False)
        axes.margins(x=0.01)
        axes.set_ylim(*_range(values))
    for axes in figure.axes[-2:]:
        axes.set_xlabel("frame" if study.seconds is None else "seconds", color=colors.MUTED)
    figure.supxlabel("shaded: the CoM is outside its base of support", size=11, color=colors.MUTED)
    save(figure, path)


def _range(values: np.ndarray) -> tuple[float, float]:
    """Limits with room above and below; a curve that hardly moves is shown flat, not as its rounding."""
    low, high = (np.nanmin(values), np.nanmax(values)) if np.isfinite(values).any() else (0.0, 0.0)
    middle, half = (low + high) / 2, (high - low) / 2
    half = max(1.1 * half, 0.02 * abs(middle), 1e-3)
    return middle - half, middle + half
