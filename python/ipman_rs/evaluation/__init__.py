"""How far estimated bodies are from true ones, and what of a difference is chance."""

from .bootstrap import Interval, paired
from .errors import aligned, mpjpe, pa_mpjpe, pve, similarity

__all__ = ["Interval", "aligned", "mpjpe", "pa_mpjpe", "paired", "pve", "similarity"]
