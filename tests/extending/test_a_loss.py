"""docs/extending/adding_a_loss.md and a_term_of_the_fused_loss.md, carried out in a copy of the repository."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers.extending import ROOT, Page, run

pytest.importorskip("torch")

TERM = (ROOT / "docs/extending/a_term_of_the_fused_loss.md").read_text()
OF_A_TERM = 2  # of the loss's edits

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
alone = ipt.height_loss(still, body.template, ground)
unreduced = ipt.IntuitivePhysicsLoss(body.template, crouching, reduction="none")(still, ground)
assert torch.equal(alone, unreduced["height"])
assert np.array_equal(ip.height_loss(still.numpy(), body.template, ip.Ground((0.1, 1.0, 0.05), 0.01)), alone.numpy())
"""
TETRAHEDRON = (
    "([[0.0, 0.01, 0.0], [1.0, 0.0, 0.1], [0.1, 0.02, 1.0], [0.2, 1.0, 0.3]], "
    "[[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])"
)


def test_as_many_files_as_the_pages_say():
    page = Page.read("adding_a_loss.md")
    assert (len(page.files), len(page.edits)) == page.claim == (2, 5)
    assert [path for path in page.files if (ROOT / path).exists()] == []
    said = re.search(r"(\d+) new files and (\d+) edits", TERM)
    assert said is not None
    assert (int(said[1]), int(said[2])) == (len(page.files), OF_A_TERM)
    named = set(re.findall(r"`((?:rust|python)/[\w/.]+)`", TERM.split("## What the")[0]))
    assert named == {*page.files, *list(page.edits)[:OF_A_TERM]}


@pytest.mark.slow
def test_the_pages_add_a_loss_that_is_a_term(tmp_path):
    if shutil.which("cargo") is None:
        pytest.skip("cargo is not installed")
    page = Page.read("adding_a_loss.md")
    for name in ("Cargo.toml", "Cargo.lock"):
        shutil.copy(ROOT / name, tmp_path)
    for name in ("rust", "tests"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"), dirs_exist_ok=True)
    copy = page.carry_out(tmp_path)

    # In the folder of the repository's own builds, where the crates that ours depend on are compiled already.
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    build = ["cargo", "build", "--release", "--locked", "-p", "ipman-py", "--target-dir", str(target)]
    done = subprocess.run(build, cwd=copy, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    library = {"darwin": "lib_core.dylib", "win32": "_core.dll"}.get(sys.platform, "lib_core.so")
    extension = "_core.pyd" if sys.platform == "win32" else "_core.abi3.so"
    shutil.copy(target / "release" / library, copy / "python" / "ipman_rs" / extension)

    (use,) = re.findall(r"```python\n(.*?)```", TERM, re.DOTALL)
    run(copy, "-c", COMPARE.format(use=use, tetrahedron=TETRAHEDRON))
    ((_, command),) = page.tries
    python, *words = command.split()
    assert python == "python"
    said = run(copy, *words, "-q", "-p", "no:cacheprovider", "-m", "not slow")
    passed = re.search(r"(\d+) passed", said)
    assert passed is not None
    assert int(passed[1]) > 50  # some in each of the five modes
