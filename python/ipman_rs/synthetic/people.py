"""People for benchmarks: bodies made from the embedded `anny` that no betas of a fitter's body can reach.

A person differs from the body model in

- shape: betas of standard deviation 0.7, and then every bone by itself is made longer or shorter and its flesh thicker
  or thinner, more so in its middle than at its ends: x' = Σ_j w_j (c'_j + s_j a u_j + g_j (1 + b_j sin πt) r), where
  x − c_j = a u_j + r along and across bone j of length l_j, t = a / l_j, and c' are the joints, moved likewise from the
  root on. Sides share their factors but for 1 %;
- joint centres, moved by 8 mm (standard deviation of each coordinate);
- skinning weights, spread over the surface by some passes of a mean over neighbours and then raised to a power.

Everything is drawn from a seed.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array

from ipman_rs.body import BodyModel, load_body

Array = NDArray[np.floating]
Draw = np.random.Generator

BETAS, LARGEST_BETA = 0.7, 1.5
LENGTH = {"hip": 0.06, "knee": 0.06, "shoulder": 0.06, "elbow": 0.06, "ankle": 0.05, "neck": 0.06}  # of log s
OTHER_LENGTH = 0.04
GIRTH, BULGE = 0.08, 0.06
SIDES = 0.01
CENTRES = 0.008  # m
PASSES, POWERS = 8, (0.7, 1.5)


def person(draw: Draw) -> BodyModel:
    """A copy of the body model of fixed shape, without betas."""
    model = load_body("anny")
    betas = (BETAS * draw.standard_normal(model.num_betas)).clip(-LARGEST_BETA, LARGEST_BETA)
    vertices, joints = reshape(model, betas, draw)
    shift = CENTRES * draw.standard_normal(joints.shape)
    shift[model.joint_names.index("pelvis")] = 0.0
    return dataclasses.replace(
        model,
        name="a person",
        v_template=vertices,
        shapedirs=np.zeros((model.num_vertices, 3, 0)),
        J_template=joints + shift,
        J_shapedirs=np.zeros((model.num_joints, 3, 0)),
        weights=smooth_weights(model, draw),
    )


def reshape(model: BodyModel, betas: Array, draw: Draw) -> tuple[Array, Array]:
    """Vertices (V, 3) and joints (J, 3) of the resting mesh."""
    vertices = model.v_template + model.shapedirs @ betas
    joints = model.J_template + model.J_shapedirs @ betas
    ends = main_children(model)
    length, girth, bulge = bone_factors(model, draw)
    moved, along = joints.copy(), bones(joints, ends)

    def stretched(points: Array, joint: int, bulged: bool) -> Array:
        size = np.linalg.norm(along[joint])
        unit, offset = along[joint] / size, points - joints[joint]
        place = offset @ unit
        across = offset - place[..., None] * unit
        profile = 1 + bulged * bulge[joint] * np.sin(np.pi * (place / size).clip(0, 1))
        return length[joint] * place[..., None] * unit + (girth[joint] * profile)[..., None] * across

    for joint, parent in enumerate(model.parents):
        if parent >= 0:
            moved[joint] = moved[parent] + stretched(joints[joint], parent, bulged=False)
    parts = [moved[joint] + stretched(vertices, joint, bulged=True) for joint in range(model.num_joints)]
    return np.einsum("vj,jvx->vx", model.weights, np.array(parts)), moved


def main_children(model: BodyModel) -> list[int]:
    """(J,) the joint at the other end of each bone: the child that goes on in the middle, -1 for none."""
    ends = [-1] * model.num_joints
    for joint, parent in enumerate(model.parents):
        if parent >= 0 and (ends[parent] < 0 or "_" not in model.joint_names[joint]):
            ends[parent] = joint
    return ends


def bones(joints: Array, ends: list[int]) -> Array:
    """(J, 3) from each joint to the end of its bone; at the tips on as the bone before."""
    before = {end: joint for joint, end in enumerate(ends) if end >= 0}
    tips = [end if end >= 0 else joint for joint, end in enumerate(ends)]
    starts = [joint if ends[joint] >= 0 else before[joint] for joint in range(len(ends))]
    return joints[tips] - joints[starts]


def bone_factors(model: BodyModel, draw: Draw) -> tuple[Array, Array, Array]:
    """s, g and b (J,) of every bone."""
    kinds = [name.partition("_")[2] or name for name in model.joint_names]
    drawn = {kind: draw.standard_normal(3) for kind in dict.fromkeys(kinds)}
    own = SIDES * draw.standard_normal((2, model.num_joints))
    numbers = np.array([drawn[kind] for kind in kinds])
    spread = np.array([LENGTH.get(kind, OTHER_LENGTH) for kind in kinds])
    return np.exp(spread * numbers[:, 0] + own[0]), np.exp(GIRTH * numbers[:, 1] + own[1]), BULGE * numbers[:, 2]


def smooth_weights(model: BodyModel, draw: Draw) -> Array:
    """Skinning weights (V, J)."""
    neighbours = neighbour_mean(model)
    weights = model.weights
    for _ in range(draw.integers(PASSES + 1)):
        weights = neighbours @ weights
    weights = weights ** draw.uniform(*POWERS)
    return weights / np.sum(weights, axis=1, keepdims=True)


def neighbour_mean(model: BodyModel) -> csr_array:
    """(V, V) sparse: the mean over a vertex and its neighbours."""
    edges = np.concatenate([model.faces[:, [i, (i + 1) % 3]] for i in range(3)])
    edges = np.concatenate([edges, edges[:, ::-1], np.tile(np.arange(model.num_vertices), (2, 1)).T])
    linked = csr_array((np.ones(len(edges)), edges.T), shape=(model.num_vertices,) * 2)
    linked.data[:] = 1.0  # an edge counts once, though two faces have it
    return diags_array(1 / (linked @ np.ones(model.num_vertices))) @ linked
