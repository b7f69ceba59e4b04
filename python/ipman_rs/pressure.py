"""Pressure (Eq. 2 of the paper) and the centre of pressure (Eq. 3), from the samples' heights."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs import quantities
from ipman_rs.arrays import Bodies
from ipman_rs.checks import positive
from ipman_rs.ground import Ground
from ipman_rs.sampling import sample_surface
from ipman_rs.template import BodyTemplate


def pressure(
    vertices: ArrayLike, template: BodyTemplate, ground: Ground, alpha: float = 100.0, gamma: float = 10.0
) -> NDArray[Any]:
    """ρ = 1 − αh below the ground, e^(−γh) from the ground up (Eq. 2), of each sample: (..., S), no unit.

    vertices (..., V, 3) m; alpha, gamma in 1/m.

    Raises:
        ValueError: wrong shapes, a ground that does not fit the batch, or a negative or infinite alpha or gamma.
        TypeError: an argument of the wrong kind, or masked vertices.
    """
    return Bodies(vertices, template).evaluate(quantities.pressure(alpha, gamma, template), ground)


def center_of_pressure(
    vertices: ArrayLike,
    template: BodyTemplate,
    ground: Ground,
    alpha: float = 100.0,
    gamma: float = 10.0,
    epsilon: float = 0.0,
) -> NDArray[Any]:
    """s̄ = Σ ρ v / (Σ ρ + epsilon) (Eq. 3), (..., 3) m; finite for hovering bodies.

    epsilon: 0 in the paper, 1e-6 in the released code.

    Raises:
        ValueError: wrong shapes, a ground that does not fit the batch, or a negative or infinite option.
        TypeError: an argument of the wrong kind, or masked vertices.
    """
    return Bodies(vertices, template).evaluate(quantities.center_of_pressure(alpha, gamma, epsilon), ground)


def binary_center_of_pressure(
    vertices: ArrayLike, template: BodyTemplate, ground: Ground, threshold: float = 0.1
) -> NDArray[Any]:
    """The centre of pressure of binary contact, (..., 3) m: the mean of the samples with |h| < threshold, each as heavy
    as any other; NaN without contact.

    The naive alternative that the paper's supplement draws beside its own (Fig. S.3). vertices (..., V, 3) m; threshold
    τ, m.

    Raises:
        ValueError: wrong shapes, a ground that does not fit the batch, or a threshold that is not positive.
        TypeError: an argument of the wrong kind, or masked vertices.
    """
    metres = positive("threshold", threshold)
    Bodies(vertices, template).over(ground)  # that they fit together
    samples = np.asarray(sample_surface(vertices, template))
    contact = np.abs(ground.signed_height(samples)) < metres
    centers = np.full((*samples.shape[:-2], 3), np.nan, samples.dtype)
    for body in np.ndindex(centers.shape[:-1]):
        if contact[body].any():
            with np.errstate(over="ignore"):  # a sum that double precision cannot hold becomes infinite
                centers[body] = samples[body][contact[body]].mean(axis=0, dtype=np.float64)
    return centers
