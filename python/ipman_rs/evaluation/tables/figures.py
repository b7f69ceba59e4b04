"""The figures of an evaluation: how each is called and shown."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """A number a frame, in the files in metres, radians or shares; shown times `factor` in `unit`.

    better: −1 where less is better, 1 where more is. undefined: why a finite body may have no such figure.
    """

    title: str
    unit: str
    factor: float
    digits: int
    better: int
    what: str
    undefined: str = "not measured"


def _mm(title: str, what: str, undefined: str = "not measured") -> Figure:
    return Figure(title, "mm", 1e3, 1, -1, what, undefined)


def _percent(title: str, what: str) -> Figure:
    return Figure(title, "%", 100.0, 1, 1, what, "no label")


FIGURES = {
    "mpjpe": _mm("MPJPE", "mean distance of the joints, aligned at the pelvis"),
    "pa_mpjpe": _mm("PA-MPJPE", "after the best rotation, scale and translation"),
    "mpjpe_world": _mm("MPJPE world", "mean distance of the joints where they stand"),
    "pve": _mm("PVE", "mean distance of the vertices, aligned at the pelvis"),
    "pve_world": _mm("PVE world", "mean distance of the vertices where they stand"),
    "bose": _percent("BoSE", "centre of mass over the base of support, contacts within 10 cm"),
    "bose_3cm": _percent("BoSE 3 cm", "contacts within 3 cm"),
    "bose_strict": _percent("BoSE strict", "snapped to the floor, contacts within 2.5 cm"),
    "bose_released": _percent("BoSE released", "as the authors' code prints it: agreement with the label"),
    "tilt": Figure("tilt", "°", 57.29577951308232, 2, -1, "of the pelvis, against gravity"),
    "penetration": _mm("penetration", "of the lowest vertex into the ground"),
    "hover": _mm("hover", "of the lowest vertex above the ground"),
    "skating": _mm(
        "skating", "way of the soles on the ground from the frame before, while they touch it",
        "soles not on the ground in both frames",
    ),
    "com_error": _mm("CoM error", "centre of mass (pCoM) against the measured one, in space"),
    "com_error_exact": _mm("CoM exact", "the same, centre of mass of the uniform solid"),
    "com_error_vertex_mean": _mm("CoM vertices", "the same, mean of the vertices"),
    "com_error_sample_mean": _mm("CoM samples", "the same, mean of uniform samples of the surface"),
    "com_error_face_area": _mm("CoM face area", "the same, faces weighed by their area"),
    "cop_error": _mm("CoP error", "centre of pressure against the measured one, along the ground"),
    "pressure_iou": Figure("mIoU", "", 1.0, 3, 1, "pressure against the mat's, fixed parameters"),
    "cop_error_chosen": _mm("CoP chosen", "parameters chosen a frame for the best CoP, as the MoYo protocol does"),
    "pressure_iou_chosen": Figure("mIoU chosen", "", 1.0, 3, 1, "parameters chosen a frame for the best IoU"),
}  # fmt: skip
