"""MoYo: yoga with markers, a pressure mat, centres of mass and cameras. One woman, 60 Hz.

    20220923_20220926_with_hands/         or 20221004_with_com/: a session; the folder above both; or one of them
      mosh/{train,val}/NAME_stageii.pkl           SMPL-X: fullpose (F, 165), betas, trans (F, 3) m
      pressure/{train,val}/xml/NAME.xml           the mat's maps, N/cm²
      pressure/{train,val}/single_csv/NAME.csv    force (N) and centre of pressure (mm) of those with a frame
      pressure/{train,val}/pressure_mat_c3d/NAME.c3d    the mat's corners SensorMat:M_1 to M_4, mm
      com/{train,val}/NAME.c3d                    CentreOfMass and CentreOfMassFloor of Vicon, mm (second session)
      cameras/**/cameras_param.json               cam_1 to cam_8: focal, princpt, rotation, position (mm)
      images/{train,val}/NAME/YOGI_Cam_01/NAME_YOGI_Cam_01_0190.jpg    30 Hz, half the size that cameras are for

World: metres, z up, the floor at z = 0. Frame i of pressure (of the CSV's rows), of the centre of mass and of the body
are of one time; image n shows frame 2n. The mat's columns run along -x and its rows along -y; its cells are centred in
the rectangle of the four corners. What a sequence lacks is NaN; so is the mat of Cow_Face_Pose_or_Gomukhasana_-c of the
first session, where it was broken. Hands are absolute (`flat_hand_mean=True`).

The authors pose a template of her own with betas of zero, `data/v_templates/…/mesh.ply` of their toolkit:
`v_template=mesh.ply` does the same; without it her betas shape the mean female body.

`frames="selected"`: one still frame a sequence instead of all, which most of the time show somebody stepping onto the
mat, into the pose and out of it. The authors chose theirs by hand, in `moyo/utils/constants.py` of their toolkit:
`frames=constants.py` (or a `.json` {pose: image}) takes that choice, "selected" one by rule: of the middle half of a
sequence the even frame about which the body turns least (see `moyo_stills`). A list's figures are the paper's, the
rule's are near them. Sequences that a list does not have are left out.

Where it comes from: the project's own site, MOYO; the scripts in its repository moyo_toolkit fetch it.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from ipman_rs.body import mesh_file

from .. import moyo_stills, sequences
from ..check import Finding
from ..frames import DataSet, Frames
from .bodies import read_body, read_frames
from .cameras import frames_with_images, with_camera
from .files import SPLITS, SequenceFiles, find_sequences
from .mat import check_loads, corners, read_maps, read_trace

__all__ = ["NAME", "check", "corners", "open", "read_maps", "read_trace"]

NAME = "moyo"


def open(
    path: str | os.PathLike[str],
    split: str | None = None,
    *,
    camera: int | None = None,
    frames: str = "all",
    v_template: str | os.PathLike[str] | None = None,
) -> DataSet:
    """The frames of all sequences of a session, or of both; `split`: "train", "val", None for both.

    `camera`: 1 to 8 for the frames of which it has an image, with the camera, at 30 Hz. `frames`: "all", "selected" for
    one still frame a sequence by rule, or the file of a list of chosen frames. `v_template`: a `.ply` or `.obj` file of
    her own body in the zero pose, posed without betas (both see above). The bodies of all sequences are read when it is
    opened, for their lengths; pressure and centres of mass when their frames are asked for. Raises ValueError naming
    the file for what is damaged, of unequal lengths, or in units or axes that cannot be; ImportError where there are
    `.c3d` files and the extra is not installed.
    """
    root = Path(path)
    if camera is not None and camera not in range(1, 9):
        raise ValueError(f"camera: expected 1 to 8, got {camera!r}")
    if frames not in ("all", "selected") and Path(frames).suffix not in (".py", ".json"):
        raise ValueError(f"frames: expected all, selected, or a list in a .py or .json file, got {frames!r}")
    chosen = None if frames in ("all", "selected") else moyo_stills.FrameList(frames)
    if v_template is not None:
        mesh_file.vertices(v_template)  # is there, and a body
    recordings = find_sequences(root, split)
    parts = (any(each.mat[0].is_file() for each in recordings), any(each.com.is_file() for each in recordings))
    rows = []
    for each in recordings:
        body = read_body(each)
        wanted = moyo_stills.select_frames(frames, body, chosen)
        rows.append(wanted if camera is None else np.intersect1d(wanted, frames_with_images(each, camera, len(body))))

    if chosen is not None and not any(map(len, rows)):
        raise ValueError(f"{frames}: has none of the poses in {root}, such as {recordings[0].name}")

    def sequence(index: int) -> Frames:
        whole = replace(
            read_frames(recordings[index], *parts), rest_shape=None if v_template is None else str(v_template)
        )
        chosen_frames = whole if frames == "all" and camera is None else whole[rows[index]]
        if frames != "all":
            chosen_frames = replace(chosen_frames, frame_rate=None)
        return chosen_frames if camera is None else with_camera(recordings[index], chosen_frames, camera, rows[index])

    return sequences.require_plausible(root, sequences.sequences([len(part) for part in rows], sequence, path))


def check(path: str | os.PathLike[str]) -> list[Finding]:
    """What each session has and lacks, which files cannot be read, and whether units, axes, loads and lengths fit."""
    root = Path(path)
    try:
        found_sequences = find_sequences(root, None)
    except ValueError as error:
        return [Finding("missing", str(error), "fetch mosh.zip of a session and unpack it")]
    findings: list[Finding] = []
    for session in dict.fromkeys(each.session for each in found_sequences):
        findings += _session([each for each in found_sequences if each.session == session], session)
    return findings


def _session(found_sequences: list[SequenceFiles], session: Path) -> list[Finding]:
    counts = {split: sum(each.split == split for each in found_sequences) for split in SPLITS}
    listed = ", ".join(f"{count} in {split}" for split, count in counts.items())
    findings = [Finding("ok", f"{session.name}: {len(found_sequences)} sequences ({listed})")]
    for what, folder in (
        ("pressure", "pressure"),
        ("centres of mass", "com"),
        ("cameras", "cameras"),
        ("images", "images"),
    ):
        if not (session / folder).is_dir():
            findings.append(Finding("missing", f"{session.name}: no {what} ({folder}/)"))
    parts = [(session / "pressure").is_dir(), (session / "com").is_dir()]
    for each in found_sequences:
        needed = ([*each.mat] if parts[0] else []) + ([each.com] if parts[1] else [])
        findings += [Finding("missing", f"{file}: no such file") for file in needed if not file.is_file()]
        if parts[0] and all(file.is_file() for file in each.mat):
            findings += check_loads(each)
    read = [(each.name, lambda each=each: read_frames(each, parts[0], parts[1])) for each in found_sequences]
    return findings + sequences.check_sequences(read)
