"""Studies: one body, or the frames of one, and everything measured on them."""

from __future__ import annotations

from .camera import Camera, camera_of
from .study import Fitted, Study, study

__all__ = ["Camera", "Fitted", "Study", "camera_of", "study"]
