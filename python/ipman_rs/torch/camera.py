"""From the camera's frame to the world's, also when the image was flipped or turned.

A camera with extrinsics R, t sees the world point X_w at X_c = R X_w + t (x right, y down, z forward). So

    R_w = Rᵀ R_body          p_w = Rᵀ p + c,   c = −Rᵀ t the camera's position in the world.

The paper writes t_w = −t_c + t_cw: its t_cw is c, and its −t_c the way from the camera to the body in world axes, Rᵀ p.

Image augmentation shows the camera something else: content turned by θ and then mirrored left to right lies at
X_a = F Z(θ) X_c with F = diag(−1, 1, 1). A body estimated in that frame stands upright in the world only if the camera
follows: R' = F Z(θ) R M, t' = F Z(θ) t. M mirrors the world along a horizontal direction where the image was flipped,
and is the identity elsewhere. F and M cancel in handedness: R' is a rotation, and the mirrored body (left and right
swapped by the flip) keeps its outward faces. Without flip the result is the body before augmentation; with flip it is
its mirror image.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from .arrays import dense


def camera_to_world(
    vertices_or_orientation: Tensor,
    translation: Tensor,
    R: Tensor,
    t: Tensor,
    flip: bool | Tensor = False,
    rotation: float | Tensor = 0.0,
    *,
    pelvis: Tensor | None = None,
    mirror: Sequence[float] = (1.0, 0.0, 0.0),
) -> tuple[Tensor, Tensor]:
    """Carry a body estimated in the frame of an (augmented) camera into the world.

    Args:
        vertices_or_orientation: vertices (..., V, 3) about the origin of `translation`, in camera axes; or the root's
            rotation matrix (..., 3, 3).
        translation: (..., 3), m, in the camera's frame: the vertices' origin, or the position of the root joint.
        R: (..., 3, 3) rotation world to camera of the image before augmentation.
        t: (..., 3) its translation, m: X_c = R X_w + t.
        flip: whether the image was mirrored left to right, after it was turned; one bool or bool (...).
        rotation: radians by which the image content was turned clockwise about the principal point; one or (...).
            SPIN and HMR count degrees counter-clockwise: pass -radians(rot).
        pelvis: (..., 3), m, root joint of the body at rest. An orientation turns the body about this joint, not about
            the model's origin. Given, `translation` is the model's own (added after that turn), before and after; left
            out, `translation` is where the joint itself lies.
        mirror: a horizontal direction of the world. The default is right for y-up and z-up worlds.

    Returns:
        The vertices or orientation in world axes, and the world translation (..., 3). The world body is
        vertices + translation[..., None, :], or the body model called with both.

    Raises:
        ValueError: a shape is wrong, or pelvis comes with vertices, whose place `translation` tells already.
    """
    body = vertices_or_orientation
    _check("vertices_or_orientation", body, (..., None, 3))
    is_orientation = body.shape[-2:] == (3, 3)
    _check("translation", translation, (..., 3))
    _check("R", R, (..., 3, 3))
    _check("t", t, (..., 3))
    if pelvis is not None and not is_orientation:
        raise ValueError("pelvis: only an orientation turns about the pelvis; leave it out with vertices")

    # Under autocast the products would be in half precision, which moves a body by centimetres.
    with torch.autocast(body.device.type, enabled=False):
        camera, origin = _follow(R, t, flip, rotation, mirror)
        to_world = camera.transpose(-1, -2)
        joint = translation if pelvis is None else translation + pelvis
        place = (to_world @ (joint - origin)[..., None])[..., 0]
        if is_orientation:
            return to_world @ body, place if pelvis is None else place - pelvis
        return body @ camera, place


def _follow(
    R: Tensor,
    t: Tensor,
    flip: bool | Tensor,
    rotation: float | Tensor,
    mirror: Sequence[float],
) -> tuple[Tensor, Tensor]:
    """Extrinsics of the camera that sees the augmented image: F Z R M (..., 3, 3) and F Z t (..., 3)."""
    augmentation = _augmentation(R, flip, rotation)
    return augmentation @ R @ _reflection(R, flip, mirror), (augmentation @ t[..., None])[..., 0]


def _augmentation(like: Tensor, flip: bool | Tensor, rotation: float | Tensor) -> Tensor:
    """F Z(θ) (..., 3, 3): turn clockwise on the screen (x right, y down), then mirror x."""
    angle = torch.as_tensor(rotation, dtype=like.dtype, device=like.device)
    side = torch.where(torch.as_tensor(flip, device=like.device), -1.0, 1.0).to(like.dtype)
    angle, side = torch.broadcast_tensors(angle, side)
    cosine, sine, zero, one = angle.cos(), angle.sin(), torch.zeros_like(angle), torch.ones_like(angle)
    rows = [side * cosine, -side * sine, zero, sine, cosine, zero, zero, zero, one]
    return torch.stack(rows, dim=-1).unflatten(-1, (3, 3))


def _reflection(like: Tensor, flip: bool | Tensor, mirror: Sequence[float]) -> Tensor:
    """I − 2 m mᵀ where flipped, else I: (..., 3, 3)."""
    direction = torch.as_tensor(mirror, dtype=like.dtype, device=like.device)
    direction = direction / direction.norm()
    flipped = torch.as_tensor(flip, device=like.device).to(like.dtype)[..., None, None]
    return torch.eye(3, dtype=like.dtype, device=like.device) - 2 * flipped * torch.outer(direction, direction)


def _check(name: str, tensor: Tensor, shape: tuple) -> None:
    """shape: `...`, then sizes, None for any."""
    sizes = shape[1:]
    dense(name, tensor, whole=True)
    fits = tensor.ndim >= len(sizes) and all(
        size in (None, got) for size, got in zip(sizes, tensor.shape[-len(sizes) :], strict=True)
    )
    if not fits:
        wanted = ", ".join("V" if size is None else str(size) for size in sizes)
        raise ValueError(f"{name}: expected shape (..., {wanted}), got {tuple(tensor.shape)}")
