"""All photos of a benchmark on one sheet: the photo with its points, the body over it, from the front and the side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ipman_rs.files import atomic_write
from ipman_rs.files import image as images
from ipman_rs.study import Study
from ipman_rs.view.fitted import draw_overlay
from ipman_rs.view.picture import camera_around, draw_picture

from .labels import Label
from .verdict import Measures, judge

if TYPE_CHECKING:
    from PIL.Image import Image

CELL = 260  # pixels of a picture's side
TEXT = 44  # of the lines above the pictures
COLUMNS = 2  # photos side by side
COLORS = {"green": (30, 130, 60), "amber": (190, 120, 0), "red": (190, 30, 30), "": (90, 90, 90)}


def draw_sheet(
    verdicts: Sequence[tuple[Label, Measures | None, str]],
    studies: Sequence[Study | None],
    folder: Path,
    path: Path,
    one: Callable[[], None] = lambda: None,
) -> None:
    """Write the sheet as PNG."""
    from PIL import Image, ImageDraw

    rows = -(-len(verdicts) // COLUMNS)
    width, height = 4 * CELL, CELL + TEXT
    sheet = Image.new("RGB", (COLUMNS * width, rows * height), "white")
    pen = ImageDraw.Draw(sheet)
    for number, ((label, measures, failure), study) in enumerate(zip(verdicts, studies, strict=True)):
        left, top = (number // rows) * width, (number % rows) * height
        for place, picture in enumerate(_pictures(folder / label.file, study)):
            picture.thumbnail((CELL, CELL))
            sheet.paste(picture, (left + place * CELL, top + TEXT))
        missed = [name for name, met in judge(label, measures).items() if met is False]
        level = measures.level if measures is not None else ""
        first = f"{label.file}: {label.posture}" + (f", {level}, {measures.support}" if measures else f", {failure}")
        pen.text((left + 6, top + 4), first[:120], fill=COLORS[level])
        pen.text((left + 6, top + 22), f"missed: {', '.join(missed)}" if missed else "all labels met", fill=COLORS[""])
        one()
    with atomic_write(path) as file:
        sheet.save(file, "PNG")


def _pictures(photo: Path, study: Study | None) -> list[Image]:
    """The photo where there is one, and three pictures of the body where there is one."""
    from PIL import Image

    pictures = [Image.fromarray(images.read(photo))] if photo.is_file() else [Image.new("RGB", (CELL, CELL), "white")]
    if study is None:
        return pictures
    over = BytesIO()
    draw_overlay(study, over)
    pictures.append(Image.open(over).convert("RGB"))
    body = np.asarray(study.vertices[0], np.float64)
    for turn in (0.0, 90.0):
        stream = BytesIO()
        draw_picture(study, 0, stream, camera_around([body], study, turn=turn, tilt=4.0))
        pictures.append(Image.open(stream).convert("RGB"))
    return pictures
