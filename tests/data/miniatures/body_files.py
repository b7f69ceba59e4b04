"""The light embedded body as SMPL and SMPL-X files: its mesh, its joints, and hands and a face that move nothing."""

from __future__ import annotations

import numpy as np

import ipman_rs as ip
from ipman_rs.body import joints

PARENTS = {  # of SMPL-X: jaw and eyes hang on the head, fingers on the wrists
    24: list(joints.SMPL_PARENTS),
    55: [*joints.SMPL_PARENTS[:22], *[15] * 3, *[20] * 15, *[21] * 15],
}


def write(path, count=55, shapes=10):
    """A model file of `count` joints, 24 or 55, with the embedded body's first shapes; its zero pose is the T-pose."""
    body = ip.load_body("anny-lite")
    names = joints.BY_COUNT[count]
    weights = np.zeros((body.num_vertices, count))
    places = np.zeros((count, 3))
    resting = body()
    for number, name in enumerate(body.joint_names):
        own = names.index(name) if name in names else names.index(name.replace("hand", "index1"))
        weights[:, own] += body.weights[:, number]
        places[own] = resting.joints[number]
    for number in range(count):
        if not places[number].any():
            places[number] = places[PARENTS[count][number]]
    parents = np.array(PARENTS[count])
    parents[0] = -1
    vertices = np.asarray(resting.vertices)
    unit = np.eye(body.num_betas)
    dirs = np.stack([np.asarray(body(betas=unit[k]).vertices) - vertices for k in range(shapes)], axis=-1)
    path.parent.mkdir(parents=True, exist_ok=True)
    hands = {} if count == 24 else {
        **{f"hands_mean{side}": np.full(45, 0.1) for side in "lr"},
        **{f"hands_components{side}": np.eye(45) for side in "lr"},
    }  # fmt: skip
    np.savez(
        path,
        v_template=vertices,
        shapedirs=np.concatenate([dirs, np.zeros((*dirs.shape[:2], 20))], axis=2) if count == 55 else dirs,
        posedirs=np.zeros((body.num_vertices, 3, 9 * (count - 1))),
        J_regressor=regressor(vertices, places),
        weights=weights,
        f=body.faces.astype(np.uint32),
        kintree_table=np.stack([parents, np.arange(count)]).astype(np.int64),
        **hands,
    )
    return path


def regressor(vertices, places):
    """Affine weights (K, V) that make the points (K, 3) of the vertices (V, 3), the smallest there are."""
    system = np.concatenate([vertices.T, np.ones((1, len(vertices)))])
    wanted = np.concatenate([places.T, np.ones((1, len(places)))])
    return np.linalg.lstsq(system, wanted, rcond=None)[0].T
