"""The blocks "From Python" of the pages in docs/use/: what a command does, in five lines, run on small data."""

from __future__ import annotations

import importlib.util
import json
import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

import ipman_rs as ip
from tests.helpers import evaluate_files, laboratory_files
from tests.helpers.miniatures import human36m

PAGES = Path(__file__).resolve().parents[1] / "docs" / "use"
BLOCKS = {  # command -> page, and which of its blocks
    "analyze": ("analysis", 0),
    "demo": ("analysis", 1),
    "evaluate": ("evaluation", 0),
    "figure": ("figures", 0),
    "simulate": ("simulation", 0),
    "data render": ("rendered", 0),
    "data check": ("data", 0),
    "validate": ("data", 1),
    "fit": ("fitting", 0),
    "train": ("training", 0),
    "predict": ("training", 1),
    "benchmark": ("training", 2),
}


def block(command: str) -> str:
    page, number = BLOCKS[command]
    section = (PAGES / f"{page}.md").read_text().split("## From Python\n")[1].split("\n## ")[0]
    return re.findall(r"```python\n(.*?)```", section, re.DOTALL)[number]


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """`run(command, {text: in its place})` in a folder of its own; what it prints."""
    monkeypatch.chdir(tmp_path)

    def call(command: str, smaller: dict[str, str] | None = None) -> str:
        source = block(command)
        for text, instead in (smaller or {}).items():
            assert source.count(text) == 1, f"{command}: {text} is not there once"
            source = source.replace(text, instead)
        exec(compile(source, f"{command} in Python", "exec"), {"__name__": "block"})
        return capsys.readouterr().out

    return call


@pytest.mark.parametrize("command", BLOCKS)
def test_five_lines(command):
    assert len([line for line in block(command).splitlines() if line.strip()]) <= 5


@pytest.fixture(scope="module")
def lite():
    return ip.load_body("anny-lite")


def save(path: str, vertices: np.ndarray, faces: np.ndarray) -> None:
    trimesh.Trimesh(vertices, faces, process=False).export(path)


@pytest.mark.slow
def test_analyze(run, lite, tmp_path):
    """A z-up scan of the warrior, who stands."""
    vertices = ip.body.posed(lite, "warrior")
    save("scan.ply", vertices[:, [2, 0, 1]], lite.faces)
    margin = ip.support_margin(vertices, lite.template, ip.Ground.under(vertices))
    assert f"[{float(margin):.3f}"[:5] in run("analyze")
    assert (tmp_path / "out/report.html").is_file()


@pytest.mark.slow
def test_demo(run, tmp_path):
    run("demo", {'"anny"': '"anny-lite"'})
    record = json.loads((tmp_path / "out/demo/report.json").read_text())
    assert [frame["label"] for frame in record["bodies"][0]["frames"]] == list(ip.body.poses.NAMES)


@pytest.mark.slow
def test_evaluate(run, tmp_path):
    """The printed mean is that of the report."""
    true = evaluate_files.truth(30)
    evaluate_files.save(tmp_path / "true.npz", true)
    evaluate_files.save(tmp_path / "estimated.npz", evaluate_files.predictions(true))
    said = run("evaluate")
    record = json.loads((tmp_path / "out/evaluation.json").read_text())
    mean = record["methods"]["estimated"]["figures"]["mpjpe"]["mean"]
    assert 0.01 < mean < 0.3
    assert f"mean={mean}" in re.sub(r"np\.float64\(([^)]*)\)", r"\1", said)


@pytest.mark.slow
def test_figure(run, tmp_path):
    said = run("figure", {"210": "7"})
    assert "7 bodies, median" in said
    assert (tmp_path / "out/stability.png").is_file()


@pytest.mark.slow
def test_simulate(run, lite, tmp_path):
    """The plank stands on hands and feet."""
    save("body.obj", ip.body.posed(lite, "plank"), lite.faces)
    assert run("simulate").startswith("[array([ True])] []")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"simulation.json", "simulation.npz", "fall.png"}


def test_data_check(run, tmp_path):
    (tmp_path / "annotations").mkdir()
    human36m.write(tmp_path / "annotations", S=None)
    said = run("data check")
    assert said.startswith("False")
    assert "h36m_train_world.npz: not in the folder" in said


@pytest.mark.slow
def test_validate(run, tmp_path):
    """A person who stands still on plates that measure 64 kg."""
    pytest.importorskip("torch", reason="torch is an extra")
    person = laboratory_files.person()
    folder = tmp_path / "gait2354"
    folder.mkdir()
    _, shift = laboratory_files.moved(0.0)
    laboratory_files.trc(folder / "static.trc", person, shift, 1000.0, "mm")
    center = (person.com + laboratory_files.OFF) * [1, 0, 1]
    weight = laboratory_files.MASS * laboratory_files.G
    laboratory_files.mot(folder / "static_grf.mot", center, lambda t: weight + 0 * t)
    assert run("validate").strip() == str(tmp_path / "out/validation.md")
    (record,) = json.loads((tmp_path / "out/validation.json").read_text())["recordings"]
    assert record["mass"]["plates"] == pytest.approx(laboratory_files.MASS, abs=0.2)  # the second plate's 1.5 N


@pytest.mark.slow
def test_render_train_and_predict(run, tmp_path):
    for module in ("lightning", "embreex", "timm"):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"{module} is not installed")
    run("data render", {"seed=1": "seed=1, size=64", '4000, "val": 400, "test": 400': '7, "val": 2, "test": 0'})
    (tmp_path / "hmr.yaml").write_text(
        "data: [{name: rendered, path: out/images, options: {split: train}}]\n"
        "model: {backbone: small, size: 64}\nsteps: 2\nbatch: 4\naccelerator: cpu\n"
    )
    assert run("train").strip() == "out/hmr/last.ckpt"

    from PIL import Image

    import ipman_rs.data

    Image.fromarray(ipman_rs.data.open("rendered", "out/images", split="val").image(0)).save("photo.png")
    run("predict")
    record = json.loads((tmp_path / "out/found/report.json").read_text())
    assert [body["name"] for body in record["bodies"]] == ["photo"]
    assert np.load(tmp_path / "out/found/photo/photo.npz")["transl"].shape == (1, 3)


@pytest.mark.slow
def test_benchmark(run, tmp_path):
    pytest.importorskip("torch", reason="torch is an extra")
    smaller = {"people=3500, bodies=2100": "people=7, bodies=2", ")), tilts=[0.0, 8.0]": "), 1, 0.001), tilts=[0.0]"}
    assert run("benchmark", smaller).strip() == "out/training_benchmark.md"
    record = json.loads((tmp_path / "out/training_benchmark.json").read_text())
    assert [each["tilt"] for each in record["blocks"]] == [0]


@pytest.mark.slow
def test_fit(run, tmp_path):
    pytest.importorskip("torch", reason="torch is an extra")
    example = Path(ip.__file__).parent / "fitting/examples/basketball.json"
    shorter = {"python/ipman_rs/fitting/examples/basketball.json": str(example), '="fast"': '="fast", iterations=2'}
    assert run("fit", shorter).strip().endswith("[]")
    record = json.loads((tmp_path / "out/fits/report.json").read_text())
    assert len(record["bodies"]) == 1
