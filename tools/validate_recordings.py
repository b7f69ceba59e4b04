"""Bodies fitted to recorded markers, against force plates and OpenSim: `ipman validate` of the measured data.

    python tools/validate_recordings.py            prints the tables, many minutes; fits are kept in out/validation
    python tools/validate_recordings.py --write    and puts tables and pictures into docs/results
    python tools/validate_recordings.py --short    without the fine body and every recording's own shape

The data are read from $IPMAN_SHARED_DATA or ../shared/data.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from validate_bodies import DATA, ROOT, put

from ipman_rs.validation import report

OUT = ROOT / "out" / "validation"
IMAGES = ROOT / "docs" / "results" / "images"
# The recordings of each person, whatever folders they came in.
PEOPLE = {
    "Subject4": ["squat_forceplates", "motion/drop_jump", "motion/walking_forces"],
    "gait2354": ["gait2354"],
    "walking2": ["c3d"],
    "moco": ["motion/moco_walking"],
    "child": ["motion/child_gait"],
}
# Person, body, and whether the standing recording's shape is kept (auto) or each finds its own (none).
RUNS = [(person, "anny-lite", "auto") for person in PEOPLE]
FURTHER = [("Subject4", "anny-lite", "none"), ("Subject4", "anny", "auto"), ("gait2354", "anny", "auto")]
PICTURES = {
    "squats-bodies.png": ("Subject4", "squats1/bodies.png"),
    "squats-over-time.png": ("Subject4", "squats1/over_time.png"),
    "squats-pressure.png": ("Subject4", "squats1/pressure.png"),
    "standing-pressure.png": ("Subject4", "static1/pressure.png"),
    "walking-over-time.png": ("gait2354", "subject01_walk1/over_time.png"),
    "walking-pressure.png": ("gait2354", "subject01_walk1/pressure.png"),
    "child-bodies.png": ("child", "HC036A10/bodies.png"),
    "child-over-time.png": ("child", "HC036A10/over_time.png"),
}
TABLES = {
    "recordings": report.recordings,
    "odd": lambda records: (f"- {one['name']}: {flag}" for one in records for flag in one["flags"]),
    "com": report.centers_of_mass,
    "formulations": report.formulations,
    "standing": report.standing,
    "cop": report.centers_of_pressure,
    "references": report.references,
    "shares": report.shares,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="put the tables and pictures into docs/results")
    parser.add_argument("--short", action="store_true", help="without the fine body and every recording's own shape")
    arguments = parser.parse_args()
    if missing := [name for names in PEOPLE.values() for name in names if not (DATA / name).is_dir()]:
        raise SystemExit(f"{', '.join(missing)} is not at {DATA}: set IPMAN_SHARED_DATA")
    records: list[dict[str, Any]] = []
    for person, body, shape in RUNS if arguments.short else [*RUNS, *FURTHER]:
        output = where(person, body, shape)
        command = [sys.executable, "-c", "from ipman_rs.cli import main; main()", "validate", str(gathered(person))]
        subprocess.run([*command, "-o", str(output), "--body", body, "--person", shape], check=True)
        found = json.loads((output / "validation.json").read_text())["recordings"]
        records += [{**one, "person": person} for one in found if {**one, "person": person} not in records]
    tables = {name: "\n".join(table(records)) for name, table in TABLES.items()}
    tables["people"] = "\n".join(people([one for one in records if one["body"] == "anny-lite"]))
    for name, rows in tables.items():
        print(rows, end="\n\n")
        if arguments.write:
            put(name, rows)
    if arguments.write:
        for name, (person, picture) in PICTURES.items():
            shutil.copyfile(where(person, "anny-lite", "auto") / picture, IMAGES / name)


def people(records: list[dict[str, Any]]) -> Iterator[str]:
    """What is off in one way with everybody, and what is not: a mean over people, each counted once, by the first of
    their recordings that has the figure."""
    rows = {
        "CoM − CoP standing, forward, mm": lambda one: one["standing"] and 1e3 * one["standing"]["offset"][0],
        "CoM − CoP standing, to the left, mm": lambda one: one["standing"] and 1e3 * one["standing"]["offset"][1],
        "CoM − OpenSim's, forward, mm": lambda one: against(one, "OpenSim", 0),
        "CoM − OpenSim's, up, mm": lambda one: against(one, "OpenSim", 2),
        "CoM − Plug-in Gait's, forward, mm": lambda one: against(one, "Plug-in Gait", 0),
        "CoM − Plug-in Gait's, up, mm": lambda one: against(one, "Plug-in Gait", 2),
        "volume × 985 against the plates, %": lambda one: (
            None if report.weighed(one) is None else 100 * (one["mass"]["volume_mean"] / report.weighed(one) - 1)
        ),
        "upward force, rms, % of the weight, moving on the floor": lambda one: (
            one["force"] and one["kind"] in ("walking", "movement in place") and 100 * one["force"]["share"]
        ),
        "ZMP of the parts from the CoP, one plate, walking, mm": lambda one: (
            "single support" in one["cop"] and millimetres(one["cop"]["single support"], "moving: ZMP of the parts")
        ),
    }
    yield "| figure | people | mean ± SD | each |"
    yield "|---|---|---|---|"
    for name, figure in rows.items():
        each: dict[str, float] = {}
        for one in records:
            value = figure(one)
            if value not in (None, False):
                each.setdefault(one["person"], float(value))
        spread = f" ± {np.std([*each.values()], ddof=1):.1f}" if len(each) > 1 else ""
        sign = "+" if "−" in name or "against" in name else ""
        told = ", ".join(f"{person} {value:{sign}.1f}" for person, value in each.items())
        yield f"| {name} | {len(each)} | {np.mean([*each.values()]):{sign}.1f}{spread} | {told} |"


def against(one: dict[str, Any], judge: str, axis: int) -> float | None:
    """How far the centre of mass is from a judge's along an axis of the person, mm."""
    if not one["com"] or not (
        one["com"]["judge"] == judge or (judge == "OpenSim" and "opensim" in one["com"]["judge"])
    ):
        return None
    return 1e3 * one["com"]["methods"]["exact"]["mean"][axis]


def millimetres(phase: dict[str, Any], name: str) -> float | None:
    found = phase["distance"].get(name)
    return None if found is None else 1e3 * found


def gathered(person: str) -> Path:
    """A folder of links to all recordings of a person."""
    folder = OUT / "people" / person
    folder.mkdir(parents=True, exist_ok=True)
    for source in PEOPLE[person]:
        for path in (DATA / source).iterdir():
            link = folder / path.name
            if path.suffix in (".trc", ".c3d", ".mot", ".sto", ".csv", ".xml") and not link.exists():
                link.symlink_to(path)
    return folder


def where(person: str, body: str, shape: str) -> Path:
    return OUT / f"{person}-{body}-{shape}"


if __name__ == "__main__":
    main()
