"""The numbers of studies as plain values: strict JSON for machines, and columns for `report.npz`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from ipman_rs.jsonable import jsonable
from ipman_rs.status import status_names

from ..study.study import Study

UNITS = {
    "vertices, centres, polygon, margin, lowest, com_cop_distance, stability, normal x height": "m",
    "area": "m²",
    "volume, part_volumes": "m³",
    "mass": "kg",
    "inertia": "kg m², about the body's own centre of mass, in the axes of the input",
    "pressure, pull, push": "relative, no unit",
    "balance": "nats",
}


def report_record(studies: Sequence[Study], failures: Sequence[tuple[str, str]] = ()) -> dict[str, Any]:
    """Everything in `report.json`. Non-finite numbers (no contact, a body of NaN) are null."""
    import ipman_rs as ip

    return {
        "ipman_rs": ip.__version__,
        "units": UNITS,
        "bodies": [study_record(study) for study in studies],
        "failures": [{"file": name, "error": message} for name, message in failures],
    }


def study_record(study: Study) -> dict[str, Any]:
    template = study.template
    fitted = {} if study.fitted is None else {"fit": jsonable(study.fitted.record)}
    return {
        "name": study.name,
        "source": study.source,
        **fitted,
        "notes": list(study.notes),
        "flags": list(study.flags),
        "preset": jsonable(asdict(study.preset)),
        "ground": {"normal": jsonable(study.ground.normal), "height": jsonable(study.ground.height)},
        "template": {
            "vertices": int(template.num_vertices),
            "faces": int(template.num_faces),
            "samples": int(template.num_samples),
            "watertight": bool(template.watertight),
            "parts": list(template.part_names),
        },
        "center_of_mass_method": study.com_method,
        "frames": [frame_record(study, frame) for frame in range(study.num_frames)],
    }


def frame_record(study: Study, frame: int) -> dict[str, Any]:
    row = {key: column[frame] for key, column in study.numbers.items()}
    volumes = dict(zip(study.template.part_names, jsonable(row.pop("part_volumes")), strict=True))
    return {
        "frame": study.number(frame),
        "label": study.label(frame),
        "seconds": None if study.seconds is None else jsonable(study.seconds[frame]),
        "status": status_names(row.pop("status")),
        **{key: jsonable(value) for key, value in row.items()},
        "polygon": jsonable(study.polygons[frame]),
        "part_volumes": volumes,
    }


def study_arrays(study: Study) -> dict[str, np.ndarray]:
    """The columns of `report.npz`.

    `polygon` holds the outlines of all frames one after the other, frame t in rows `polygon_start[t]` to
    `polygon_start[t + 1]`; `pressure` (K, S) and `vertices` (K, V, 3) are those of the frames `key_frames` (K,).
    """
    counts = [len(polygon) for polygon in study.polygons]
    arrays = dict(study.numbers)
    arrays["polygon"] = np.concatenate(study.polygons) if counts else np.zeros((0, 3))
    arrays["polygon_start"] = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    arrays["pressure"] = study.pressure
    arrays["key_frames"] = study.key_frames
    arrays["vertices"] = study.vertices[study.key_frames]
    arrays["faces"] = study.template.faces
    arrays["face_parts"] = study.template.face_parts
    arrays["part_names"] = np.array(study.template.part_names)
    arrays["sample_faces"] = study.template.sample_faces
    arrays["sample_barycentric"] = study.template.sample_barycentric
    arrays["ground_normal"] = study.ground.normal
    arrays["ground_height"] = np.asarray(study.ground.height)
    if study.seconds is not None:
        arrays["seconds"] = study.seconds
    if study.labels:
        arrays["labels"] = np.array(study.labels)
    return arrays
