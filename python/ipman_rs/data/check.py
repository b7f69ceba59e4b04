"""Whether frames of people can be right: units, axes, ground and cameras, judged by the size and the stance of a body.

Every function takes the rows that it judges (a few hundred are enough) and returns findings. `check_frames` makes all
checks of the common form; `raise_if_wrong` raises an error for what is wrong.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body.rotations import from_axis_angle
from ipman_rs.ground import Ground
from ipman_rs.renamed import old_names

from .frames import Cameras, DataSet, Frames

__getattr__ = old_names(__name__, {"demanded": "require_plausible", "of_frames": "check_frames"})

SAMPLE = 256  # frames that are checked
UNITS = (
    ("metres", "m", 1.0), ("millimetres", "mm", 1e-3), ("centimetres", "cm", 0.01), ("decimetres", "dm", 0.1),
    ("kilometres", "km", 1e3), ("inches", "in", 0.0254), ("feet", "ft", 0.3048), ("micrometres", "1e-6", 1e-6),
)  # fmt: skip
TALL = 1.9  # m: the diagonal of the box of an adult who stands
UNLIKE = 2.5  # times smaller: no other unit is suggested
SMALL = 0.45  # m: newborn children span about so much
BODY = (0.25, 3.5)  # m: extent of a body's joints or markers, rolled up or with raised arms
WORLD = 100.0  # m: no body or camera is farther from the origin of its world
NEAR_IN_CENTIMETRES = 500.0  # so far from the origin in millimetres would be within arm's reach
AXES = ("+x", "+y", "+z", "-x", "-y", "-z")
HEADS = ("head_top", "head", "nose", "neck")  # the first of these that a data set has
FEET = ("ankle", "foot", "heel", "toe")  # words in the names of what is low on a person who stands

DS = TypeVar("DS", bound=DataSet)


@dataclass(frozen=True)
class Finding:
    """One result of a check, with advice; `option` names the argument that corrects it, if there is one.

    odd: unusual, but possible. missing: not there. wrong: cannot be a person, or cannot be right.
    """

    level: Literal["ok", "odd", "missing", "wrong"]
    what: str
    advice: str = ""
    option: str = ""

    @property
    def remedy(self) -> str:
        """The advice, and the argument of fits that take such data."""
        option = "" if self.option in self.advice else f"for ipman fit: {self.option}"
        return "; ".join(part for part in (self.advice, option) if part)


def is_complete(findings: Iterable[Finding]) -> bool:
    """Whether nothing is missing or wrong."""
    return all(each.level in ("ok", "odd") for each in findings)


def raise_if_wrong(path: str | os.PathLike[str], findings: Iterable[Finding]) -> None:
    """ValueError with the file's name and all that is wrong; what is merely missing passes."""
    wrong = [f"{each.what}; {each.advice}" if each.advice else each.what for each in findings if each.level == "wrong"]
    if wrong:
        raise ValueError(f"{path}: {'. '.join(wrong)}")


def require_plausible(path: str | os.PathLike[str], data: DS) -> DS:
    """`data`, if a sample of its frames has plausible units, axes, ground and cameras; else ValueError."""
    raise_if_wrong(path, check_frames(sample(data)))
    return data


def sample(data: DataSet, size: int = SAMPLE) -> Frames:
    """Up to `size` frames, evenly spaced."""
    return data[evenly(len(data), size) if len(data) > size else slice(None)]


def evenly(count: int, most: int = SAMPLE) -> NDArray[np.int64]:
    """Up to `most` numbers from 0 to count − 1, evenly spaced."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(np.int64))


def check_frames(frames: Frames) -> list[Finding]:
    """All checks that the frames allow; what they lack is not checked."""
    if not len(frames):
        return [Finding("wrong", "no frame at all", "the file is empty: is the download complete?")]
    findings = names(frames.names) + _lengths(frames)
    if frames.pose is not None:
        findings += finite("pose", frames.pose) + radians("pose", frames.pose)
    if frames.betas is not None:
        findings += finite("betas", frames.betas)
    if _any_wrong(findings):  # floor and cameras would only repeat it
        return findings
    standing = stance(frames, frames.ground) if frames.ground is not None else []
    findings += standing
    if frames.ground is not None and not _any_wrong(standing):
        findings += _on_ground(frames, frames.ground)
    if frames.cameras is not None:
        findings += cameras(frames.cameras)
        findings += [] if _any_wrong(standing) else _projections(frames, frames.cameras)
    return findings


def _any_wrong(findings: list[Finding]) -> bool:
    return any(each.level == "wrong" for each in findings)


def _lengths(frames: Frames) -> list[Finding]:
    findings = []
    for what in ("joints", "vertices"):
        points = getattr(frames, what)
        if points is not None:
            findings += finite_points(what, points) + size_of_body(what, points)
    if frames.transl is not None:
        findings += finite("transl", frames.transl) + near_origin("transl", frames.transl)
    return findings


def names(values: NDArray[np.str_]) -> list[Finding]:
    """Each frame has a name of its own."""
    unique, counts = np.unique(values, return_counts=True)
    if len(unique) == len(values):
        return []
    return [
        Finding("wrong", f"{len(values) - len(unique)} frames share a name, such as {str(unique[counts.argmax()])!r}")
    ]


def finite(what: str, values: NDArray[Any]) -> list[Finding]:
    """Whether every frame has the thing, values (F, …). A frame without it is NaN throughout: no figure needs it."""
    good = np.isfinite(np.asarray(values).reshape(len(values), -1))
    return _finite(what, good.any(axis=1), good.all(axis=1))


def finite_points(what: str, points: NDArray[Any]) -> list[Finding]:
    """The same for points (F, K, 3), of which a frame may lack some: those are NaN in x, y and z."""
    good = np.isfinite(points)
    return _finite(what, good.any(axis=(1, 2)), (good.all(axis=-1) | ~good.any(axis=-1)).all(axis=-1))


def _finite(what: str, any_finite: Any, all_finite: Any) -> list[Finding]:
    findings = []
    if not any_finite.all():
        findings.append(Finding("ok", f"{what}: {(~any_finite).sum()} of {len(any_finite)} frames have none"))
    if (any_finite & ~all_finite).any():
        count = (any_finite & ~all_finite).sum()
        message = f"{what}: NaN or infinity among the numbers of {count} of {len(any_finite)} frames"
        findings.append(Finding("missing", message, "no figure is computed for them"))
    return findings


def size_of_body(what: str, points: NDArray[Any]) -> list[Finding]:
    """Whether points (F, K, 3) of a person each, joints, vertices or markers, span a body in metres."""
    extent = extent_of(points)
    if not np.isfinite(extent):
        return []
    low, high = BODY
    if SMALL <= extent <= high:
        return [Finding("ok", f"{what}: metres (a body spans {extent:.2f})")]
    units = [each for each in units_of(extent) if each[1] != "m"]
    names = " or ".join(unit for unit, _, _ in units)
    message = f"a body spans {extent:.4g}, expected {low} to {high} metres"
    option = " or ".join(f"`units={option!r}`" for _, option, _ in units)
    if low <= extent < SMALL:
        return [Finding("odd", f"{what}: a body spans {extent:.2f} metres: a newborn child?", option="`units=UNIT`")]
    if not units:
        return [Finding("wrong", f"{what}: no unit of length fits a person: {message}", option="`units=UNIT`")]
    metres = units[0][2]
    advice = f"divide by {1 / metres:g}" if metres in (0.1, 0.01, 1e-3) else f"multiply by {metres:g}"
    return [Finding("wrong", f"{what}: looks like {names}: {message}", advice, option)]


def extent_of(points: NDArray[Any]) -> float:
    """The diagonal of the box of points (F, K, 3), the median over frames; NaN where nothing was seen."""
    points = np.asarray(points, np.float64)
    points = np.where(np.isfinite(points).all(axis=-1, keepdims=True), points, np.nan)
    visible = ~np.isnan(points).all(axis=(1, 2))
    if not visible.any():
        return np.nan
    with np.errstate(over="ignore"):  # beyond double precision is infinite
        span = np.nanmax(points[visible], axis=1) - np.nanmin(points[visible], axis=1)
        return float(np.median(np.linalg.norm(span, axis=-1)))


def units_of(extent: float) -> list[tuple[str, str, float]]:
    """Up to two units, nearest first, in which a person who spans so much would be one: name, option and metres."""
    fits = [each for each in UNITS if TALL / UNLIKE < extent * each[2] <= BODY[1]]
    return sorted(fits, key=lambda each: abs(np.log(extent * each[2] / TALL)))[:2]


def first_names(names: Sequence[str], most: int = 8) -> str:
    """The first of the names, and an ellipsis for more."""
    return ", ".join(names[:most]) + (", …" if len(names) > most else "")


def _norms(vectors: NDArray[Any]) -> NDArray[np.float64]:
    """The norms of vectors (..., 3), NaN where they are not finite; where only their squares are not, a large one."""
    numbers = np.asarray(vectors, np.float64)
    return np.linalg.norm(np.where(np.isfinite(numbers), np.clip(numbers, -1e100, 1e100), np.nan), axis=-1)


def near_origin(what: str, positions: NDArray[Any]) -> list[Finding]:
    """Whether positions (F, 3) of bodies or cameras can be metres in a world of people."""
    distance = _norms(positions)
    distance = distance[np.isfinite(distance)]
    if not len(distance) or np.median(distance) <= WORLD:
        return []
    middle = float(np.median(distance))
    unit, advice, option = ("millimetres", "divide by 1000", "`units='mm'`")
    if middle < NEAR_IN_CENTIMETRES:
        unit, advice, option = ("centimetres", "divide by 100", "`units='cm'`")
    message = f"{what}: looks like {unit}: {middle:.4g} from the origin, expected up to {WORLD:g} metres"
    return [Finding("wrong", message, advice, option)]


def radians(what: str, pose: NDArray[Any]) -> list[Finding]:
    """Whether rotation vectors (F, J, 3) can be radians."""
    largest = _norms(pose).max(axis=-1)
    largest = largest[np.isfinite(largest)]
    if not len(largest) or np.median(largest) <= 2 * np.pi:
        return []
    message = f"{what}: looks like degrees: rotations by up to {largest.max():.4g}, expected radians"
    return [Finding("wrong", message, "multiply by π/180", "`degrees`")]


def upright(what: str, up: NDArray[Any], ground: Ground) -> list[Finding]:
    """Whether the ways from the feet to the head (F, 3), of any length, agree on average with the ground's normal.

    People who lie, crawl or stand on their hands give no verdict: only a clear majority along another axis is wrong.
    """
    up = np.asarray(up, np.float64)
    normal = np.broadcast_to(ground.normal, up.shape)
    length = np.linalg.norm(up, axis=-1)
    valid = np.isfinite(length) & (length > 0)
    if not valid.any():
        return []
    unit, normal = up[valid] / length[valid][:, None], normal[valid]
    agreement = float((unit * normal).sum(axis=-1).mean())
    expected = f"({', '.join(f'{number:.2g}' for number in normal[0])})"
    if agreement > 0.5:
        return [Finding("ok", f"{what}: people stand along up, {expected}")]
    mean = unit.mean(axis=0)
    axis = int(np.concatenate([mean, -mean]).argmax())
    if np.abs(mean).max() < 0.6 or agreement > 0.3:
        return []
    message = f"{what}: looks like {AXES[axis]} up: heads lie that way from the feet, but up is said to be {expected}"
    advice = "these are other axes than the data set's own: were they turned or not turned?"
    return [Finding("wrong", message, advice, f"`up={AXES[axis].lstrip('+')!r}`")]


def stance(frames: Frames, ground: Ground) -> list[Finding]:
    """`upright` of the frames' joints, or else of the roots of their SMPL bodies; the ground's height is not needed."""
    if frames.joints is not None and frames.joint_names is not None:
        joints = dict(zip(frames.joint_names, np.moveaxis(frames.joints, 1, 0), strict=True))
        heads = [joints[name] for name in HEADS if name in joints and np.isfinite(joints[name]).any()]
        feet = [points for name, points in joints.items() if any(word in name for word in FEET)]
        if heads and feet:
            return upright("joints", heads[0] - _mean(np.stack(feet)), ground)
    if frames.pose is not None and (frames.body or "").startswith("smpl"):
        return upright("pose", from_axis_angle(np.asarray(frames.pose[:, 0], np.float64))[..., 1], ground)
    return []


def heights(what: str, lowest: NDArray[Any], allowed: tuple[float, float] = (-0.3, 0.5)) -> list[Finding]:
    """Whether heights (F,) in m above the ground, of the lowest point of each person, are those of people on it."""
    lowest = np.asarray(lowest, np.float64)
    lowest = lowest[np.isfinite(lowest)]
    if not len(lowest):
        return []
    middle = float(np.median(lowest))
    if allowed[0] <= middle <= allowed[1]:
        return [Finding("ok", f"{what}: {1e3 * middle:.0f} mm from the ground in the median")]
    side = "above" if middle > 0 else "below"
    message = f"{what}: {abs(middle):.2f} m {side} the ground in the median"
    return [Finding("wrong", message, "is the ground's height, or its axis, another one?")]


def cameras(views: Cameras) -> list[Finding]:
    """Rotations that are rotations, intrinsics of pinholes in pixels, positions in metres."""
    findings = finite("cameras.rotation", views.rotation) + near_origin("cameras.translation", views.translation)
    rotation = np.asarray(views.rotation, np.float64)
    rotation = rotation[np.isfinite(rotation).all(axis=(1, 2))]
    off = np.abs(rotation @ rotation.swapaxes(1, 2) - np.eye(3)).max(axis=(1, 2), initial=0) > 1e-3
    mirrored = np.linalg.det(rotation) < 0
    if off.any() or mirrored.any():
        message = f"cameras.rotation: {off.sum()} of {len(rotation)} are no rotations, {mirrored.sum()} are mirrored"
        findings.append(Finding("wrong", message))
    focal = np.asarray(views.intrinsics, np.float64)[:, [0, 1], [0, 1]]
    focal = focal[np.isfinite(focal).all(axis=1)]
    if len(focal) and (np.median(focal, axis=0) < 10).any():
        message = f"cameras.intrinsics: focal lengths of {np.median(focal, axis=0)} are no pixels"
        findings.append(Finding("wrong", message, "they look divided by the image's size, or are another matrix"))
    return findings or [Finding("ok", "cameras: rotations, focal lengths in pixels, positions in metres")]


def _mean(points: NDArray[Any]) -> NDArray[np.float64]:
    """Mean of points (K, F, 3) over those of the K that are known; NaN where none is."""
    known = np.isfinite(points).all(axis=-1, keepdims=True)
    with np.errstate(invalid="ignore"):
        return np.where(known, points, 0.0).sum(axis=0) / known.sum(axis=0)


def _on_ground(frames: Frames, ground: Ground) -> list[Finding]:
    for what, points in (("vertices", frames.vertices), ("joints", frames.joints)):
        if points is not None:
            height = ground.signed_height(points)
            lowest = np.where(np.isfinite(height), height, np.inf).min(axis=-1)
            return heights(f"lowest of the {what}", lowest)
    if frames.transl is not None:  # the pelvis, give or take SMPL's offset of 0.2 to 0.4 m
        return heights("transl", ground.signed_height(frames.transl[:, None])[:, 0], (-0.5, 2.5))
    return []


def _projections(frames: Frames, views: Cameras) -> list[Finding]:
    """Joints seen through the camera, against the keypoints of the same names."""
    if frames.joints is None or frames.joint_names is None:
        return []
    projected = np.einsum("fij,fkj->fki", views.rotation, frames.joints) + views.translation[:, None]
    depth = projected[..., 2][np.isfinite(projected[..., 2])]
    if len(depth) and np.median(depth) <= 0:
        advice = "is the camera's transform that of the world to the camera?"
        return [Finding("wrong", f"joints lie behind the camera ({np.median(depth):.2f} m)", advice)]
    shared = [name for name in frames.joint_names if name in (frames.keypoint_names or ())]
    if frames.keypoints is None or frames.keypoint_names is None or not shared:
        return []
    keypoints = frames.keypoints[:, [list(frames.keypoint_names).index(name) for name in shared]]
    projected = np.einsum("fij,fkj->fki", views.intrinsics, projected)
    projected = projected[:, [list(frames.joint_names).index(name) for name in shared]]
    both = (
        (keypoints[..., 2] > 0)
        & np.isfinite(projected).all(axis=-1)
        & np.isfinite(keypoints).all(axis=-1)
        & (projected[..., 2] > 0)
    )
    if not both.any():
        return []
    pixels, labelled = projected[both], keypoints[both]
    off = np.median(np.linalg.norm(pixels[:, :2] / pixels[:, 2:] - labelled[:, :2], axis=-1))
    size = np.linalg.norm(
        np.ptp(np.where(both[..., None], keypoints[..., :2], keypoints[..., :1, :2]), axis=1), axis=-1
    )
    message = f"joints seen through the camera lie {off:.1f} pixels from the keypoints in the median"
    if off <= max(0.25 * np.median(size), 5.0):
        return [Finding("ok", message)]
    return [Finding("wrong", message, "the camera, the joints or the image's size are of another frame")]
