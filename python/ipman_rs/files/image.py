"""Images that anybody may have made."""

from __future__ import annotations

import math
import os
import warnings

import numpy as np
from numpy.typing import NDArray

from .regular import regular_file

SMALLEST = 32  # pixels: nobody is found in less
FILM = math.hypot(36, 24)  # mm: the diagonal of a 35 mm film
SHORTEST, LONGEST = 8.0, 2000.0  # mm: of lenses on such a film


def read(path: str | os.PathLike[str]) -> NDArray[np.uint8]:
    """The pixels (height, width, 3) of an image, turned as its EXIF says. ValueError if unreadable or tiny."""
    from PIL import Image, ImageOps

    regular_file(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(path, formats=("JPEG", "PNG")) as image:  # others start programs
                pixels = np.array(ImageOps.exif_transpose(image).convert("RGB"))
    except Exception as error:  # damaged bytes can fail in any way
        raise ValueError(f"{path}: expected an image: {error}") from None
    if min(pixels.shape[:2]) < SMALLEST:
        height, width = pixels.shape[:2]
        raise ValueError(
            f"{path}: expected an image of at least {SMALLEST} × {SMALLEST} pixels, got {width} × {height}"
        )
    return pixels


def focal_length(path: str | os.PathLike[str]) -> float | None:
    """The focal length in pixels that the camera wrote into the file (EXIF); None without one, or of a cropped image.

    From the length that a 35 mm film would need, whose diagonal is 43.27 mm. ValueError if unreadable.
    """
    from PIL import ExifTags, Image

    regular_file(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(path, formats=("JPEG", "PNG")) as image:
                size, tags = image.size, image.getexif().get_ifd(ExifTags.IFD.Exif)
        taken = [float(tags.get(tag, 0)) for tag in (ExifTags.Base.ExifImageWidth, ExifTags.Base.ExifImageHeight)]
        film = float(tags.get(ExifTags.Base.FocalLengthIn35mmFilm, 0))
    except Exception as error:  # damaged bytes can fail in any way
        raise ValueError(f"{path}: expected an image: {error}") from None
    if sorted(taken) != sorted(map(float, size)) or not SHORTEST <= film <= LONGEST:
        return None
    return film / FILM * math.hypot(*size)
