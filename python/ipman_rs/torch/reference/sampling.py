"""Points drawn once on the template's surface, carried along by the posed vertices: v_i = (W V)_i."""

from __future__ import annotations

from torch import Tensor

from .posed import Posed


def sample_surface(body: Posed) -> Tensor:
    """(B, S, 3), m."""
    return body.samples
