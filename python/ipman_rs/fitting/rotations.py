"""Rotation vectors and matrices: roma's, under the names used here."""

from __future__ import annotations

from roma import rotmat_to_rotvec as vector
from roma import rotvec_to_rotmat as matrix

__all__ = ["matrix", "vector"]
