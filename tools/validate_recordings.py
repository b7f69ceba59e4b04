"""Bodies fitted to recorded markers, against force plates and OpenSim: `ipman validate` of the measured data.

    python tools/validate_recordings.py            prints the tables, many minutes; fits are kept in out/validation
    python tools/validate_recordings.py --write    and puts them into docs/validation.md, the pictures beside it

The data are read from $IPMAN_SHARED_DATA or ../shared/data.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from validate_bodies import DATA, ROOT, put

from ipman_rs.validation import report

OUT = ROOT / "out" / "validation"
IMAGES = ROOT / "docs" / "images"
# Folder, body, and whether the standing recording's shape is kept (auto) or each finds its own (none).
RUNS = [(folder, "anny-lite", "auto") for folder in ("squat_forceplates", "gait2354", "c3d")]
RUNS += [("squat_forceplates", "anny-lite", "none")]
RUNS += [(folder, "anny", "auto") for folder in ("squat_forceplates", "gait2354")]
SHOWN = RUNS[0][1:]  # of which the document has pictures
PICTURES = {
    "squats-bodies.png": ("squat_forceplates", "squats1/bodies.png"),
    "squats-over-time.png": ("squat_forceplates", "squats1/over_time.png"),
    "squats-pressure.png": ("squat_forceplates", "squats1/pressure.png"),
    "standing-pressure.png": ("squat_forceplates", "static1/pressure.png"),
    "walking-over-time.png": ("gait2354", "subject01_walk1/over_time.png"),
    "walking-pressure.png": ("gait2354", "subject01_walk1/pressure.png"),
}
TABLES = {
    "recordings": report.recordings,
    "com": report.centers_of_mass,
    "formulations": report.formulations,
    "standing": report.standing,
    "cop": report.centers_of_pressure,
    "references": report.references,
    "shares": report.shares,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="put the tables and pictures into docs")
    arguments = parser.parse_args()
    if missing := [name for name, *_ in RUNS if not (DATA / name).is_dir()]:
        raise SystemExit(f"{', '.join(dict.fromkeys(missing))} is not at {DATA}: set IPMAN_SHARED_DATA")
    records: list[dict[str, Any]] = []
    for folder, body, person in RUNS:
        output = where(folder, body, person)
        command = [sys.executable, "-c", "from ipman_rs.cli import main; main()", "validate", str(DATA / folder)]
        subprocess.run([*command, "-o", str(output), "--body", body, "--person", person], check=True)
        found = json.loads((output / "validation.json").read_text())["recordings"]
        records += [one for one in found if one not in records]
    for name, table in TABLES.items():
        rows = "\n".join(table(records))
        print(rows, end="\n\n")
        if arguments.write:
            put(name, rows)
    if arguments.write:
        for name, (folder, picture) in PICTURES.items():
            shutil.copyfile(where(folder, *SHOWN) / picture, IMAGES / name)


def where(folder: str, body: str, person: str) -> Path:
    return OUT / f"{folder}-{body}-{person}"


if __name__ == "__main__":
    main()
