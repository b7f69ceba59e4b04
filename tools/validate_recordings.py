"""Bodies fitted to recorded markers, against force plates and OpenSim.

    python tools/validate_recordings.py            prints the tables, some minutes
    python tools/validate_recordings.py --write    and puts them into docs/validation.md, the plots beside it

Markers are all that the fits see: no weight, no force, no centre of mass. The data are read from $IPMAN_SHARED_DATA or
../shared/data.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from validate_bodies import DATA, GRAVITY, ROOT, TWO_PLATES, combined, put, storage

import ipman_rs.torch as ipt
from ipman_rs.fitting import markers
from ipman_rs.fitting.recorded import Recorded, fit_tracks

IMAGES = ROOT / "docs" / "images"
SQUATS = DATA / "squat_forceplates"
OPENSIM = SQUATS / "squats1_opensim_com_manually_scaled.csv"
GAMMAS = (5, 10, 20, 50, 100, 200)
STEPS = {"static1": 20, "squats1": 5}  # of the 100 frames a second, every which is fitted
BODIES = ("anny-lite", "anny")

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Trial:
    """A fitted recording and what was measured of it."""

    name: str
    body: ipt.BodyModel
    shape: str  # where it comes from
    recorded: Recorded
    seconds: float
    weight: float  # kg, by the plates, or told
    cop: Array | None = None  # (T, 2) m, measured: x, z
    opensim: Array | None = None  # (T, 3) m, OpenSim's CoM

    @cached_property
    def vertices(self) -> torch.Tensor:
        with torch.no_grad():
            return self.recorded.fit.candidate.vertices

    @cached_property
    def solid(self) -> ipt.MassProperties:
        return ipt.mass_properties(self.vertices, self.body.template)

    @property
    def com(self) -> Array:
        """(T, 3) m: of the whole volume."""
        return np.asarray(self.solid.center, dtype=np.float64)

    @property
    def pcom(self) -> Array:
        """(T, 3) m: the paper's, of surface samples weighted by their part's volume."""
        return ipt.center_of_mass(self.vertices, self.body.template).double().numpy()

    @property
    def mass(self) -> Array:
        """(T,) kg: volume × 985 kg/m³ of the posed mesh."""
        return np.asarray(self.solid.mass, dtype=np.float64)

    @cached_property
    def ground(self) -> ipt.Ground:
        """Under each frame's lowest vertex: people wear shoes. The pressure of points above it knows no offset."""
        up = torch.tensor([0.0, 1.0, 0.0]).expand(len(self.vertices), 3)
        return ipt.Ground(up, self.vertices[..., 1].amin(dim=1))

    def pressed(self, gamma: float) -> Array:
        """The paper's centre of pressure (T, 2)."""
        found = ipt.center_of_pressure(self.vertices, self.body.template, self.ground, gamma=gamma)
        return found.double().numpy()[:, [0, 2]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="put the tables and plots into docs")
    arguments = parser.parse_args()
    if missing := [name for name in ("squat_forceplates", "gait2354") if not (DATA / name).is_dir()]:
        raise SystemExit(f"{', '.join(missing)} is not at {DATA}: set IPMAN_SHARED_DATA")
    trials = list(fitted())
    shown = {trial.name: trial for trial in reversed(trials) if trial.body.body.name == BODIES[0]}
    for name, rows in (("recordings", figures(trials)), ("cop", pressures(trials))):
        table = "\n".join(rows)
        print(table, end="\n\n")
        if arguments.write:
            put(name, table)
    if arguments.write:
        heights(shown["squats1"], IMAGES / "squats-com.svg")
        floors(shown["static1"], shown["squats1"], IMAGES / "squats-cop.svg")
        people(shown["static1"], shown["squats1"], IMAGES / "squats-bodies.png")


def fitted() -> Iterator[Trial]:
    for name in BODIES:
        body = ipt.BodyModel(name)
        standing = trial(body, "static1", "itself")
        yield standing
        yield trial(body, "squats1", "static1", standing.recorded)
        yield trial(body, "squats1", "itself")
        yield walker(body)


def trial(body: ipt.BodyModel, name: str, shape: str, person: Recorded | None = None) -> Trial:
    """Of the person on the force plates."""
    step = STEPS[name]
    recorded, seconds = timed(body, SQUATS / f"{name}.trc", step, person)
    forces = storage(SQUATS / f"{name}_grf.mot")
    force, cop = combined(forces, TWO_PLATES)
    if len(cop) != len(force):
        raise SystemExit(f"{name}: expected a load on the plates in every frame")
    opensim = np.loadtxt(OPENSIM, delimiter=",")[::step, 1:] if name == "squats1" else None
    return Trial(name, body, shape, recorded, seconds, force.mean() / GRAVITY, cop[::step], opensim)


def walker(body: ipt.BodyModel) -> Trial:
    """OpenSim's example, standing; its model weighs 72.6 kg."""
    recorded, seconds = timed(body, DATA / "gait2354" / "subject01_static.trc", 20, None)
    return Trial("gait2354 static", body, "itself", recorded, seconds, 72.6)


def timed(body: ipt.BodyModel, path: Path, step: int, person: Recorded | None) -> tuple[Recorded, float]:
    begin = time.perf_counter()
    recorded = fit_tracks(body, markers.read(path), every=step, person=person)
    return recorded, time.perf_counter() - begin


def figures(trials: list[Trial]) -> Iterator[str]:
    yield (
        "| trial | body | shape from | frames | markers, mm | volume × 985, kg | measured | off "
        "| CoM height to OpenSim, rms (worst) | the paper's pCoM, mean | CoM to measured CoP | time |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|---|---|"
    for one in trials:
        errors, mass = 1e3 * one.recorded.errors, one.mass
        height = paper = apart = ""
        if one.opensim is not None:
            above, sampled = ((centre - one.opensim)[:, 1] * 1e3 for centre in (one.com, one.pcom))
            height, paper = f"{rms(above):.1f} ({np.abs(above).max():.1f}) mm", f"{sampled.mean():+.0f} mm"
        if one.cop is not None:
            apart = f"{1e3 * distance(one.com[:, [0, 2]], one.cop):.1f} mm"
        yield (
            f"| {one.name} | {one.body.body.name} | {one.shape} | {len(mass)} | {np.nanmean(errors):.1f} "
            f"| {mass.mean():.1f} ({mass.min():.1f} to {mass.max():.1f}) | {one.weight:.1f} "
            f"| {mass.mean() / one.weight - 1:+.1%} | {height} | {paper} | {apart} | {one.seconds:.0f} s |"
        )


def pressures(trials: list[Trial]) -> Iterator[str]:
    yield f"| trial | body | shape from | CoM | {' | '.join(f'γ = {gamma}' for gamma in GAMMAS)} |"
    yield f"|---|---|---|---|{'---|' * len(GAMMAS)}"
    for one in trials:
        if one.cop is None:
            continue
        cells = [one.com[:, [0, 2]], *(one.pressed(gamma) for gamma in GAMMAS)]
        told = " | ".join(f"{1e3 * distance(cell, one.cop):.1f}" for cell in cells)
        yield f"| {one.name} | {one.body.body.name} | {one.shape} | {told} |"
    for one in trials[:2]:
        if one.opensim is not None and one.cop is not None:
            apart = 1e3 * distance(one.opensim[:, [0, 2]], one.cop)
            yield f"| {one.name} | OpenSim's model | by hand | {apart:.1f} |{' |' * len(GAMMAS)}"


def distance(points: Array, others: Array) -> float:
    return float(np.linalg.norm(points - others, axis=1).mean())


def rms(values: Array) -> float:
    return float(np.sqrt(np.square(values).mean()))


def heights(squats: Trial, path: Path) -> None:
    """The CoM's height over time, ours and OpenSim's."""
    assert squats.opensim is not None
    figure, (above, below) = canvas(2, 1, (8, 4.4), sharex=True, height_ratios=[3, 1])
    times, ours, theirs = squats.recorded.tracks.times, squats.com[:, 1], squats.opensim[:, 1]
    above.plot(times, theirs, color="0.6", lw=3, label="OpenSim, manually scaled model")
    above.plot(times, ours, color="C0", lw=1.2, label=f"fitted body ({squats.body.body.name}), whole volume")
    above.set_ylabel("height of the CoM, m")
    above.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1), ncols=2)
    below.axhline(0, color="0.6", lw=0.8)
    below.plot(times, 1e3 * (ours - theirs), color="C0", lw=1.2)
    below.set_ylim(-22, 22)
    below.set_ylabel("difference, mm")
    below.set_xlabel("s")
    save(figure, path)


def floors(standing: Trial, squats: Trial, path: Path) -> None:
    """Where CoM and CoP are: on the floor while standing, and forwards over time in the squats."""
    assert standing.cop is not None
    assert squats.cop is not None
    assert squats.opensim is not None
    figure, (left, right) = canvas(1, 2, (11, 4.2), width_ratios=[1, 1.7])
    low = standing.vertices[0, :, 1] < standing.ground.height[0] + 0.03
    soles = standing.vertices[0, low].numpy()
    left.plot(1e3 * soles[:, 2], 1e3 * soles[:, 0], ".", color="0.6", ms=3, label="soles of the fitted body")
    shown = {"measured CoP": (standing.cop, "k", "o"), "CoM": (standing.com[:, [0, 2]], "C0", "s")}
    shown |= {f"paper's CoP, γ = {g}": (standing.pressed(g), f"C{n}", "^") for n, g in ((3, 10), (1, 100))}
    for name, (points, color, mark) in shown.items():
        x, z = 1e3 * points.mean(axis=0)
        left.plot(z, x, mark, color=color, ms=6, label=name)
    left.set_aspect("equal")
    left.set_xlabel("z, mm (the person faces up the page)")
    left.set_ylabel("x, mm")
    left.set_title("standing, mean", fontsize=10)
    left.margins(y=0.3)
    left.legend(frameon=False, fontsize=7, loc="upper center", ncols=2)
    times = squats.recorded.tracks.times
    right.plot(times, 1e3 * squats.cop[:, 0], "k", lw=1, label="measured CoP")
    right.plot(times, 1e3 * squats.opensim[:, 0], color="0.6", lw=2.5, label="OpenSim's CoM")
    right.plot(times, 1e3 * squats.com[:, 0], "C0", lw=1.2, label="CoM")
    for n, gamma in ((3, 10), (1, 100)):
        right.plot(times, 1e3 * squats.pressed(gamma)[:, 0], f"C{n}", lw=1.2, label=f"paper's CoP, γ = {gamma}")
    right.set_xlabel("s")
    right.set_ylabel("forwards, x, mm")
    right.set_title("squats", fontsize=10)
    right.margins(y=0.25)
    right.legend(frameon=False, fontsize=7, ncols=3, loc="upper center")
    save(figure, path)


def people(standing: Trial, squats: Trial, path: Path) -> None:
    """Fitted bodies from the side and from behind, with the markers, the CoM and the measured CoP."""
    lowest = int(squats.com[:, 1].argmin())
    frames = [(standing, 0), (squats, lowest // 2), (squats, lowest)]
    figure, axes = canvas(1, 4, (11, 4.6), sharey=True)
    for axis, (one, frame), across in zip(axes, [*frames, frames[-1]], (0, 0, 0, 2), strict=True):
        draw(axis, one, frame, across)
    axes[0].set_ylabel("m")
    save(figure, path)


def draw(axis, one: Trial, frame: int, across: int) -> None:
    """A body seen along the axis that is neither up nor `across`."""
    from matplotlib.collections import PolyCollection

    away = 2 - across
    vertices, faces = one.vertices[frame].numpy(), one.body.body.faces
    sign = 1 if away == 2 else -1  # the person faces +x: seen from their right, or from behind
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    light = (normal / np.linalg.norm(normal, axis=1, keepdims=True).clip(1e-12))[:, away] * sign
    order = (sign * corners[:, :, away].mean(axis=1)).argsort()
    order = order[light[order] > 0]
    shade = np.repeat((0.45 + 0.45 * light[order])[:, None], 3, axis=1)
    seen = list(corners[order][:, :, [across, 1]])
    axis.add_collection(PolyCollection(seen, facecolors=shade, edgecolors="face", linewidths=0.3))
    points = one.recorded.tracks.points[frame]
    axis.plot(points[:, across], points[:, 1], "o", ms=2.5, color="C3")
    axis.plot(*one.com[frame, [across, 1]], "P", ms=9, color="C0", mec="w")
    if one.cop is not None:
        axis.plot(one.cop[frame, 0 if across == 0 else 1], 0, "^", ms=7, color="k")
    axis.axhline(0, color="0.5", lw=0.8)
    axis.set_aspect("equal")
    middle = vertices[:, across].mean()
    axis.set_xlim(middle - 0.5, middle + 0.5)
    axis.set_xticks([])
    axis.set_title(f"{one.name}, {one.recorded.tracks.times[frame]:.1f} s", fontsize=9)


def canvas(rows: int, columns: int, size: tuple[float, float], **options):
    import matplotlib

    matplotlib.use("agg")
    matplotlib.rcParams["svg.hashsalt"] = "ipman"  # the same file from the same data
    import matplotlib.pyplot as plt

    shared = {name: options.pop(name) for name in ("sharex", "sharey") if name in options}
    return plt.subplots(rows, columns, figsize=size, layout="constrained", gridspec_kw=options, **shared)


def save(figure, path: Path) -> None:
    for axis in figure.axes:
        axis.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=110, metadata={"Date": None} if path.suffix == ".svg" else None)


if __name__ == "__main__":
    main()
