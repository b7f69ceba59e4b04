"""The paper's training runs, one file each, to be run or copied; they expect the data sets in `data/`.

ipman-r           IPMAN-R on all data sets          ipman-r-human36m  fine-tuned on Human3.6M alone
hmr-star          the baseline, without its terms
"""

from __future__ import annotations

from pathlib import Path

NAMES = tuple(sorted(path.stem for path in Path(__file__).parent.glob("*.yaml")))


def path_of(name: str) -> Path:
    """The file of a recipe. ValueError, listing all, for an unknown name."""
    if name not in NAMES:
        raise ValueError(f"{name}: no such file, nor a recipe; those are {', '.join(NAMES)}")
    return Path(__file__).parent / f"{name}.yaml"
