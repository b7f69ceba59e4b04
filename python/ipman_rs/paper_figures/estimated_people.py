"""The people that one method estimated, by name, each with its image and camera: from a folder of `ipman fit` or
`ipman predict`, or from a file of predictions for a data set with images."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

import ipman_rs as ip
from ipman_rs import view
from ipman_rs.body import BodyModel, embedded, pose_arrays
from ipman_rs.data.frames import DataSet, Frames
from ipman_rs.evaluation.tables import predictions
from ipman_rs.evaluation.tables.models import Models
from ipman_rs.files import read_json, safe_npz
from ipman_rs.study import camera_of
from ipman_rs.view import Study

PHOTOS = (".jpg", ".jpeg", ".png")
RECORD, PREDICTIONS = "fit.json", "predictions.npz"
CAMERA = ("camera_rotation", "camera_translation", "focal", "center")


class ImageWarning(UserWarning):
    """An image that is not there or cannot be read; its person is drawn on white."""


@contextmanager
def distinct_warnings() -> Iterator[list[str]]:
    """Collects what is odd as text instead of warning: one line about units, one about each image."""
    said: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        for kind in (ip.UnitsWarning, ImageWarning):
            warnings.simplefilter("always", kind)
        yield said
    units = [str(each.message) for each in caught if issubclass(each.category, ip.UnitsWarning)]
    images = [str(each.message) for each in caught if issubclass(each.category, ImageWarning)]
    said += [*units[:1], *dict.fromkeys(images)]


@dataclass(frozen=True)
class FittedFolder:
    """The outputs of `ipman fit` or `ipman predict`, one folder per person. `photos`: the folder of their photos,
    if they were moved; `body`: the model's file, unless it is an embedded one."""

    path: Path
    photos: Path | None = None
    body: str | None = None

    def names(self) -> list[str]:
        """Names of the people, in the order of their folders. ValueError if there are none."""
        names = [record.parent.name for record in sorted(self.path.glob(f"*/{RECORD}"))] if self.path.is_dir() else []
        if not names and (self.path / PREDICTIONS).is_file():
            raise ValueError(
                f"{self.path}: holds the predictions for a data set; name that with `data` and `path`, for its images "
                "and cameras"
            )
        if not names:
            what = "no fitted body in this folder" if self.path.is_dir() else "there is no such folder"
            raise ValueError(f"{self.path}: {what}; expected the output of ipman fit or ipman predict (NAME/{RECORD})")
        return names

    def study(self, name: str, preset: str = "paper-r") -> Study:
        """The measured body of one person. ValueError, naming the file, for what is damaged or missing."""
        path = self.path / name / f"{name}.npz"
        if not path.is_file():
            raise ValueError(f"{path}: there is no such file; was the fit interrupted?")
        try:
            return self._study(path, name, preset)
        except (IndexError, TypeError) as error:  # an array of another shape
            raise ValueError(f"{path}: expected parameters of ipman fit or predict: {error}") from error

    def _study(self, path: Path, name: str, preset: str) -> Study:
        arrays = {key: safe_npz.read(path, key) for key in safe_npz.names(path)}
        lacking = [key for key in ("betas", "transl", "model", "image_size", *CAMERA) if key not in arrays]
        if lacking:
            raise ValueError(f"{path}: no {', '.join(lacking)} in it; expected parameters of ipman fit or predict")
        body = self._model(path, str(arrays["model"]))
        vertices = _posed(body, arrays, path)
        ground, note = _ground(arrays, vertices)
        points = np.zeros((0, 3)) if "keypoints" not in arrays else arrays["keypoints"][0]
        fitted = view.Fitted(
            camera=camera_of(*(arrays[key][0] for key in CAMERA)),
            size=(float(arrays["image_size"][0, 0]), float(arrays["image_size"][0, 1])),
            seen=points,
            projected=points[:, :2],
            photo=self._photo(name),
        )
        return replace(view.study(name, vertices, body.template, ground, preset, notes=[note]), fitted=fitted)

    def _model(self, path: Path, named: str) -> BodyModel:
        if self.body is not None:
            return ip.load_body(self.body)
        if named in embedded.NAMES:
            return ip.load_body(named)
        raise ValueError(f"{path}: is of the body {named}, whose file is not known here; give `model=FILE`")

    def _photo(self, name: str) -> NDArray[np.uint8] | None:
        """The pixels of a person's photo, None where there is none."""
        record = self.path / name / RECORD
        try:
            source = Path(str(read_json(record)["source"]))
        except (KeyError, TypeError, IndexError) as error:
            raise ValueError(f"{record}: expected the record of a fit, with its source ({error})") from error
        folders = [] if self.photos is None else [self.photos]
        stems = dict.fromkeys((name, source.stem))
        places = [folder / f"{stem}{ending}" for folder in folders for stem in stems for ending in PHOTOS]
        places += [source] if source.suffix.lower() in PHOTOS else []
        return next((_pixels(name, place) for place in places if place.is_file()), None)


def _pixels(name: str, place: Path) -> NDArray[np.uint8] | None:
    """Of a person's image; None, with an `ImageWarning`, where it cannot be read."""
    from ipman_rs.fitting import photo

    try:
        return photo.read(place)
    except ValueError as error:
        warnings.warn(f"{name} is drawn on white: {error}", ImageWarning, stacklevel=2)
        return None


def _posed(body: BodyModel, arrays: Mapping[str, NDArray[Any]], path: Path) -> NDArray[np.float64]:
    try:
        pose = pose_arrays.joined(arrays, body)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    face = arrays["expression"][0] if "expression" in arrays and body.num_expressions else None
    return np.asarray(body(pose, arrays["betas"][0], arrays["transl"][0], face).vertices, np.float64)


def _ground(arrays: Mapping[str, NDArray[Any]], vertices: NDArray[np.float64]) -> tuple[ip.Ground, str]:
    if "ground_normal" in arrays and "ground_height" in arrays:
        return ip.Ground(arrays["ground_normal"][0], arrays["ground_height"][0]), "ground: of the fit"
    return ip.Ground.under(vertices), "ground: under the lowest vertex"


@dataclass(frozen=True)
class Predicted:
    """Predictions (.npz or .parquet, as `ipman evaluate` reads them) for a data set with images and cameras.
    `images`: the folder in which its paths begin."""

    path: Path
    data: DataSet
    models: Models = field(default_factory=Models)
    images: Path = Path()

    def names(self) -> list[str]:
        """Of the predicted frames. ValueError as `ipman evaluate` says it."""
        return [str(name) for name in self._read[0].columns["names"][:]]

    @cached_property
    def _read(self) -> tuple[predictions.Predictions, TemporaryDirectory]:
        """The file, and the folder of what had to be unpacked, which lasts as long."""
        unpacked = TemporaryDirectory()
        return predictions.read(self.path, Path(unpacked.name)), unpacked

    def study(self, name: str, preset: str = "paper-r") -> Study:
        """The measured body of one frame in the data set's camera. ValueError, naming the file, where something that is
        needed is not there."""
        row, true = self._frame(name)
        number = int(self._read[0].index.find(np.array([name]))[0])
        if number < 0:
            raise ValueError(f"{self.path}: has no prediction for {name!r}")
        guess = self._read[0][np.array([number])]
        bodies = self.models.posed(guess)
        if bodies.vertices is None or bodies.model is None:
            raise ValueError(f"{self.path}: has no bodies whose model is here: give `models=FOLDER`")
        ground = guess.ground if guess.ground is not None else true.ground
        if ground is None:
            raise ValueError(f"{name}: the data set has no ground for it")
        if true.cameras is None:
            raise ValueError(f"{name}: the data set has no camera for it; of moyo one is chosen by the option camera=1")
        ground = ip.Ground(np.reshape(ground.normal, (-1, 3))[0], np.ravel(ground.height)[0])
        photo = self._photo(row, true)
        matrix = true.cameras.intrinsics[0]
        camera = camera_of(
            true.cameras.rotation[0], true.cameras.translation[0], matrix[[0, 1], [0, 1]], matrix[:2, 2]
        )  # fmt: skip
        points = np.zeros((0, 3)) if true.keypoints is None else np.nan_to_num(true.keypoints[0])
        size = (2.0 * matrix[0, 2], 2.0 * matrix[1, 2]) if photo is None else (photo.shape[1], photo.shape[0])
        fitted = view.Fitted(camera=camera, size=size, seen=points, projected=points[:, :2], photo=photo)
        vertices = np.asarray(bodies.vertices[0], np.float64)
        analyzed = view.study(name, vertices, bodies.model.template, ground, preset, notes=["ground: of the data set"])
        return replace(analyzed, fitted=fitted)

    def _frame(self, name: str) -> tuple[int, Frames]:
        for start in range(0, len(self.data), 4096):
            rows = np.flatnonzero(self.data[slice(start, start + 4096)].names == name)
            if len(rows):
                row = start + int(rows[0])
                return row, self.data[slice(row, row + 1)]
        raise ValueError(f"{self.path}: predicts {name!r}, but the data set has no such frame")

    def _photo(self, row: int, true: Frames) -> NDArray[np.uint8] | None:
        if hasattr(self.data, "image"):  # it brings its images along
            return self.data.image(row)  # type: ignore[attr-defined]
        if true.images is None or not str(true.images[0]):
            return None
        return _pixels(str(true.names[0]), self.images / str(true.images[0]))


Estimated = FittedFolder | Predicted


def predicted(path: Path, data: DataSet, models: Models, images: Path = Path()) -> Predicted:
    """A file of predictions for a data set, or the folder of `ipman fit --data` that has one."""
    return Predicted(path / PREDICTIONS if path.is_dir() else path, data, models, images)


def shared_names(methods: Sequence[tuple[str, Estimated]], wanted: Sequence[str], most: int) -> list[str]:
    """The people that all methods have: those that are wanted, or up to `most`, evenly spaced. ValueError if one is not
    in all, or none is."""
    lists = [method.names() for _, method in methods]
    others = [set(names) for names in lists[1:]]
    shared = [name for name in lists[0] if all(name in other for other in others)]
    lost = [name for name in wanted if name not in shared]
    if lost:
        raise ValueError(f"people: {lost[0]!r} is not in all of them; these are: {', '.join(shared[:20]) or 'nobody'}")
    if not shared:
        names = " and ".join(str(method.path) for _, method in methods)
        raise ValueError(f"{names}: have nobody of the same name")
    if wanted:
        return list(wanted)
    return [shared[int(row)] for row in np.unique(np.linspace(0, len(shared) - 1, min(most, len(shared))).round())]


def studies(
    methods: Sequence[tuple[str, Estimated]], name: str, preset: str = "paper-r"
) -> Iterator[tuple[str, Study]]:
    """Each method with its measured body of one person."""
    for title, method in methods:
        yield title, method.study(name, preset)
