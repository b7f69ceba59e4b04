"""How many frames a second `ipman evaluate` measures, and in how much memory; shards, Ray and kill -9 change no bit.

python -m benchmarks.evaluation [--frames 1000000] [--out docs/results] [--folder TMP]

The truth is made of named poses of the small embedded body with noise, and the predictions are the truth with noise.
"""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.lib import format as npy

import ipman_rs as ip
from ipman_rs.body import poses

ROOT = Path(__file__).resolve().parents[1]
BLOCK = 1 << 14  # frames that are made at a time
SEQUENCE = 1000  # frames of one
BODY = "anny-lite"
REPORTS = ("evaluation.json", "evaluation.csv", "evaluation.md", "evaluation.svg")


def write_truth(path: Path, frames: int, seed: int = 0) -> None:
    """Frames in the form of predictions: names, sequences, pose (F, 72), betas (F, 10), transl (F, 3), ground (4,)."""
    named, lowest = _named()

    def block(start: int, stop: int) -> dict[str, np.ndarray]:
        draw = np.random.default_rng([seed, start])
        which = (np.arange(start, stop) // SEQUENCE) % len(named)  # a sequence holds one pose
        pose = named[which] + 0.05 * draw.standard_normal((stop - start, 72), np.float32)
        transl = np.zeros((stop - start, 3), np.float32)
        transl[:, 1] = -lowest[which]
        betas = 0.3 * draw.standard_normal((stop - start, 10), np.float32)
        return {**_called(start, stop), "pose": pose, "betas": betas, "transl": transl}

    _write(path, frames, block)


def write_predictions(path: Path, frames: int, seed: int = 0, noise: float = 0.1, nan: int | None = None) -> None:
    """The same frames with noise on pose (rad) and place (m / 5); `nan`: every so many frames one is NaN."""
    folder = Path(tempfile.mkdtemp(dir=path.parent))
    write_truth(folder / "truth.npz", frames, seed)
    from ipman_rs.evaluation.tables import read

    truth = read(folder / "truth.npz", folder)

    def block(start: int, stop: int) -> dict[str, np.ndarray]:
        draw = np.random.default_rng([seed + 1, start])
        true = {name: column[start:stop] for name, column in truth.columns.items()}
        pose = true["pose"] + noise * draw.standard_normal((stop - start, 72), np.float32)
        if nan is not None:
            pose[-start % nan :: nan] = np.nan
        transl = true["transl"] + noise / 5 * draw.standard_normal((stop - start, 3), np.float32)
        return {"names": true["names"], "pose": pose, "betas": 0 * true["betas"], "transl": transl}

    _write(path, frames, block, ground=False)
    (folder / "truth.npz").unlink()
    folder.rmdir()


def _named() -> tuple[np.ndarray, np.ndarray]:
    named = np.stack([poses.pose(name) for name in poses.NAMES])
    lowest = ip.load_body(BODY)(named).vertices[..., 1].min(axis=-1)
    return named.reshape(-1, 72).astype(np.float32), lowest.astype(np.float32)


def _called(start: int, stop: int) -> dict[str, np.ndarray]:
    numbers = range(start, stop)
    sequences = np.array([f"seq{number // SEQUENCE:06d}" for number in numbers], "U9")
    return {
        "names": np.array([f"seq{n // SEQUENCE:06d}/{n % SEQUENCE:06d}" for n in numbers], "U16"),
        "sequences": sequences,
    }


def _write(path: Path, frames: int, block: Any, ground: bool = True) -> None:
    """An .npz file written array by array, block by block."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED, allowZip64=True) as archive:
        for name, first in block(0, min(BLOCK, frames)).items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                header = {"descr": first.dtype.str, "fortran_order": False, "shape": (frames, *first.shape[1:])}
                npy.write_array_header_1_0(file, header)
                for part in _blocks(frames, block, name):
                    file.write(np.ascontiguousarray(part, first.dtype).tobytes())
        common: dict[str, Any] = {"body": np.str_(BODY)}
        if ground:
            common["ground"] = np.array([0.0, 1.0, 0.0, 0.0])
        for name, value in common.items():
            with archive.open(f"{name}.npy", "w") as file:
                npy.write_array(file, np.asarray(value), allow_pickle=False)


def _blocks(frames: int, block: Any, name: str) -> Iterator[np.ndarray]:
    for start in range(0, frames, BLOCK):
        yield block(start, min(start + BLOCK, frames))[name]


def command(folder: Path, out: Path, *more: str, frames: int) -> list[str]:
    """The command line that evaluates the made files."""
    program = [sys.executable, "-c", "import sys; from ipman_rs.cli import main; main(sys.argv[1:])", "evaluate"]
    predictions, truth = folder / f"noisy-{frames}.npz", folder / f"truth-{frames}.npz"
    return [*program, str(predictions), "--data", "own", "--path", str(truth), "-o", str(out), *more]


def run(arguments: list[str]) -> dict[str, Any]:
    """Seconds, of which of processor cores, and the peak memory of the process in megabytes. RuntimeError."""
    begun, peak = time.perf_counter(), 0.0
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(arguments, stdout=output, stderr=subprocess.STDOUT)
        while True:
            # The peak that wait4 tells is at least that of the process which started this one.
            peak = max(peak, _peak_megabytes(process.pid))
            ended, status, used = os.wait4(process.pid, os.WNOHANG)
            if ended:
                break
            time.sleep(0.02)
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        said = output.read()
    if status:
        raise RuntimeError(f"{' '.join(arguments)}: {said}")
    seconds, cpu = time.perf_counter() - begun, used.ru_utime + used.ru_stime
    peak = peak or used.ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)
    return {"seconds": seconds, "cpu_seconds": cpu, "peak_megabytes": peak, "said": said.splitlines()[0]}


def _peak_megabytes(pid: int) -> float:
    """So far; 0 where the system does not tell."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except OSError:
        return 0.0
    return next((float(line.split()[1]) / 1e3 for line in lines if line.startswith("VmHWM")), 0.0)


def run_and_kill(arguments: list[str], out: Path, pieces: int) -> None:
    """Begins, and kills (-9) the process when so many pieces are there."""
    process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while process.poll() is None and len(list(out.glob("methods/*/*.npz"))) < pieces:
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    if process.wait() != -signal.SIGKILL:
        raise RuntimeError("it ended before it could be killed")


def fingerprints(out: Path) -> dict[str, str]:
    """Of the final figures, the picture, and every piece."""
    files = [*(out / name for name in REPORTS), *sorted(out.glob("methods/*/*.npz"))]
    return {str(file.relative_to(out)): hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


@click.command()
@click.option("--frames", default=1_000_000, show_default=True, help="Of the largest run; a tenth of it is run, too.")
@click.option("--same", "same", default=100_000, show_default=True, help="Frames of the runs that must agree.")
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), default=ROOT / "docs" / "results", show_default=True
)
@click.option("--folder", type=click.Path(file_okay=False, path_type=Path), help="For the made files.")
@click.option("--ray", is_flag=True, help="On Ray, too.")
def main(frames: int, same: int, out: Path, folder: Path | None, ray: bool) -> None:
    """Evaluate made predictions and write OUT/evaluation.json."""
    with tempfile.TemporaryDirectory(dir=folder) as made:
        result = _measured(Path(made), frames, same, ray)
    out.mkdir(parents=True, exist_ok=True)
    (out / "evaluation.json").write_text(json.dumps(result, indent=1) + "\n")


def _measured(made: Path, frames: int, same: int, ray: bool) -> dict[str, Any]:
    from .measure import machine

    result: dict[str, Any] = {"machine": machine(), "body": BODY, "runs": [], "equal": {}}
    for count in sorted({frames // 10, frames, same}):
        write_truth(made / f"truth-{count}.npz", count)
        write_predictions(made / f"noisy-{count}.npz", count, nan=997)
    for count in sorted({frames // 10, frames}):
        found = run(command(made, made / f"out-{count}", frames=count))
        cpu = 1e6 * found["cpu_seconds"] / count
        speed = {"frames_a_second": count / found["seconds"], "cpu_us_a_frame": cpu}
        result["runs"].append({"frames": count, **found, **speed})
        click.echo(
            f"{count:9,} frames: {speed['frames_a_second']:6,.0f} a second, {cpu:.0f} µs of one core each; "
            f"peak {found['peak_megabytes']:,.0f} MB"
        )
    expected = _expected(made, same, frames)
    for name, way in _ways(made, same, ray).items():
        way(made / name)
        equal = fingerprints(made / name) == expected
        result["equal"][name] = equal
        click.echo(f"{name}: {'every bit is the same' if equal else 'DIFFERENT'}")
    return result


def _expected(made: Path, same: int, frames: int) -> dict[str, str]:
    out = made / f"out-{same}"
    if not out.exists():
        run(command(made, out, frames=same))
    return fingerprints(out)


def _ways(made: Path, same: int, ray: bool) -> dict[str, Any]:
    def shards(count: int) -> Any:
        def way(out: Path) -> None:
            for index in range(count, 0, -1):
                run(command(made, out, "--shard", f"{index}/{count}", frames=same))

        return way

    def killed(out: Path) -> None:
        pieces = -(-same // 4096)
        run_and_kill(command(made, out, frames=same), out, pieces // 3)
        run_and_kill(command(made, out, frames=same), out, 2 * pieces // 3)
        run(command(made, out, frames=same))

    def on_ray(out: Path) -> None:
        run(command(made, out, "--ray", frames=same))

    return {"2 shards": shards(2), "7 shards": shards(7), "killed twice": killed} | ({"Ray": on_ray} if ray else {})


if __name__ == "__main__":
    main()
