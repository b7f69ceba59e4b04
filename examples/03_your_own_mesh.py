"""Your own mesh, from any file that trimesh reads: a template with parts of your choice, pressure and base of support.

Run:

    python examples/03_your_own_mesh.py [FILE]        (metres, Y up; without one, a body is written to a file first)
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
import trimesh

import ipman_rs as ip


def mesh_file() -> Path:
    if len(sys.argv) > 1:
        return Path(sys.argv[1])
    body = ip.load_body("anny-lite")
    path = Path(tempfile.mkdtemp()) / "warrior.ply"
    trimesh.Trimesh(ip.body.posed(body, "warrior"), body.faces, process=False).export(path)
    return path


# process=False keeps the vertices as they are in the file, so that labels and other poses of the same mesh still fit.
mesh = trimesh.load_mesh(mesh_file(), process=False)
vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)

# Any segmentation will do, one label a face. Parts matter for the paper's centre of mass, which weighs each sample with
# its part's volume; here three slabs of equal height. Without parts use method="exact".
height = vertices[faces].mean(axis=1)[:, 1]
face_parts = np.digitize(height, np.linspace(height.min(), height.max(), 4)[1:-1])
template = ip.BodyTemplate(vertices, faces, face_parts, part_names=("low", "middle", "high"), num_samples=20_000)
print(template)

floor = ip.Ground.y_up(height=vertices[:, 1].min())  # the floor where the mesh touches it
volumes = ip.part_volumes(vertices, template)
print("litres:", *(f"{name} {volume * 1e3:.2f}" for name, volume in zip(template.part_names, volumes, strict=True)))
print(f"sum of the parts {volumes.sum() * 1e3:.4f} l, trimesh on the whole {mesh.volume * 1e3:.4f} l")

pressure = ip.pressure(vertices, template, floor)  # (S,), one a sample
samples = ip.sample_surface(vertices, template)  # (S, 3)
share = np.bincount(template.sample_parts, pressure, minlength=3) / pressure.sum()
print("share of the pressure:", *(f"{name} {part:.1%}" for name, part in zip(template.part_names, share, strict=True)))
print("largest pressure at", samples[pressure.argmax()].round(3))

for method in ("pcom", "exact"):
    support = ip.base_of_support(vertices, template, floor, threshold=0.05, method=method)
    print(f"{method:5}: base of support {support.area:.3f} m2 from {support.num_contacts} contacts, "
          f"margin {support.margin * 1e3:+.0f} mm, {'stands' if support.inside else 'falls'}")  # fmt: skip
