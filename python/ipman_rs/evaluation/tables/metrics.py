"""The metrics of an evaluation: titles, units, explanations, and what each needs."""

from __future__ import annotations

from dataclasses import dataclass

_JOINTS = "joints of the same names, pelvis or hips among them, in the data and in the predictions (or `regressors`)"
_MESH = "bodies of one mesh in the data and in the predictions"
_ALIGNED = f"{_MESH}, and a pelvis of one definition (the same body model, or `regressors`)"
_FLOOR = "a body model for the predictions, and a ground"
_COM = "a measured centre of mass, and a body model for the predictions"
_COP = "a measured centre of pressure, and what BoSE needs"
_MAT = "a measured pressure map, and what BoSE needs"


@dataclass(frozen=True)
class Metric:
    """One number per frame, stored in metres, radians or shares, and shown times `factor` in `unit`.

    better: −1 if less is better, 1 if more is. needs: what data set and predictions must have for it. undefined: why a
    frame with a finite body may lack it.
    """

    title: str
    unit: str
    factor: float
    digits: int
    better: int
    what: str
    needs: str
    undefined: str = "not measured"


def _mm(title: str, what: str, needs: str, undefined: str = "not measured") -> Metric:
    return Metric(title, "mm", 1e3, 1, -1, what, needs, undefined)


def _percent(title: str, what: str, needs: str = _FLOOR) -> Metric:
    return Metric(title, "%", 100.0, 1, 1, what, needs, "not labelled")


def _share(title: str, what: str) -> Metric:
    return Metric(title, "", 1.0, 3, 1, what, _MAT)


METRICS = {
    "mpjpe": _mm("MPJPE", "mean distance of the joints, aligned at the pelvis", _JOINTS),
    "pa_mpjpe": _mm("PA-MPJPE", "after the best rotation, scale and translation", _JOINTS),
    "mpjpe_world": _mm("MPJPE world", "mean distance of the joints, not aligned", _JOINTS),
    "pve": _mm("PVE", "mean distance of the vertices, aligned at the pelvis", _ALIGNED),
    "pve_world": _mm("PVE world", "mean distance of the vertices, not aligned", _MESH),
    "bose": _percent("BoSE", "share with the centre of mass over the base of support, contacts within 10 cm"),
    "bose_3cm": _percent("BoSE 3 cm", "contacts within 3 cm"),
    "bose_strict": _percent("BoSE strict", "of the paper's centre of mass, put on the floor, contacts within 2.5 cm"),
    "bose_released": _percent("BoSE released", "what the authors' code prints: agreement with the label", "labels"),
    "tilt": Metric(
        "tilt", "°", 57.29577951308232, 2, -1, "of the pelvis, relative to gravity", f"{_JOINTS}, and a ground"
    ),
    "penetration": _mm("penetration", "of the lowest vertex into the ground", _FLOOR),
    "hover": _mm("hover", "of the lowest vertex above the ground", _FLOOR),
    "skating": _mm(
        "skating", "distance that the soles move along the ground since the previous frame, while touching it", _FLOOR,
        "soles not on the ground in both frames",
    ),
    "com_error": _mm("CoM error", "distance in space of the centre of mass (pCoM) from the measured one", _COM),
    "com_error_exact": _mm("CoM exact", "the same, centre of mass of the uniform solid", _COM),
    "com_error_vertex_mean": _mm("CoM vertices", "the same, mean of the vertices", _COM),
    "com_error_sample_mean": _mm("CoM samples", "the same, mean of uniform samples of the surface", _COM),
    "com_error_face_area": _mm("CoM face area", "the same, mean of the faces, weighted by area", _COM),
    "cop_error": _mm("CoP error", "distance along the ground of the centre of pressure from the measured one", _COP),
    "pressure_iou": _share("mIoU", "overlap of the pressure with the mat's, fixed parameters"),
    "cop_error_chosen": _mm("CoP chosen", "parameters chosen per frame for the best CoP, as in MoYo's protocol", _MAT),
    "pressure_iou_chosen": _share("mIoU chosen", "parameters chosen per frame for the best IoU"),
}  # fmt: skip
