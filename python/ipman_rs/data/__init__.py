"""Data sets of people with ground, cameras, forces or pressure, each read into one common form."""

from .frames import Cameras, DataSet, Frames, PressureMaps, pieces

__all__ = ["Cameras", "DataSet", "Frames", "PressureMaps", "pieces"]
