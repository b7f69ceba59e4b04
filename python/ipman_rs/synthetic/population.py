"""Static people of the embedded body `anny-lite` on the floor y = 0.

Named poses (`ipman_rs.body.poses`), mirrored or not, with every joint perturb, are laid on the floor as in
`synthetic.at_rest`: they rest on a facet of their hull over which the exact centre of mass lies, supported by the
samples within 1 cm of the floor. Others are drawn again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ipman_rs.body import joints, load_body, poses
from ipman_rs.files import atomic_write
from ipman_rs.synthetic.at_rest import FAMILIES, TRIES, perturb, settle

Array = NDArray[np.floating]
Draw = np.random.Generator

BODY = "anny-lite"
BETAS, LARGEST_BETA = 0.7, 1.5
SPREADS = (12.0, 6.0, 4.0)  # degrees, as `at_rest.SPREADS`


@dataclass(frozen=True, eq=False)
class Population:
    """n people: family (n,), pose (n, 24, 3) with the root in the world, betas (n, 10), transl (n, 3) m."""

    family: NDArray[np.str_]
    pose: Array
    betas: Array
    transl: Array

    def __len__(self) -> int:
        return len(self.family)

    def __getitem__(self, rows: slice) -> Population:
        return Population(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})

    def save(self, path: Path) -> None:
        with atomic_write(path) as file:
            np.savez_compressed(file, **vars(self))

    @classmethod
    def load(cls, path: Path) -> Population:
        with np.load(path, allow_pickle=False) as stored:
            return cls(**{field.name: stored[field.name] for field in fields(cls)})


def draw_population(count: int, seed: int, progress: Callable[[int], None] | None = None) -> Population:
    """Draw `count` people, cycling through the families; each depends only on the seed and its index."""
    rows = []
    for index in range(count):
        family = list(FAMILIES)[index % len(FAMILIES)]
        rows.append((family, *_at_rest(family, np.random.default_rng([seed, index]))))
        if progress is not None:
            progress(index + 1)
    return Population(*(np.array(column) for column in zip(*rows, strict=True)))


def _at_rest(family: str, draw: Draw) -> tuple[Array, Array, Array]:
    """Pose, betas and translation of a new person. RuntimeError if none of many tries stands."""
    body = load_body(BODY)
    betas = (BETAS * draw.standard_normal(body.num_betas)).clip(-LARGEST_BETA, LARGEST_BETA)
    for _ in range(TRIES):
        name = FAMILIES[family][draw.integers(len(FAMILIES[family]))]
        pose = poses.pose_of(body, name)
        pose = perturb(mirror(pose) if draw.integers(2) else pose, body, draw, SPREADS)
        settled = settle(pose, partial(body, betas=betas), body.template)
        if settled is not None:
            heading = Rotation.from_rotvec([0.0, draw.uniform(0, 2 * np.pi), 0.0])
            pose, transl = settled
            pelvis = body.J_template[0] + body.J_shapedirs[0] @ betas
            pose[0] = (heading * Rotation.from_rotvec(pose[0])).as_rotvec()
            return pose, betas, transl + [-pelvis[0], 0.0, -pelvis[2]]  # the pelvis over the world's origin
    raise RuntimeError(f"{family}: none of {TRIES} tries came to rest")


def mirror(pose: Array) -> Array:
    """The pose (..., 24, 3) of the mirror image across x = 0: sides swapped, turns about y and z reversed."""
    other = [joints.SMPL.index(_other_side(name)) for name in joints.SMPL]
    return pose[..., other, :] * [1.0, -1.0, -1.0]


def _other_side(name: str) -> str:
    side, _, rest = name.partition("_")
    return {"left": f"right_{rest}", "right": f"left_{rest}"}.get(side, name)
