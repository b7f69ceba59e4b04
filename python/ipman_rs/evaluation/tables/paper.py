"""The tables of the paper (Tripathi et al., CVPR 2023): their data, their metrics, and the printed values.

Printed values are in the paper's units (mm, %) and of the paper's own predictions; the user's are shown beside them.
Two tables print HMR* on RICH with different last digits (48.3 and 92.4, 48.2 and 92.3); both are kept as printed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

Printed = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class Table:
    """metrics: the columns, by their names in `metrics.METRICS`; published: by method, then by metric, as printed.

    options: of the data set's reader, unless the user gives others. regressor: whether the paper compares the joints
    of J_regressor_h36m.npy. across: one row per metric and one column per method, instead of the other way round.
    """

    title: str
    data: str
    split: str | None
    metrics: tuple[str, ...]
    published: Printed = field(default_factory=dict)
    note: str = ""
    across: bool = False
    options: Mapping[str, str] = field(default_factory=dict)
    regressor: bool = False


def _rows(figures: tuple[str, ...], rows: Mapping[str, tuple[float | None, ...]]) -> Printed:
    """Printed values by method and metric; None where the paper has a dash."""
    return {
        method: {figure: value for figure, value in zip(figures, values, strict=True) if value is not None}
        for method, values in rows.items()
    }


_POSE = ("mpjpe", "pa_mpjpe", "pve", "bose")
_STILL = {"frames": "selected"}
_STILLS = (
    "One still frame a pose: of the authors' choice with the option frames=constants.py, the list in their toolkit, "
    "else by this project's rule (`ipman data layout moyo`). Without the authors' list the figures are not exactly the "
    "paper's."
)
_TEMPLATE = "The authors pose a template of her own: the option v_template=mesh.ply, from their toolkit."

TABLES = {
    "rich": Table(
        "Regression on RICH (Table 1)", "rich-ipman", "test-all", (*_POSE, "bose_strict", "tilt"),
        _rows(_POSE, {
            "SPIN": (112.2, 71.5, 129.5, 54.7),
            "PARE": (107.0, 73.1, 125.0, 74.4),
            "CLIFF": (107.0, 67.2, 122.3, 67.6),
            "HMR*": (82.5, 48.3, 92.4, 62.0),
            "HMR* + L_ground": (80.9, 47.8, 89.9, 66.5),
            "HMR* + L_stability": (81.0, 47.5, 90.8, 69.6),
            "IPMAN-R": (79.0, 47.6, 89.9, 71.2),
        }),
        "All cameras of the test sequences, in the form of IPMAN's code, bodies SMPL; `split='test'` takes camera 0 "
        "only. For SMPL-X methods `data='rich'`, its own files.",
        regressor=True,
    ),
    "h36m": Table(
        "Regression on Human3.6M (Table 1)", "human36m", "valid-p2", (*_POSE, "bose_strict", "tilt"),
        _rows(("mpjpe", "pa_mpjpe"), {
            "PhysCap": (113.0, 68.9),
            "DiffPhy": (81.7, 55.6),
            "Zou et al.": (69.9, None),
            "Xie et al.": (68.1, None),
            "VIBE": (61.3, 43.1),
            "SimPoE": (56.7, 41.6),
            "D&D": (52.5, 35.5),
            "HMR": (88.0, 56.8),
            "Zanfir et al.": (69.0, None),
            "SPIN": (62.3, 41.9),
            "CLIFF": (81.4, 52.1),
            "HMR*, fine-tuned on Human3.6M": (62.1, 41.6),
            "IPMAN-R, fine-tuned on Human3.6M": (60.7, 41.1),
            "HMR*, all data sets": (61.6, 41.9),
            "HMR* + L_ground, all data sets": (61.9, 41.8),
            "HMR* + L_stability, all data sets": (61.2, 41.9),
            "IPMAN-R, all data sets": (60.6, 41.8),
        }),
        "Subjects 9 and 11, frontal camera; `split='valid-p1'` takes all cameras. The paper compares with the joints "
        "that the marker system measured, which is done here unless the file has bodies, too.",
        regressor=True,
    ),
    "moyo": Table(
        "Optimisation on MoYo (Table 2)", "moyo", "val", (*_POSE, "bose_strict"),
        _rows(_POSE, {
            "SMPLify-XMC": (75.3, 36.5, 16.8, 98.0),
            "SMPLify-XMC + L_ground": (73.3, 36.2, 14.5, 98.2),
            "SMPLify-XMC + L_stability": (88.5, 38.6, 15.3, 97.8),
            "IPMAN-O": (71.9, 34.3, 11.4, 98.6),
        }),
        f"{_STILLS} {_TEMPLATE} The printed PVE lies below the printed PA-MPJPE, so it is aligned by more than the "
        "pelvis, and the paper does not say how: it cannot be held against the PVE measured here.",
        options=_STILL,
    ),
    "biomech": Table(
        "Pressure, centre of pressure and centre of mass on MoYo", "moyo", "val",
        ("pressure_iou", "pressure_iou_chosen", "cop_error", "cop_error_chosen", "com_error"),
        {"paper": {"pressure_iou_chosen": 0.32, "cop_error_chosen": 57.3, "com_error": 53.3}},
        "The paper chooses the pressure's parameters for each frame by what was measured there (chosen); beside it, "
        "the figures at fixed parameters. The paper's bodies are the data set's own: PRED truth. Its scripts measure "
        "pressure in the session 20220923_20220926_with_hands and the centre of mass in 20221004_with_com: `path` "
        f"takes one session, or both. {_STILLS} {_TEMPLATE}",
        options=_STILL,
    ),
    "com": Table(
        "Formulations of the centre of mass on MoYo", "moyo", "val",
        ("com_error", "com_error_vertex_mean", "com_error_sample_mean", "com_error_face_area", "com_error_exact"),
        {
            "paper": {
                "com_error": 53.3, "com_error_vertex_mean": 264.1, "com_error_sample_mean": 68.5,
                "com_error_face_area": 70.0,
            }
        },
        f"{_STILLS} {_TEMPLATE}",
        across=True,
        options=_STILL,
    ),
    "3dpw": Table(
        "Regression on 3DPW", "3dpw", "test", ("mpjpe", "pa_mpjpe", "pve"),
        _rows(("mpjpe", "pa_mpjpe"), {"SPIN": (97.2, 59.6), "IPMAN-R": (96.8, 57.1)}),
        regressor=True,
    ),
    "push-pull": Table(
        "What pulling to the ground and pushing out of it do on RICH", "rich-ipman", "test-all",
        (*_POSE, "penetration", "hover"),
        _rows(("mpjpe", "pa_mpjpe", "pve"), {
            "HMR*": (82.5, 48.2, 92.3),
            "HMR* + push": (85.4, 49.0, 96.6),
            "HMR* + pull": (88.0, 48.8, 99.4),
            "HMR* + ground": (80.9, 47.8, 89.9),
        }),
        "One file of predictions a setting: without both, with either, with both. The first is the baseline.",
        regressor=True,
    ),
    "rich-o-star": Table(
        "Optimisation on RICH, without a presented pose", "rich", "ipman-test",
        (*_POSE, "mpjpe_world", "pve_world", "bose_strict"),
        _rows(("mpjpe", "pve", "bose"), {
            "SMPLify-X": (268.6, 228.3, 96.9),
            "IPMAN-O*": (240.9, 217.1, 98.0),
        }),
        "IPMAN-O* against SMPLify-X: the data set's own files, all cameras of IPMAN's test sequences, bodies SMPL-X in "
        "the axes of camera 0. The paper does not say how the printed errors are aligned; at their size they may be "
        "those in the world.",
    ),
}  # fmt: skip
