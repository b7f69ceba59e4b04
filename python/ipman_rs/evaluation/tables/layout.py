"""The arrays of predictions (of .npz files, or columns of Parquet), by type: text, lengths, labels, numbers, points."""

from __future__ import annotations

TEXT = ("names", "sequences", "genders")
LENGTHS = ("transl", "vertices", "joints", "center_of_mass", "center_of_pressure")
LABELS = ("standing", "contact")
NUMBERS = (
    "pose", "betas", "transl", "vertices", "joints", "ground", "center_of_mass", "center_of_pressure", *LABELS,
)  # fmt: skip
POINTS = ("pose", "vertices", "joints")  # (F, n, 3)
FOR_ALL = ("body", "joint_names", "frame_rate")
