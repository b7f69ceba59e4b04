"""One still frame a pose of MoYo: the authors' own choice from the user's copy of their list, or this project's.

The list is in the authors' toolkit (moyo_toolkit, under a research licence, so it is not in this package):
`moyo/utils/constants.py` has `frame_select_dict_combined` (200 poses; of recordings with hands) and
`frame_select_dict_nexus` (192; of recordings with centres of mass, whose names say "nexus"). Both lead from the pose's
name to the number of an image, 30 Hz; image n shows frame 2 n. A `.json` file {pose: image} does as well.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body.rotations import from_axis_angle
from ipman_rs.files import parse_json, read_bytes

from .frames import Frames

FRAMES_AN_IMAGE = 2
COMBINED, NEXUS = "frame_select_dict_combined", "frame_select_dict_nexus"
POSE = re.compile(r"^\d{6}_yogi_(?:nexus_)?body_hands_\d+_")  # what stands before the pose in a sequence's name
WINDOW = 30  # frames, half a second
BODY = 22  # joints, without face and fingers
MAX_BYTES = 1 << 20  # of a list


def stillest_frame(frames: Frames) -> int:
    """The still frame of one sequence: of its middle half, the even frame about which the body turns least.

    The measure is the angle by which root and joints turn from frame to frame, mean over them and over half a second.
    Even frames only, since images show those; the first of equals.
    """
    count = len(frames)
    pose = np.asarray(frames.pose)[:, :BODY]
    turns = from_axis_angle(np.nan_to_num(pose))
    cosine = (np.einsum("fjab,fjab->fj", turns[1:], turns[:-1]) - 1) / 2
    step = np.append(0.0, np.arccos(np.clip(cosine, -1.0, 1.0)).mean(axis=1))
    total = np.append(0.0, np.cumsum(step))
    numbers = np.arange(count)
    first, last = np.maximum(numbers - WINDOW // 2, 0), np.minimum(numbers + WINDOW // 2, count - 1)
    motion = (total[last + 1] - total[first + 1]) / np.maximum(last - first, 1)
    motion[~np.isfinite(pose).all(axis=(1, 2))] = np.inf
    middle = numbers[(numbers >= count // 4) & (numbers <= (3 * count) // 4) & (numbers % FRAMES_AN_IMAGE == 0)]
    middle = middle if len(middle) else np.array([0])
    return int(middle[np.argmin(motion[middle].round(9))])


class FrameList:
    """A list of the chosen images: of each pose, or of each pose in recordings with and without "nexus" in their names.

    ValueError, naming the file, for one that is missing, damaged, or no list of images. Nothing in it is executed.
    """

    def __init__(self, path: str) -> None:
        self.path = Path(path)
        content = read_bytes(path, MAX_BYTES)
        try:
            lists = _python(content.decode()) if self.path.suffix == ".py" else {"": parse_json(content)}
        except (ValueError, SyntaxError, RecursionError, MemoryError) as error:
            raise ValueError(f"{path}: expected the chosen image of each pose: {error}") from None
        for name, images in lists.items():
            _check(f"{path}: {name}".removesuffix(": "), images)
        self.lists: Mapping[str, Mapping[str, int]] = lists

    def frame(self, sequence: str, count: int) -> int | None:
        """The chosen frame of a sequence of `count` frames; None for a pose that is not in the list.

        ValueError where the sequence ends before it.
        """
        name = "" if "" in self.lists else NEXUS if "_nexus_" in sequence else COMBINED
        image = self.lists[name].get(POSE.sub("", sequence))
        if image is None:
            return None
        if image * FRAMES_AN_IMAGE >= count:
            raise ValueError(
                f"{self.path}: {sequence}: expected one of its {count} frames, got image {image}, which is frame "
                f"{image * FRAMES_AN_IMAGE}"
            )
        return image * FRAMES_AN_IMAGE


def _python(text: str) -> dict[str, Any]:
    """Both dictionaries of the authors' constants.py, read as literals."""
    lists = {
        target.id: ast.literal_eval(line.value)
        for line in ast.parse(text).body
        if isinstance(line, ast.Assign)
        for target in line.targets
        if isinstance(target, ast.Name) and target.id in (COMBINED, NEXUS)
    }
    lacking = [name for name in (COMBINED, NEXUS) if name not in lists]
    if lacking:
        raise ValueError(f"no {lacking[0]} in it; it should be moyo/utils/constants.py of moyo_toolkit")
    return lists


def _check(where: str, images: Any) -> None:
    good = isinstance(images, dict) and images and all(isinstance(pose, str) for pose in images)
    if not good or not all(type(image) is int and image >= 0 for image in images.values()):
        raise ValueError(f'{where}: expected {{"pose": number of its image, …}}, whole numbers from 0')


def select_frames(wanted: str, sequence: Frames, chosen: FrameList | None) -> NDArray[np.int64]:
    """The numbers of the frames of one sequence that are wanted: "all", "selected" by our rule, or of a list."""
    if wanted == "all":
        return np.arange(len(sequence))
    frame = stillest_frame(sequence) if chosen is None else chosen.frame(str(sequence.sequences[0]), len(sequence))
    return np.array([] if frame is None else [frame], np.int64)
