"""`ipman fit` on marker files that do not say what they are: refused in one line, and mended by the option it names."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

torch = pytest.importorskip("torch", reason="torch is an extra")

import ipman_rs.torch as ipt  # noqa: E402
from ipman_rs.body.poses import pose_of  # noqa: E402
from ipman_rs.cli import main  # noqa: E402
from ipman_rs.data.markers import sites  # noqa: E402
from ipman_rs.fitting.landmarks import Landmarks  # noqa: E402

NAMES = (
    *(f"{side}{name}" for side in "LR" for name in ["ASI", "PSI", "KNE", "ANK", "HEE", "TOE", "SHO", "ELB", "WRA"]),
    "C7", "CLAV", "LFHD", "RFHD",
)  # fmt: skip
RATE = 50.0


@pytest.fixture(scope="module")
def points():
    """Markers (3, M, 3) m of the mean body that stands on y = 0 and sways by a millimetre a frame."""
    body = ipt.BodyModel("anny-lite", torch.float64)
    pose = torch.as_tensor(pose_of(body.body, "standing"), dtype=torch.float64).expand(3, -1, -1)
    lowest = float(body.body(pose[0].numpy()).vertices[:, 1].min())
    transl = torch.tensor([[0.001 * frame, -lowest, 0] for frame in range(3)], dtype=torch.float64)
    with torch.no_grad():
        return Landmarks(body, NAMES, sites(body.body, NAMES))(pose, None, transl).numpy()


def write(path, points, names=NAMES, units="m"):
    head = ["PathFileType\t4\t(X/Y/Z)\tx.trc", "DataRate\tNumFrames\tNumMarkers\tUnits"]
    head += [f"{RATE}\t{len(points)}\t{len(names)}\t{units}", "Frame#\tTime\t" + "\t\t\t".join(names)]
    head += ["\t\t" + "\t".join(f"{axis}{n}" for n in range(1, len(names) + 1) for axis in "XYZ"), ""]
    rows = [
        "\t".join([str(number + 1), f"{number / RATE:.3f}", *(f"{value:.6f}" for value in frame.ravel())])
        for number, frame in enumerate(points)
    ]
    path.write_text("\n".join([*head, *rows, ""]))
    return path


def fit(*arguments):
    result = CliRunner().invoke(main, ["fit", *map(str, arguments), "--pictures", "0", "--iterations", "10"])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def record(folder, name):
    return json.loads((folder / name / "fit.json").read_text())


@pytest.mark.slow
def test_a_file_that_says_nothing_rightly(points, tmp_path):
    """z up, in millimetres though it says metres, with a laboratory's own names: refused three times, then fitted."""
    plain = write(tmp_path / "plain.trc", points)
    assert fit(plain, "-o", tmp_path / "out").exit_code == 0
    own = [f"M{number}" for number in range(len(NAMES))]
    turned = points @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]) * 1000  # (x, y, z) -> (x, -z, y)
    other = write(tmp_path / "other.trc", turned, own)
    (tmp_path / "names.json").write_text(json.dumps({**dict(zip(own, NAMES, strict=True)), "M999": "LASI"}))
    options = []
    for option, value in (("--markers", tmp_path / "names.json"), ("--units", "mm"), ("--up", "z")):
        said = fit(other, "-o", tmp_path / "out", *options)
        assert said.exit_code == 1
        assert len(said.stderr.strip().splitlines()) == 1
        assert option in said.stderr
        assert not (tmp_path / "out" / "other").exists()
        options += [option, value]
    said = fit(other, "-o", tmp_path / "out", *options)
    assert said.exit_code == 0, said.stderr
    with np.load(tmp_path / "out/plain/plain.npz") as one, np.load(tmp_path / "out/other/other.npz") as two:
        for name in ("transl", "global_orient", "betas"):
            np.testing.assert_allclose(two[name], one[name], atol=2e-3)  # files are rounded to a micrometre
        assert two["mocap_frame_rate"] == pytest.approx(RATE)
    found = record(tmp_path / "out", "other")
    assert found["mean_marker_error_m"] < 0.003
    assert found["unknown"] == []
    assert "up: (0, 0, 1) of the file's axes, turned to y: the bodies are y up" in found["notes"]
    assert f"no marker is called M999, as {tmp_path / 'names.json'} has it (`markers`)" in found["notes"]
    assert set(found["skin_distances_m"]) == set(own)
    assert 0.005 < np.median(list(found["skin_distances_m"].values())) < 0.015  # they were put 10 mm off the skin


@pytest.mark.slow
def test_markers_that_do_not_say_all(points, tmp_path):
    """Legs and pelvis alone, one marker that was never seen and one that nobody knows: told on the screen and kept."""
    legs = [name for name in NAMES if name[1:] in ("ASI", "PSI", "KNE", "ANK", "HEE", "TOE")]
    columns = [NAMES.index(name) for name in legs]
    some = np.concatenate([points[:, columns], np.zeros((3, 1, 3)), points[:, :1] + 0.3], axis=1)
    path = write(tmp_path / "legs.trc", some, [*legs, "C7", "Box.1"])
    said = fit(path, "-o", tmp_path / "out", "--rate", "100")
    assert said.exit_code == 0, said.stderr
    found = record(tmp_path / "out", "legs")
    assert found["unseen"] == ["C7"]
    assert found["unknown"] == ["Box.1"]
    above = "no marker above the pelvis was ever seen: trunk, arms, mass and centre of mass are the body's mean"
    assert above in found["flags"]
    assert (
        "1 of 13 markers have names without a known place: Box.1; `markers=FILE` says where they are" in found["flags"]
    )
    assert above in said.stderr
    assert "Box.1" in said.stderr
    (body,) = json.loads((tmp_path / "out/report.json").read_text())["bodies"]
    assert above in body["flags"]
    assert "1 markers of the file were never seen: C7" in body["notes"]
    with np.load(tmp_path / "out/legs/legs.npz") as stored:
        assert stored["mocap_frame_rate"] == pytest.approx(100)


@pytest.mark.slow
def test_what_is_no_person_is_fitted_by_force_only(points, tmp_path):
    """Markers that are nowhere near a body are no fit that converged."""
    scattered = np.random.default_rng(5).uniform(-0.9, 0.9, points.shape[1:])
    path = write(tmp_path / "chaos.trc", np.repeat(scattered[None], 3, axis=0))
    said = fit(path, "-o", tmp_path / "out", "--up", "y")
    assert said.exit_code == 1
    assert "left and right look swapped" in said.stderr
    assert not (tmp_path / "out" / "chaos").exists()
    said = fit(path, "-o", tmp_path / "out", "--up", "y", "--force")
    assert said.exit_code == 0, said.stderr
    assert record(tmp_path / "out", "chaos")["converged"] is False


def test_options_of_marker_files(tmp_path):
    said = fit(tmp_path / "a.trc", "-o", tmp_path / "out", "--markers", tmp_path / "none.json")
    assert said.exit_code == 2
    assert "none.json: there is no such file" in said.stderr
    places = CliRunner().invoke(main, ["fit", "--marker-places"])
    assert places.exit_code == 0
    assert {"left_asis", "c7", "right_hip_centre", "left_thigh", "pelvis"} <= set(places.stdout.split())
