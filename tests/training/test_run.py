"""The trainer: configurations, a run, a kill, two processes, folders and checkpoints that do not fit."""

from __future__ import annotations

import copy
import csv
import dataclasses
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch
from click.testing import CliRunner

pytest.importorskip("lightning", reason="lightning is not installed")

from PIL import Image

from ipman_rs.cli import main
from ipman_rs.training import recipes
from ipman_rs.training.augment import Augmentation, AugmentConfig, crop
from ipman_rs.training.projection import project
from ipman_rs.training.trainer import config
from ipman_rs.training.trainer.checkpoints import WholeFiles
from ipman_rs.training.trainer.curve import Curve, drop_after
from ipman_rs.training.trainer.module import Training
from tests.helpers import ipman_script

SETTINGS = """
data: [{name: people, path: 28}]
validation: [{name: people, path: 7}]
model: {backbone: keypoints, dropout: 0.3}
physics: {preset: paper-r}
steps: 24
batch: 4
rate: 1.0e-3
validate: 12
save: 5
accelerator: cpu
"""


@pytest.fixture
def settings(tmp_path):
    path = tmp_path / "run.yaml"
    path.write_text(SETTINGS)
    return path


def curve(folder: Path, name: str = "curve.csv") -> list[dict[str, str]]:
    with (folder / name).open() as file:
        return list(csv.DictReader(file))


def command(*arguments) -> list[str]:
    return [sys.executable, ipman_script.__file__, *map(str, arguments)]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A run that nothing interrupted."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "run.yaml").write_text(SETTINGS)
    result = CliRunner().invoke(main, ["train", str(folder / "run.yaml"), "-o", str(folder / "out")])
    assert result.exit_code == 0, result.output
    return folder / "out"


@pytest.mark.slow
def test_a_run(whole):
    lines = curve(whole)
    assert [int(line["step"]) for line in lines] == list(range(24))
    losses = [float(line["loss"]) for line in lines]
    assert sum(losses[-4:]) < 0.8 * sum(losses[:4])
    assert {"keypoints_2d", "joints_3d", "pose", "betas", "scale", "stability", "pull", "push"} <= set(lines[0])
    found = curve(whole, "validation.csv")
    assert [int(line["step"]) for line in found] == [12, 24]
    assert 0 < float(found[1]["people/0/PVE"]) < 1000
    assert (whole / "last.ckpt").exists()
    assert (whole / "best.ckpt").exists()


@pytest.mark.slow
def test_a_killed_run_goes_on_as_if_nothing_had_been(whole, settings, tmp_path):
    folder = tmp_path / "out"
    process = subprocess.Popen(
        command("train", settings, "-o", folder, "steps=2000", "validate=0"), stderr=subprocess.DEVNULL
    )
    until = time.time() + 300
    while time.time() < until and not (folder / "last.ckpt").exists():
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    reached = len(curve(folder))
    assert 5 <= reached < 2000
    saved = torch.load(folder / "last.ckpt", weights_only=True)["global_step"]
    result = CliRunner().invoke(
        main, ["train", str(settings), "-o", str(folder), f"steps={max(24, saved + 3)}", "validate=0"]
    )
    assert result.exit_code == 0, result.output
    again, straight = curve(folder), curve(whole)
    assert [int(line["step"]) for line in again] == list(range(max(24, saved + 3)))
    assert again[:24] == straight  # to the last digit


class Killed(BaseException):
    """Nothing catches it: the run ends here, as by a kill."""


@pytest.mark.slow
@pytest.mark.parametrize("moment", ["before validation.csv", "after validation.csv", "after best.ckpt"])
def test_a_kill_around_a_validation_leaves_the_same_bytes(whole, settings, tmp_path, monkeypatch, moment):
    """Step 12 is saved and validated: killed between the two, the next run validates it once, no more and no less."""
    when, name = moment.split()
    write, save = Curve._write, WholeFiles.save_checkpoint

    def written(self, file, step, numbers):
        if (when, name, step) == ("before", file, 12):
            raise Killed
        write(self, file, step, numbers)
        if (when, name, step) == ("after", file, 12):
            raise Killed

    def saved(self, checkpoint, path, *options, **named):
        save(self, checkpoint, path, *options, **named)
        if Path(path).name == name:
            raise Killed

    arguments = ["train", str(settings), "-o", str(tmp_path / "out"), "save=4"]
    with monkeypatch.context() as patched:
        patched.setattr(Curve, "_write", written)
        patched.setattr(WholeFiles, "save_checkpoint", saved)
        with pytest.raises(Killed):
            CliRunner().invoke(main, arguments)
    assert len(curve(tmp_path / "out")) == 12
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    for file in ("curve.csv", "validation.csv"):
        assert (tmp_path / "out" / file).read_bytes() == (whole / file).read_bytes()
    again, straight = (torch.load(place / "best.ckpt", weights_only=True) for place in (tmp_path / "out", whole))
    assert again["global_step"] == straight["global_step"]
    assert all(torch.equal(value, straight["state_dict"][key]) for key, value in again["state_dict"].items())


def test_lines_that_a_kill_cut_short_are_dropped(tmp_path):
    for content, kept in ((b"", None), (b"step,lo", None), (b"step,loss\n0,1.0\n1,2.0\n2,3", b"step,loss\n0,1.0\n")):
        path = tmp_path / "curve.csv"
        path.write_bytes(content)
        drop_after(path, 0)
        assert (path.read_bytes() if path.exists() else None) == kept


def test_a_gradient_is_clipped_and_one_that_is_infinite_dropped(settings, tmp_path):
    module = Training(config.load(settings, ["clip=12.5"]))
    before = copy.deepcopy(module.state_dict())
    # So small that nothing is left of a gradient in single precision.
    told = ["train", str(settings), "-o", str(tmp_path / "out"), "steps=2", "save=1", "validate=0", "clip=1.0e-45"]
    done = CliRunner().invoke(main, told)
    assert done.exit_code == 0, done.output
    after = torch.load(tmp_path / "out/last.ckpt", weights_only=True)["state_dict"]
    assert all(torch.equal(after[name], before[name]) for name in before)
    first, *others = module.model.parameters()
    first.grad, others[0].grad = torch.full_like(first, 1e4), torch.full_like(others[0], -1e3)
    module.configure_gradient_clipping(None)
    norm = torch.cat([first.grad.flatten(), others[0].grad.flatten()]).norm()
    assert norm == pytest.approx(12.5, rel=1e-4)  # sums in single precision
    assert first.grad.unique() == pytest.approx(-10 * others[0].grad.unique())
    free = Training(config.load(settings, ["clip=.inf"]))  # as SPIN
    weights = next(iter(free.model.parameters()))
    weights.grad = torch.full_like(weights, 1e4)
    free.configure_gradient_clipping(None)
    assert (weights.grad == 1e4).all()
    first.grad, others[0].grad = torch.full_like(first, math.inf), torch.ones_like(others[0])
    module.configure_gradient_clipping(None)
    assert all(weights.grad is None for weights in module.parameters())


@pytest.mark.slow
def test_the_last_step_is_saved_and_gone_on_with(settings, tmp_path, whole):
    """Seven steps, saved every five, then on to twelve: nothing is lost or done twice."""
    for steps in (7, 12):
        told = ["train", str(settings), "-o", str(tmp_path / "out"), f"steps={steps}", "save=5", "validate=0"]
        done = CliRunner().invoke(main, told)
        assert done.exit_code == 0, done.output
        assert torch.load(tmp_path / "out/last.ckpt", weights_only=True)["global_step"] == steps
    assert curve(tmp_path / "out") == curve(whole)[:12]


def test_the_rate_falls_along_half_a_cosine(settings):
    told = Training(config.load(settings, ["schedule=cosine"])).configure_optimizers()
    assert isinstance(told, dict)
    rates = []
    for _ in range(25):
        rates.append(told["optimizer"].param_groups[0]["lr"])
        told["optimizer"].step()
        told["lr_scheduler"]["scheduler"].step()
    expected = [1e-3 * (0.1 + 0.9 * (1 + math.cos(math.pi * step / 24)) / 2) for step in range(25)]
    assert rates == pytest.approx(expected, rel=1e-9)


@pytest.mark.slow
def test_a_killed_run_goes_on_with_its_rate(settings, tmp_path):
    changes = ["steps=300", "validate=0", "schedule=cosine"]
    process = subprocess.Popen(
        command("train", settings, "-o", tmp_path / "killed", *changes), stderr=subprocess.DEVNULL
    )
    until = time.time() + 300
    while time.time() < until and not (tmp_path / "killed/last.ckpt").exists():
        time.sleep(0.01)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert 5 <= len(curve(tmp_path / "killed")) < 300
    for name in ("killed", "straight"):
        result = CliRunner().invoke(main, ["train", str(settings), "-o", str(tmp_path / name), *changes])
        assert result.exit_code == 0, result.output
    assert curve(tmp_path / "killed") == curve(tmp_path / "straight")
    other = CliRunner().invoke(main, ["train", str(settings), "-o", str(tmp_path / "killed"), *changes, "steps=400"])
    assert other.exit_code == 1
    assert "another steps" in other.output


def test_starting_from_a_checkpoint(whole, settings):
    start = f"model.start={whole / 'last.ckpt'}"
    found = Training(config.load(settings, ["seed=5", start])).model.state_dict()
    kept = torch.load(whole / "last.ckpt", weights_only=True)["state_dict"]
    assert all(torch.equal(value, kept[f"model.{name}"]) for name, value in found.items())
    with pytest.raises(ValueError, match=r"last.ckpt: does not fit .* keypoints for anny-lite"):
        Training(config.load(settings, ["model.backbone=small", start]))
    with pytest.raises(ValueError, match=r"run.yaml: cannot be read as a checkpoint"):
        Training(config.load(settings, [f"model.start={settings}"]))


def of_torchrun(arguments) -> list[str]:
    python, *script = command(*arguments)
    return [python, "-m", "torch.distributed.run", "--nproc-per-node", "2", *script]


def ended(processes: list[subprocess.Popen]) -> None:
    for process in processes:
        _, said = process.communicate(timeout=900)
        assert process.returncode == 0, said[-2000:]


@pytest.mark.slow
def test_two_processes_are_one_with_twice_the_batch(settings, tmp_path):
    """Equal but for the order of sums: weights after six steps within 1e-4. Lightning, torchrun and SLURM start them
    in their own ways, and the same comes out."""
    common = ["train", settings, "steps=6", "validate=0", "save=6", "model.dropout=0"]
    slurm = {
        "SLURM_JOB_ID": "1", "SLURM_JOB_NAME": "train", "SLURM_NTASKS": "2", "SLURM_NTASKS_PER_NODE": "2",
        "SLURM_NNODES": "1", "SLURM_NODEID": "0", "SLURM_NODELIST": "localhost", "SLURM_JOB_NODELIST": "localhost",
        "SLURM_STEP_NODELIST": "localhost",
    }  # fmt: skip
    weights = {}
    for way in ("one", "lightning", "torchrun", "slurm"):
        number = 1 if way == "one" else 2
        arguments = [*common, "-o", tmp_path / way, f"devices={number}", f"batch={8 // number}"]
        ranks = [{}]
        if way == "slurm":
            ranks = [{**slurm, "SLURM_PROCID": str(rank), "SLURM_LOCALID": str(rank)} for rank in range(2)]
        whole = of_torchrun(arguments) if way == "torchrun" else command(*arguments)
        ended(
            [
                subprocess.Popen(
                    whole, env={**os.environ, **own}, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
                )
                for own in ranks
            ]
        )
        weights[way] = torch.load(tmp_path / way / "last.ckpt", weights_only=True)["state_dict"]
    # Adam's first steps are the gradient's sign: where a gradient is near zero the two may part by the rate.
    both = weights["lightning"]
    differences = torch.cat([(weights["one"][name] - both[name]).abs().flatten() for name in both])
    assert (differences < 1e-4).float().mean() > 0.999
    assert differences.max() < 6e-3
    for way in ("torchrun", "slurm"):
        assert all(torch.equal(weights[way][name], both[name]) for name in both)


def test_another_configuration_is_refused(whole, settings):
    result = CliRunner().invoke(main, ["train", str(settings), "-o", str(whole), "rate=0.5"])
    assert result.exit_code == 1
    assert "another rate" in result.output


def test_damaged_checkpoints_are_named(settings, tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "last.ckpt").write_bytes(b"no checkpoint")
    result = CliRunner().invoke(main, ["train", str(settings), "-o", str(folder)])
    assert result.exit_code == 1
    assert "last.ckpt" in result.output


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("stepz=3", "stepz: unknown; expected some of data"),
        ("steps=many", "steps: expected int, got 'many'"),
        ("steps=0", "steps: expected at least 1"),
        ("model.backbones=small", "model.backbones: unknown"),
        ("physics.preset=paper-x", "physics.preset: expected none or one of paper-r"),
        ("data=[]", "at least one data set"),
        ("data=[{name: people}]", r"data\[0\].path: missing"),
        ("data=3", "data: expected a list"),
        ("steps", "steps: expected name=value"),
        ("clip=0", "clip: expected more than 0, got 0"),
        ("schedule=steep", "schedule: expected one of constant, cosine"),
        ("model={backbone: small, start: a.ckpt, spin: b.pt}", "model.start: has all weights"),
    ],
)
def test_configurations_that_cannot_be(settings, change, said):
    with pytest.raises(ValueError, match=said):
        config.load(settings, [change])


def test_configurations_survive_their_file(settings):
    made = config.load(settings, ["model.size=128", "augment.flip=0.25", "loss.pose=2", "precision=bf16-mixed"])
    assert (made.model.size, made.augment.flip, made.loss.pose, made.precision) == (128, 0.25, 2.0, "bf16-mixed")
    assert config.config_of(config.as_dict(made)) == made


def test_the_recipes_are_the_paper_s():
    """Shares as the released code names them: Human3.6M 30 %, in the wild 40 % by size, 3DHP 10 %, RICH 20 %."""
    from ipman_rs.data import module

    made = {name: config.load(recipes.path_of(name)) for name in recipes.NAMES}
    assert set(made) == {"ipman-r", "hmr-star", "ipman-r-human36m"}
    for one in made.values():
        assert (one.steps, one.batch, one.rate, one.schedule) == (14_600, 64, 5e-5, "constant")
        assert one.steps == pytest.approx(3 * 312_188 / 64, rel=5e-3)
        assert one.clip == math.inf
        assert config.config_of(config.as_dict(one)) == one
        assert (one.loss.keypoints_2d, one.loss.keypoints_2d_count, one.loss.all) == (5, 49, 60)
        assert one.augment == AugmentConfig()
        for told in one.data:
            assert told.options["split"] in module(told.name).FORM.files
    shares = {(one.name, one.options["split"]): one.share for one in made["ipman-r"].data}
    sizes = {"coco train": 28_344, "mpii train": 14_810, "lsp extended": 9_427, "lsp train": 1_000}
    for name, size in sizes.items():
        assert shares.pop(tuple(name.split())) == pytest.approx(0.4 * size / sum(sizes.values()), abs=5e-4)
    assert shares == {("human36m", "train"): 0.3, ("mpi-inf-3dhp", "train"): 0.1, ("rich-ipman", "train"): 0.2}
    assert made["hmr-star"] == dataclasses.replace(made["ipman-r"], physics=config.PhysicsConfig())
    assert made["ipman-r"].physics == config.PhysicsConfig("paper-r")
    assert [told.name for told in made["ipman-r-human36m"].data] == ["human36m"]


def test_a_recipe_by_its_name(tmp_path):
    """It runs where its data lie; here there are none, and the first that is missing is named."""
    done = CliRunner().invoke(main, ["train", "ipman-r-human36m", "-o", str(tmp_path / "out"), "body=anny-lite"])
    assert done.exit_code == 1
    assert "data/J_regressor_extra.npy" in done.output
    done = CliRunner().invoke(main, ["train", "ipman-q", "-o", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert "ipman-q: no such file, nor a recipe; those are hmr-star" in done.output


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (["model.backbone=small"], "people.*need model.backbone: keypoints"),
        (["loss.keypoint_maps=1"], "loss.keypoint_maps: has maps with model.backbone: small alone"),
        (["data=[{name: rendered, path: nowhere}]"], "keypoints' is for 'people' alone"),
        (["data=[{name: rendered, path: nowhere}]", "model.backbone=small", "validation=[]"], "rendered: .*nowhere"),
        (
            ["data=[{name: picasso, path: nowhere}]", "model.backbone=small", "validation=[]"],
            "picasso.*expected one of",
        ),
    ],
)
def test_data_that_does_not_fit(settings, tmp_path, changes, said):
    import re

    result = CliRunner().invoke(main, ["train", str(settings), "-o", str(tmp_path / "out"), *changes])
    assert result.exit_code == 1
    assert re.search(said, result.output), result.output


@pytest.mark.slow
def test_rendered_images(tmp_path, monkeypatch):
    """From rendering to a checkpoint, with a network for images."""
    pytest.importorskip("embreex", reason="embreex is not installed")
    render = [
        "data",
        "render",
        "-o",
        str(tmp_path / "images"),
        "-n",
        "7",
        "--val",
        "3",
        "--test",
        "0",
        "--size",
        "64",
    ]
    done = CliRunner().invoke(main, render)
    assert done.exit_code == 0, done.output
    (tmp_path / "run.yaml").write_text(f"""
data: [{{name: rendered, path: {tmp_path / "images"}, options: {{split: train}}}}]
validation: [{{name: rendered, path: {tmp_path / "images"}, options: {{split: val}}}}]
model: {{backbone: small, size: 64}}
loss: {{keypoint_maps: 0.02}}
physics: {{preset: balanced}}
steps: 3
batch: 4
validate: 3
save: 3
accelerator: cpu
""")
    done = CliRunner().invoke(main, ["train", str(tmp_path / "run.yaml"), "-o", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    terms = curve(tmp_path / "out")[2]
    assert float(terms["balance"]) > 0
    assert float(terms["keypoints_2d"]) > 0
    assert 0 < float(terms["keypoint_maps"]) < 1.2 * math.log(64)  # of maps of 8 x 8
    assert float(terms["pose"]) > 0
    assert float(curve(tmp_path / "out", "validation.csv")[0]["rendered/0/PVE"]) > 0

    # Predictions for the same images, measured by `ipman evaluate`: what the trainer's validation said.
    seen = ["--data", "rendered", "--path", str(tmp_path / "images"), "--split", "val"]
    predicting = ["predict", *seen, "--checkpoint", str(tmp_path / "out/last.ckpt"), "-o", str(tmp_path / "predicted")]
    done = CliRunner().invoke(main, predicting)
    assert done.exit_code == 0, done.output
    measuring = ["evaluate", str(tmp_path / "predicted/predictions.npz"), *seen, "-o", str(tmp_path / "measured")]
    done = CliRunner().invoke(main, measuring)
    assert done.exit_code == 0, done.output
    with (tmp_path / "measured/evaluation.csv").open() as file:
        measured = {line["figure"]: line["mean"] for line in csv.DictReader(file)}
    validated = curve(tmp_path / "out", "validation.csv")[0]
    for figure in ("PVE", "MPJPE", "PA-MPJPE", "BoSE", "hover"):
        assert float(measured[figure]) == pytest.approx(float(validated[f"rendered/0/{figure}"]), abs=0.01)

    # And back: bodies for two of the images and a file that is none.
    import numpy as np

    from ipman_rs.data import open as open_data
    from ipman_rs.training.predict import TrainedModel

    data = open_data("rendered", tmp_path / "images", split="val")
    photos = tmp_path / "photos"
    photos.mkdir()
    for row in range(2):
        Image.fromarray(data.image(row)).save(photos / f"{row}.png")
    (photos / "2.jpg").write_bytes(b"none")
    arguments = [
        "predict",
        str(photos),
        "--whole",
        "--checkpoint",
        str(tmp_path / "out" / "last.ckpt"),
        "-o",
        str(tmp_path / "found"),
    ]
    done = CliRunner().invoke(main, [*arguments, "--pictures", "1"])
    assert done.exit_code == 1
    assert "2.jpg" in done.output
    assert (tmp_path / "found" / "report.html").exists()
    assert (tmp_path / "found" / "0" / "overlay.png").exists()
    stored = np.load(tmp_path / "found" / "1" / "1.npz")
    # The stored body, seen by the stored camera, lies in the image where the regressor's own camera put it.
    trained = TrainedModel.load(tmp_path / "out" / "last.ckpt")
    body = trained.posing.body.body
    pose = np.concatenate([stored["global_orient"], stored["body_pose"].reshape(23, 3)])
    joints = np.asarray(body(pose, stored["betas"][0], stored["transl"][0]).joints)
    inside = joints @ stored["camera_rotation"][0].T + stored["camera_translation"][0]
    pixels = stored["focal"][0] * inside[:, :2] / inside[:, 2:] + stored["center"][0]
    with torch.no_grad():
        estimate = trained.model(crop(Image.fromarray(data.image(1)), (0, 0, 64, 64), Augmentation(), 64)[None])
        posed = trained.posing(estimate)
        own = project(posed.joints, estimate.camera)[0].numpy() * 0.5 * 1.2 * 64 + 32
    # Perspectives differ in depth by the body's own: by a few pixels at its ends, none at its middle.
    assert np.abs(pixels - own).max() < 8
    assert np.linalg.norm((pixels - own)[0]) < 1

    # Who holds no MediaPipe hears it once, not for each image.
    monkeypatch.setitem(sys.modules, "mediapipe.python.solutions", None)
    done = CliRunner().invoke(main, [argument for argument in arguments if argument != "--whole"])
    assert done.exit_code == 1
    assert done.output.count("photos need MediaPipe") == 1
    assert "or give --box or --whole" in " ".join(done.output.split())


def test_box_of_predicting_is_told_once(tmp_path):
    options = ["--checkpoint", "x.ckpt", "--whole", "--box", "0", "0", "9", "9"]
    done = CliRunner().invoke(main, ["predict", "x.png", "-o", str(tmp_path), *options])
    assert done.exit_code == 2
    assert "--box or --whole, not both" in done.output


@pytest.mark.slow
def test_predicting_needs_a_checkpoint_of_images(whole, tmp_path):
    (tmp_path / "wrong.ckpt").write_bytes(b"nothing")
    torch.save({"model": {}}, tmp_path / "spin.pt")
    for path, said in (
        (tmp_path / "wrong.ckpt", "cannot be read as a checkpoint"),
        (tmp_path / "spin.pt", "expected a checkpoint of `ipman train`"),
        (whole / "last.ckpt", "sees keypoints, not images"),
    ):
        done = CliRunner().invoke(main, ["predict", "x.png", "--checkpoint", str(path), "-o", str(tmp_path / "out")])
        assert done.exit_code == 1
        assert said in done.output
        assert path.name in done.output
