"""Plausibility checks of recorded markers, with the limits of `ipman_rs.data.plausibility`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ipman_rs.data import check, plausibility
from ipman_rs.data.check import Finding
from ipman_rs.data.tracks import TO_Y_UP, Tracks
from ipman_rs.ground import Ground

from ...body.sites import FEWEST_POINTS
from .anatomy import ANYWHERE, MIDDLE, SIDED, SPREAD
from .names import meanings as meanings_of
from .sets import Meaning

Array = NDArray[np.float64]

HEAD = ("forehead", "occiput", "temple", "head", "ear", "eye", "nose", "jaw", "head_top")
TRUNK = (
    "c7", "clavicle", "sternum", "lower_sternum", "sternoclavicular", "scapula", "acromion", "shoulder_front",
    "shoulder_back", "shoulder", "mid_shoulder", "neck", "spine1", "spine2", "spine3", "collar",
)  # fmt: skip
PELVIS = ("asis", "psis", "sacrum", "iliac_crest", "hip_centre", "hip", "mid_hip", "pelvis")
ARMS = ("upper_arm", "biceps", "elbow", "elbow_lateral", "elbow_medial", "forearm", "radius", "ulna", "wrist",
        "wrist_back", "hand", "hand_back", "hand_back_5", "index", "pinky", "thumb")  # fmt: skip
FEET = re.compile(r"heel|toe|malleolus|metatarsal|midfoot|ankle|foot")

BELOW = 0.15  # m: farther below the floor is no marker of a foot
# Which sites are in front, behind, and on the sides of a part of the body.
FACING = {
    "pelvis": ("asis", "psis|sacrum", "asis|psis|iliac_crest|hip_centre|hip|trochanter"),
    "trunk": (
        "clavicle|sternum|lower_sternum|sternoclavicular",
        r"c7|[tl]\d+|scapula|spine\d",
        "acromion|shoulder|shoulder_front|shoulder_back|sternoclavicular|scapula",
    ),
    "feet": (
        r"toe_tip|metatarsal_\d|big_toe|small_toe",
        "heel_marker|heel",
        r"toe_tip|metatarsal_\d|big_toe|heel_marker|heel|malleolus_lateral|ankle",
    ),
}
SLANT = 0.1  # volume of front × left × up, as unit vectors: with less, a part does not say where its left is
MOST = 0.8  # of the frames that say it, less those that say the opposite
SKIN = (-0.015, 0.04)  # m from the skin to a marker's middle; 7 to 15 mm are usual


def region(meaning: Meaning) -> str:
    """The part of the body where a marker is: head, trunk, arms, pelvis or legs."""
    if isinstance(meaning, tuple):
        return "legs"  # places of their own are those of clusters on legs, and of feet
    name = _without_side(meaning)
    if name in TRUNK or re.fullmatch(r"[tl]\d+", name):
        return "trunk"
    return "head" if name in HEAD else "arms" if name in ARMS else "pelvis" if name in PELVIS else "legs"


def on_skin(meaning: Meaning) -> bool:
    """Whether such a marker is stuck to the skin: not inside the body, not on a plate or a wand."""
    if isinstance(meaning, tuple):
        return meaning[2] < ANYWHERE
    return meaning in MIDDLE or (_without_side(meaning) in SIDED and _without_side(meaning) not in SPREAD)


def _without_side(name: str) -> str:
    return name.removeprefix("left_").removeprefix("right_")


def check_tracks(
    tracks: Tracks,
    own: Mapping[str, Meaning | None] | None = None,
    up_is_said: bool = False,
    ground: float | None = None,
) -> list[Finding]:
    """Findings about a recording before its fit: names, coverage, size, place, stance, rate; and, with a floor at y =
    `ground` m, whether the markers are above it."""
    names, _ = seen_names(tracks)
    meant = meanings_of(names, own)
    unknown = [name for name in names if name not in meant]
    findings = plausibility.known_markers([*meant], unknown, FEWEST_POINTS) + check_rate(tracks)
    if not meant:
        return findings
    placed = check_points(tracks, meant, up_is_said)
    if ground is not None and not any(each.level == "wrong" for each in placed):
        placed += check_floor(tracks, meant, ground)
    return findings + check_coverage([*meant], meant) + placed


def seen_names(tracks: Tracks) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The markers that were ever seen, and those that are only in the file."""
    visible = tracks.confidence.any(axis=0)
    return tuple(np.array(tracks.names)[visible].tolist()), tuple(np.array(tracks.names)[~visible].tolist())


def check_points(tracks: Tracks, meanings: Mapping[str, Meaning], up_is_said: bool = False) -> list[Finding]:
    """Size, place and stance of the markers whose places are known; `up_is_said`: by the user, who knows.

    Axes are the file's own: the argument `up` names them.
    """
    known = tracks.select([name for name in tracks.names if name in meanings])
    rows = sampled_rows(known)
    points = np.where(known.confidence[rows, :, None] > 0, known.points[rows], np.nan)
    if not len(points):
        return []
    findings = check_size(points, known.unit)
    if any(each.level == "wrong" for each in findings):
        return findings
    with np.errstate(invalid="ignore"):
        findings += plausibility.far("markers", points[np.isfinite(points).all(axis=-1)])
    rotation = TO_Y_UP[tracks.up]
    up = feet_to_head(points @ rotation, known, meanings)
    findings += check_sides(points, known, meanings)
    return findings + ([] if up_is_said else check.upright("markers", up, Ground(rotation[1])))


def check_size(points: Array, unit: float) -> list[Finding]:
    """Whether points (T, M, 3) m of a person can be, that were given in units of so many metres."""
    findings = check.size_of_body("markers", points)
    if not any(each.level == "wrong" for each in findings):
        return findings
    fits = [each for each in check.units_of(check.extent_of(points) / unit) if each[2] != unit]
    if not fits:
        return [Finding("wrong", findings[0].what, option="`units=UNIT`")]
    message = findings[0].what.rpartition(": ")[2]
    option = " or ".join(f"`units={option!r}`" for _, option, _ in fits)
    return [Finding("wrong", f"markers: {message}, if the file's unit is right", option=option)]


def check_floor(tracks: Tracks, meanings: Mapping[str, Meaning], ground: float = 0.0) -> list[Finding]:
    """Whether the lowest marker of each frame is not below a floor at y = `ground` m."""
    known = tracks.select([name for name in tracks.names if name in meanings])
    rows = sampled_rows(known)
    if not len(rows):
        return []
    heights = np.where(known.confidence[rows] > 0, known.points[rows, :, 1], np.inf).min(axis=1) - ground
    heights = heights[np.isfinite(heights)]
    middle = float(np.median(heights)) if len(heights) else 0.0
    if middle >= -BELOW:
        return []
    message = f"the lowest markers are {-middle:.2f} m below the floor in the median"
    return [Finding("odd", message, option="`ground=HEIGHT`")]


def check_rate(tracks: Tracks) -> list[Finding]:
    return plausibility.rate(tracks.rate) if len(tracks) > 1 else []


def sampled_rows(tracks: Tracks) -> NDArray[np.int64]:
    """Frames in which something was seen, a few hundred of them."""
    visible = np.flatnonzero(tracks.confidence.any(axis=1))
    return visible[check.evenly(len(visible))]


def feet_to_head(points: Array, tracks: Tracks, meanings: Mapping[str, Meaning]) -> Array:
    """From the feet, or the legs, to the head, the trunk or the pelvis: (T, 3), NaN where neither was seen."""
    places = [meanings[name] for name in tracks.names]
    regions = np.array([region(place) for place in places])
    feet = np.array([isinstance(place, str) and FEET.search(place) is not None for place in places])
    upper, lower = np.isin(regions, ("head", "trunk")), feet | (regions == "legs")
    upper = upper if upper.any() else regions == "pelvis"
    lower = feet if feet.any() else lower if lower.any() else regions == "pelvis"
    if not upper.any() or not lower.any() or (upper & lower).any():
        return np.full((len(points), 3), np.nan)
    return _mean(points[:, upper]) - _mean(points[:, lower])


def check_sides(points: Array, tracks: Tracks, meanings: Mapping[str, Meaning]) -> list[Finding]:
    """Whether what is called left in points (T, M, 3) is on the left of those who face as their front and back say.

    In their own axes, so whichever way they stand or lie.
    """
    places = [place if isinstance(place, str) else "" for place in (meanings[name] for name in tracks.names)]
    up = feet_to_head(points, tracks, meanings)
    turned = {part: _handedness(points, places, up, *words) for part, words in FACING.items()}
    signs = {part: sign for part, sign in turned.items() if sign}
    swapped = [part for part, sign in signs.items() if sign < 0]
    if not swapped:
        return []
    sure = len(swapped) == len(signs) and (len(swapped) > 1 or "pelvis" in swapped)
    advice = "are names exchanged (`markers=FILE` gives others), or axes mirrored?"
    return [Finding("wrong" if sure else "odd", f"left and right look swapped of {' and '.join(swapped)}", advice)]


def _handedness(points: Array, places: Sequence[str], up: Array, front: str, back: str, sided: str) -> int:
    """1 where left is on the left in most frames, -1 where it is on the right; 0 where nobody can tell."""

    def middle(words: str, side: str = "(left_|right_)?") -> Array:
        return _mean(points[:, [re.fullmatch(f"{side}({words})", place) is not None for place in places]])

    ahead, left = middle(front) - middle(back), middle(sided, "left_") - middle(sided, "right_")
    with np.errstate(invalid="ignore", divide="ignore"):
        lengths = np.prod([np.linalg.norm(way, axis=1) for way in (ahead, left, up)], axis=0)
        volume = (np.cross(ahead, left) * up).sum(axis=1) / lengths
    sure = volume[np.abs(volume) > SLANT]
    if not len(sure) or abs(np.mean(np.sign(sure))) < MOST:
        return 0
    return int(np.sign(np.mean(np.sign(sure))))


def _mean(points: Array) -> Array:
    known = np.isfinite(points).all(axis=-1, keepdims=True)
    with np.errstate(invalid="ignore"):
        return np.where(known, points, 0).sum(axis=1) / known.sum(axis=1)


def check_coverage(known: Sequence[str], meanings: Mapping[str, Meaning]) -> list[Finding]:
    """Findings about parts of the body without a marker that was seen."""
    regions = {region(meanings[name]) for name in known}
    if not regions & {"head", "trunk", "arms"}:
        message = "no marker above the pelvis was ever seen: trunk, arms, mass and centre of mass are the body's mean"
        return [Finding("odd", message)]
    lacking = [part for part in ("head", "trunk", "arms", "pelvis", "legs") if part not in regions]
    if "head" in lacking and len(lacking) == 1:
        return []
    if not lacking:
        return []
    parts = " and ".join(lacking)
    return [Finding("odd", f"no marker on {parts} was ever seen: there the body's mean is shown")]


def check_skin(distances: Mapping[str, float]) -> list[Finding]:
    """Markers that are not on the skin of the fitted body: distances in metres, by name."""
    off = {name: away for name, away in distances.items() if not SKIN[0] <= away <= SKIN[1]}
    if not off:
        return []
    worst = sorted(off, key=lambda name: -abs(off[name] - 0.01))
    listed = ", ".join(f"{name} {1e3 * off[name]:+.0f} mm" for name in worst[:6]) + (", …" if len(off) > 6 else "")
    what = f"{len(off)} of {len(distances)} markers are not on the skin of the fitted body ({listed}; 7 to 15 is usual)"
    return [Finding("odd", what, "are they where their names say? (`markers`)")]
