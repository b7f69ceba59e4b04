"""Rotation vectors, matrices and unit quaternions (x, y, z, w): roma's, under the names used here."""

from __future__ import annotations

from roma import rotmat_to_rotvec as vector
from roma import rotvec_to_rotmat as matrix
from roma import rotvec_to_unitquat as quaternion

__all__ = ["matrix", "quaternion", "vector"]
