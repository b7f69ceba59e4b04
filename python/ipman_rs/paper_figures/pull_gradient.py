"""The gradient of L_pull (Eq. 6) over height, and bodies in the colours of their pull and push (Eqs. 5 to 7).

The paper says of α1 tanh²(h/α2) that it pulls what is near the ground and that its gradient is "minimal" beyond 15 to
20 cm. For the α2 = 0.15 m of the paper the gradient peaks at 9.9 cm, and at 20 cm still has half of its peak.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import ipman_rs as ip
from ipman_rs import quantities, view
from ipman_rs.arrays import Bodies
from ipman_rs.body import embedded
from ipman_rs.checks import positive
from ipman_rs.view import cells, colors
from ipman_rs.view.picture import camera_around

from .files import PaperFigure
from .style import SERIES, WORDS, new_figure, plot_style, show_pixels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap

Array = NDArray[np.floating]

REACH = 0.5  # m, of the heights, or a multiple for wide terms
STEPS = 500  # of the heights: 1 mm each where they reach 0.5 m
TAIL = 2.5  # widths: from 2.30 of them on, a tenth of the peak is left
PEAK = float(np.arctanh(1 / np.sqrt(3)))  # widths: where tanh(x) / cosh²(x) is largest, tanh²(x) = 1/3
CLAIM = (0.15, 0.20)  # m: the paper calls the gradient minimal beyond
ASKED = (0.10, 0.15, 0.20, 0.30)  # m
LITTLE = 0.1  # of the peak
MOVED = 0.15  # m: how far the two bodies are above and below their ground
POSE = "walking"
CELL = (420, 560)  # pixels
PULL, PUSH = SERIES[0], SERIES[4]


def pull_gradient(
    alpha1: float = 1.0, alpha2: float = 0.15, beta1: float = 10.0, beta2: float = 0.15, body: str = "anny"
) -> PaperFigure:
    """L_pull and its gradient over height; a floating and a sinking `body` of `ipman_rs.load_body`, each point in the
    colour of its own term's gradient. alpha1, beta1: weights; alpha2, beta2: widths, m.

    Raises:
        ValueError: weights or widths that are not above 0, widths of 100 m or more, or another body.
    """
    for name, width in (("alpha2", alpha2), ("beta2", beta2)):
        if not 0 < width < 100:
            raise ValueError(f"{name}: expected metres above 0 and below 100, got {width:g}")
    if body not in embedded.NAMES:
        raise ValueError(f"body: expected one of {', '.join(embedded.NAMES)}, got {body!r}")
    weights = positive("alpha1", alpha1), positive("alpha2", alpha2), positive("beta1", beta1), positive("beta2", beta2)
    reach = REACH * max(1, int(np.ceil(TAIL * max(alpha2, beta2) / REACH)))
    heights = np.arange(STEPS + 1) * (1000 * reach / STEPS) / 1000
    pull, pull_slope = engine_curve(heights, *weights)[0]
    push, push_slope = engine_curve(-heights, *weights)[1]
    top = PEAK * alpha2
    steepest, *asked = engine_curve(np.array([top, *ASKED]), *weights)[0][1]
    late = heights[(heights > top) & (pull_slope < LITTLE * steepest)]
    beyond = pull_slope[heights >= CLAIM[1]].max() if top <= CLAIM[1] else steepest
    numbers = {
        "alpha1": alpha1,
        "alpha2_m": alpha2,
        "beta1": beta1,
        "beta2_m": beta2,
        "claim": "the paper: the gradient of L_pull is minimal beyond 15 to 20 cm",
        "peak_m": top,
        "peak_gradient_per_m": steepest,
        "share_of_peak": {f"{height:g}": slope / steepest for height, slope in zip(ASKED, asked, strict=True)},
        "below_a_tenth_of_the_peak_beyond_m": late[0],
        "claim_holds": bool(beyond < LITTLE * steepest),
    }
    table = [
        {"height_m": f"{h:.3f}", "pull": p, "pull_gradient_per_m": dp, "push_below": q, "push_gradient_below_per_m": dq}
        for h, p, dp, q, dq in zip(heights, pull, pull_slope, push, push_slope, strict=True)
    ]
    figure = new_figure(10.0, 4.0)
    left, middle, right = figure.subplots(1, 3, width_ratios=(1.7, 1, 1))
    _draw_curve(left, heights, pull, pull_slope, numbers)
    paints = _paints(heights, pull_slope, push_slope)
    for axes, lift, word in ((middle, MOVED, "floats"), (right, -MOVED, "sinks")):
        show_pixels(axes, _moved_body(body, lift, paints))
        axes.set_title(f"{word}: {abs(100 * lift):.0f} cm", size=WORDS, color=colors.INK)
    _draw_bars(figure, (middle, right), (steepest, np.abs(push_slope).max()))
    return PaperFigure("pull", figure, numbers, table=table, summary=_in_words(numbers))


def _in_words(numbers: dict[str, Any]) -> list[str]:
    shares = ", ".join(
        f"{100 * share:.0f} % at {100 * float(at):.0f} cm" for at, share in numbers["share_of_peak"].items()
    )
    claim = "holds" if numbers["claim_holds"] else "does not hold"
    return [
        f"gradient of L_pull: largest at {100 * numbers['peak_m']:.1f} cm; of that {shares}",
        f"the paper's “minimal beyond 15–20 cm”: {claim}",
    ]


def engine_curve(
    heights: Array, alpha1: float = 1.0, alpha2: float = 0.15, beta1: float = 10.0, beta2: float = 0.15
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """(L_pull, dL_pull/dh) and (L_push, dL_push/dh) of points at these heights (H,) m, as the engine has them: of a
    sheet all of whose points lie at one height, moved as a whole."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    faces = np.array(
        [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
         [1, 5, 7], [1, 7, 3]]
    )  # fmt: skip
    sheet = ip.BodyTemplate(corners, faces)
    sheets = np.repeat(corners[None], len(heights), axis=0)
    sheets[..., 1] = np.asarray(heights, float)[:, None]
    quantity = quantities.ground_loss(alpha1, alpha2, beta1, beta2, "samples", "tanh_squared").of(sheet)
    curves = []
    for term in np.eye(2):
        arguments = Bodies(sheets, sheet).over(ip.Ground.y_up())
        asked = np.tile(term, (len(heights), 1))
        values, gradients = quantity.value_and_vjp(*arguments, asked)
        curves.append((values @ term, gradients[..., 1].sum(axis=1)))
    return curves[0], curves[1]


def _draw_curve(axes: Axes, heights: Array, pull: Array, slope: Array, numbers: dict[str, Any]) -> None:
    peak = numbers["peak_gradient_per_m"]
    cm = 100 * heights
    axes.axvspan(100 * CLAIM[0], 100 * CLAIM[1], color="#f5e6c8", linewidth=0, zorder=0)
    axes.axvspan(100 * CLAIM[1], cm[-1], color="#faf4e6", linewidth=0, zorder=0)
    axes.plot(cm, pull / numbers["alpha1"], color=PULL, linewidth=1.8, label="L_pull / α1")
    axes.plot(cm, slope / peak, color=SERIES[1], linewidth=2.2, label="its gradient, of the largest")
    for height, share in numbers["share_of_peak"].items():
        at = 100 * float(height)
        if float(height) >= CLAIM[0]:
            axes.plot(at, share, "o", color=SERIES[1], markersize=5)
            axes.annotate(
                f"{100 * share:.0f} % at {at:.0f} cm", (at, share), (9, 11), textcoords="offset points", size=WORDS - 1
            )
    words = {"size": WORDS - 1, "color": "#8a6d3b", "ha": "center"}
    axes.text(50 * CLAIM[1] + 0.5 * cm[-1] + 2, 0.66, "the paper: “minimal”\nbeyond 15–20 cm", **words)
    title = f"α2 = {numbers['alpha2_m']:g} m: steepest at {100 * numbers['peak_m']:.1f} cm"
    plot_style(axes, title, "height above the ground, cm", "share")
    axes.set(xlim=(0, cm[-1]), ylim=(0, 1.2))
    axes.legend(fontsize=WORDS - 1, frameon=False, loc="upper right", ncols=2)


def _paints(heights: Array, pull: Array, push: Array):
    """Colours (N, 3) of signed heights (N,): blue where the pull is steep, red where the push is."""
    blue, red = _map(PULL), _map(PUSH)

    def paint(height: Array) -> Array:
        up = np.interp(height, heights, pull) / pull.max()
        down = np.interp(-height, heights, np.abs(push)) / np.abs(push).max()
        return np.where((height >= 0)[:, None], blue(up)[:, :3], red(down)[:, :3])

    return paint


def _map(color: str) -> Colormap:
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list(color, [colors.SKIN, color])


def _moved_body(name: str, lift: float, paint: Any) -> Array:
    body = ip.load_body(name)
    vertices = ip.body.posed(body, POSE) + np.array([0.0, lift, 0.0])
    study = view.study(POSE, vertices, body.template, ip.Ground.y_up())
    camera = camera_around([study.vertices[0]], study, 50.0, 8.0, cells.box_of(CELL))
    return cells.scene_cell(study, camera, CELL, paint, markers=False)


def _draw_bars(figure: Any, places: tuple[Axes, Axes], tops: tuple[float, float]) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    for axes, color, top, word in zip(places, (PULL, PUSH), tops, ("pull", "push"), strict=True):
        scale = ScalarMappable(Normalize(0, top), _map(color))
        bar = figure.colorbar(scale, ax=axes, orientation="horizontal", fraction=0.04, pad=0.02, aspect=28)
        bar.set_label(f"|dL_{word}/dh| of a point, 1/m", size=WORDS - 1)
        bar.ax.tick_params(labelsize=WORDS - 2)
