"""BoSE (Eq. 10): does the centre of mass lie over the base of support?

Three definitions: the paper's, that of its released code, and a stricter one.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ipman_rs.arrays import Bodies
from ipman_rs.checks import choice, real_array
from ipman_rs.ground import Ground
from ipman_rs.quantities import Method
from ipman_rs.support import support_margin
from ipman_rs.template import BodyTemplate

from .numpy_or_torch import AnyGround, numpy_or_torch

BoseMode = Literal["paper", "released", "strict"]

THRESHOLDS = {"paper": 0.1, "released": 0.1, "strict": 0.025}  # τ, m


@numpy_or_torch
def bose(
    vertices: ArrayLike,
    template: BodyTemplate,
    ground: AnyGround,
    bose_mode: BoseMode = "paper",
    threshold: float | None = None,
    method: Method = "pcom",
    labels: ArrayLike | None = None,
) -> Any:
    """One number per body, (...), whose mean is the BoSE; NaN for a body that is not finite. vertices (..., V, 3) m.

    - "paper": 1 over the base of support, 0 outside or without contact (a hovering body is supported by nothing).
      Contacts are the samples with |h| < τ = 10 cm.
    - "strict": the same with the body snapped to the floor (its lowest vertex at height 0) and τ = 2.5 cm, so that
      neither sinking nor hovering passes for balance.
    - "released": what the authors' evaluation prints. Its verdict is 1, 0, or −1 with ten samples or fewer below τ.
      With the `labels` of the true bodies it is 1 where the verdict is the label (also where both are −1), else 0;
      without, the verdict itself, −1 averaged in.

    Args:
        threshold: another τ, m, such as 0.03.
        method: how the centre of mass is computed (`center_of_mass`).
        labels: (...) 1, 0 or −1, the true bodies' verdicts (`in_bos_label`); NaN where there is none. "released" only.

    Raises:
        ValueError: an unknown mode, labels in another, or of another shape than the batch.
    """
    choice("bose_mode", bose_mode, BoseMode)
    if labels is not None and bose_mode != "released":
        raise ValueError(f'labels: expected with bose_mode="released" only, got bose_mode={bose_mode!r}')
    shape = Bodies(vertices, template).shape
    truth = None if labels is None else real_array("labels", labels).astype(float)
    if truth is not None and truth.shape != shape:
        raise ValueError(f"labels: expected one per body, {shape}, got {truth.shape}")
    tau = THRESHOLDS[bose_mode] if threshold is None else threshold
    floor = Ground.under(vertices, ground.normal) if bose_mode == "strict" else ground
    contact = "released" if bose_mode == "released" else "paper"
    margin = np.asarray(support_margin(vertices, template, floor, tau, method, contact), float)
    verdict = np.where(margin >= 0, 1.0, 0.0)
    if bose_mode == "released":
        verdict = np.where(margin == -np.inf, -1.0, verdict)
    if truth is not None:
        verdict = np.where(np.isnan(truth), np.nan, verdict == truth)
    return np.where(np.isnan(margin), np.nan, verdict)
