"""Plausibility checks of all input: can it be a person, and if not, which argument corrects it?

Every function takes the rows that it judges (a few hundred are enough) and returns findings. `admit` refuses what is
wrong, in one line that names the argument to use, and returns in words what is unusual.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.ground import Ground
from ipman_rs.template import BodyTemplate

from .check import AXES, BODY, WORLD, Finding, first_names, size_of_body, upright

MASS = (1.0, 650.0)  # kg: the heaviest person known weighed 635
USUAL_MASS = (1.8, 250.0)  # kg
# kg/m³, mass by the cubed diagonal of a body's box: 5 with arms and legs spread, 12 standing, 65 curled up, 190 a cube.
BUILD, USUAL_BUILD = (1.0, 400.0), (2.5, 200.0)
MARKER_ERROR = 0.1  # m in the mean: with more, the body is not the one that the markers were on
USUAL_MARKER_ERROR = 0.03
USUAL_RATE = (5.0, 2000.0)  # frames a second
USUAL_SPEED = 15.0  # m/s: nobody runs so fast
USUAL_HEIGHT = 10.0  # m from the origin of the world, up or down
SMALLEST_TURN = 0.12  # rad, 7 degrees: the largest turn in a pose of a person is larger
LIES = 0.46  # of its length: a body whose height is less
UPRIGHT = 0.6  # cosine: where heads are from feet and torsos of people who stand, squat, kneel or sit, it is more
CARRIES = 0.06  # m: hands and feet within it of the lowest point carry the body
NEAR = 0.15  # m: a hand within it of the floor may carry somebody who stands on the head

SURE = 0.5  # confidence of a keypoint
FEWEST_POINTS = 4  # of a person in an image that say something about them
RELATIVE = 3.0  # a keypoint no farther from the image's corner is a share of its size, not pixels
FLAT = 0.01  # breadth of a person's keypoints by their length: none is on one line
AROUND = 0.1  # of the image's size: how far detectors guess points outside it
SMALL_PERSON = 24.0  # pixels

Array = NDArray[np.floating[Any]]


class NoPerson(ValueError):
    """The input cannot be a person; the message names the argument that corrects it."""


def admit(path: str | os.PathLike[str], findings: Iterable[Finding], force: bool = False) -> tuple[str, ...]:
    """What is unusual, in words. NoPerson, naming the file, for what is wrong; with `force` that counts as unusual."""
    findings = list(findings)
    wrong = [each for each in findings if each.level == "wrong"]
    if wrong and not force:
        message = ". ".join(_advised(each) for each in wrong)
        raise NoPerson(f"{path}: {message} (`force`: it is right as it is)")
    return tuple(_advised(each) for each in findings if each.level in ("odd", "wrong"))


def _advised(finding: Finding) -> str:
    ending = "says otherwise" if re.search("=[A-Z]", finding.option) else "if so"  # `units=UNIT`, and `units='mm'`
    mends = f"{finding.option} {ending}" if finding.option else finding.advice
    return f"{finding.what}; {mends}" if mends else finding.what


def bodies(vertices: Array, template: BodyTemplate, normal: Array, *, up_is_said: bool = False) -> list[Finding]:
    """Size, place and stance of bodies (T, V, 3) of one template; `normal` (3,) points up.

    `up_is_said`: by the user, who knows: then no stance is wrong.
    """
    vertices = np.asarray(vertices, np.float64)
    vertices = vertices[np.isfinite(vertices).all(axis=(1, 2))]
    if not len(vertices):
        return []
    findings = size_of_body("vertices", vertices)
    if findings[0].level == "wrong":
        return findings
    findings += _sizes(vertices)
    away = far("vertices", vertices.mean(axis=1)) or _height(vertices, normal)
    if up_is_said:
        return findings + away
    return findings + away + (_stance(vertices, template, normal) or _shape(vertices, template, normal))


def _sizes(vertices: Array) -> list[Finding]:
    """Findings about single bodies of implausible size."""
    spans = np.linalg.norm(np.ptp(vertices, axis=1), axis=-1)
    odd = spans[(spans < BODY[0]) | (spans > BODY[1])]
    if not len(odd):
        return []
    verb = "spans" if len(odd) == 1 else "span up to"
    message = (
        f"vertices: {len(odd)} of {len(spans)} bodies {verb} {odd.max():.4g}, expected {BODY[0]} to {BODY[1]} metres"
    )
    return [Finding("odd", message)]


def far(what: str, places: Array) -> list[Finding]:
    """Whether people of a person's size at places (T, 3) m can be in a world of metres."""
    away = np.linalg.norm(places, axis=-1)
    away = float(np.median(away[np.isfinite(away)])) if np.isfinite(away).any() else 0.0
    if away <= WORLD:
        return []
    message = (
        f"{what}: bodies of a person's size, {away:.4g} m from the origin of their world, expected up to {WORLD:g}"
    )
    return [Finding("wrong", message, "are their places in another unit, or those of a map? Put the origin near them")]


def _height(vertices: Array, normal: Array) -> list[Finding]:
    """Findings about bodies far above or below the origin of their world."""
    height = float(np.median((vertices @ Ground(normal).normal).min(axis=-1)))
    if abs(height) <= USUAL_HEIGHT:
        return []
    side = "above" if height > 0 else "below"
    message = f"vertices: {abs(height):.4g} m {side} the origin of their world"
    return [Finding("odd", message, "is the unit of their places another (`units`), or their origin?")]


def _stance(vertices: Array, template: BodyTemplate, normal: Array) -> list[Finding]:
    """The stance of bodies with named parts, from the directions of legs and torso to the head."""
    limbs = ("left_forearm", "right_forearm", "left_lower_leg", "right_lower_leg")
    points = {word: _of_parts(template, word) for word in ("head", "torso", *limbs)}
    if not all(len(index) for index in points.values()):
        return []
    head, torso = (vertices[:, points[word]].mean(axis=1) for word in ("head", "torso"))
    legs = vertices[:, np.concatenate([points["left_lower_leg"], points["right_lower_leg"]])].mean(axis=1)
    ways = _unit(_unit(head - legs) + _unit(head - torso))
    ground = Ground(normal)
    heights = vertices @ ground.normal
    low = {word: heights[:, index].min(axis=1) - heights.min(axis=1) for word, index in points.items()}
    on_hands_and_feet = (np.max([low[limb] for limb in limbs], axis=0) < CARRIES) & (low["torso"] > CARRIES)
    ways, up = ways[~on_hands_and_feet], (ways @ ground.normal)[~on_hands_and_feet]
    if not len(up):
        return [Finding("ok", "bodies: on hands and feet")]
    axis = f"`up={_axis(_unit(ways.mean(axis=0)))!r}`"
    if len(vertices) > 1:
        message = f"bodies: heads are above feet in {(up > UPRIGHT).sum()} of {len(up)}"
        return upright("bodies", ways, ground) or [Finding("ok" if up.mean() > 0.5 else "odd", message, option=axis)]
    if up[0] < -0.5:
        if up[0] < -0.8 and low["head"][0] < 1e-3 and min(low[limb][0] for limb in limbs[:2]) > NEAR:
            return [Finding("wrong", "stands on its head, with its feet in the air", option=axis)]
        return [Finding("odd", "its head is below its feet", option=axis)]
    if up[0] < UPRIGHT:
        return [Finding("odd", "lies: its head is beside its feet", option=axis)]
    return [Finding("ok", "bodies: heads are above feet")]


def _unit(ways: Array) -> Array:
    length = np.linalg.norm(ways, axis=-1, keepdims=True)
    return ways / np.where(length > 0, length, 1.0)


def _shape(vertices: Array, template: BodyTemplate, normal: Array) -> list[Finding]:
    """The stance of bodies without named parts: whether they lie, and whether their lower end looks like a head."""
    first, normal = vertices[0], Ground(normal).normal
    height = first @ normal
    extent = np.ptp(first, axis=0)
    axis = int(extent.argmax())
    if np.ptp(height) < LIES * extent[axis] and abs(normal[axis]) < 0.5:
        message = f"lies: {np.ptp(height):.2f} m high and {extent[axis]:.2f} m long"
        return [Finding("odd", message, option="`up=AXIS`")]
    middle = float(np.median(height[np.unique(template.faces)]) - height.min()) / max(float(np.ptp(height)), 1e-9)
    below, above = (_ends(first, height, normal, end) for end in ("low", "high"))
    if below == 1 and above == 2 and middle < 0.5:
        return [Finding("odd", "its head seems to be below its feet", option=f"`up={_axis(-normal)!r}`")]
    return []


def _ends(points: Array, height: Array, normal: Array, end: str) -> int:
    """The number of pieces of the lowest or highest eighth of a body: 1, or 2 for more."""
    span = float(np.ptp(height))
    there = height < height.min() + span / 8 if end == "low" else height > height.max() - span / 8
    flat = points[there] - np.outer(height[there], normal)
    way = np.linalg.svd(flat - flat.mean(axis=0), full_matrices=False)[2][0]
    along = np.sort(flat @ way)
    return 1 + int(len(along) > 1 and bool(np.diff(along).max() > 0.03 * span))


def _of_parts(template: BodyTemplate, word: str) -> NDArray[np.int64]:
    """The vertices of the parts with this word in their names."""
    wanted = [part for part, name in enumerate(template.part_names) if word in name]
    return np.unique(template.faces[np.isin(template.face_parts, wanted)])


def _axis(way: Array) -> str:
    """The axis, as `up` takes it, that is nearest to a direction."""
    return AXES[int(np.concatenate([way, -way]).argmax())].lstrip("+")


def mass(kilograms: float, span: float | None = None) -> list[Finding]:
    """Whether a body's mass can be a person's; `span` in metres is the diagonal of its box, where it is known."""
    if not np.isfinite(kilograms):
        return []
    if kilograms <= 0:
        message = f"a body of {kilograms:.4g} kg"
        return [Finding("wrong", message, "is its surface closed, and do its faces point outwards?")]
    message = f"a person of {kilograms:.4g} kg"
    if not USUAL_MASS[0] <= kilograms <= USUAL_MASS[1]:
        level = "odd" if MASS[0] <= kilograms <= MASS[1] else "wrong"
        return [Finding(level, message, option="`units=UNIT`")]
    build = 10.0 if span is None else kilograms / span**3
    if USUAL_BUILD[0] <= build <= USUAL_BUILD[1]:
        return []
    level = "odd" if BUILD[0] <= build <= BUILD[1] else "wrong"
    return [
        Finding(level, f"{message} who spans {span:.2f} m", "are shape and units right, left and right not swapped?")
    ]


def masses(kilograms: Array, vertices: Array) -> list[Finding]:
    """`mass` of bodies (T,) kg with vertices (T, V, 3) m, in the median."""
    finite = kilograms[np.isfinite(kilograms)]
    spans = np.linalg.norm(np.ptp(np.asarray(vertices, np.float64), axis=1), axis=-1)
    spans = spans[np.isfinite(spans)]
    return mass(float(np.median(finite)), float(np.median(spans)) if len(spans) else None) if len(finite) else []


def rate(hertz: float) -> list[Finding]:
    """Whether frames a second can be those of a recording."""
    if np.isfinite(hertz) and USUAL_RATE[0] <= hertz <= USUAL_RATE[1]:
        return []
    level = "odd" if np.isfinite(hertz) and hertz > 0 else "wrong"
    return [Finding(level, f"{hertz:.4g} frames a second", option="`rate=HZ`")]


def speed(what: str, positions: Array, seconds: Array | None) -> list[Finding]:
    """Whether people at positions (T, 3) m move as people do; `seconds` (T,) where they are known."""
    if seconds is None or len(positions) < 2 or len(positions) != len(seconds):
        return []
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # steps that are not finite are left out
        moved = np.linalg.norm(np.diff(np.asarray(positions, np.float64), axis=0), axis=-1) / np.diff(seconds)
    usual = float(np.median(moved[np.isfinite(moved)])) if np.isfinite(moved).any() else 0.0
    if usual <= USUAL_SPEED:
        return []
    message = f"{what}: moves at {usual:.4g} m/s in the median, expected up to {USUAL_SPEED:g}"
    return [Finding("odd", message, "is its unit (`units`) or its rate (`rate`) another?")]


def degrees(rotations: Sequence[Array]) -> list[Finding]:
    """Whether rotation vectors (T, n, 3) that were said to be degrees, in radians here, were so."""
    largest = [np.linalg.norm(np.asarray(each, np.float64), axis=-1).max(axis=-1) for each in rotations]
    largest = max((float(np.median(each[np.isfinite(each)])) for each in largest if np.isfinite(each).any()), default=0)
    if not 0 < largest <= SMALLEST_TURN:
        return []
    message = f"the pose: with `degrees` no joint turns by more than {np.degrees(largest):.2g} degrees"
    return [Finding("odd", message, "is it in radians?")]


def marker_error(metres: float) -> list[Finding]:
    """Whether a body was found for the markers, by their mean distance from it."""
    if metres <= USUAL_MARKER_ERROR:
        return []
    level = "odd" if metres <= MARKER_ERROR else "wrong"
    message = f"markers lie {1e3 * metres:.0f} mm from the fitted body in the mean, expected under 30"
    return [Finding(level, message, "are units, axes and names of the markers right? (`units`, `up`, `markers`)")]


def known_markers(known: Sequence[str], unknown: Sequence[str], fewest: int = 6) -> list[Finding]:
    """Whether enough of the markers that were seen have places on the body that are known."""
    count = len(known) + len(unknown)
    if not unknown:
        return []
    message = f"{len(unknown)} of {count} markers have names without a known place: {first_names(unknown)}"
    wrong = len(known) < fewest or 3 * len(known) < count
    return [Finding("wrong" if wrong else "odd", message, "`markers=FILE` says where they are")]


def keypoints(points: Array, size: Array) -> list[Finding]:
    """Whether points (K, 3) of one person, x and y in pixels and confidence, can lie in an image of `size` (2,).

    Those that the detector is sure of are judged, all that were seen where it is sure of few.
    """
    sure = points[:, 2] > SURE
    visible = np.asarray(points[sure if sure.sum() >= FEWEST_POINTS else points[:, 2] > 0, :2], np.float64)
    if len(visible) < FEWEST_POINTS:
        return []
    image = f"{size[0]:g} × {size[1]:g} pixels"
    extent = float(np.ptp(visible, axis=0).max())
    if extent == 0:
        return [Finding("wrong", f"all {len(visible)} points lie at one place, ({visible[0, 0]:g}, {visible[0, 1]:g})")]
    if abs(visible).max() <= RELATIVE and min(size) > SMALL_PERSON:
        message = f"points of {visible.min():.3g} to {visible.max():.3g} look relative to the image"
        return [Finding("wrong", message, "multiply them by its width and height")]
    spread = np.linalg.svd(visible - visible.mean(axis=0), compute_uv=False)
    if spread[1] < FLAT * spread[0]:
        message = f"all {len(visible)} points lie on one line"
        return [Finding("wrong", message, "are x and y columns of their own in the file?")]
    outside = ((visible < -AROUND * size) | (visible > (1 + AROUND) * size)).any(axis=1)
    if 2 * outside.sum() > len(visible):
        x, y = visible[:, 0], visible[:, 1]
        message = f"{outside.sum()} of {len(visible)} points lie outside the image of {image}"
        message += f": x from {x.min():.0f} to {x.max():.0f}, y from {y.min():.0f} to {y.max():.0f}"
        return [Finding("wrong", message, "is that its size? (`image_size=WxH`)")]
    if extent < SMALL_PERSON:
        message = f"the person is {extent:.2g} pixels large in an image of {image}"
        return [Finding("odd", message, "is that its size? (`image_size=WxH`)")]
    return [Finding("ok", f"keypoints: a person of {extent:.0f} pixels in an image of {image}")]
