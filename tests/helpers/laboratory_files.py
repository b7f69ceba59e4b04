"""Recordings of a laboratory, markers and force plates, made up from a body."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import torch

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs.data import markers
from ipman_rs.data.markers.sets import OPENCAP
from ipman_rs.fitting.landmarks import Landmarks

RATE, FRAMES = 50, 40
MASS = 64.0  # kg
OFF = np.array([0.012, 0.0, -0.005])  # m, from g(CoM) to the made-up CoP
G = 9.81


def person() -> SimpleNamespace:
    """A body that stands on y = 0, its markers (M, 3) and its centre of mass."""
    body = ipt.BodyModel("anny-lite")
    sites = markers.sites(body.body, OPENCAP)
    pose = torch.zeros(1, body.body.num_joints, 3, dtype=torch.float64)
    for side, joint in ((-1, "left_shoulder"), (1, "right_shoulder")):  # arms down
        pose[0, body.body.joint_names.index(joint), 2] = side * 1.2
    betas = torch.zeros(1, body.body.num_betas, dtype=torch.float64)
    vertices = body.body(pose.numpy(), betas.numpy()).vertices
    up = torch.tensor([[0.3, -float(vertices[..., 1].min()), 0.2]], dtype=torch.float64)
    with torch.no_grad():
        points = Landmarks(body, sites, sites)(pose, betas, up)[0].double().numpy()
    com = np.asarray(ip.mass_properties(vertices[0] + up.numpy()[0], body.body.template).center, float)
    return SimpleNamespace(names=list(sites), points=points, com=com)


def moved(height=0.0):
    """The way (T, 3) of somebody who is lifted up and down once a second."""
    times = np.arange(FRAMES) / RATE
    return times, np.stack([0 * times, height * np.sin(2 * np.pi * times), 0 * times], axis=1)


def trc(path, person, shift, scale=1.0, unit="m"):
    columns = "Frame#\tTime\t" + "\t\t\t".join(person.names)
    lines = ["PathFileType\t4\t(X/Y/Z)\tx.trc", "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits"]
    lines += [f"{RATE}\t{RATE}\t{FRAMES}\t{len(person.names)}\t{unit}", columns, ""]
    for frame, off in enumerate(shift):
        values = "\t".join(f"{value * scale:.6f}" for value in (person.points + off).ravel())
        lines.append(f"{frame + 1}\t{frame / RATE:.4f}\t{values}")
    path.write_text("\n".join(lines) + "\n")


def mot(path, cop, upward, rate=10 * RATE, scale=1.0, start=0.0, rename=False, up="y"):
    """Two plates: all load is on the first, the second's centre is garbage; ten times the markers' rate."""
    kinds = ("F", "COP", "M") if rename else "vpm"
    begin = "FP" if rename else "ground_force_"
    heads = ["time", *(f"{begin}{plate}_{kind}{axis}" for plate in (1, 2) for kind in kinds for axis in "xyz")]
    times = start + np.arange(FRAMES * rate // RATE) / rate
    axis = np.eye(3)["xyz".index(up)]
    rows = [[t, *(upward(t) * axis), *(scale * cop), 0, 0, 0, *(1.5 * axis), 99.0, 99.0, 99.0, 0, 0, 0] for t in times]
    header = ["grf", "version=1", f"nRows={len(rows)}", f"nColumns={len(heads)}", "inDegrees=yes", "endheader"]
    lines = [*header, "\t".join(heads), *("\t".join(f"{value:.6f}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
