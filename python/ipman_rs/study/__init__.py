"""Studies: one body, or the frames of one, and everything measured on them."""

from __future__ import annotations

from ..renamed import old_names
from .camera import ViewCamera, camera_of
from .study import Fitted, Study, study

__all__ = ["Fitted", "Study", "ViewCamera", "camera_of", "study"]

__getattr__ = old_names(__name__, {"Camera": "ViewCamera"})
