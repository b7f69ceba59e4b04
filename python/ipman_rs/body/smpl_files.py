"""Model files of SMPL (24 joints), SMPL+H (52) and SMPL-X (55), as `.npz` or `.pkl`.

They have the same arrays and do not name their joints. A file whose first 22 joints are those of SMPL's tree is one of
the three; which one, the number of its joints says.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from ..files import safe_npz
from . import joints
from .body_format import BodyFormat
from .hands import JOINTS_PER_HAND, Hands
from .joints import BODY, LEFT_HAND, RIGHT_HAND, SMPL_PARENTS
from .model import BodyModel
from .model_file import ModelFile

EXPRESSIONS = 10
FULL_SHAPE_SPACE = 300  # SMPL-X files with all components: 300 of shape, then 100 of expression
FULL_EXPRESSION_SPACE = 100
HAND_KEYS = ("hands_meanl", "hands_meanr", "hands_componentsl", "hands_componentsr")


def _load(
    file: ModelFile,
    name: str,
    names: tuple[str, ...],
    num_betas: int,
    flat_hand_mean: bool,
    v_template: NDArray[np.float64] | None,
) -> BodyModel:
    read = file.read
    mean = read("v_template", (-1, 3))
    num_vertices = len(mean)
    if v_template is None:
        v_template = mean
    elif v_template.shape != mean.shape:
        raise ValueError(f"v_template: expected {mean.shape}, as {file.path} has, got {v_template.shape}")
    parents = _parents(file)
    faces = file.faces("f", num_vertices)
    # One layout for all files, and einsum for products: BLAS sums in an order of the layout's.
    regressor = np.array(read("J_regressor", (len(parents), num_vertices)), order="C")
    shapedirs, expressiondirs = _split_shapes(
        read("shapedirs", (num_vertices, 3, -1)), num_betas, has_face="jaw" in names
    )
    return BodyModel(
        name=file.path.stem,
        v_template=v_template,
        shapedirs=shapedirs,
        expressiondirs=expressiondirs,
        posedirs=read("posedirs", (num_vertices, 3, 9 * (len(parents) - 1))) if "posedirs" in file.keys else None,
        J_template=np.einsum("jv,vc->jc", regressor, v_template),
        J_shapedirs=np.einsum("jv,vck->jck", regressor, shapedirs),
        J_expressiondirs=np.einsum("jv,vck->jck", regressor, expressiondirs),
        rest_rotation=np.tile(np.eye(3), (len(parents), 1, 1)),
        weights=read("weights", (num_vertices, len(parents))),
        faces=faces,
        parents=parents,
        joint_names=names,
        hands=_hands(file, flat_hand_mean) if file.keys.issuperset(HAND_KEYS) else None,
        kind=name,
    )


def refuse(file: ModelFile) -> NoReturn:
    """Raise the ValueError of a file that is none of the three."""
    file.read("v_template", (-1, 3))
    parents = _parents(file)
    counts = [f"{len(each.joints)} ({each.title})" for each in (SMPL, SMPLH, SMPLX)]
    raise ValueError(f"{file.path}: expected {', '.join(counts[:-1])} or {counts[-1]} joints, found {len(parents)}")


_GENDERS = {"female": "female", "f": "female", "male": "male", "m": "male", "neutral": "neutral", "n": "neutral"}


def gender(word: str) -> str:
    """female, male or neutral, of what files call it; empty for other words."""
    return _GENDERS.get(word.strip().lower().removeprefix("b").strip("'\""), "")


def gender_of(path: Path) -> str:
    """Of a model file: what an array of it says, or its name, or that of its folder, as AMASS's SMPL+H has it; empty
    where nothing does."""
    if path.suffix == ".npz" and "gender" in safe_npz.names(path):
        stored = safe_npz.read(path, "gender").reshape(-1)
        if stored.dtype.kind in "US" and len(stored) == 1:
            return gender(stored[0].decode("latin1") if stored.dtype.kind == "S" else str(stored[0]))
    stem, folder = path.stem.lower(), path.parent.name.lower()
    words = [word for name in (stem, folder) for word in ("female", "male", "neutral") if word in name]
    return next((_GENDERS[word] for word in (*words, *re.split(r"[^a-z]+", stem)) if word in _GENDERS), "")


def _parents(file: ModelFile) -> NDArray[np.int64]:
    """Parent of each joint; upstream marks the root with 2**32 - 1 or with -1."""
    kintree = file.read("kintree_table", (2, -1))
    parents = np.concatenate([[-1], kintree[0, 1:]])
    if not ((parents[1:] >= 0) & (parents[1:] < np.arange(1, len(parents)))).all():
        raise ValueError(
            f"{file.path}: kintree_table: each joint after the root must name an earlier joint as its parent"
        )
    return parents.astype(np.int64)


def _split_shapes(
    directions: NDArray[np.float64], num_betas: int, has_face: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Shape and expression directions: one array, expressions after 300 shapes or, in short files, after 10."""
    total = directions.shape[-1]
    start = total
    if has_face:
        start = min(FULL_SHAPE_SPACE if total >= FULL_SHAPE_SPACE + FULL_EXPRESSION_SPACE else 10, total)
    return directions[..., : min(num_betas, start)], directions[..., start : start + EXPRESSIONS]


def _hands(file: ModelFile, flat: bool) -> Hands:
    read = file.read
    size = 3 * JOINTS_PER_HAND
    mean = np.concatenate([read("hands_meanl", (size,)), read("hands_meanr", (size,))]).reshape(-1, 3)
    return Hands(
        mean=np.zeros_like(mean) if flat else mean,
        left_components=read("hands_componentsl", (-1, size)),
        right_components=read("hands_componentsr", (-1, size)),
    )


def _format(name: str, title: str, names: tuple[str, ...], **more: Any) -> BodyFormat:
    def matches(file: ModelFile) -> bool:
        try:
            parents = _parents(file) if "v_template" in file.keys else []
            return len(parents) == len(names) and tuple(parents[1 : len(BODY)]) == SMPL_PARENTS[1 : len(BODY)]
        except ValueError:
            return False

    def load(
        file: ModelFile, *, num_betas: int, flat_hand_mean: bool, v_template: NDArray[np.float64] | None
    ) -> BodyModel:
        return _load(file, name, names, num_betas, flat_hand_mean, v_template)

    written = (
        "global_orient", "body_pose", "jaw_pose", "leye_pose", "reye_pose", "left_hand_pose", "right_hand_pose",
    )  # fmt: skip
    return BodyFormat(name, title, names, matches, load, written=written, **more)


# Arrays that hold a piece of the pose, in files of AMASS, of the smplx package, and of EasyMocap.
_BODY_PIECES = {
    "global_orient": (BODY[:1],),
    "root_orient": (BODY[:1],),
    "Rh": (BODY[:1],),
    "body_pose": (BODY[1:],),
    "pose_body": (BODY[1:],),
}
_HAND_PIECES = {
    "left_hand_pose": (LEFT_HAND,),
    "right_hand_pose": (RIGHT_HAND,),
    "pose_hand": ((*LEFT_HAND, *RIGHT_HAND),),
}
_FACE_PIECES = {
    "jaw_pose": (("jaw",),),
    "pose_jaw": (("jaw",),),
    "leye_pose": (joints.SMPLX[23:24],),
    "reye_pose": (joints.SMPLX[24:25],),
    "pose_eye": (joints.SMPLX[23:25],),
}
_BODY_OR_ALL = (BODY[1:], joints.SMPL[1:])

SMPL = _format(
    "smpl",
    "SMPL",
    joints.SMPL,
    poses=(joints.SMPL, BODY),
    pieces={**_BODY_PIECES, "body_pose": _BODY_OR_ALL, "pose_body": _BODY_OR_ALL},
    # SMPL itself is downloaded under these names; all else is called SMPLX_NEUTRAL.npz and so on.
    downloaded={"neutral": "basicmodel_neutral_lbs", "male": "basicmodel_m_lbs", "female": "basicmodel_f_lbs"},
)
SMPLH = _format("smplh", "SMPL+H", joints.SMPLH, poses=(joints.SMPLH, BODY), pieces={**_BODY_PIECES, **_HAND_PIECES})
SMPLX = _format(
    "smplx",
    "SMPL-X",
    joints.SMPLX,
    poses=(joints.SMPLX, BODY),
    pieces={**_BODY_PIECES, **_HAND_PIECES, **_FACE_PIECES},
)
