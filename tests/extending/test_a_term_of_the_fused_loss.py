"""docs/extending/a_term_of_the_fused_loss.md, carried out in a copy of the repository."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("torch")

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "extending" / "a_term_of_the_fused_loss.md"
RUST, PYTHON = Path("rust/core/src/losses"), Path("python/ipman_rs/torch/reference")

# The values and the gradients of all terms, from the core and from the reference, on a body that leans over its ground.
COMPARE = """
import numpy as np
import torch
from ipman_rs import _core

{use}
body = ip.load_body("anny-lite")
ground = ipt.Ground((0.1, 1.0, 0.05), 0.01)
still = torch.from_numpy(np.stack([ip.body.posed(body, name) for name in ("standing", "one_leg")]))
upstream = torch.tensor([0.5, -2.0, 3.0, 1.5], dtype=torch.float64)


def values_and_gradients(vertices):
    vertices = vertices.clone().requires_grad_()
    total, terms = loss.weighted(vertices, ground)
    separate = torch.stack(list(loss(vertices, ground).values()))
    slopes = [torch.autograd.grad(total, vertices)[0], torch.autograd.grad(separate, vertices, upstream)[0]]
    return torch.stack(list(terms.values())), separate.detach(), *slopes


def close(ours, theirs, tolerance):
    for one, other in zip(ours, theirs, strict=True):
        torch.testing.assert_close(one.double(), other, rtol=0, atol=tolerance * other.abs().max().item())


assert loss.terms == ("stability", "pull", "push", "height")
assert _core.Quantity(loss.template._core, loss._quantity.full_name, loss._quantity.options).num_outputs == 4
with ipt.dispatch._reference_path():
    expected = values_and_gradients(still)
assert 0.8 < expected[0][3] < 1.1  # m, the height of the centre of mass of a person who stands
close(values_and_gradients(still), expected, 1e-10)  # sums in another order
close(values_and_gradients(still.float()), expected, 1e-5)
with ipt.dispatch._device_path():  # whose kernels do not know the fourth term
    close(values_and_gradients(still), expected, 1e-12)
three = ipt.IntuitivePhysicsLoss(loss.template, "paper-r")(still, ground)
with_height = loss(still, ground)
assert all(torch.equal(with_height[name], value) for name, value in three.items())
total = lambda vertices: loss.weighted(vertices, ground)[0]
tiny = ip.BodyTemplate(*(array for array in {tetrahedron}), num_samples=50)
loss = ipt.IntuitivePhysicsLoss(tiny, crouching)
corner = torch.tensor({tetrahedron}[0], dtype=torch.float64).requires_grad_()
assert torch.autograd.gradcheck(total, corner, check_forward_ad=True)
assert torch.autograd.gradgradcheck(total, corner)
"""
TETRAHEDRON = (
    "([[0.0, 0.01, 0.0], [1.0, 0.0, 0.1], [0.1, 0.02, 1.0], [0.2, 1.0, 0.3]], "
    "[[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])"
)


def blocks() -> list[str]:
    """The blocks of code of the page, in its order."""
    return re.findall(r"```(?:rust|python)\n(.*?)```", PAGE.read_text(), re.DOTALL)


def after(file: Path, line: str, added: str) -> None:
    """Inserts text after a line that stands there once."""
    text = file.read_text()
    assert text.count(line) == 1, (file, line)
    file.write_text(text.replace(line, line + added))


def test_every_path_is_there():
    """But for the two files that the reader is to write."""
    paths = re.findall(r"`((?:rust|python|tests)/[\w/.]+)`", PAGE.read_text())
    missing = {path for path in paths if not (ROOT / path).exists()}
    assert missing == {str(RUST / "height.rs"), str(PYTHON / "height.py")}


@pytest.mark.slow
def test_the_page_adds_a_term(tmp_path):
    if shutil.which("cargo") is None:
        pytest.skip("cargo is not installed")
    formula, module, listed, reference, imported, named, use = blocks()
    for name in ("Cargo.toml", "Cargo.lock"):
        shutil.copy(ROOT / name, tmp_path)
    for name in ("rust", "python"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("*.so", "__pycache__"))

    (tmp_path / RUST / "height.rs").write_text(formula)
    after(tmp_path / RUST / "mod.rs", "pub mod ground;\n", module)
    after(tmp_path / RUST / "mod.rs", "    Ground(ground::GroundLoss),\n", listed)
    (tmp_path / PYTHON / "height.py").write_text(reference)
    after(tmp_path / PYTHON / "quantities.py", "from .ground import ground_loss\n", imported)
    after(tmp_path / PYTHON / "quantities.py", '    "ground": FORMULAS["ground_loss"],\n', named)

    # In the folder of the repository's own builds, where the crates that ours depend on are compiled already.
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    build = ["cargo", "build", "--release", "--locked", "-p", "ipman-py", "--target-dir", str(target)]
    done = subprocess.run(build, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    library = {"darwin": "lib_core.dylib", "win32": "_core.dll"}.get(sys.platform, "lib_core.so")
    extension = "_core.pyd" if sys.platform == "win32" else "_core.abi3.so"
    shutil.copy(target / "release" / library, tmp_path / "python" / "ipman_rs" / extension)

    script = COMPARE.format(use=use, tetrahedron=TETRAHEDRON)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "python"), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
