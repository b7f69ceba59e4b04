"""The paper's recipe from the command line on miniatures of all its data sets, then bodies for Human3.6M's images:
their hips, as SPIN's regressor makes them, stand where the data set has its own."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

import ipman_rs as ip
from ipman_rs.body import joints
from ipman_rs.cli import main
from tests.helpers.miniatures import human36m, mpi_inf_3dhp, photos, rich_ipman, spin

pytest.importorskip("lightning", reason="lightning is not installed")

SMALL = [
    "body=data/SMPL_NEUTRAL.npz", 'model.spin=""', 'model.mean=""', "model.backbone=small", "model.size=64", "steps=3",
    "batch=16", "workers=0", "accelerator=cpu",
]  # fmt: skip


def write_images(folder, file):
    with np.load(file) as stored:
        for name in stored["imgname"]:
            place = folder / str(name)
            place.parent.mkdir(parents=True, exist_ok=True)
            Image.fromarray(np.full((40, 60, 3), 120, np.uint8)).save(place)


def relative(name, count, old):
    """Names of images in the folder of the data set."""
    return {"imgname": np.array([f"images/{old.format(row=row)}" for row in range(count)])}


@pytest.fixture
def data(tmp_path, monkeypatch):
    """The folder `data`, with a body of SMPL's form (the light embedded one) and a regressor for its mesh."""
    monkeypatch.chdir(tmp_path)
    root = tmp_path / "data"
    for name in ("human36m", "coco", "mpii", "lspet", "lsp", "mpi_inf_3dhp", "rich"):
        (root / name).mkdir(parents=True)
    h36m = relative("human36m", 6, "S9/Directions_1.60457274/{row:06d}.jpg")
    rich = relative("rich", 6, "Seq_Yoga/data/{row:05d}/00/images_orig_720p/{row:05d}_01.png")
    written = [
        ("human36m", human36m.write(root / "human36m", "h36m_train_world.npz", 6, **h36m)),
        ("human36m", human36m.write(root / "human36m", count=6, with_smpl=False, **h36m)),
        ("coco", photos.write(root / "coco", "coco_2014_train.npz")),
        ("mpii", photos.write(root / "mpii", "mpii_train.npz")),
        ("lspet", photos.write(root / "lspet", "hr-lspet_train.npz")),
        ("lsp", photos.write(root / "lsp", "lsp_dataset_original_train.npz")),
        ("mpi_inf_3dhp", mpi_inf_3dhp.write(root / "mpi_inf_3dhp")),
        ("rich", rich_ipman.write(root / "rich", "rich_world_val_new.npz", 6, (1,), **rich)),
    ]
    for name, (file, _) in written:
        write_images(root / name, file)
    body = ip.load_body("anny-lite")
    rest = body()
    near = np.array([np.argsort(np.linalg.norm(rest.vertices - joint, axis=1))[:8] for joint in rest.joints])
    regressor = np.zeros((24, body.num_vertices))
    np.put_along_axis(regressor, near, 1 / 8, axis=1)
    np.savez(
        root / "SMPL_NEUTRAL.npz", v_template=rest.vertices, shapedirs=body.shapedirs, weights=body.weights,
        posedirs=np.zeros((body.num_vertices, 3, 207)), J_regressor=regressor, f=body.faces.astype(np.uint32),
        kintree_table=np.stack([joints.SMPL_PARENTS, np.arange(24)]).astype(np.uint32),
    )  # fmt: skip
    extra = regressor[[2, 1, 12, 15, 0, 9, 6, 15, 15]]
    extra[:2] = np.roll(extra[:2], 3, axis=1)  # hips of their own
    np.save(root / "J_regressor_extra.npy", extra)
    return root


@pytest.mark.slow
@pytest.mark.parametrize("recipe", ["ipman-r", "hmr-star"])
def test_training_and_predicting(data, tmp_path, recipe, recwarn):
    done = CliRunner().invoke(main, ["train", recipe, "-o", "out", *SMALL])
    assert done.exit_code == 0, done.output
    with (tmp_path / "out/curve.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == 3
    terms = ["keypoints_2d", "joints_3d", "pose", *(["stability", "pull"] if recipe == "ipman-r" else [])]
    for term in terms:
        assert any(float(line[term]) > 0 for line in lines)
    assert ("pull" in lines[0]) == (recipe == "ipman-r")
    seen = ["--data", "human36m", "--path", "data/human36m", "--split", "valid-p2", "--image-folder", "data/human36m"]
    done = CliRunner().invoke(main, ["predict", *seen, "--checkpoint", "out/last.ckpt", "-o", "found"])
    assert done.exit_code == 0, done.output
    assert not [warning for warning in recwarn if "bodies are put where" in str(warning.message)]
    found = np.load(tmp_path / "found/predictions.npz")
    vertices = ip.load_body(data / "SMPL_NEUTRAL.npz")(found["pose"], found["betas"], found["transl"]).vertices
    hips = np.load(data / "J_regressor_extra.npy")[:2].mean(axis=0) @ vertices
    with np.load(data / "human36m/h36m_valid_protocol2.npz") as truth:
        labelled = truth["S_world"][:, [spin.J24.index("left_hip"), spin.J24.index("right_hip")], :3].mean(axis=1)
    np.testing.assert_allclose(hips, labelled, atol=1e-6)  # labels are single precision


@pytest.mark.slow
def test_a_regressor_of_predict(data, tmp_path):
    """Another one takes precedence; none is of use without a data set."""
    done = CliRunner().invoke(main, ["train", "hmr-star", "-o", "out", *SMALL, "steps=1", 'model.regressor=""'])
    assert done.exit_code == 0, done.output
    told = ["--checkpoint", "out/last.ckpt", "-o", "found", "--regressor"]
    seen = ["--data", "human36m", "--path", "data/human36m", "--split", "valid-p2", "--image-folder", "data/human36m"]
    done = CliRunner().invoke(main, ["predict", *seen, *told, "data/J_regressor_extra.npy"])
    assert done.exit_code == 0, done.output
    done = CliRunner().invoke(main, ["predict", *seen, *told, "data/SMPL_NEUTRAL.npz"])
    assert done.exit_code == 1
    assert "SMPL_NEUTRAL.npz: " in done.output
    done = CliRunner().invoke(main, ["predict", "x.png", *told, "data/J_regressor_extra.npy"])
    assert done.exit_code == 2
    assert "--regressor: expected --data" in done.output
