"""Gravity, the same wherever bodies fall, are weighed, or move over force plates."""

from ipman_rs import _core

GRAVITY = _core.GRAVITY  # m/s²
