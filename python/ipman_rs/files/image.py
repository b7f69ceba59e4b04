"""Images that anybody may have made."""

from __future__ import annotations

import os
import warnings

import numpy as np
from numpy.typing import NDArray

from .regular import regular_file

SMALLEST = 32  # pixels: nobody is found in less


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
