"""The tables of the paper (Tripathi et al., CVPR 2023): which data, which figures, and what is printed there.

Printed figures stand here only where they are certain; the paper has more rows, and more figures in these rows. They
are in the units that the paper prints (mm, %), and of the paper's own bodies and data: yours are measured beside them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Table:
    """figures: the columns, by their names in `figures.FIGURES`; published: by method, then by figure, as printed.

    across: one row a figure and one column a method, instead of the other way round.
    """

    title: str
    data: str
    split: str | None
    figures: tuple[str, ...]
    published: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    note: str = ""
    across: bool = False


_POSE = ("mpjpe", "pa_mpjpe", "pve", "bose")

TABLES = {
    "rich": Table(
        "Regression on RICH", "rich-ipman", "test", (*_POSE, "bose_strict", "tilt"),
        {"IPMAN-R": {"mpjpe": 79.0, "pve": 89.9}},
        "Camera 0, in the form of IPMAN's code, bodies SMPL. For SMPL-X methods --data rich, its own files.",
    ),
    "h36m": Table(
        "Regression on Human3.6M", "human36m", "valid-p2", (*_POSE, "bose_strict", "tilt"),
        {"IPMAN-R": {"mpjpe": 60.7}},
        "Subjects 9 and 11, frontal camera; --split valid-p1 takes all cameras.",
    ),
    "moyo": Table("Optimisation on MoYo", "moyo", "val", (*_POSE, "bose_strict")),
    "biomech": Table(
        "Pressure, centre of pressure and centre of mass on MoYo", "moyo", None,
        ("pressure_iou", "pressure_iou_chosen", "cop_error", "cop_error_chosen", "com_error"),
        {"paper": {"pressure_iou_chosen": 0.32, "cop_error_chosen": 57.3, "com_error": 53.3}},
        "The paper chooses the pressure's parameters for each frame by what was measured there (chosen); beside it, "
        "the figures at fixed parameters. The paper's bodies are the data set's own: PRED truth.",
    ),
    "com": Table(
        "Formulations of the centre of mass on MoYo", "moyo", None,
        ("com_error", "com_error_vertex_mean", "com_error_sample_mean", "com_error_face_area", "com_error_exact"),
        {
            "paper": {
                "com_error": 53.3, "com_error_vertex_mean": 264.1, "com_error_sample_mean": 68.5,
                "com_error_face_area": 70.0,
            }
        },
        across=True,
    ),
    "3dpw": Table("Regression on 3DPW", "3dpw", "test", ("mpjpe", "pa_mpjpe", "pve")),
    "push-pull": Table(
        "What pulling to the ground and pushing out of it do", "rich-ipman", "test",
        (*_POSE, "penetration", "hover"),
        note="One file of predictions a setting: without both, with either, with both. The first is the baseline.",
    ),
}  # fmt: skip
