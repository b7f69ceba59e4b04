"""The t-SNE of body poses of one or several data sets: similar poses lie near each other.

A pose is the rotation matrices of the 21 joints of the body that the SMPL family shares; where a body faces, its shape,
hands and face do not count. Needs scikit-learn (the extra figures).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body import rotations
from ipman_rs.data.check import evenly
from ipman_rs.data.frames import DataSet
from ipman_rs.progress import Progress as Stages
from ipman_rs.progress import silent

from .files import PaperFigure
from .inputs import DataSets
from .posed_bodies import Progress
from .style import SERIES, WORDS, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.floating]

JOINTS = slice(1, 22)  # of the body without its root, in the order of every model of the SMPL family
MOST = 2000  # poses of a data set
PERPLEXITY = 30.0
PIECE = 4096  # frames


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses (F, 189) of one data set, the numbers of 21 rotation matrices, and the names of their frames (F,)."""

    name: str
    values: Array
    frames: NDArray[np.str_]


def of_data_set(name: str, data: DataSet, most: int = MOST, progress: Progress = lambda done: None) -> Poses:
    """Up to `most` poses of a data set, evenly spaced; those that are not finite left out. `progress` is called with
    the number of frames done. ValueError, naming the data set, without poses of the SMPL family."""
    rows = evenly(len(data), most)
    values, names = [], []
    for start in range(0, len(rows), PIECE):
        frames = data[rows[start : start + PIECE]]
        if frames.pose is None or frames.pose.shape[1] < JOINTS.stop:
            raise ValueError(f"{name}: has no poses of a body model; expected rotations of at least 22 joints")
        pose = np.asarray(frames.pose, np.float64)[:, JOINTS]
        finite = np.flatnonzero(np.isfinite(pose).all(axis=(1, 2)))
        values.append(_as_matrices(pose[finite]))
        names.append(frames.names[finite])
        progress(start + len(pose))
    poses = Poses(name, np.concatenate(values), np.concatenate(names))
    if not len(poses.values):
        raise ValueError(f"{name}: none of its {len(rows)} poses is finite")
    return poses


def of_built_people(people: int, progress: Progress = lambda done: None) -> list[Poses]:
    """Poses of built people at rest, those of each family (standing, lunge, ...) by themselves: the "balanced" scenes
    of `ipman benchmark fit` from seed 0."""
    from ipman_rs.synthetic.at_rest import draw_people

    scenes = draw_people(people, 0, progress=progress)
    families: dict[str, list[int]] = {}
    for number, scene in enumerate(scenes):
        families.setdefault(scene.family, []).append(number)
    return [
        Poses(
            family,
            _as_matrices(np.stack([scenes[number].full_pose[JOINTS] for number in numbers])),
            np.array([f"{number:05d}/{scenes[number].name}" for number in numbers]),
        )
        for family, numbers in families.items()
    ]


def of_data_sets(data_sets: DataSets, people: int, most: int = MOST, progress: Stages = silent) -> list[Poses]:
    """Up to `most` poses of each data set; of so many built people where there is no data set. Raises as
    `of_data_set`."""
    groups = []
    with data_sets.open() as opened:
        for name, data in opened:
            with progress(f"reading {name}", min(most, len(data))) as step:
                groups.append(of_data_set(name, data, most, step.to))
    if groups:
        return groups
    with progress("building people", people) as step:
        return of_built_people(people, step.to)


def _as_matrices(pose: Array) -> Array:
    """Numbers (F, 9 J) of rotation vectors (F, J, 3)."""
    return rotations.from_axis_angle(pose.astype(np.float64)).reshape(len(pose), -1)


def poses(groups: Sequence[Poses], perplexity: float = PERPLEXITY, seed: int = 0) -> PaperFigure:
    """The map of all poses, each group in its colour. The same poses give the same map.

    The numbers say how often a pose's nearest neighbour on the map is of the same group: as often as chance has it
    where groups are mixed, always where they lie apart.

    Raises:
        ValueError: fewer poses than the perplexity asks for.
        ImportError: scikit-learn is not installed.
    """
    values = np.concatenate([group.values for group in groups]) if groups else np.zeros((0, 1))
    if not 1 <= perplexity < len(values):
        raise ValueError(f"perplexity: expected from 1 to below the number of poses, {len(values)}, got {perplexity:g}")
    group = np.repeat(np.arange(len(groups)), [len(each.values) for each in groups])
    places, divergence = embedded(values, perplexity, seed)
    shares = np.bincount(group) / len(group)
    numbers: dict[str, Any] = {
        "poses": len(values),
        "perplexity": perplexity,
        "seed": seed,
        "kl_divergence": divergence,
        "groups": {each.name: len(each.values) for each in groups},
        "nearest_neighbour_of_same_group": _same_group(places, group),
        "nearest_neighbour_of_same_group_by_chance": float((shares**2).sum()),
    }
    names = np.concatenate([each.frames for each in groups])
    table = [
        {"group": groups[number].name, "frame": name, "x": f"{x:.4f}", "y": f"{y:.4f}"}
        for number, name, (x, y) in zip(group.tolist(), names, places, strict=True)
    ]
    arrays = {"places": places, "group": group, "frames": names}
    summary = (
        f"{numbers['poses']:,} poses; the nearest neighbour is of the same group in "
        f"{100 * numbers['nearest_neighbour_of_same_group']:.0f} % "
        f"({100 * numbers['nearest_neighbour_of_same_group_by_chance']:.0f} % by chance)"
    )
    return PaperFigure("poses", _draw(groups, places, group), numbers, arrays, table, [summary])


def embedded(values: Array, perplexity: float, seed: int) -> tuple[Array, float]:
    """Places (F, 2) of the poses by t-SNE, from their principal components, and its Kullback–Leibler divergence."""
    try:
        from sklearn.manifold import TSNE
        from threadpoolctl import threadpool_limits
    except ImportError as error:
        raise ImportError("t-SNE needs scikit-learn: pip install 'ipman_rs[figures]'") from error
    # Sums in another order end elsewhere: one thread, whatever the machine has.
    with threadpool_limits(1):
        model = TSNE(perplexity=perplexity, init="pca", learning_rate="auto", random_state=seed, n_jobs=1)
        places = model.fit_transform(values)
    return np.asarray(places, np.float64), float(model.kl_divergence_)


def _same_group(places: Array, group: NDArray[np.integer]) -> float:
    from scipy.spatial import KDTree

    nearest = np.asarray(KDTree(places).query(places, k=2)[1])
    own = nearest[:, 0] == np.arange(len(places))
    other = np.where(own, nearest[:, 1], nearest[:, 0])  # of two poses in one place either may come first
    return float((group[other] == group).mean())


def _draw(groups: Sequence[Poses], places: Array, group: NDArray[np.integer]) -> Figure:
    figure = new_figure(6.4, 5.2)
    axes = figure.subplots()
    size = float(np.clip(4000 / len(places), 3, 22))
    order = np.random.default_rng(0).permutation(len(places))  # no group lies on top of all others
    tints = np.array([SERIES[number % len(SERIES)] for number in range(len(groups))])
    axes.scatter(*places[order].T, s=size, c=tints[group[order]], linewidths=0, alpha=0.8)
    axes.set(xticks=[], yticks=[])
    axes.set_aspect("equal", adjustable="datalim")
    for side in axes.spines.values():
        side.set_visible(False)
    handles: list[Any] = [
        axes.scatter([], [], s=30, color=tints[number], label=f"{each.name} ({len(each.values):,})")
        for number, each in enumerate(groups)
    ]
    figure.legend(
        handles=handles, loc="outside lower center", ncols=min(4, len(groups)), fontsize=WORDS - 1, frameon=False,
    )  # fmt: skip
    return figure
