"""The types of the options: an up axis and a ground height. Light: `ipman --help` loads this."""

from __future__ import annotations

import math

import click

# Kept equal to `ipman_rs.presets.PRESETS` by a test.
PRESETS = ("paper-r", "paper-o", "released", "balanced")

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class UpAxis(click.ParamType):
    name = "axis"

    def convert(self, value, param, ctx):
        """A unit axis or a normal as three numbers."""
        if isinstance(value, tuple):
            return value
        text = value.strip().lower()
        if text.lstrip("+-") in _AXES and len(text) <= 2:
            sign = -1.0 if text.startswith("-") else 1.0
            return tuple(sign * x for x in _AXES[text.lstrip("+-")])
        try:
            normal = tuple(float(x) for x in text.split(","))
        except ValueError:
            normal = ()
        if len(normal) != 3 or not all(map(math.isfinite, normal)) or not any(normal):
            self.fail(f"{value!r} is neither one of x, y, z, -x, -y, -z nor a normal such as 0,0,1", param, ctx)
        return normal


class GroundHeight(click.ParamType):
    name = "height"

    def convert(self, value, param, ctx):
        """Metres, or None for auto."""
        if value is None or isinstance(value, float):
            return value
        if value.strip().lower() == "auto":
            return None
        try:
            height = float(value)
        except ValueError:
            height = math.nan
        if not math.isfinite(height):
            self.fail(f"{value!r} is neither a height in metres nor auto", param, ctx)
        return height


UP, GROUND = UpAxis(), GroundHeight()
