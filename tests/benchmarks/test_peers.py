"""Every peer of the benchmarks computes the same thing; the command line writes its page. Nothing is timed here."""

from __future__ import annotations

import json

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("fast_simplification")
pytest.importorskip("smplx")

from click.testing import CliRunner  # noqa: E402

import ipman_rs as ip  # noqa: E402
from benchmarks import bodies, cases, measure, widths  # noqa: E402
from benchmarks.__main__ import main  # noqa: E402
from benchmarks.measure import Row, Times, interleaved, relative_error  # noqa: E402
from benchmarks.peers import skinning  # noqa: E402
from benchmarks.peers.best_torch import BestTorch  # noqa: E402
from benchmarks.peers.metrics import Metrics  # noqa: E402
from benchmarks.peers.vectorised import Vectorised  # noqa: E402

# float32 positions of metres carry 6e-8 m, and α = 100 / m turns that into 6e-6 of a pressure near 1; eager torch sums
# 20,000 of them pairwise, best torch one after the other.
SINGLE = 2e-5


def peers(template):
    made = {name: make(template) for name, make in cases.LOSS_PEERS.items() if name != "best torch"}
    return made | {"best torch": BestTorch(template, compiled=False)}


@pytest.fixture(scope="module")
def template():
    return bodies.body("lite").make_template(num_samples=3_000)


@pytest.mark.parametrize("case", ["weighted", "terms"])
@pytest.mark.parametrize("peer", list(cases.LOSS_PEERS))
def test_loss_peers_against_float64(template, peer, case):
    made = peers(template)[peer]
    upstream = torch.tensor([[1.0, -0.3], [0.5, 2.0], [0.7, 0.1]])
    found = []
    for dtype, judge in ((torch.float32, made), (torch.float64, Vectorised(template))):
        vertices = torch.tensor(bodies.posed_batch(bodies.body("lite"), 2), dtype=dtype, requires_grad=True)
        value = judge.weighted(vertices) if case == "weighted" else judge.terms(vertices)
        (value * (1 if case == "weighted" else upstream.to(value.dtype))).sum().backward()
        found.append((value, vertices.grad))
    assert relative_error(found[0][0], found[1][0]) < SINGLE
    assert relative_error(found[0][1], found[1][1]) < SINGLE


def test_best_torch_on_three_part_junctions(blob):
    """Rings of vertices where three parts meet, a lid shared by all."""
    from tests.helpers import solids

    rng = np.random.default_rng(3)
    labels = rng.integers(0, 3, len(blob.faces))
    template = ip.BodyTemplate(blob.vertices, blob.faces, labels, num_samples=500)
    vertices = torch.tensor(solids.posed(blob, 2), dtype=torch.float64)
    best = BestTorch(template, compiled=False).terms(vertices.float().requires_grad_())
    assert relative_error(best, Vectorised(template).terms(vertices)) < 1e-4  # volumes of scattered parts are small


@pytest.mark.slow
def test_compiled_best_torch(template):
    vertices = torch.tensor(bodies.posed_batch(bodies.body("lite"), 2), dtype=torch.float32)
    compiled, plain = BestTorch(template), BestTorch(template, compiled=False)
    assert relative_error(compiled.terms(vertices), plain.terms(vertices)) < SINGLE


def test_metrics(template):
    metrics, literal = Metrics(template), cases.LOSS_PEERS["literal"](template)
    vertices = bodies.posed_batch(bodies.body("lite"), 6)
    margin = metrics.our_margin(vertices)
    assert 0 < (margin > 0).sum() < len(margin)
    # Both in float64; outside, scipy's distance is that to a line, not to its segment.
    np.testing.assert_allclose(metrics.scipy_margin(vertices)[margin > 0], margin[margin > 0], atol=1e-12)
    assert ((metrics.scipy_margin(vertices) >= 0) == (margin >= 0)).all()
    assert (literal.is_supported(torch.from_numpy(vertices)) == (margin >= 0)).all()
    for ours, theirs in zip(metrics.our_mass(vertices), metrics.trimesh_mass(vertices), strict=True):
        assert relative_error(ours, theirs) < 1e-11


@pytest.mark.slow
def test_skinning():
    found = []
    for make in (skinning.Smplx, skinning.TorchSkinning, skinning.OurSkinning):
        inputs = skinning.parameters(2)
        vertices = make()(*inputs)
        vertices.square().sum().backward()
        found.append([vertices, *(value.grad for value in inputs)])
    for other in found[1:]:
        for got, expected in zip(other, found[0], strict=True):
            assert relative_error(got, expected) < 1e-5


def test_smpl_sized_body():
    """SMPL's counts; `body` itself refuses an open surface."""
    model = bodies.body("smpl")
    assert (model.num_vertices, len(model.faces)) == (6_890, 13_776)
    assert model.template.watertight
    full = bodies.body("full")
    volumes, expected = (ip.part_volumes(body().vertices, body.template) for body in (model, full))
    np.testing.assert_allclose(volumes, expected, rtol=0.05)  # labels move by half a triangle


def test_interleaved_takes_turns(monkeypatch):
    order = []
    monkeypatch.setattr(measure, "TURN", 0.0)
    times = interleaved({name: (lambda name=name: order.append(name)) for name in "ab"}, seconds=0, min_turns=3)
    assert order == ["a", "a", "b", "b"] * 4  # once before, and three turns of a first and a further call
    assert all(len(found.first) == len(found.further) == 3 for found in times.values())


def test_the_first_call_of_a_turn_is_kept_apart():
    times = Times(first=[5.0, 6.0, 7.0], further=[1.0, 2.0, 3.0, 1.0])
    assert times.medians() == (1.5, 6.0)


@pytest.mark.slow
def test_page(tmp_path, monkeypatch):
    def rows(budget):
        assert budget.batches == (1, 8, 64)
        for case in ("weighted", "terms"):
            for number, peer in enumerate(cases.LOSS_PEERS):
                yield Row(case, "smpl", "paper-r", 8, 1, peer, 1000.0 / 4**number, 2000.0 / 4**number, 5, 1e-7, 2e-7)

    monkeypatch.setattr(cases, "rows", rows)
    done = CliRunner().invoke(main, ["--quick", "--out", str(tmp_path)], catch_exceptions=False)
    assert done.exit_code == 0
    assert len(json.loads((tmp_path / "performance.json").read_text())["rows"]) == 8
    page = (tmp_path / "performance.md").read_text()
    assert "64× (missed: ≥ 100×); first calls 64×" in page
    assert "4.0× (missed: ≥ 8×)" in page
    assert (tmp_path / "performance.svg").read_text().startswith("<?xml")


def test_widths_flag_a_quantity_out_of_line():
    times = {name: {"scalar": 1000.0, "avx512": 100.0} for name in ("volume", "mass", "ground")}
    times["pressure"] = {"scalar": 1000.0, "avx512": 125.0}
    lines, flagged = widths.table(times, ["scalar", "avx512"], batch=1)
    assert flagged == ["pressure"]
    assert "10.00×" in lines[-1]


@pytest.mark.slow
def test_every_case_once(monkeypatch):
    """The smallest grid through the real code."""
    monkeypatch.setitem(cases.LOSS_PEERS, "best torch", lambda template, preset: BestTorch(template, preset, False))
    budget = cases.Budget(
        batches=(2,), threads=(1,), bodies=("lite",), presets=("paper-r", "balanced"), skinned=(1,), metric_batch=2,
        seconds=0.0, min_turns=1,
    )  # fmt: skip
    rows = list(cases.rows(budget))
    met = {(row.case, row.preset, row.peer) for row in rows}
    assert ("weighted", "balanced", "ours") in met
    assert ("terms", "paper-r", "literal") in met
    assert ("support", "", "literal LP") in met
    assert all(row.microseconds > 0 for row in rows)
    assert all(row.gradient_error < SINGLE for row in rows if row.gradient_error is not None)
