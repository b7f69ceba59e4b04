"""What can be said against outside judges without a fit: real bodies against trimesh, force plates against OpenSim.

    python tools/validate_bodies.py            prints the tables
    python tools/validate_bodies.py --write    and puts them into docs/results/validation.md

The data are read from $IPMAN_SHARED_DATA or ../shared/data; what is not there is left out, saying so.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

import ipman_rs as ip
from ipman_rs.data import opensim
from ipman_rs.gravity import GRAVITY
from ipman_rs.validation import measured

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("IPMAN_SHARED_DATA") or ROOT.parent / "shared" / "data")
DOCUMENT = ROOT / "docs" / "results" / "validation.md"
Array = NDArray[np.float64]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="put the tables into docs/results/validation.md")
    arguments = parser.parse_args()
    for make, folders in ((bodies, ["mhr_bodies"]), (plates, ["squat_forceplates", "gait2354"])):
        if missing := [folder for folder in folders if not (DATA / folder).is_dir()]:
            print(f"{make.__name__}: left out, for {', '.join(missing)} is not at {DATA} (set IPMAN_SHARED_DATA)")
            continue
        table = "\n".join(make())
        print(table, end="\n\n")
        if arguments.write:
            put(make.__name__, table)


def put(name: str, table: str) -> None:
    """Replaces what stands between the document's two marks of that name."""
    begin, end = f"<!-- begin {name} -->\n", f"<!-- end {name} -->"
    before, rest = DOCUMENT.read_text().split(begin)
    DOCUMENT.write_text(f"{before}{begin}{table}\n{end}{rest.split(end)[1]}")


def bodies() -> Iterator[str]:
    """SAM-3D-Body meshes of two photographed people, y down, against trimesh on the same mesh."""
    folder = DATA / "mhr_bodies"
    faces = np.asarray(trimesh.load_mesh(folder / "mhr_face_mask.ply", process=False).faces)
    yield "| body | vertices | volume, l | against trimesh | CoM off by | inertia off by | mass at 985 kg/m³ |"
    yield "|---|---|---|---|---|---|---|"
    for path in sorted(folder.glob("img_subj*.npz")):
        vertices = np.load(path, allow_pickle=False)["pred_vertices"].astype(np.float64)
        ours = ip.mass_properties(vertices, ip.BodyTemplate(vertices, faces))
        judge = trimesh.Trimesh(vertices, faces, process=False)
        judge.density = 985.0
        inertia = np.linalg.norm(ours.inertia - judge.moment_inertia) / np.linalg.norm(judge.moment_inertia)
        yield (
            f"| {path.stem} | {len(vertices):,} | {ours.volume * 1e3:.2f} | {abs(ours.volume / judge.volume - 1):.1e} "
            f"| {np.linalg.norm(ours.center - judge.center_mass):.1e} m | {inertia:.1e} | {ours.mass:.1f} kg |"
        )


def plates() -> Iterator[str]:
    """What force plates say of body mass and centre of pressure, and OpenSim of the centre of mass."""
    yield "| trial | figure | value |"
    yield "|---|---|---|"
    yield from (f"| quiet standing | {figure} |" for figure in quiet_standing())
    yield from (f"| squats | {figure} |" for figure in squats())
    yield from (f"| walking | {figure} |" for figure in walking())


def quiet_standing() -> Iterator[str]:
    found = measured.plates(DATA / "squat_forceplates" / "static1_grf.mot")
    force, cop = found.loads.sum(axis=1), found.center()[:, [0, 2]]
    yield f"body mass by the plates, ± over time | {force.mean() / GRAVITY:.2f} ± {force.std() / GRAVITY:.2f} kg"
    for plate, name in enumerate(("first", "second")):
        center, load = found.points[:, plate, [0, 2]].mean(axis=0), found.loads[:, plate].mean()
        yield f"CoP of the {name} plate (x, z) | {pair(center)} m, {load / force.mean():.1%} of the load"
    sway = np.sqrt(((cop - cop.mean(0)) ** 2).sum(1).mean())
    yield f"CoP of both (x, z) | {pair(cop.mean(0))} m, sway {1e3 * sway:.1f} mm rms"


def squats() -> Iterator[str]:
    folder = DATA / "squat_forceplates"
    found = measured.plates(folder / "squats1_grf.mot")
    cop = found.center()[:, [0, 2]]
    com = measured.center_of_mass(folder / "squats1_opensim_com_manually_scaled.csv", found.times)
    apart = np.linalg.norm(cop.mean(0) - com[:, [0, 2]].mean(0))
    yield f"body mass by the plates, mean over the trial | {found.loads.sum(axis=1).mean() / GRAVITY:.2f} kg"
    yield f"CoP of both: range of x, of z | {ranges(cop)}"
    yield f"CoM by OpenSim: range of x, of z | {ranges(com[:, [0, 2]])}"
    yield f"CoM by OpenSim: range of height | {ranges(com[:, [1]])}"
    yield f"mean CoP to mean CoM by OpenSim, on the floor | {1e3 * apart:.1f} mm"


def walking() -> Iterator[str]:
    found = measured.plates(DATA / "gait2354" / "subject01_walk1_grf.mot")
    table = opensim.storage(DATA / "gait2354" / "g2354_bodykin.sto")
    time, height = table.times, opensim.center_of_mass(table)[:, 1]
    # Mean force = m (g + mean acceleration); the CoM's speed at both ends comes from a polynomial through its heights.
    speed = np.polynomial.Polynomial.fit(time, height, 5).deriv()
    acceleration = (speed(time[-1]) - speed(time[0])) / (time[-1] - time[0])
    force = found.loads.sum(axis=1)
    mass = force[(found.times >= time[0]) & (found.times <= time[-1])].mean() / (GRAVITY + acceleration)
    window = f"t {time[0]:.2f}–{time[-1]:.2f} s"
    yield f"body mass by the plates and the CoM's acceleration, {window} | {mass:.1f} kg"
    yield f"CoM by OpenSim: range of height, {window} | {ranges(height[:, None])}"


def pair(point: Array) -> str:
    return f"({point[0]:.3f}, {point[1]:.3f})"


def ranges(columns: Array) -> str:
    return ", ".join(f"{low:.3f} to {high:.3f} m" for low, high in zip(columns.min(0), columns.max(0), strict=True))


if __name__ == "__main__":
    main()
