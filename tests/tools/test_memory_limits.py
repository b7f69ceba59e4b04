"""Where memory lacks: MemoryError, and neither a panic, nor the end of the process, nor a hang. The long run is
`python tools/memory_limits.py`."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))
from memory_limits import ending

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="other systems do not hold to a limit of address space")


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [
        "template of 1e6 faces",
        "template of 1e7 samples",
        "pressure",
        "sample_surface",
        "gradient of the samples",
        "terms",
        "skinning",
    ],
)
def test_what_does_not_fit_is_a_memory_error(case):
    """With 100 MB left, of which a thread takes most; the backtrace is what made it hang."""
    assert ending(case, 0.1, backtrace=True) == "MemoryError"


@pytest.mark.slow
@pytest.mark.parametrize("case", ["simulate", "analyze of 1e6 samples", "tip_test", "self_contact_loss"])
@pytest.mark.parametrize("spare", [0.1, 0.2])
def test_many_small_vectors_are_asked_for_too(case, spare):
    assert ending(case, spare, backtrace=True) in ("MemoryError", "answered")


@pytest.mark.slow
@pytest.mark.parametrize("limit", [200_000, 260_000, 350_000])  # kB
def test_a_command_with_too_little_to_load_scipy_says_so(tmp_path, limit):
    """SciPy then loaded for minutes, each small allocation a failing system call, or OpenBLAS ended the process."""
    import resource

    mesh = tmp_path / "tetrahedron.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    done = subprocess.run(
        [sys.executable, "-c", "from ipman_rs.cli import main; main()", "analyze", mesh, "--json"],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit << 10, limit << 10)),
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    said = f"ipman: error: memory is limited to {limit * 1.024e-3:.0f} MB (ulimit -v), but NumPy and SciPy need 400"
    assert (done.returncode, done.stdout, done.stderr) == (1, "", f"{said}; raise the limit\n")
