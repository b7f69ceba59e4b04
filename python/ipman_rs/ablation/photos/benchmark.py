"""`ipman benchmark photos`: photos with labels, fitted by some presets, judged, and drawn on one sheet."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

import ipman_rs as ip
from ipman_rs.body import BodyModel, pose_arrays
from ipman_rs.files import read_json, safe_names, safe_npz, write_whole
from ipman_rs.files.item_folder import RECORD
from ipman_rs.fitting.jobs.options import fit_options
from ipman_rs.fitting.jobs.run import fit_files
from ipman_rs.jsonable import jsonable
from ipman_rs.progress import Progress, silent
from ipman_rs.study import Study

from .labels import Label, read_labels
from .sheet import draw_sheet
from .verdict import Measures, judge, trunk_direction

NAME = "photos_benchmark"
CONTACT = 0.03  # m above the floor: what stands on it
Verdicts = list[tuple[Label, Measures | None, str]]


def benchmark(
    folder: str | Path,
    output: str | Path,
    presets: Sequence[str] = ("fast",),
    model: str = "anny-lite",
    progress: Progress = silent,
) -> Path:
    """Fit the photos of a folder by each preset and judge the bodies by its `labels.csv`; the page in `output`.

    A photo may be replaced by a keypoint file of the same name (`.json`). Writes photos_benchmark.md, .json, .csv and
    a sheet of all pictures for each preset, photos_PRESET.png, beside the fits. Interrupted, it continues.

    Raises:
        ValueError: labels, presets or model cannot be read.
        OSError: the output folder cannot be written.
    """
    folder, output = Path(folder), Path(output)
    labels = read_labels(folder)
    results: dict[str, Verdicts] = {}
    for preset, name in zip(presets, safe_names([Path(preset).stem for preset in presets]), strict=True):
        options = fit_options(preset, model)
        inputs = [_input(folder, label) for label in labels]
        fits = fit_files(inputs, output / name, options, resume=True, pictures=len(inputs), progress=progress)
        body = ip.load_body(model)
        bodies = {study.source: (study, _measure(study, output / name / study.name, body)) for study in fits.studies}
        failures = dict(fits.failures)
        results[name] = [
            (label, bodies[str(path)][1] if str(path) in bodies else None, failures.get(str(path), ""))
            for label, path in zip(labels, inputs, strict=True)
        ]
        studies = [bodies[str(path)][0] if str(path) in bodies else None for path in inputs]
        with progress(f"drawing {name}", len(labels)) as step:
            draw_sheet(results[name], studies, folder, output / f"photos_{name}.png", step.one)
    return _write(results, output)


def _input(folder: Path, label: Label) -> Path:
    """The photo, or the keypoints that stand for it."""
    points = (folder / label.file).with_suffix(".json")
    return points if points.exists() else folder / label.file


def _measure(study: Study, folder: Path, body: BodyModel) -> Measures:
    assert study.fitted is not None
    vertices, ground = np.asarray(study.vertices[0], np.float64), study.ground
    up = np.asarray(ground.normal, np.float64)
    path = folder / f"{study.name}.npz"
    arrays = {name: safe_npz.read(path, name) for name in safe_npz.names(path)}
    pose = pose_arrays.joined(arrays, body)
    joints = np.asarray(body(pose, arrays["betas"][0], arrays["transl"][0]).joints, np.float64)
    record = read_json(folder / RECORD)
    confidence = record["confidence"]
    owner = np.array(body.joint_names)[body.weights.argmax(axis=1)]
    heights = vertices @ up - float(ground.height)
    soles = [float(heights[np.isin(owner, (f"{side}_ankle", f"{side}_foot"))].min()) for side in ("left", "right")]
    forward = arrays["camera_rotation"][0][2]  # the camera's axis of sight, in the world
    return Measures(
        float(ip.support_margin(vertices, body.template, ground, threshold=CONTACT)),
        (soles[0], soles[1]),
        trunk_direction(dict(zip(body.joint_names, joints, strict=True)), up),
        float(np.degrees(np.arcsin(np.clip(-forward @ up, -1, 1)))) + 0.0,
        float(record["reprojection"]["median_percent"]),
        confidence["level"],
        confidence.get("support", ""),
        tuple(confidence["reasons"]),
    )


def _write(results: dict[str, Verdicts], output: Path) -> Path:
    """The numbers, and the page of them."""
    rows: list[dict[str, Any]] = []
    summaries: dict[str, dict[str, Any]] = {}
    for preset, verdicts in results.items():
        met = [judge(label, measures) for label, measures, _ in verdicts]
        names = list(met[0])
        asked = {name: [each[name] for each in met if each[name] is not None] for name in names}
        summaries[preset] = {
            **{name: {"met": sum(map(bool, each)), "of": len(each)} for name, each in asked.items()},
            "error": float(np.median([m.error for _, m, _ in verdicts if m is not None] or [np.nan])),
            "levels": {
                level: sum(m is not None and m.level == level for _, m, _ in verdicts)
                for level in ("green", "amber", "red")
            },
            "not found": sum(m is None for _, m, _ in verdicts),
        }
        for (label, measures, failure), each in zip(verdicts, met, strict=True):
            measured = {} if measures is None else asdict(measures)
            rows.append(
                {"preset": preset, "label": asdict(label), "measures": measured, "failure": failure, "met": each}
            )
    output.mkdir(parents=True, exist_ok=True)
    record = jsonable({"summaries": summaries, "photos": rows})
    write_whole(output / f"{NAME}.json", json.dumps(record, indent=1, allow_nan=False) + "\n")
    write_whole(output / f"{NAME}.csv", _csv(rows))
    page = output / f"{NAME}.md"
    write_whole(page, _page(summaries, rows))
    return page


def _csv(rows: list[dict[str, Any]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = list(rows[0]["met"])
    writer.writerow(["preset", "file", "posture", "level", "support", "pitch", "margin_mm", "error_percent", *names])
    for row in rows:
        own = row["measures"]
        numbers = (
            [own["level"], own["support"], f"{own['pitch']:.0f}", f"{1000 * own['margin']:.0f}", f"{own['error']:.2f}"]
            if own
            else ["none", "", "", "", ""]
        )
        writer.writerow([row["preset"], row["label"]["file"], row["label"]["posture"], *numbers, *row["met"].values()])
    return text.getvalue()


def _page(summaries: dict[str, dict[str, Any]], rows: list[dict[str, Any]]) -> str:
    names = list(rows[0]["met"])
    lines = [
        "# Photos of real people", "",
        "`ipman benchmark photos FOLDER -o OUT` writes this page, its numbers (JSON, CSV) and a sheet of pictures for",
        "each preset. Of the photos with such a label, the bodies that meet it:", "",
        f"| preset | {' | '.join(names)} | median 2D error | green, amber, red | nobody found |",
        f"|---|{'---|' * (len(names) + 3)}",
    ]  # fmt: skip
    for preset, summary in summaries.items():
        shares = " | ".join(f"{summary[name]['met']} of {summary[name]['of']}" for name in names)
        levels = ", ".join(str(count) for count in summary["levels"].values())
        error = f"{summary['error']:.2f} %"
        lines.append(f"| `{preset}` | {shares} | {error} | {levels} | {summary['not found']} |")
    for preset in summaries:
        lines += ["", f"## `{preset}`", "", f"| photo | label | support | pitch | {' | '.join(names)} | confidence |"]
        lines.append(f"|---|---|---|---|{'---|' * (len(names) + 1)}")
        lines += [_line(row) for row in rows if row["preset"] == preset]
    return "\n".join(lines) + "\n"


def _line(row: dict[str, Any]) -> str:
    """One photo's row of the page."""
    own, label = row["measures"], row["label"]
    marks = " | ".join("" if each is None else "yes" if each else "**no**" for each in row["met"].values())
    if not own:
        return f"| {label['file']} | {label['posture']} | | | {marks} | {row['failure']} |"
    sure = f"{own['level']}{': ' if own['reasons'] else ''}{'; '.join(own['reasons'])}"
    return f"| {label['file']} | {label['posture']} | {own['support']} | {own['pitch']:.0f}° | {marks} | {sure} |"
