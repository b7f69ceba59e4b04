"""Damaged files against every reader: each must be read, or refused with an error that names the file.

    python tools/fuzz_readers.py --seconds 30 --seed 1          # about half a minute
    python tools/fuzz_readers.py --seconds 0 --files 30000      # by hand
    python tools/fuzz_readers.py --seed 1 --case 4711           # that one again, with its traceback

What must not happen: a crash, more than 5 s of CPU time, an exception other than ValueError,
FileError or MemoryError, an
error without the file's name, a warning of numpy's, and, of one in ten refused files,
a traceback from the command line.
The seeds are made by the tests' miniature writers, so nothing but this repository is needed.
"""

from __future__ import annotations

import functools
import io
import os
import pickle
import random
import sys
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]
os.environ.setdefault("OMP_NUM_THREADS", "1")

import fuzz_mutations as damage  # noqa: E402
import numpy as np  # noqa: E402
from fuzz_harness import Wrong, run  # noqa: E402

import ipman_rs as ip  # noqa: E402
from ipman_rs.files.errors import FileError  # noqa: E402

FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
VERTICES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
IN_CLI = 0.1  # of refused files


@dataclass(frozen=True)
class Kind:
    """One kind of file: an undamaged one, how it is damaged, who reads it, and the command that takes it."""

    name: str
    content: bytes
    mutation: damage.Mutation
    read: Callable[[Path], Any]
    command: tuple[str, ...] = ()  # FILE and OUT stand for the file and a folder


def npz(**arrays: Any) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def _written(write: Callable[..., Any], name: str, *arguments: Any, **options: Any) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        write(path, *arguments, **options)
        return path.read_bytes()


@functools.cache
def kinds() -> list[Kind]:
    found: list[Kind] = []
    for make in (_meshes, _bodies, _keypoints, _settings, _recordings, _pickles, _tensors, _tables):
        try:
            found += make()
        except ImportError as error:  # an extra is not installed
            print(f"left out: {make.__name__[1:]} ({error})", file=sys.stderr)
    return found


def _meshes() -> list[Kind]:
    from ipman_rs.io import write_mesh
    from ipman_rs.io.parts import read_parts
    from ipman_rs.study.from_file import Request, read

    def mesh(path: Path) -> Any:
        return read(path, Request())

    def parts(path: Path) -> Any:
        return read_parts(path, FACES, None)

    rows = b"".join(b"%g %g %g\n" % tuple(row) for row in VERTICES) + b"".join(
        b"3 %d %d %d\n" % tuple(f) for f in FACES
    )
    head = (
        "ply\nformat {}\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    packed = VERTICES.astype("<f4").tobytes() + b"".join(b"\3" + f.astype("<i4").tobytes() for f in FACES)
    stl = b"\0" * 80 + b"\4\0\0\0" + b"".join(b"\0" * 12 + VERTICES[f].astype("<f4").tobytes() + b"\0\0" for f in FACES)
    command = ("analyze", "FILE", "-o", "OUT")
    return [
        Kind("a.obj", write_mesh.obj(VERTICES, FACES), damage.of_text, mesh, command),
        Kind("a.glb", write_mesh.glb(VERTICES, FACES), damage.of_glb, mesh, command),
        Kind("text.ply", head.format("ascii 1.0").encode() + rows, damage.of_text, mesh, command),
        Kind("binary.ply", head.format("binary_little_endian 1.0").encode() + packed, damage.of_bytes, mesh, command),
        Kind("a.stl", stl, damage.of_bytes, mesh, command),
        Kind("parts.json", b'{"legs": [0, 1], "rest": [2, 3]}', damage.of_json, parts),
        Kind("labels.json", b"[0, 0, 1, 1]", damage.of_json, parts),
        Kind("labels.npy", _written(np.save, "a.npy", np.array([0, 0, 1, 1])), damage.of_npy, parts),
        Kind("labels.npz", npz(face_parts=np.array([0, 0, 1, 1]), part_names=np.array(["a", "b"])), damage.of_npz,
        parts),
    ]  # fmt: skip


def _bodies() -> list[Kind]:
    from ipman_rs.body import joint_regressors
    from ipman_rs.data import open as open_data
    from ipman_rs.fitting import presented, presented_files
    from ipman_rs.study.from_file import Request, read
    from tests.helpers.miniatures import amass, models

    body = ip.load_body("anny-lite")
    pose = np.zeros((2, body.num_joints, 3), np.float32)

    def parameters(path: Path) -> Any:
        return read(path, Request())

    def recorded(path: Path) -> Any:
        return open_data("amass", path)[:]

    command = ("analyze", "FILE", "-o", "OUT")
    return [
        Kind("mesh.npz", npz(vertices=VERTICES, faces=FACES), damage.of_npz, parameters, command),
        Kind("fit.npz", npz(pose=pose.reshape(2, -1), betas=np.zeros((1, 10)), transl=np.zeros((2, 3)),
        model="anny-lite"),
             damage.of_npz, parameters, command),
        Kind("amass.npz", _written(amass.motion, "a.npz", frames=3), damage.of_npz, parameters, command),
        Kind("amass_data.npz", _written(amass.motion, "a.npz", frames=3), damage.of_npz, recorded),
        Kind("smpl.npz", _written(models.smpl, "a.npz"), damage.of_npz, ip.load_body),
        Kind("pose.npz", npz(poses=np.zeros((1, 156)), trans=np.zeros((1, 3)), contact=np.array([1, 2])), damage.of_npz,
             lambda path: (presented.load(path, body), presented_files.read_contact(path, body))),
        Kind("contact.json", b'{"contact": [1, 2, 3]}', damage.of_json,
        lambda path: presented_files.read_contact(path, body)),
        Kind("regressor.npy", _written(np.save, "a.npy", np.zeros((17, 9))), damage.of_npy, joint_regressors.read),
    ]  # fmt: skip


def _keypoints() -> list[Kind]:
    import json

    from ipman_rs.data import keypoints
    from ipman_rs.fitting import camera_file
    from tests.helpers import keypoint_files

    def read(path: Path) -> Any:
        return keypoints.read(path, image_size=(640, 480))

    mediapipe = _written(keypoint_files.write, "a.json", keypoint_files.seen())
    people = {"version": 1.3, "people": [{"pose_keypoints_2d": [1.0, 2.0, 0.9] * 25}]}
    person = {
        "image_id": 1,
        "id": 2,
        "category_id": 1,
        "keypoints": [10.0, 20.0, 2] * 17,
        "bbox": [0, 0, 9, 9],
        "score": 0.9,
    }
    coco = {"images": [{"id": 1, "width": 640, "height": 480, "file_name": "a.jpg"}], "annotations": [person]}
    camera = {"R": np.eye(3).tolist(), "t": [0, 0, 3], "focal": [1000, 1000], "center": [320, 240]}
    command = ("fit", "FILE", "-o", "OUT", "--image-size", "640x480", "--preset", "fast")
    return [
        Kind("mediapipe.json", mediapipe, damage.of_json, read, command),
        Kind("openpose.json", json.dumps(people).encode(), damage.of_json, read, command),
        Kind("coco.json", json.dumps(coco).encode(), damage.of_json, read, command),
        Kind("results.json", json.dumps([person]).encode(), damage.of_json, read, command),
        Kind("camera.json", json.dumps(camera).encode(), damage.of_json, camera_file.read),
    ]


def _settings() -> list[Kind]:
    from ipman_rs.fitting import config
    from ipman_rs.training.trainer import config as training

    presets = [(config.FOLDER / f"{name}.yaml").read_bytes() for name in ("balanced", "fast", "smplify-x")]
    recipe = (ROOT / "python/ipman_rs/training/recipes/hmr-star.yaml").read_bytes()
    command = ("fit", "FILE.json", "-o", "OUT", "--preset", "FILE")
    kinds = [Kind(f"preset{k}.yaml", each, damage.of_text, config.load, command) for k, each in enumerate(presets)]
    return [*kinds, Kind("recipe.yaml", recipe, damage.of_text, training.load, ("train", "FILE", "-o", "OUT"))]


def _recordings() -> list[Kind]:
    from ipman_rs.data import c3d, trc
    from ipman_rs.data import opensim as storage
    from ipman_rs.data.moyo import read_maps, read_trace
    from ipman_rs.files import safe_xml
    from tests.helpers.miniatures import c3d_file, moyo, opensim

    times = np.arange(8) / 100.0
    markers = {name: np.stack([times + k, times, times], axis=1) for k, name in enumerate(("LASI", "RASI"))}
    force, maps, _ = moyo.pressed(3, (0.0, 0.0))
    fit = ("fit", "FILE", "-o", "OUT")
    found = [
        Kind("a.trc", _written(opensim.trc, "a.trc", frames=4), damage.of_text, trc.read, fit),
        Kind("a.mot", _written(opensim.forces, "a.mot", frames=6), damage.of_text, storage.storage),
        Kind("a.sto", _written(opensim.center_of_mass, "a.sto", frames=6), damage.of_text, storage.storage),
        Kind("a.c3d", _written(c3d_file.write, "a.c3d", markers), damage.of_first_bytes, c3d.read, fit),
    ]
    mat = _written(moyo.xml, "a.xml", maps)
    return [
        *found,
        Kind("mat.xml", mat, damage.of_text, read_maps),
        Kind("any.xml", mat, damage.of_bytes, safe_xml.read),
        Kind("mat.csv", _written(moyo.csv, "a.csv", force, maps), damage.of_text, read_trace),
    ]


def _pickles() -> list[Kind]:
    from ipman_rs.files import safe_pickle
    from ipman_rs.fitting import presented
    from tests.helpers.miniatures import models, threedpw

    def arrays(path: Path) -> Any:
        content = safe_pickle.read(path, "sequence", "a file", tolerant=True)
        for name, value in content.items():
            if isinstance(value, (str, int, float, list)):
                continue
            try:
                safe_pickle.as_array(value)
            except ValueError as error:
                raise ValueError(f"{path}: {name}: {error}") from None

    plain = {"pose": np.zeros((1, 72)), "betas": np.zeros(10), "gender": "m", "list": [1, 2.0, "x"]}
    with np.load(io.BytesIO(_written(models.smpl, "a.npz"))) as stored:
        model = dict(stored)
    body = ip.load_body("anny-lite")
    return [
        Kind("two.pkl", pickle.dumps(plain, 2), damage.of_pickle, arrays),
        Kind("five.pkl", pickle.dumps(plain, 5), damage.of_pickle, arrays),
        Kind("threedpw.pkl", threedpw.pickled(threedpw.content(frames=2)), damage.of_pickle, arrays),
        Kind("pose.pkl", pickle.dumps(plain, 2), damage.of_pickle, lambda path: presented.load(path, body)),
        Kind("smpl.pkl", pickle.dumps(model, 2), damage.of_pickle, ip.load_body),
    ]


def _tensors() -> list[Kind]:
    import torch

    from ipman_rs.fitting.terms import vposer
    from ipman_rs.training.model.checkpoint_file import read_checkpoint
    from ipman_rs.training.model.trained_weights import read_trained

    torch.set_num_threads(1)

    def saved(content: Any, **options: Any) -> bytes:
        stream = io.BytesIO()
        torch.save(content, stream, **options)
        return stream.getvalue()

    state = {"settings": {"body": "anny"}, "state_dict": {"model.a": torch.zeros(3, 4), "model.b": torch.ones(2)}}
    old = saved(state, _use_new_zipfile_serialization=False)
    sizes = {"1": (63,), "2": (4, 63), "4": (4,), "6": (4, 4), "7": (4, 4), "8.mu": (2, 4)}
    encoder = {f"encoder_net.{layer}.weight": torch.ones(size) for layer, size in sizes.items()}
    encoder |= {f"encoder_net.{layer}.bias": torch.ones(size[0]) for layer, size in sizes.items()}
    encoder |= {
        f"encoder_net.{layer}.running_{what}": torch.ones(sizes[layer]) for layer in "14" for what in ("mean", "var")
    }
    return [
        Kind("new.ckpt", saved(state), damage.of_bytes, read_checkpoint),
        Kind("old.ckpt", old, damage.of_bytes, read_trained),
        Kind("vposer.pt", saved(encoder), damage.of_bytes, vposer.load),
    ]


def _tables() -> list[Kind]:
    from ipman_rs.evaluation import Accumulator
    from ipman_rs.evaluation.tables import predictions

    def frames(path: Path) -> Any:
        return predictions.read(path, path.parent / "unpacked")[:]

    names, joints = np.array([f"f{k}" for k in range(4)]), np.zeros((4, 24, 3)) + np.linspace(0, 1.7, 24)[:, None]
    arrays = {
        "names": names,
        "sequences": names,
        "joints": joints,
        "joint_names": np.array([f"j{k}" for k in range(24)]),
    }
    sums = Accumulator()
    sums.add({"mpjpe": np.arange(4.0)}, names.tolist(), names.tolist())
    found = [
        Kind("predictions.npz", npz(**arrays), damage.of_npz, frames),
        Kind("sums.npz", _saved(sums), damage.of_npz, Accumulator.load),
    ]
    import pyarrow
    import pyarrow.parquet

    stream = io.BytesIO()
    columns = {"names": names, "joints": list(joints.reshape(4, -1))}
    pyarrow.parquet.write_table(pyarrow.table(columns), stream)
    return [*found, Kind("predictions.parquet", stream.getvalue(), damage.of_bytes, frames)]


def _saved(sums: Any) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        sums.save(Path(folder) / "a.npz")
        return (Path(folder) / "a.npz").read_bytes()


def case(seed: int, number: int) -> str:
    """One damaged file, and what its reader makes of it."""
    draw = random.Random(f"{seed} {number}")
    kind = draw.choice(kinds())
    content = kind.mutation(draw, kind.content)
    with tempfile.TemporaryDirectory(prefix="fuzz") as folder:
        path = Path(folder) / kind.name
        path.write_bytes(content)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                warnings.simplefilter("error", RuntimeWarning)
                kind.read(path)
            return "accepted"
        except (ValueError, FileError) as error:
            if type(error).__module__.partition(".")[0] not in ("builtins", "ipman_rs"):
                raise
            if kind.name not in str(error):
                raise Wrong(f"{kind.name}: an error without the file's name: {str(error)[:200]!r}") from error
            if kind.command and draw.random() < IN_CLI:
                _on_the_command_line(kind, path)
            return "refused"
        except MemoryError:
            return "MemoryError"
        except Exception as error:
            raise type(error)(f"{kind.name}: {error}").with_traceback(error.__traceback__) from None


def _on_the_command_line(kind: Kind, path: Path) -> None:
    from click.testing import CliRunner

    from ipman_rs.cli import main

    (path.parent / f"{path.name}.json").write_text("{}")
    words = [word.replace("FILE", str(path)).replace("OUT", str(path.parent / "out")) for word in kind.command]
    done = CliRunner().invoke(main, words)
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise Wrong(f"{kind.name}: ipman {kind.command[0]}: {type(done.exception).__name__}: {done.exception}")
    if done.exit_code not in (1, 2) or "Traceback" in done.output:
        raise Wrong(f"{kind.name}: ipman {kind.command[0]} ended with {done.exit_code}: {done.output[-200:]!r}")


def _warm_up() -> None:
    """Reads every undamaged file, and tries every command once: what children need is then imported."""
    with tempfile.TemporaryDirectory(prefix="fuzz") as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for kind in kinds():
            path = Path(folder) / kind.name
            path.write_bytes(kind.content)
            try:
                kind.read(path)
            except (ValueError, FileError) as error:
                print(f"the undamaged file is refused: {error}", file=sys.stderr)
            path.write_bytes(b"")
            if kind.command:
                _on_the_command_line(kind, path)


if __name__ == "__main__":
    _warm_up()
    run(case, (__doc__ or "").splitlines()[0])
