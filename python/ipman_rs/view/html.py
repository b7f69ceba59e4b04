"""The page of a report: one HTML file with its data, style and viewer inside, which asks the network for nothing."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ipman_rs.jsonable import jsonable
from ipman_rs.status import status_names

from ..study.study import Study
from . import colors
from .picture import pressure_scale_top
from .timeline import SERIES

# Columns that the page shows for every frame.
_SHOWN = (
    "volume", "mass", "com_cop_distance", "area", "margin", "has_contact", "num_contacts", "bose", "stability", "pull",
    "push", "balance", "lowest",
)  # fmt: skip


def page(
    studies: Sequence[Study], failures: Sequence[tuple[str, str]] = (), folders: Sequence[Path | None] = ()
) -> str:
    """The HTML text. Names and messages are escaped wherever they stand, inside the data too.

    ``folders`` hold the studies' pictures; those of fitted bodies are shown on the page.
    """
    from jinja2 import Environment, select_autoescape
    from markupsafe import Markup

    import ipman_rs as ip

    folders = folders or [None] * len(studies)
    here = files("ipman_rs.view") / "page"
    environment = Environment(autoescape=select_autoescape(default=True, default_for_string=True))
    data = {
        "bodies": [_body(study, folder) for study, folder in zip(studies, folders, strict=True)],
        "heat": _base64(np.round(colors.heat_table() * 255).astype(np.uint8)),
        "series": [{"key": key, "title": title, "unit": unit, "factor": factor, "color": color}
                   for key, title, unit, factor, color in SERIES],
        "colors": {"com": colors.COM, "cop": colors.COP, "support": colors.SUPPORT, "edge": colors.SUPPORT_EDGE},
        "partColors": list(colors.PART_COLORS),
    }  # fmt: skip
    stops = colors.heat_table(9)
    return environment.from_string((here / "page.html").read_text(encoding="utf-8")).render(
        title=studies[0].name if len(studies) == 1 else f"{len(studies)} bodies",
        version=ip.__version__,
        studies=studies,
        failures=failures,
        data=Markup(script_json(data)),
        style=Markup((here / "page.css").read_text(encoding="utf-8")),
        scene=Markup((here / "scene.js").read_text(encoding="utf-8")),
        script=Markup((here / "page.js").read_text(encoding="utf-8")),
        gradient=", ".join(f"rgb({r:.0f},{g:.0f},{b:.0f})" for r, g, b in stops * 255),
        colors=data["colors"],
    )


def script_json(value: Any) -> str:
    """Strict JSON that cannot end the <script> element it stands in."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _body(study: Study, folder: Path | None) -> dict[str, Any]:
    keys = study.key_frames
    vertices = _floor_axes(study, study.vertices[keys])
    finite = np.isfinite(vertices)
    low = np.array([vertices[..., k][finite[..., k]].min(initial=np.inf) for k in range(3)])
    high = np.array([vertices[..., k][finite[..., k]].max(initial=-np.inf) for k in range(3)])
    low, high = (np.where(np.isfinite(edge), edge, 0.0) for edge in (low, high))
    step = np.maximum((high - low) / 65535.0, 1e-12)
    packed = np.round((np.where(finite, vertices, low) - low) / step).astype("<u2")
    small = study.template.num_vertices <= 65535
    return {
        "name": study.name,
        "source": study.source,
        "notes": list(study.notes),
        "flags": list(study.flags),
        "level": "" if study.fitted is None else study.fitted.record.get("confidence", {}).get("level", ""),
        "stages": [] if study.fitted is None else [*map(_stage_in_words, study.fitted.record.get("stages", []))],
        "pictures": _pictures(study, folder),
        "method": study.com_method,
        "preset": study.preset.name,
        "alpha": study.preset.alpha,
        "gamma": study.preset.gamma,
        "top": pressure_scale_top(study),
        "parts": list(study.template.part_names),
        "labels": [study.label(frame) for frame in range(study.num_frames)],
        "named": bool(study.labels),
        "seconds": jsonable(study.seconds),
        "keyFrames": jsonable(keys),
        "broken": [not bool(finite[k].all()) for k in range(len(keys))],
        "numVertices": int(study.template.num_vertices),
        "low": jsonable(low),
        "step": jsonable(step),
        "vertices": _base64(packed),
        "faces": _base64(study.template.faces.astype("<u2" if small else "<u4")),
        "wide": not small,
        "vertexParts": _base64(_vertex_parts(study)),
        "polygons": [jsonable(np.round(_floor_axes(study, study.polygons[frame]), 5)) for frame in keys],
        "com": _points(study, "center_of_mass"),
        "cop": _points(study, "center_of_pressure"),
        "status": [status_names(status) for status in study.numbers["status"]],
        "numbers": {key: jsonable(_short(study.numbers[key])) for key in _SHOWN},
        "partVolumes": jsonable(_short(study.numbers["part_volumes"][keys])),
    }


def _stage_in_words(stage: dict[str, Any]) -> str:
    """How a stage of a fit ended, and what each term costs there."""
    terms = ", ".join(f"{name} {cost:.4g}" for name, cost in stage["terms"].items() if cost is not None)
    return f"{stage['name']}, {stage['iterations']} iterations ({stage['reason']}): {terms}"


def _pictures(study: Study, folder: Path | None) -> list[dict[str, str]]:
    """Pictures as the page holds them: JPEGs of a size for the screen."""
    from PIL import Image

    if study.fitted is None or folder is None:
        return []
    shown = []
    for name, title in study.fitted.pictures():
        stream = BytesIO()
        with Image.open(folder / name) as image:
            small = image.convert("RGB")
            small.thumbnail((1400, 900))
            small.save(stream, "JPEG", quality=86)
        text = base64.b64encode(stream.getvalue()).decode("ascii")
        shown.append({"title": title, "src": f"data:image/jpeg;base64,{text}"})
    return shown


def _floor_axes(study: Study, points: np.ndarray) -> np.ndarray:
    """Points in the page's axes: y up from the ground, whatever is up in the input."""
    e1, e2 = study.ground.axes()
    points = np.asarray(points, dtype=np.float64)
    return np.stack([points @ e1, study.ground.signed_height(points), -(points @ e2)], axis=-1)


def _points(study: Study, key: str) -> list[Any]:
    return jsonable(np.round(_floor_axes(study, study.numbers[key]), 5))


def _short(column: np.ndarray) -> np.ndarray:
    """Eight digits are more than the page shows."""
    return np.char.mod("%.8g", column).astype(float) if column.dtype.kind == "f" else column


def _vertex_parts(study: Study) -> np.ndarray:
    """(V,) uint8 colour index of each vertex: the part of one of its faces."""
    parts = np.zeros(study.template.num_vertices, dtype=np.int64)
    parts[study.template.faces] = study.template.face_parts[:, None]
    return (parts % len(colors.PART_COLORS)).astype(np.uint8)


def _base64(array: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
