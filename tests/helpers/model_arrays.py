"""Arrays of body models with the names that upstream's files give them."""

from __future__ import annotations

import numpy as np

import ipman_rs as ip
from ipman_rs.body import joints

SMPLX_PARENTS = np.array(
    [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 15, 15, 15]
    + [base if i % 3 == 0 else 25 + i - 1 + offset for offset, base in ((0, 20), (15, 21)) for i in range(15)]
)
PARENTS = {
    24: np.array(joints.SMPL_PARENTS),
    52: np.concatenate([SMPLX_PARENTS[:22], [p if p < 22 else p - 3 for p in SMPLX_PARENTS[25:]]]),
    55: SMPLX_PARENTS,
}


def _hands(rng: np.random.Generator) -> dict[str, np.ndarray]:
    return {
        "hands_meanl": 0.3 * rng.normal(size=45),
        "hands_meanr": 0.3 * rng.normal(size=45),
        "hands_componentsl": 0.3 * rng.normal(size=(45, 45)),
        "hands_componentsr": 0.3 * rng.normal(size=(45, 45)),
    }


def _kintree(num_joints: int) -> np.ndarray:
    return np.stack([PARENTS[num_joints], np.arange(num_joints)]).astype(
        np.uint32
    )  # the root is 2**32 - 1, as upstream


def random_arrays(
    num_joints: int, num_vertices: int, num_shapes: int, dtype: type = np.float32
) -> dict[str, np.ndarray]:
    """Arrays of a valid model with `num_joints` joints: random shapes, weights, regressor and faces."""
    rng = np.random.default_rng(num_joints)
    regressor = rng.random((num_joints, num_vertices)) * (rng.random((num_joints, num_vertices)) < 0.01)
    np.fill_diagonal(regressor, 1.0)
    weights = rng.random((num_vertices, num_joints)) ** 20
    arrays = {
        "v_template": rng.normal(size=(num_vertices, 3)),
        "shapedirs": 0.05 * rng.normal(size=(num_vertices, 3, num_shapes)),
        "posedirs": 0.01 * rng.normal(size=(num_vertices, 3, 9 * (num_joints - 1))),
        "J_regressor": regressor / regressor.sum(1, keepdims=True),
        "weights": weights / weights.sum(1, keepdims=True),
    }
    arrays = {name: array.astype(dtype) for name, array in arrays.items()}
    arrays["f"] = rng.integers(0, num_vertices, (2 * num_vertices, 3)).astype(np.uint32)
    arrays["kintree_table"] = _kintree(num_joints)
    if num_joints > 24:
        arrays |= _hands(rng)
    return arrays


def lifelike_arrays(num_joints: int) -> dict[str, np.ndarray]:
    """The light embedded body in its zero pose, written as a model with 24, 52 or 55 joints: small, and a real body."""
    body = ip.load_body("anny-lite")
    rng = np.random.default_rng(num_joints)
    names = {24: joints.SMPL, 52: joints.SMPLH, 55: joints.SMPLX}[num_joints]
    weights = np.zeros((body.num_vertices, num_joints))
    for j, name in enumerate(body.joint_names):
        weights[:, names.index(name if name in names else name.replace("hand", "index1"))] += body.weights[:, j]
    zero = body().vertices
    regressor = np.zeros((num_joints, body.num_vertices))
    for row in regressor:
        row[rng.choice(body.num_vertices, 8, replace=False)] = 1 / 8
    return {
        "v_template": zero,
        "shapedirs": 0.01 * rng.normal(size=(body.num_vertices, 3, 20)),
        "posedirs": 0.001 * rng.normal(size=(body.num_vertices, 3, 9 * (num_joints - 1))),
        "J_regressor": regressor,
        "weights": weights,
        "f": body.faces.astype(np.uint32),
        "kintree_table": _kintree(num_joints),
    } | (_hands(rng) if num_joints > 24 else {})
