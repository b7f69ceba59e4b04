"""Figures of bodies whose answer is known, intervals, the frozen settings, and a tiny run of the benchmark."""

from __future__ import annotations

import csv
import dataclasses
import json
import math

import numpy as np
import pytest
import torch
from click.testing import CliRunner

import ipman_rs.data
from ipman_rs.ablation.training import claims, report
from ipman_rs.ablation.training.from_images import AUGMENTING, ImageTask, jitter
from ipman_rs.ablation.training.intervals import paired_over_seeds
from ipman_rs.ablation.training.variants import BASELINE, CONTROL, OURS, ablation_of
from ipman_rs.body import load_body
from ipman_rs.cli import main
from ipman_rs.training.augment import normalised
from ipman_rs.training.lifting import views
from ipman_rs.training.metrics import pose_metrics
from ipman_rs.training.model import Estimate
from ipman_rs.training.model.keypoint_encoder import KEYPOINTS
from ipman_rs.training.sources.images import Images
from ipman_rs.training.train_loop import TrainingPlan


@pytest.fixture(scope="module")
def truth(static):
    return views.views(static, seed=1)


def exact(truth, pose=None) -> Estimate:
    pose = truth.pose if pose is None else pose
    return Estimate(torch.cat([pose[..., 0], pose[..., 1]], dim=-1), truth.betas, torch.zeros(len(truth), 3))


def test_the_truth_has_no_error(truth, posing):
    found = pose_metrics(exact(truth), truth, posing)
    for name in ("mpjpe", "pa_mpjpe", "pve", "lowest", "tilt"):
        assert np.abs(getattr(found, name)).max() < 2e-6
    assert found.strict.mean() > 0.9  # the support at 2.5 cm is wider than that at 1 cm, but for samples
    assert found.bose.mean() > 0.9


def test_a_lean_is_a_tilt(truth, posing):
    """Leaning by 10 degrees: the tilt is that, about the vertical it is none; the aligned error stays zero."""
    for axis, tilt in ((0, 10.0), (1, 0.0)):
        turn = torch.linalg.matrix_exp(
            math.radians(10) * torch.linalg.cross(torch.eye(3), torch.eye(3)[axis].expand(3, 3)).T
        )
        pose = truth.pose.clone()
        pose[:, 0] = truth.camera @ turn @ truth.camera.transpose(1, 2) @ pose[:, 0]
        found = pose_metrics(exact(truth, pose), truth, posing)
        np.testing.assert_allclose(np.degrees(found.tilt), tilt, atol=2e-3)
        assert found.pa_mpjpe.max() < 1e-5
        assert found.mpjpe.min() > 0.01
        if axis == 1:
            assert np.abs(found.lowest).max() < 1e-5
            np.testing.assert_allclose(found.bose, pose_metrics(exact(truth), truth, posing).bose)


def test_sinking_does_not_pass_the_strict_figure(truth, posing):
    """Bodies are judged on the floor: moving the hips changes height and BoSE, and not the strict figure."""
    lower = dataclasses.replace(truth, hips=truth.hips - torch.tensor([0.0, 0.08, 0.0]))
    usual, sunk = pose_metrics(exact(truth), truth, posing), pose_metrics(exact(truth), lower, posing)
    np.testing.assert_allclose(sunk.lowest, -0.08, atol=1e-5)
    assert np.array_equal(usual.strict, sunk.strict)


@pytest.mark.slow
def test_intervals_hold_the_mean_and_tell_a_difference():
    draw = np.random.default_rng(0)
    baseline = draw.normal(size=(3, 200))
    same = paired_over_seeds(baseline + draw.normal(scale=0.5, size=(3, 200)), baseline)
    assert same.low < 0 < same.high
    better = paired_over_seeds(baseline - 1 + draw.normal(scale=0.5, size=(3, 200)), baseline)
    assert better.high < 0
    # Seeds that differ as wholes widen it; bodies alone would not.
    apart = paired_over_seeds(baseline + np.array([[-1.0], [0.0], [1.0]]), baseline)
    assert apart.high - apart.low > 1
    with pytest.raises(ValueError, match=r"\(seeds, bodies\) of one shape, got \(3, 200\) and \(200,\)"):
        paired_over_seeds(baseline, baseline[0])


@pytest.mark.parametrize("task", ["keypoints", "images"])
def test_the_settings_have_all_rows(task):
    rows = {row.name: row for row in ablation_of(task).rows}
    assert next(iter(rows)) == BASELINE
    assert rows[BASELINE].preset is None
    assert rows[CONTROL] == dataclasses.replace(rows[OURS], name=CONTROL, shuffled=True)
    template = views.posing().body.template
    for row in ablation_of(task).rows[1:]:
        physics = row.physics(template)
        assert physics is not None
        assert sum(weight > 0 for weight in physics.loss.weights.values()) >= 1
    assert rows["both, λ of the paper"].weights == {}
    assert rows["push only"].weights == {"stability": 0, "pull": 0, "push": 0.05}
    assert (ablation_of(task).plan.first is None) == (task == "keypoints")


@pytest.mark.slow
def test_command(tmp_path):
    arguments = ["benchmark", "train", "-o", str(tmp_path), "-n", "14", "--people", "14", "--seeds", "2"]
    arguments += ["--split", "tune", "--part", "0.001", "--tilt", "0", "--tilt", "8", "-j", "1"]
    first = CliRunner().invoke(main, arguments)
    assert first.exit_code == 0, first.output
    record = json.loads((tmp_path / "training_benchmark.json").read_text())
    assert [block["tilt"] for block in record["blocks"]] == [0, 8]
    rows = record["blocks"][1]["rows"]
    assert [row["name"] for row in rows] == [row.name for row in ablation_of("keypoints").rows]
    assert rows[0]["against baseline"]["PVE"] == [0, 0, 0]
    with (tmp_path / "training_benchmark.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == 2 * 2 * 14 * len(rows)
    ours = [float(line["PVE"]) for line in lines if line["labels"] == "8" and line["row"] == OURS]
    named = next(row for row in rows if row["name"] == OURS)
    assert np.mean(ours) == pytest.approx(named["mean"]["PVE"], abs=1e-3)
    page = (tmp_path / "training_benchmark.md").read_text()
    assert "## Labels that lean by 8°" in page
    assert "`ipman benchmark train --tilt 0 --tilt 8 -o out`" in page
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.iterdir() if path.suffix in (".npz", ".pt")}
    assert len(kept) == 2 + 4 + 4 * len(rows)
    again = CliRunner().invoke(main, arguments)
    assert again.exit_code == 0
    assert {path: path.stat().st_mtime_ns for path in kept} == kept  # nothing was done twice
    assert (tmp_path / "training_benchmark.md").read_text() == page
    other = [argument if argument != str(tmp_path) else str(tmp_path / "other") for argument in arguments]
    assert CliRunner().invoke(main, [*other[:-1], "2"]).exit_code == 0  # two processes: the same figures
    lines = (tmp_path / "training_benchmark.csv").read_text()
    assert (tmp_path / "other/training_benchmark.csv").read_text() == lines


@pytest.mark.slow
def test_command_on_images(tmp_path):
    pytest.importorskip("embreex", reason="embreex is not installed")
    images = ["data", "render", "-o", str(tmp_path / "images"), "-n", "8", "--val", "0", "--test", "8", "--size", "64"]
    assert CliRunner().invoke(main, images).exit_code == 0
    arguments = ["benchmark", "train", "--images", str(tmp_path / "images"), "-o", str(tmp_path / "out"), "-j", "2"]
    done = CliRunner().invoke(main, [*arguments, "--seeds", "1", "--part", "0.0002"])
    assert done.exit_code == 0, done.output
    record = json.loads((tmp_path / "out/training_benchmark_images.json").read_text())
    data = ipman_rs.data.open("rendered", tmp_path / "images", split="test")
    standing = data[:].standing
    assert standing is not None
    assert [block["bodies"] for block in record["blocks"]] == [standing.sum()] * 2
    assert [block["tilt"] for block in record["blocks"]] == [0, 8]
    page = (tmp_path / "out/training_benchmark_images.md").read_text()
    assert "small" in page
    assert "--tilt" not in page  # as by default
    kept = ImageTask(tmp_path / "out", tmp_path / "images")
    assert len(kept.training()) == 2 * 8
    # Crops as they are kept, with their colours as they are, are those of the trainer, turned.
    source = Images(data, load_body("anny-lite"), KEYPOINTS, 96)
    rows, truth = np.flatnonzero(standing), kept.truth()
    for row, found, turn in zip(rows, truth.inputs, truth.turn, strict=True):
        change = dataclasses.replace(AUGMENTING.draw(np.random.default_rng([row, 0])), gains=(1.0, 1.0, 1.0))
        assert turn == pytest.approx(change.turn)
        pixels, _ = source.cut(int(row), change)
        expected = normalised(torch.from_numpy(pixels)[None], torch.ones(1, 3))[0]
        torch.testing.assert_close(found, expected, rtol=0, atol=1e-6)
    # And bodies stand in the world as they did before: true ones have no error there.
    exactly = pose_metrics(exact(truth), truth, kept.posing())
    assert truth.turn.abs().min() > 0.01
    assert max(exactly.tilt.max(), exactly.mpjpe.max()) < 1e-5
    assert np.abs(exactly.lowest).max() < 1e-5
    # What the backbone finds is in the crop, and depends on the seed alone.
    for name, seed in (("seen", 0), ("again", 0), ("other", 1)):
        kept.fit_backbone(seed, TrainingPlan(2, 1e-3, 4), tmp_path / name)
    seen, again, other = (kept.training(tmp_path / name).inputs for name in ("seen", "again", "other"))
    assert seen.shape == (2 * 8, len(KEYPOINTS), 3)
    assert seen[..., :2].abs().max() <= 1
    assert (seen[..., 2] == 1).all()
    assert torch.equal(seen, again)
    assert not torch.equal(seen, other)
    assert torch.equal(kept.truth(tmp_path / "seen").inputs, kept.truth(tmp_path / "again").inputs)
    # Figures of another folder's images, of the same regressors.
    trained = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").glob("base-*.pt")}
    others = ["data", "render", "-o", str(tmp_path / "others"), "-n", "1", "--val", "0", "--test", "4", "--size", "64"]
    assert CliRunner().invoke(main, [*others, "--seed", "5"]).exit_code == 0
    arguments += ["--test-images", str(tmp_path / "others")]
    done = CliRunner().invoke(main, [*arguments, "--seeds", "1", "--part", "0.0002"])
    assert done.exit_code == 0, done.output
    record = json.loads((tmp_path / "out/training_benchmark_images.json").read_text())
    assert record["run"]["test_images"] == 4
    assert record["run"]["test_rendered"]["seed"] == 5
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "out").glob("base-*.pt")} == trained
    empty = CliRunner().invoke(main, [*arguments, "--split", "tune"])
    assert empty.exit_code == 1
    assert "no images of the split val" in empty.output


def test_moved_crops_have_their_keypoints_with_them(truth):
    """A white spot at each keypoint is where the keypoint went, to half a pixel; what left the crop is not seen."""
    count, side = 40, 96
    batch = truth[torch.arange(count) % len(truth)]
    generator = torch.Generator().manual_seed(0)
    places = 2 * torch.rand(count, 1, 2, generator=generator) - 1
    pixels = ((places + 1) * side / 2).long().clamp(0, side - 1)[:, 0]
    inputs = torch.zeros(count, side, side, 3, dtype=torch.uint8)
    inputs[torch.arange(count), pixels[:, 1], pixels[:, 0]] = 255
    middles = (pixels[:, None] + 0.5) * 2 / side - 1
    batch = dataclasses.replace(batch, inputs=inputs, keypoints=torch.cat([middles, torch.ones(count, 1, 1)], dim=2))
    after = jitter(batch, generator)
    bright = (after.inputs - after.inputs.amin(dim=(2, 3), keepdim=True)).sum(dim=1)
    grid = (torch.arange(side) + 0.5) * 2 / side - 1
    total = bright.sum(dim=(1, 2))
    found = (
        torch.stack([(bright.sum(dim=1) * grid).sum(dim=1), (bright.sum(dim=2) * grid).sum(dim=1)], dim=1)
        / total[:, None]
    )
    well = (after.keypoints[:, 0, :2].abs() < 0.9).all(dim=1) & (middles[:, 0].abs() < 0.95).all(dim=1)
    assert well.sum() > count / 2
    assert (found - after.keypoints[:, 0, :2])[well].abs().max() < 1 / side
    assert (after.keypoints[:, 0, :2] - middles[:, 0]).abs().max() > 0.1
    outside = (after.keypoints[:, 0, :2].abs() > 1).any(dim=1)
    assert outside.any()
    assert torch.equal(after.keypoints[:, 0, 2] == 0, outside)


def test_verdicts_say_what_the_figures_say():
    """Of blocks made up for it."""

    def row(name, pve, bose, seeds, hover=(0, -1, 1)):
        difference = {"PVE": pve, "BoSE": bose, "hover": hover, "penetration": (0, -1, 1)}
        return {"name": name, "mean": {"PVE": 100.0}, "against baseline": difference, "seeds": {"BoSE": seeds}}

    zero = (0.0, 0.0, 0.0)
    clean = {"tilt": 0, "rows": [row(BASELINE, zero, zero, [0]), row(OURS, (2.1, 1, 3), zero, [0], (2, 1, 3)),
                                 row(CONTROL, zero, zero, [0])]}  # fmt: skip
    assert [holds for _, holds, _ in report.verdicts([clean])] == [False, False, True]
    tilted = {"tilt": 8.0, "rows": [row(BASELINE, zero, zero, [0]), row(OURS, (-1, -2, 0), (5, 4, 6), [4.1, 6]),
                                    row(CONTROL, zero, (1.0, 0.2, 2), [0])]}  # fmt: skip
    # Its BoSE gain is not lost, and it has none in PVE.
    assert [holds for _, holds, _ in report.verdicts([tilted])] == [True, True, True, False]


def test_the_paper_s_claims_are_judged_by_their_intervals():
    """Rows of made-up figures; printed differences are those of the paper's tables: Table 1, push and pull."""
    printed = {(claim.row, claim.figure): claim.printed for claim in claims.CLAIMS}
    assert printed["both (IPMAN-R)", "PVE"] == pytest.approx(89.9 - 92.4)
    assert printed["both (IPMAN-R)", "BoSE"] == pytest.approx(71.2 - 62.0)
    assert printed["+ ground", "BoSE"] == pytest.approx(66.5 - 62.0)
    assert printed["+ stability", "PVE"] == pytest.approx(90.8 - 92.4)
    assert (printed["push only", "PVE"], printed["pull only", "PVE"]) == pytest.approx((96.6 - 92.3, 99.4 - 92.3))
    assert {claim.row for claim in claims.CLAIMS} <= {row.name for row in ablation_of("keypoints").rows}
    pve, bose = claims.Claim("x", "PVE", -2.5), claims.Claim("x", "BoSE", 9.2)
    worse = claims.Claim("x", "PVE", 4.3)
    assert [one.question for one in (pve, bose, worse)] == ["x: PVE better?", "x: BoSE better?", "x: PVE worse?"]
    above, below, both = (0.4, 0.2, 0.6), (-0.4, -0.6, -0.2), (0.1, -0.2, 0.4)
    for claim, verdicts in ((pve, "no yes"), (bose, "yes no"), (worse, "yes no")):
        assert [claim.verdict(interval) for interval in (above, below)] == verdicts.split()
        assert claim.verdict(both) == "not shown"
