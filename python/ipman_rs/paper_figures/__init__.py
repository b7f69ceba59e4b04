"""The paper's figures, reproduced from any data: a picture as PNG and SVG, and the numbers in it.

from ipman_rs import paper_figures
from ipman_rs.paper_figures import pull_gradient

paper_figures.write(pull_gradient.pull_gradient(alpha2=0.15), Path("out"))     # out/pull.png, .svg, .json, .csv
"""

from __future__ import annotations

from .files import PaperFigure, write

__all__ = ["FIGURES", "PaperFigure", "write"]

FIGURES = {  # name, as of `ipman figure` and of its files -> module, whose function of the module's name makes it
    "stability": "stability_distribution",
    "pull": "pull_gradient",
    "com": "center_of_mass",
    "pressure": "pressure",
    "poses": "poses",
    "compare": "comparison",
}
