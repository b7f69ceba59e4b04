"""Studies: one body, or the frames of one, and everything measured on them."""

from __future__ import annotations

from .camera import Camera
from .fitted import Fitted, camera_of
from .study import Study, study

__all__ = ["Camera", "Fitted", "Study", "camera_of", "study"]
