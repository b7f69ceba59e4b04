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

import csv
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from ipman_rs.body import mesh_file
from ipman_rs.files import read_json, regular, safe_pickle
from ipman_rs.ground import Ground

from ..files import safe_xml
from . import c3d, moyo_stills, sequences
from .check import Finding
from .frames import Cameras, DataSet, Frames, PressureMaps

NAME = "moyo"

Array = NDArray[np.float64]

RATE, IMAGE_RATE = 60.0, 30.0  # Hz
SPLITS = ("train", "val")
SUFFIX = "_stageii.pkl"
UNIT = "N/cm2"  # of the maps
CELLS, CELL = (110, 37), 0.0127  # the mat's rows and columns, and their size in m
APART = 2  # frames by which recordings of one sequence may differ in length: an image's time
IMAGE_SCALE = 0.5  # of released images to those that were calibrated
BROKEN_MAT = "_body_hands_03596_Cow_Face_Pose_or_Gomukhasana_-c"  # left out by the authors, too
CORNERS = tuple(f"SensorMat:M_{number}" for number in (1, 2, 3, 4))
COM, COM_FLOOR = "CentreOfMass", "CentreOfMassFloor"
FORCE = "Force (N)"
COP = tuple(f"Pressure, Raw Pressure-distribution-Pressure center-{axis} (mm)" for axis in "xy")


@dataclass(frozen=True)
class Recorded:
    """The files of a sequence, of which only the body's must be there."""

    session: Path
    split: str
    name: str

    @property
    def mosh(self) -> Path:
        return self.session / "mosh" / self.split / f"{self.name}{SUFFIX}"

    @property
    def com(self) -> Path:
        return self.session / "com" / self.split / f"{self.name}.c3d"

    @property
    def mat(self) -> tuple[Path, Path, Path]:
        """Maps, centres of pressure, and corners."""
        folder = self.session / "pressure" / self.split
        parts = (("xml", ".xml"), ("single_csv", ".csv"), ("pressure_mat_c3d", ".c3d"))
        maps, centers, corners = (folder / part / f"{self.name}{ending}" for part, ending in parts)
        return maps, centers, corners

    def images(self, camera: int) -> Path:
        return self.session / "images" / self.split / self.name / f"YOGI_Cam_{camera:02d}"


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
    chosen = None if frames in ("all", "selected") else moyo_stills.Chosen(frames)
    if v_template is not None:
        mesh_file.vertices(v_template)  # is there, and a body
    found = _sequences(root, split)
    parts = (any(each.mat[0].is_file() for each in found), any(each.com.is_file() for each in found))
    rows = []
    for each in found:
        body = _body(each)
        wanted = moyo_stills.selected(frames, body, chosen)
        rows.append(wanted if camera is None else np.intersect1d(wanted, _pictured(each, camera, len(body))))

    if chosen is not None and not any(map(len, rows)):
        raise ValueError(f"{frames}: has none of the poses in {root}, such as {found[0].name}")

    def sequence(index: int) -> Frames:
        whole = replace(_frames(found[index], *parts), rest_shape=None if v_template is None else str(v_template))
        some = whole if frames == "all" and camera is None else whole[rows[index]]
        if frames != "all":
            some = replace(some, frame_rate=None)
        return some if camera is None else _seen(found[index], some, camera, rows[index])

    return sequences.demanded(root, sequences.sequences([len(part) for part in rows], sequence, path))


def _sequences(root: Path, split: str | None) -> list[Recorded]:
    if split is not None and split not in SPLITS:
        raise ValueError(f"split: expected one of {', '.join(SPLITS)}, got {split!r}")
    if not root.is_dir():
        raise ValueError(f"{root}: expected a folder with mosh/train/*{SUFFIX} in it, {_what(root)}")
    sessions = [root] if (root / "mosh").is_dir() else sorted(each.parent for each in root.glob("*/mosh"))
    found = [
        Recorded(session, part, file.name.removesuffix(SUFFIX))
        for session in sessions
        for part in (SPLITS if split is None else (split,))
        for file in sorted((session / "mosh" / part).glob(f"*{SUFFIX}"))
    ]
    if not found:
        raise ValueError(f"{root}: expected sequences (mosh/{split or 'train'}/*{SUFFIX}), found none")
    return found


def _what(path: Path) -> str:
    return "got a file" if path.exists() else "no such folder"


def _body(files: Recorded) -> Frames:
    """The body alone."""
    path = files.mosh
    content = safe_pickle.read(path, "body of MoYo", "an unmodified file of its mosh folder", tolerant=True)

    def array(name: str, shape: tuple[int, ...]) -> Array:
        if name not in content:
            raise ValueError(f"{path}: no {name} in it (it has {', '.join(sorted(map(str, content)))})")
        try:
            values = safe_pickle.as_array(content[name])
        except ValueError as error:
            raise ValueError(f"{path}: {name}: {error}") from error
        fits = values.ndim == len(shape) and all(w in (-1, g) for w, g in zip(shape, values.shape, strict=True))
        if not fits or values.dtype.kind not in "fiu":
            wanted = ", ".join("any" if size == -1 else str(size) for size in shape)
            raise ValueError(f"{path}: {name}: expected numbers ({wanted}), got {values.dtype} {values.shape}")
        return values.astype(np.float64)

    pose = array("fullpose", (-1, 165))
    count = len(pose)
    if not count:
        raise ValueError(f"{path}: expected frames, the sequence is empty")
    transl, betas = array("trans", (count, 3)), array("betas", (-1,))
    frames = Frames(
        names=sequences.numbered(files.name, count),
        sequences=np.full(count, files.name),
        ground=Ground.z_up(),
        frame_rate=RATE,
        body="smplx",
        genders=np.full(count, "female"),
        pose=pose.reshape(count, 55, 3),
        betas=np.broadcast_to(betas, (count, len(betas))),
        transl=transl,
    )
    return sequences.plausible(path, frames)


def _frames(files: Recorded, with_pressure: bool, with_com: bool) -> Frames:
    frames = _body(files)
    count = len(frames)
    if with_com:
        com = _center_of_mass(files.com, count) if files.com.is_file() else np.full((count, 3), np.nan)
        frames = replace(frames, center_of_mass=com)
    if with_pressure:
        frames = _with_mat(files, frames)
    return frames


def _center_of_mass(path: Path, count: int) -> Array:
    """(count, 3) m, NaN where Vicon has none."""
    points = c3d.read(path).positions([COM, COM_FLOOR])
    points[(points == 0).all(axis=-1)] = np.nan
    found, floor = _fitted(path, "frames", points, count).swapaxes(0, 1)
    both = np.isfinite(floor).all(axis=1) & np.isfinite(found).all(axis=1)
    if not both.any():
        return found
    off = np.median(np.abs(floor - found)[both], axis=0)
    if off[:2].max() > 0.02 or abs(np.median(floor[both, 2])) > 0.05:
        axis = "xyz"[int(off.argmax())]
        raise ValueError(
            f"{path}: looks like {axis} up: {COM_FLOOR} is expected under {COM}, on z = 0, but lies "
            f"({', '.join(f'{number:.2f}' for number in off)}) m from it"
        )
    return found


def _fitted(path: Path, what: str, values: NDArray[Any], count: int) -> NDArray[Any]:
    """`values` with `count` rows: one or two may be missing at the end, or be too many."""
    if abs(len(values) - count) > APART:
        raise ValueError(
            f"{path}: expected {count} {what}, as many as the body has, give or take {APART}, got {len(values)}"
        )
    lacking = max(count - len(values), 0)
    more = np.full((lacking, *values.shape[1:]), np.nan, values.dtype)
    return np.concatenate([values[:count], more])


@dataclass(frozen=True, eq=False)
class Mat:
    """What the mat recorded: all maps, and the centres of pressure of some of them. Rows run along +y of the mat."""

    maps: NDArray[np.float32]  # (N, H, W) N/cm²
    cell: float  # m
    rate: float  # Hz


def read_maps(path: str | os.PathLike[str]) -> Mat:
    """The maps of an XML file of the mat; each is stored as a crop, upside down.

    ValueError, naming the file, for a document type, and for what is damaged, missing, or in other units than N/cm² and
    millimetres.
    """
    clip = _anywhere(safe_xml.read(path), "clip", path)
    width, height = _pair(clip, ".//cell_count", path)  # the first is the mat's
    size = [safe_xml.number(clip, f".//cell_size/{axis}", path) for axis in "xy"]
    if abs(size[0] - size[1]) > 1e-6 or not 1 < size[0] < 100:
        hint = "; looks like metres" if 0 < size[0] < 0.1 else ""
        raise ValueError(f"{path}: cell_size: expected square cells, in millimetres, got {size[0]} × {size[1]}{hint}")
    unit = clip.find(".//units")
    if unit is not None and (unit.text or "").strip() != UNIT:
        raise ValueError(f"{path}: units: expected {UNIT}, got {unit.text!r}")
    if not (0 < width <= 4096 and 0 < height <= 4096):
        raise ValueError(f"{path}: cell_count: expected a mat of some thousand cells, got {width} × {height}")
    data = _anywhere(clip, "data", path)
    crops = [element for element in data.iter() if element.find("cells") is not None]
    said = safe_xml.number(clip, ".//count", path)
    if said != len(crops):
        raise ValueError(f"{path}: expected {said:g} maps by its count, got {len(crops)}: is the file complete?")
    if len(crops) * width * height * 4 > safe_pickle.MAX_BYTES:
        raise ValueError(f"{path}: {len(crops)} maps of {width} × {height} cells are more than any recording has")
    maps = np.zeros((len(crops), height, width), np.float32)
    for number, (crop, whole) in enumerate(zip(crops, maps, strict=True)):
        _uncrop(crop, whole, f"{path}: map {number}")
    return Mat(maps, size[0] / 1000, safe_xml.number(clip, ".//frequency", path))


def _anywhere(element: Element, tag: str, path: str | os.PathLike[str]) -> Element:
    found = element if element.tag == tag else element.find(f".//{tag}")
    if found is None:
        raise ValueError(f"{path}: expected a recording of the pressure mat, with <{tag}>, got <{element.tag}>")
    return found


def _pair(element: Element, tag: str, path: str | os.PathLike[str]) -> tuple[int, int]:
    x, y = (safe_xml.number(element, f"{tag}/{axis}", path) for axis in "xy")
    if not (x.is_integer() and y.is_integer()):
        raise ValueError(f"{path}: {tag.removeprefix('.//')}: expected whole numbers, got {x} and {y}")
    return int(x), int(y)


def _uncrop(crop: Element, whole: NDArray[np.float32], place: str) -> None:
    """The cells of a map, put where they are on the mat."""
    (column, row), (width, height) = _pair(crop, "cell_begin", place), _pair(crop, "cell_count", place)
    if min(column, row, width, height) < 0 or row + height > whole.shape[0] or column + width > whole.shape[1]:
        raise ValueError(
            f"{place}: expected cells of a mat of {whole.shape[1]} × {whole.shape[0]}, got {width} × {height} from "
            f"({column}, {row})"
        )
    try:
        with np.errstate(over="ignore"):  # what is too large is refused as infinite
            values = np.array((crop.findtext("cells") or "").split(), np.float32)
    except ValueError as error:
        raise ValueError(f"{place}: expected numbers: {error}") from None
    if values.size != width * height:
        raise ValueError(f"{place}: expected {width * height} cells, got {values.size}: is the file complete?")
    if not np.isfinite(values).all() or (values < 0).any():
        raise ValueError(f"{place}: expected pressures of 0 or more, got {values.min()} to {values.max()}")
    whole[row : row + height, column : column + width] = values.reshape(height, width)[::-1]


@dataclass(frozen=True, eq=False)
class Trace:
    """Force and centre of pressure over the frames of a sequence, and the numbers of their maps."""

    maps: NDArray[np.int64]  # (F,)
    force: Array  # (F,) N
    center: Array  # (F, 2) m, along the mat's columns and rows; NaN without a load
    rate: float


def read_trace(path: str | os.PathLike[str]) -> Trace:
    """A CSV file of the mat: two lines about the recording, then a table.

    ValueError, naming the file, for what is missing, damaged, with gaps, or at another rate than 60 Hz.
    """
    regular(path)
    try:
        with Path(path).open(encoding="utf-8-sig", errors="replace", newline="") as stream:
            lines = [row for row in csv.reader(stream) if any(field.strip() for field in row)]
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}") from None
    except csv.Error as error:
        raise ValueError(f"{path}: expected comma-separated values: {error}") from None
    if len(lines) < 4:
        raise ValueError(
            f"{path}: expected a line of names and of values, and a table with its names, got {len(lines)} lines"
        )
    about = dict(zip((name.strip() for name in lines[0]), lines[1], strict=False))
    names, table = [name.strip() for name in lines[2]], lines[3:]
    lacking = [name for name in ("time", FORCE, *COP) if name not in names]
    lacking += [name for name in ("frequency", "count") if name not in about]
    if lacking:
        raise ValueError(f"{path}: no column {lacking[0]!r}; it has {', '.join([*about, *names])[:200]}")
    rate, count = (_float(about[name], f"{path}: {name}") for name in ("frequency", "count"))
    if rate != RATE:
        raise ValueError(f"{path}: frequency: expected {RATE:g} Hz, got {rate:g}")
    if len(table) != count:
        raise ValueError(f"{path}: expected {count:g} rows by its count, got {len(table)}: is the file complete?")
    columns = [names.index(name) for name in ("time", FORCE, *COP)]
    numbers = np.array(
        [[_cell(row, column, f"{path}: row {number}") for column in columns] for number, row in enumerate(table)]
    )
    with np.errstate(over="ignore", invalid="ignore"):  # refused below
        maps = np.rint(numbers[:, 0] * rate)
        steps = np.diff(maps)
    if not np.isfinite(maps).all() or (steps != 1).any():
        raise ValueError(f"{path}: time: expected steps of 1/{rate:g} s, without a gap")
    return Trace(maps.astype(np.int64), numbers[:, 1], numbers[:, 2:] / 1000, rate)


def _cell(row: Sequence[str], column: int, place: str) -> float:
    said = row[column].strip() if column < len(row) else ""
    return np.nan if said == "" else _float(said, place)


def _float(said: str, place: str) -> float:
    try:
        return float(said)
    except ValueError:
        raise ValueError(f"{place}: expected a number, got {said[:40]!r}") from None


def corners(path: str | os.PathLike[str]) -> Array:
    """The mat's corners (4, 3) m in the world, in their order: at +x +y, where cell (0, 0) is, +x -y, -x -y, -x +y.

    ValueError, naming the file, without the markers, or if they are no rectangle on the floor.
    """
    points = c3d.read(path).positions(CORNERS)
    points[(points == 0).all(axis=-1)] = np.nan
    if not np.isfinite(points).all(axis=-1).any(axis=0).all():
        raise ValueError(f"{path}: expected the mat's corners {', '.join(CORNERS)}, one was never seen")
    found = np.nanmedian(points, axis=0)
    if np.abs(found[:, 2]).max() > 0.1:
        flat = "xyz"[int(np.ptp(found, axis=0).argmin())]
        hint = f"; looks like {flat} up" if flat != "z" else ""
        raise ValueError(
            f"{path}: expected the mat's corners on the floor z = 0, got z = {found[:, 2].round(2)} m{hint}"
        )
    side = found[:, :2] > found[:, :2].mean(axis=0)
    order = [np.flatnonzero((side == sides).all(axis=1)) for sides in ((1, 1), (1, 0), (0, 0), (0, 1))]
    if any(len(each) != 1 for each in order):
        raise ValueError(
            f"{path}: expected the mat's corners at four corners along x and y, got {found[:, :2].tolist()}"
        )
    return found[[int(each[0]) for each in order]]


def _placed(mat: Mat, outline: Array, path: Path) -> PressureMaps:
    """The maps in the world: the cells are centred in the rectangle of the corner markers, which lie on the rim."""
    first, second, third, fourth = outline
    rows, columns = (second + third - first - fourth) / 2, (third + fourth - first - second) / 2
    sides = np.array([np.linalg.norm(rows), np.linalg.norm(columns)])
    cells = np.array(mat.maps.shape[1:]) * mat.cell
    if np.abs(sides - cells).max() > 0.1:
        raise ValueError(
            f"{path}: expected the mat's corners {cells[0]:.3f} × {cells[1]:.3f} m apart, as its cells are, got "
            f"{sides[0]:.3f} × {sides[1]:.3f} m"
        )
    e1, e2 = rows / sides[0], columns / sides[1]
    origin = outline.mean(axis=0) - (cells[0] * e1 + cells[1] * e2) / 2
    return PressureMaps(mat.maps, origin, e1, e2, mat.cell)


def _with_mat(files: Recorded, frames: Frames) -> Frames:
    """The frames with the mat's maps, centre of pressure and force; NaN if the sequence has no files of the mat."""
    maps_file, trace_file, corners_file = files.mat
    count = len(frames)
    if not maps_file.is_file() or (files.name.endswith(BROKEN_MAT) and "_nexus_" not in files.name):
        nothing, nowhere = np.full((count, 3), np.nan), np.full(3, np.nan)
        maps = PressureMaps(np.full((count, *CELLS), np.nan, np.float32), nowhere, nowhere, nowhere, CELL)
        return replace(frames, center_of_pressure=nothing, forces=nothing[:, None], pressure=maps)
    mat, trace = read_maps(maps_file), read_trace(trace_file)
    if mat.rate != trace.rate or trace.maps[0] < 0 or trace.maps[-1] >= len(mat.maps):
        raise ValueError(
            f"{trace_file}: expected times of the {len(mat.maps)} maps of {maps_file.name} at {mat.rate:g} Hz, got "
            f"maps {trace.maps[0]} to {trace.maps[-1]} at {trace.rate:g} Hz"
        )
    placed = _placed(mat, corners(corners_file), corners_file)
    center = placed.origin + trace.center[:, 1:] * placed.e1 + trace.center[:, :1] * placed.e2
    force = np.stack([np.zeros_like(trace.force), np.zeros_like(trace.force), trace.force], axis=1)
    maps = _fitted(trace_file, "rows", placed.values[trace.maps], count)
    return replace(
        frames,
        center_of_pressure=_fitted(trace_file, "rows", center, count),
        forces=_fitted(trace_file, "rows", force, count)[:, None],
        pressure=replace(placed, values=maps),
    )


def _pictured(files: Recorded, camera: int, count: int) -> NDArray[np.int64]:
    """The frames that the camera has images of."""
    numbers = (path.stem.rpartition("_")[2] for path in files.images(camera).glob("*.*"))
    rows = sorted({2 * int(number) for number in numbers if number.isdigit()})
    return np.array([row for row in rows if row < count], np.int64)


def _seen(files: Recorded, frames: Frames, camera: int, rows: NDArray[np.int64]) -> Frames:
    count = len(frames)
    by_number = {int(path.stem.rpartition("_")[2]): path for path in files.images(camera).glob("*.*")}
    view = _camera(files, camera)
    spread = (np.broadcast_to(part, (count, *part.shape)) for part in view)
    images = np.array([str(by_number[row // 2]) for row in rows.tolist()] or np.empty(0, "U1"))
    rate = None if frames.frame_rate is None else IMAGE_RATE
    return replace(frames, frame_rate=rate, images=images, cameras=Cameras(*spread))


def _camera(files: Recorded, camera: int) -> tuple[Array, Array, Array]:
    """Rotation, translation and intrinsics of a camera on the sequence's day."""
    day = files.name.split("_")[0]
    paths = sorted(files.session.glob("cameras/**/cameras_param.json"))
    paths = [path for path in paths if any(day in part for part in path.relative_to(files.session).parts)] or paths
    if len(paths) != 1:
        raise ValueError(f"{files.session}: expected one cameras/**/{day}*/**/cameras_param.json, got {len(paths)}")
    content = read_json(paths[0])
    try:
        view = content[f"cam_{camera}"]
        rotation = np.array(view["rotation"], float).reshape(3, 3)
        position = np.array(view["position"], float).reshape(3)
        focal, center = float(view["focal"]), np.array(view["princpt"], float).reshape(2)
    except (ValueError, LookupError, TypeError, OverflowError) as error:
        raise ValueError(
            f"{paths[0]}: expected cam_{camera} with focal, princpt, rotation, position: {error!r}"
        ) from None
    if np.linalg.norm(position) < 20:
        raise ValueError(f"{paths[0]}: position: looks like metres: {position}, expected millimetres")
    intrinsics = np.array([[focal, 0, center[0]], [0, focal, center[1]], [0, 0, 1]])
    return rotation, -rotation @ position / 1000, np.diag([IMAGE_SCALE, IMAGE_SCALE, 1.0]) @ intrinsics


def check(path: str | os.PathLike[str]) -> list[Finding]:
    """What each session has and lacks, which files cannot be read, and whether units, axes, loads and lengths fit."""
    root = Path(path)
    try:
        found_sequences = _sequences(root, None)
    except ValueError as error:
        return [Finding("missing", str(error), "fetch mosh.zip of a session and unpack it")]
    found: list[Finding] = []
    for session in dict.fromkeys(each.session for each in found_sequences):
        found += _session([each for each in found_sequences if each.session == session], session)
    return found


def _session(found_sequences: list[Recorded], session: Path) -> list[Finding]:
    counts = {split: sum(each.split == split for each in found_sequences) for split in SPLITS}
    said = ", ".join(f"{count} in {split}" for split, count in counts.items())
    found = [Finding("ok", f"{session.name}: {len(found_sequences)} sequences ({said})")]
    for what, folder in (
        ("pressure", "pressure"),
        ("centres of mass", "com"),
        ("cameras", "cameras"),
        ("images", "images"),
    ):
        if not (session / folder).is_dir():
            found.append(Finding("missing", f"{session.name}: no {what} ({folder}/)"))
    parts = [(session / "pressure").is_dir(), (session / "com").is_dir()]
    for each in found_sequences:
        needed = ([*each.mat] if parts[0] else []) + ([each.com] if parts[1] else [])
        found += [Finding("missing", f"{file}: no such file") for file in needed if not file.is_file()]
        if parts[0] and all(file.is_file() for file in each.mat):
            found += _loads(each)
    read = [(each.name, lambda each=each: _frames(each, parts[0], parts[1])) for each in found_sequences]
    return found + sequences.judged(read)


def _loads(files: Recorded) -> list[Finding]:
    """Whether maps and centres of pressure agree on force and place."""
    try:
        mat, trace = read_maps(files.mat[0]), read_trace(files.mat[1])
        maps = mat.maps[trace.maps].astype(np.float64)
    except (ValueError, IndexError) as error:
        return [Finding("wrong", str(error))]
    force = maps.sum(axis=(1, 2)) * (100 * mat.cell) ** 2
    loaded = (trace.force > 50) & np.isfinite(trace.center).all(axis=1)
    if not loaded.any():
        return [Finding("missing", f"{files.name}: nobody is on the mat")]
    share = float(np.median(force[loaded] / trace.force[loaded]))
    if abs(share - 1) > 0.02:
        return [Finding("wrong", f"{files.name}: the maps add up to {share:.3g} of the force", "are the maps N/cm²?")]
    rows, columns = (np.arange(size) + 0.5 for size in maps.shape[1:])
    total = maps.sum(axis=(1, 2))[loaded]
    center = np.stack([maps[loaded].sum(axis=1) @ columns, maps[loaded].sum(axis=2) @ rows], axis=1) / total[:, None]
    off = float(np.median(np.linalg.norm(center * mat.cell - trace.center[loaded], axis=1)))
    if off > 0.005:
        said = f"{files.name}: the maps' centre is {1e3 * off:.0f} mm from the centre of pressure in the median"
        return [Finding("wrong", said, "are the maps turned or upside down?")]
    return []
