"""How the figures look: white paper, small sans-serif text, one colour for each series."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from ipman_rs.view import colors

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SERIES = ("#1f4e79", "#e08214", "#2e7d32", "#8e44ad", "#c0392b", "#00838f", "#7f6000", "#5d6d7e")
WORDS = 9  # points


def new_figure(width: float, height: float) -> Figure:
    """A figure of this size in inches, whose axes make room for their words."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), facecolor="white", layout="constrained")


def plot_style(axes: Axes, title: str, x: str, y: str) -> None:
    """Title and labels of a plot, a light grid, no frame on the right and at the top."""
    axes.set_title(title, loc="left", size=WORDS + 1, weight="bold", color=colors.INK)
    axes.set_xlabel(x, size=WORDS, color=colors.INK)
    axes.set_ylabel(y, size=WORDS, color=colors.INK)
    axes.tick_params(labelsize=WORDS - 1, colors=colors.MUTED)
    axes.grid(color=colors.GRID, alpha=0.5, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def show_pixels(axes: Axes, pixels: NDArray[Any]) -> None:
    """A picture that fills its axes, without ticks or frame."""
    axes.imshow(pixels, interpolation="antialiased")
    axes.set(xticks=[], yticks=[])
    for side in axes.spines.values():
        side.set_visible(False)
