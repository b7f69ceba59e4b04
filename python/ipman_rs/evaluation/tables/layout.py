"""The arrays of predictions, in .npz files and in the columns of Parquet: which are text, lengths, labels, points."""

from __future__ import annotations

TEXT = ("names", "sequences", "genders")
LENGTHS = ("transl", "vertices", "joints", "center_of_mass", "center_of_pressure")
LABELS = ("standing", "contact")
NUMBERS = (
    "pose", "betas", "transl", "vertices", "joints", "ground", "center_of_mass", "center_of_pressure", *LABELS,
)  # fmt: skip
POINTS = ("pose", "vertices", "joints")  # (F, n, 3)
FOR_ALL = ("body", "joint_names", "frame_rate")
