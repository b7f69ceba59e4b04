"""The camera's sensor, from linear light to the pixels of an image: exposure, blur, noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

EXPOSURE = (0.75, 1.3)
BLUR = 0.8  # pixels, at most
NOISE = 0.02  # at most
QUALITY = (75, 95)


@dataclass(frozen=True)
class CameraSensor:
    exposure: float
    blur: float  # pixels, standard deviation
    noise: Array  # (S, S, 3)
    quality: int  # of the JPEG

    def develop(self, colors: Array) -> NDArray[np.uint8]:
        """Linear light (S, S, 3) -> an image (S, S, 3)."""
        from scipy.ndimage import gaussian_filter

        exposed = (self.exposure * colors).clip(0, 1) ** (1 / 2.2)
        seen = gaussian_filter(exposed, (self.blur, self.blur, 0)) + self.noise
        return np.rint(255 * seen.clip(0, 1)).astype(np.uint8)


def draw_sensor(draw: np.random.Generator, size: int) -> CameraSensor:
    noise = draw.uniform(0, NOISE) * draw.standard_normal((size, size, 3), dtype=np.float32)
    return CameraSensor(
        draw.uniform(*EXPOSURE), draw.uniform(0, BLUR), noise, int(draw.integers(*QUALITY, endpoint=True))
    )
