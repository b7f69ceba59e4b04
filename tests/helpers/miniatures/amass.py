"""Miniature AMASS: folders of motions, as the releases for SMPL+H and for SMPL-X have them."""

from __future__ import annotations

import numpy as np

STANDING = np.array([np.pi / 2, 0, 0])  # turns SMPL's y up into the data set's z up


def motion(path, frames=20, rate=120.0, kind="smplh", seed=0, lies=False, up="z", scale=1.0, **changes):
    """One motion; `lies`: on the back along y. Gives poses (F, n) and trans (F, 3) as written."""
    rng = np.random.default_rng(seed)
    poses = rng.normal(scale=0.1, size=(frames, {"smplh": 156, "smplx": 165}[kind]))
    poses[:, :3] = 0 if lies or up == "y" else STANDING
    trans = np.stack([np.linspace(0, 1, frames), np.zeros(frames), np.full(frames, 0.15 if lies else 1.2)], axis=1)
    if up == "y":
        trans = trans[:, [0, 2, 1]]
    content = {
        "poses": poses,
        "trans": trans * scale,
        "betas": rng.normal(size=16),
        "gender": "female",
        {"smplh": "mocap_framerate", "smplx": "mocap_frame_rate"}[kind]: rate,
    }
    if kind == "smplh":
        content["dmpls"] = np.zeros((frames, 8))
    else:
        content |= {"surface_model_type": "smplx", "root_orient": poses[:, :3], "pose_body": poses[:, 3:66]}
    content |= changes
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, **{name: value for name, value in content.items() if value is not None})
    return poses, trans


def tree(root, kind="smplh", **options):
    """Motions of six data sets, two for each split; gives their files, sorted, with poses and trans."""
    ending = {"smplh": "poses", "smplx": "stageii"}[kind]
    names = {
        "smplh": ("ACCAD", "CMU", "HumanEva", "MPI_mosh", "SSM_synced", "Transitions_mocap"),
        "smplx": ("ACCAD", "CMU", "HumanEva", "MoSh", "SSM", "Transitions"),
    }[kind]
    found = {}
    for seed, name in enumerate(names):
        for number in range(2):
            path = root / name / "s1" / f"walk{number}_{ending}.npz"
            found[path] = motion(path, kind=kind, frames=10 + seed, rate=60.0 + 60 * (seed % 2), seed=seed, **options)
        np.savez(root / name / "s1" / "shape.npz", betas=np.zeros(16))
        np.savez(root / name / "s1" / "female_stagei.npz", betas=np.zeros(16))
    return found
