"""A made-up recording of MoYo: the light built-in body at rest on a mat of springs, whose map is worked out here.

Each cell presses as deep as the body sinks into it; how deep the mat gives way and how it tilts under the body are such
that it carries the weight and the moments of the exact centre of mass. So its centre of pressure is g(CoM), which the
paper's pressure does not know.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import ipman_rs as ip
from ipman_rs.body import joints, poses
from tests.helpers.miniatures import moyo

NAME = "220923_yogi_body_hands_03596_Made_Up_-a"
WEIGHT = 600.0  # N
STIFF = 300.0  # N/cm² that a cell carries a metre of depth
PLACE = np.array([0.03, -0.02])  # m: where the person stands in the room
FRAMES = 3


def smplx(path: Path) -> None:
    """The light embedded body as an SMPL-X file: its 22 body joints, and hands and a face that move nothing."""
    body = ip.load_body("anny-lite")
    weights = np.zeros((body.num_vertices, 55))
    for j, name in enumerate(body.joint_names):
        weights[:, joints.SMPLX.index(name.replace("hand", "index1"))] += body.weights[:, j]
    rest = np.zeros((55, 3))
    for j, name in enumerate(body.joint_names):
        rest[joints.SMPLX.index(name.replace("hand", "index1"))] = body.J_template[j]
    # A regressor that gives the body's own joints: each from four vertices that are not in one plane.
    base = body.v_template[[0, 400, 800, 1200]]
    regressor = np.zeros((55, body.num_vertices))
    square = np.vstack([base.T, np.ones(4)])
    for j, point in enumerate(rest):
        regressor[j, [0, 400, 800, 1200]] = np.linalg.solve(square, np.append(point, 1.0))
    parents = np.array([-1, *joints.SMPL_PARENTS[1:22], *[15] * 3, *[20] * 15, *[21] * 15])
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(
        path,
        v_template=body.v_template,
        shapedirs=np.zeros((body.num_vertices, 3, 20)),
        posedirs=np.zeros((body.num_vertices, 3, 9 * 54)),
        J_regressor=regressor,
        weights=weights,
        f=body.faces.astype(np.uint32),
        kintree_table=np.stack([parents, np.arange(55)]).astype(np.uint32),
        **{f"hands_mean{side}": np.zeros(45) for side in "lr"},
        **{f"hands_components{side}": np.eye(45) for side in "lr"},
    )


def write(root: Path, pose: str = "standing", facing: float = 0.0) -> tuple[Path, Path]:
    """The recording and its body model: the folders of the data set and of the models. `facing`: radians about z that
    the person is turned; at 0 they face along the mat, towards -y."""
    models, session = root / "models", root / "moyo" / moyo.HANDS
    for gender in ("FEMALE", "NEUTRAL"):
        smplx(models / f"SMPLX_{gender}.npz")
    body = ip.load_body(models / "SMPLX_FEMALE.npz", flat_hand_mean=True)
    full = np.zeros((55, 3))
    named = poses.pose_of(ip.load_body("anny-lite"), pose)
    full[:22] = named[:22]
    aside, upright, own = (Rotation.from_rotvec(turn) for turn in ([0.0, 0.0, facing], moyo.STANDING, named[0]))
    full[0] = (aside * upright * own).as_rotvec()
    vertices = np.asarray(body(full).vertices)
    transl = np.array([*(PLACE - vertices[:, :2].mean(axis=0)), -vertices[:, 2].min()])
    values, center = carried(vertices + transl, body.template)
    moyo.body(
        session / "mosh" / "val" / f"{NAME}_stageii.pkl",
        FRAMES,
        fullpose=np.tile(full.reshape(-1), (FRAMES, 1)),
        trans=np.tile(transl, (FRAMES, 1)),
    )
    maps = np.tile(values, (FRAMES, 1, 1))
    folder = session / "pressure" / "val"
    moyo.xml(folder / "xml" / f"{NAME}.xml", maps)
    moyo.csv(folder / "single_csv" / f"{NAME}.csv", np.full(FRAMES, WEIGHT), maps)
    moyo.corners(folder / "pressure_mat_c3d" / f"{NAME}.c3d", FRAMES)
    return root / "moyo", models


def carried(vertices: np.ndarray, template: ip.BodyTemplate) -> tuple[np.ndarray, np.ndarray]:
    """The map (ROWS, COLUMNS) N/cm² under a body (V, 3), z up, on a mat whose middle is the origin; and g(CoM) (2,)."""
    center = np.asarray(ip.center_of_mass(vertices, template, "exact"))[:2]
    samples = np.asarray(ip.sample_surface(vertices, template))
    along, across = moyo.axes(0.0)
    rows, columns = np.arange(moyo.ROWS) + 0.5 - moyo.ROWS / 2, np.arange(moyo.COLUMNS) + 0.5 - moyo.COLUMNS / 2
    places = moyo.CELL * (rows[:, None, None] * along + columns[None, :, None] * across)
    height = np.full((moyo.ROWS, moyo.COLUMNS), np.inf)
    i = np.floor(samples[:, :2] @ along / moyo.CELL + moyo.ROWS / 2).astype(int)
    j = np.floor(samples[:, :2] @ across / moyo.CELL + moyo.COLUMNS / 2).astype(int)
    on = (i >= 0) & (i < moyo.ROWS) & (j >= 0) & (j < moyo.COLUMNS)
    np.minimum.at(height, (i[on], j[on]), samples[on, 2])
    area = (100 * moyo.CELL) ** 2

    def pressed(way: np.ndarray) -> np.ndarray:
        return STIFF * np.maximum(way[0] / 100 + (places - center) @ (way[1:] / 10) - height, 0)

    def lacking(way: np.ndarray) -> np.ndarray:
        force = area * pressed(way)
        moment = ((places - center) * force[..., None]).sum(axis=(0, 1))
        return np.append(force.sum() - WEIGHT, 10 * moment) / WEIGHT

    found = least_squares(lacking, [2.0, 0.0, 0.0], xtol=1e-14, ftol=1e-14, gtol=1e-14)
    assert np.abs(found.fun).max() < 1e-6, "the mat carries nobody"
    return np.round(pressed(found.x), 2), center
