"""Kill commands at random moments, run them again, and compare what is there with an uninterrupted run.

    python tools/kill_tests.py                          # 20 kills of each command
    python tools/kill_tests.py render --kills 3 --seed 1

The process group gets SIGKILL at 5 to 95 % of the time that the uninterrupted run took. Then the same command runs to
its end. Every file must have the same bytes (checkpoints: the same tensors), nothing may be left over, and the second
run must end with the first one's exit code. Inputs are the smallest that are of use, made by the tests' own writers.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
PROGRAM = (sys.executable, "-c", "from ipman_rs.cli import main; main()")
UNEQUAL = ("tensorboard", "lightning_logs")  # folders that hold times


@dataclass(frozen=True)
class Command:
    """prepare: writes the inputs into a folder and gives the words, in which OUT stands for the output."""

    prepare: Callable[[Path], list[str]]


def _evaluate(folder: Path) -> list[str]:
    from tests.helpers import evaluate_files as files

    true = files.truth(frames=1500)
    files.save(folder / "true.npz", true)
    files.save(folder / "predicted.npz", files.predictions(true))
    return ["evaluate", "predicted.npz", "--data", "own", "--path", "true.npz", "-o", "OUT"]


def _fit(folder: Path) -> list[str]:
    from tests.helpers import keypoint_files as files

    (folder / "people").mkdir()
    (folder / "quick.yaml").write_text(files.QUICK)
    for name in ("standing", "t_pose", "a_pose", "standing"):
        place = folder / "people" / f"{name}_{len(list((folder / 'people').iterdir()))}.json"
        files.write(place, files.seen(name))
    return ["fit", "people", "-o", "OUT", "--resume", "--preset", "quick.yaml"]


def _validate(folder: Path) -> list[str]:
    from tests.helpers import laboratory_files as made

    person = made.person()
    (folder / "lab").mkdir()
    for name, height in (("static", 0.0), ("lift", 0.04)):
        made.trc(folder / "lab" / f"{name}.trc", person, made.moved(height)[1])
        cop = (person.com + made.OFF) * [1, 0, 1]
        made.mot(folder / "lab" / f"{name}_grf.mot", cop, lambda _: made.MASS * made.G)
    return ["validate", "lab", "-o", "OUT"]


def _render(_: Path) -> list[str]:
    counts = ["-n", "24", "--val", "6", "--test", "6", "--shard-size", "6", "--size", "64"]
    return ["data", "render", "-o", "OUT", *counts, "--workers", "1"]


def _train(folder: Path) -> list[str]:
    (folder / "run.yaml").write_text(
        "data: [{name: people, path: 28}]\nvalidation: [{name: people, path: 7}]\n"
        "model: {backbone: keypoints, dropout: 0.3}\nphysics: {preset: paper-r}\nsteps: 60\nbatch: 4\nrate: 1.0e-3\n"
        "validate: 20\nsave: 5\naccelerator: cpu\n"
    )
    return ["train", "run.yaml", "-o", "OUT"]


COMMANDS = {
    "evaluate": Command(_evaluate),
    "fit": Command(_fit),
    "validate": Command(_validate),
    "render": Command(_render),
    "train": Command(_train),
}


@dataclass(frozen=True)
class Run:
    code: int
    seconds: float
    files: dict[str, str]
    said: str


def run(folder: Path, words: list[str], after: float | None = None) -> Run:
    """One run in `folder`; with `after`, killed so many seconds after its begin."""
    begun = time.monotonic()
    process = subprocess.Popen(
        [*PROGRAM, *(word.replace("OUT", "out") for word in words)], cwd=folder, start_new_session=True, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env={**os.environ, "OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    try:
        said, _ = process.communicate(timeout=after)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        said, _ = process.communicate()
    return Run(process.returncode, time.monotonic() - begun, contents(folder / "out"), said)


def contents(folder: Path) -> dict[str, str]:
    """What is in each file, as a hash, by its path."""
    files = sorted(path for path in folder.rglob("*") if path.is_file()) if folder.is_dir() else []
    found = {}
    for path in files:
        name = str(path.relative_to(folder))
        if not set(path.relative_to(folder).parts) & {*UNEQUAL}:
            found[name] = _tensors(path) if path.suffix == ".ckpt" else hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def _tensors(path: Path) -> str:
    """Weights and the optimiser's state; the rest of a checkpoint has paths and times in it."""
    import torch

    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # a damaged one, which is then unequal
        return repr(error)
    digest = hashlib.sha256()

    def take(value: object) -> None:
        if isinstance(value, torch.Tensor):
            digest.update(value.contiguous().numpy().tobytes())
        elif isinstance(value, dict):
            for name in sorted(value, key=str):
                digest.update(str(name).encode())
                take(value[name])
        elif isinstance(value, (list, tuple)):
            for each in value:
                take(each)
        else:
            digest.update(repr(value).encode())

    take([content.get("state_dict"), content.get("optimizer_states"), content.get("global_step")])
    return digest.hexdigest()


def kills(name: str, count: int, seed: int, progress: Callable[[str], None] = print) -> list[str]:
    """What went wrong in `count` kills of a command."""
    draw = random.Random(f"{name} {seed}")
    wrong, completed = [], 0
    with tempfile.TemporaryDirectory(prefix="kills") as room:
        folder = Path(room)
        words = COMMANDS[name].prepare(folder)
        whole = run(folder, words)
        if whole.code != 0:
            return [f"{name}: the uninterrupted run ended with {whole.code}: {whole.said[-500:]}"]
        for number in range(count):
            shutil.rmtree(folder / "out", ignore_errors=True)
            after = whole.seconds * draw.uniform(0.05, 0.95)
            killed = run(folder, words, after)
            completed += killed.code == 0
            again = run(folder, words)
            what = compared(whole, again)
            progress(f"{name} {number}: killed after {after:.1f} of {whole.seconds:.1f} s: {what or 'the same'}")
            wrong += [f"{name} {number} (after {after:.2f} s): {what}"] if what else []
    progress(f"{name}: {count} kills, {completed} of them after the end, {len(wrong)} wrong")
    return wrong


def compared(whole: Run, again: Run) -> str:
    if again.code != whole.code:
        return f"ended with {again.code}: {again.said[-300:]}"
    more, less = sorted(set(again.files) - set(whole.files)), sorted(set(whole.files) - set(again.files))
    other = sorted(name for name in whole.files.keys() & again.files.keys() if whole.files[name] != again.files[name])
    listed = (("left over", more), ("missing", less), ("other bytes", other))
    return "; ".join(f"{what}: {', '.join(names[:5])}" for what, names in listed if names)


def main() -> None:
    words = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    words.add_argument("commands", nargs="*", default=list(COMMANDS), help=f"of {', '.join(COMMANDS)}; all by default")
    words.add_argument("--kills", type=int, default=20, help="of each command")
    words.add_argument("--seed", type=int, default=0)
    asked = words.parse_args()
    wrong = [each for name in asked.commands for each in kills(name, asked.kills, asked.seed)]
    for each in wrong:
        print(f"wrong: {each}")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
