"""Small body files in SMPL's and SMPL-X's forms, of the light embedded body, and joint regressors for its vertices."""

from __future__ import annotations

import numpy as np

import ipman_rs as ip
from ipman_rs.body import joint_regressors, joints


def _written(path, names, parents, own, width, rest_of_shape=0.0, **more):
    """A model file whose joints are the vertices nearest to the embedded body's. `own`: its name of a joint.

    rest_of_shape: the size of what components after the tenth do, beside the first ten.
    """
    body = ip.load_body("anny-lite")
    rest = body()
    weights = np.zeros((body.num_vertices, len(names)))
    regressor = np.zeros((len(names), body.num_vertices))
    regressor[:, 0] = 1  # of joints that move nothing
    for j, name in enumerate(body.joint_names):
        row = names.index(own(name))
        weights[:, row] += body.weights[:, j]
        regressor[row] = 0
        regressor[row, np.linalg.norm(rest.vertices - rest.joints[j], axis=1).argmin()] = 1
    np.savez(
        path,
        v_template=rest.vertices,
        shapedirs=np.concatenate([0.9 * body.shapedirs, rest_of_shape * body.shapedirs[::-1]], axis=2)[..., :width],
        posedirs=np.zeros((body.num_vertices, 3, 9 * (len(names) - 1))),
        J_regressor=regressor,
        weights=weights,
        f=body.faces.astype(np.uint32),
        kintree_table=np.stack([parents, np.arange(len(names))]).astype(np.uint32),
        **more,
    )


def smplx(path):
    """Its 22 body joints, and hands and a face that move nothing."""
    parents = np.array([-1, *joints.SMPL_PARENTS[1:22], *[15] * 3, *[20] * 15, *[21] * 15])
    more = {f"hands_mean{side}": np.full(45, 0.1) for side in "lr"}
    more |= {f"hands_components{side}": np.eye(45) for side in "lr"}
    _written(path, joints.SMPLX, parents, lambda name: name.replace("hand", "index1"), 20, **more)


def smplh(path, betas=16):
    """With so many betas, and hands that move nothing."""
    parents = np.array([-1, *joints.SMPL_PARENTS[1:22], *[20] * 15, *[21] * 15])
    more = {f"hands_mean{side}": np.full(45, 0.1) for side in "lr"}
    more |= {f"hands_components{side}": np.eye(45) for side in "lr"}
    _written(path, joints.SMPLH, parents, lambda name: name.replace("hand", "index1"), betas, 0.01, **more)


def smplx_with_a_face(path):
    """SMPL-X whose ten expressions move vertices."""
    parents = np.array([-1, *joints.SMPL_PARENTS[1:22], *[15] * 3, *[20] * 15, *[21] * 15])
    _written(path, joints.SMPLX, parents, lambda name: name.replace("hand", "index1"), 20, 0.1)


def smpl(path):
    _written(path, joints.SMPL, np.array(joints.SMPL_PARENTS), str, 10)


def folder(place):
    """Both, of every gender."""
    place.mkdir(exist_ok=True)
    for gender in ("NEUTRAL", "FEMALE", "MALE"):
        smpl(place / f"SMPL_{gender}.npz")
        smplx(place / f"SMPLX_{gender}.npz")
    return place


def regressors(place):
    """J_regressor_h36m.npy (17, V) and J_regressor_extra.npy (9, V): means of vertices about a place 40 mm or more from
    the body's own joint of that name, or of one nearby."""
    place.mkdir(exist_ok=True)
    body = ip.load_body("anny-lite")
    rest = body()
    own = dict(zip(body.joint_names, rest.joints, strict=True))
    own |= {"spine": own["spine2"], "thorax": own["spine3"], "jaw": own["head"], "head_top": own["head"] + [0, 0.2, 0]}
    draw, files = np.random.default_rng(0), []
    for name, names in (("h36m", joint_regressors.HUMAN36M), ("extra", joint_regressors.EXTRA)):
        middles = np.array([own[joint] for joint in names]) + draw.choice([-0.04, 0.04], (len(names), 3))
        away = np.linalg.norm(rest.vertices - middles[:, None], axis=2)
        weights = np.exp(-((away - away.min(axis=1, keepdims=True)) ** 2) / 0.003)
        np.save(place / f"J_regressor_{name}.npy", weights / weights.sum(axis=1, keepdims=True))
        files.append(place / f"J_regressor_{name}.npy")
    return files
