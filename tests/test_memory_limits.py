"""Where memory lacks: MemoryError, and neither a panic, nor the end of the process, nor a hang. The long run is
`python tools/memory_limits.py`."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "tools"))
from memory_limits import ending

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="other systems do not hold to a limit of address space")


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


@pytest.mark.parametrize("case", ["simulate", "analyze of 1e6 samples", "tip_test", "self_contact_loss"])
@pytest.mark.parametrize("spare", [0.1, 0.2])
def test_many_small_vectors_are_asked_for_too(case, spare):
    assert ending(case, spare, backtrace=True) in ("MemoryError", "answered")
