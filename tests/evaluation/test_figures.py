"""The final figures against plain loops over the posed bodies, and against DuckDB over the frames' figures."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ipman_rs as ip
from ipman_rs.body.soles import sole_vertices
from ipman_rs.evaluation import paired, paired_test
from ipman_rs.evaluation.tables import Job, Source, frame_metrics, read
from ipman_rs.evaluation.tables.metrics import METRICS
from tests.helpers import evaluate_files as files


@pytest.fixture(scope="module")
def record(evaluated):
    return json.loads((evaluated[0] / "out" / "evaluation.json").read_text())


@pytest.fixture(scope="module")
def bodies(true, guessed):
    model = ip.load_body("anny-lite")
    return [model(each["pose"], each["betas"], each["transl"]) for each in (true, guessed)]


@pytest.mark.slow
def test_means_are_those_of_plain_loops(record, bodies):
    """Float32 bodies measured in float64: only the order of sums differs, so 1e-12."""
    truth, guess = bodies
    pelvis, joints, vertices, aligned = [], [], [], []
    for k in range(files.FRAMES):
        own, real = guess.joints[k].astype(float), truth.joints[k].astype(float)
        joints.append(np.mean([math.dist(a - own[0], b - real[0]) for a, b in zip(own, real, strict=True)]))
        mesh = zip(guess.vertices[k].astype(float), truth.vertices[k].astype(float), strict=True)
        vertices.append(np.mean([math.dist(a - own[0], b - real[0]) for a, b in mesh]))
        pelvis.append(np.mean(np.linalg.norm(own - real, axis=1)))
        here, there = own - own.mean(axis=0), real - real.mean(axis=0)
        turned = Rotation.align_vectors(there, here)[0].apply(here)
        scale = (turned * there).sum() / (turned**2).sum()
        aligned.append(np.linalg.norm(scale * turned - there, axis=1).mean())
    found = record["methods"]["guess"]["figures"]
    assert found["mpjpe"]["mean"] == pytest.approx(np.mean(joints), abs=1e-12)
    assert found["pve"]["mean"] == pytest.approx(np.mean(vertices), abs=1e-12)
    assert found["mpjpe_world"]["mean"] == pytest.approx(np.mean(pelvis), abs=1e-12)
    assert found["pa_mpjpe"]["mean"] == pytest.approx(np.mean(aligned), abs=1e-9)
    assert found["mpjpe"]["frames"] == files.FRAMES
    assert found["mpjpe"]["sequences"] == files.FRAMES // 10


def test_balance_and_ground_are_those_of_the_engine(record, bodies):
    model, floor = ip.load_body("anny-lite"), ip.Ground.y_up()
    vertices = bodies[1].vertices
    found = record["methods"]["guess"]["figures"]
    inside = ip.bose(vertices, model.template, floor)
    assert found["bose"]["mean"] == inside.mean()
    assert 0 < inside.mean() < 1
    lowest = vertices[..., 1].astype(float).min(axis=1)
    assert found["penetration"]["mean"] == pytest.approx(np.maximum(-lowest, 0).mean(), abs=1e-15)
    assert found["hover"]["mean"] == pytest.approx(np.maximum(lowest, 0).mean(), abs=1e-15)


def test_skating_knows_the_frame_before_a_piece(evaluated, bodies):
    """Against a loop over the whole recording, which knows no pieces."""
    _, job = evaluated
    soles = sole_vertices(ip.load_body("anny-lite").template, frame_metrics.SOLE)
    assert 20 < len(soles) < 200
    feet = bodies[1].vertices[:, soles].astype(float)
    found = np.concatenate([piece["skating"] for piece in job.results()])
    for k in range(files.FRAMES):
        both = (feet[k, :, 1] < 0.005) & (feet[k - 1, :, 1] < 0.005)
        if k % 10 == 0 or not both.any():
            assert np.isnan(found[k])
        else:
            step = np.hypot(*(feet[k] - feet[k - 1])[both][:, [0, 2]].T).mean()
            assert found[k] == pytest.approx(step, abs=1e-12)
    assert np.isfinite(found[:: files.PIECE]).sum() == 0  # here every piece begins with a sequence ...
    assert np.isfinite(found).any()


def test_pieces_within_a_sequence_do_not_change_skating(evaluated, tmp_path):
    folder, whole = evaluated
    job = files.job(tmp_path, folder / "guess.npz", folder / "truth.npz", piece=37)  # ... and here they do not
    files.finish([job])
    for name in ("skating", "mpjpe", "bose_strict"):
        first = np.concatenate([piece[name] for piece in whole.results()])
        second = np.concatenate([piece[name] for piece in job.results()])
        np.testing.assert_array_equal(first, second)


def test_duckdb_over_the_frames_gives_the_means(evaluated, record):
    duckdb = pytest.importorskip("duckdb")
    pytest.importorskip("pyarrow")
    frames = str(evaluated[0] / "out" / "frames.parquet")
    for name, told in record["methods"]["guess"]["figures"].items():
        query = f"select avg({name}), count({name}), stddev_samp({name}) from '{frames}'"
        mean, count, std = duckdb.sql(query).fetchall()[0]
        assert told["mean"] == pytest.approx(mean, rel=1e-12)
        assert told["frames"] == count
        assert told["std"] == pytest.approx(std, rel=1e-9)
    by_sequence = duckdb.sql(f"select sequence, 1000 * avg(pve) from '{frames}' group by sequence").fetchall()
    lines = (evaluated[0] / "out" / "sequences.csv").read_text().splitlines()
    written = {line.split(",")[1]: float(line.split(",")[4]) for line in lines if ",PVE,mm," in line}
    assert written == pytest.approx(dict(by_sequence), rel=1e-12)


@pytest.mark.slow
def test_two_methods_are_compared_frame_by_frame(evaluated, tmp_path, true):
    folder, _ = evaluated
    better = files.save(tmp_path / "better.npz", files.predictions(true, noise=0.05, seed=2))
    jobs = [files.job(tmp_path / "out", path, folder / "truth.npz") for path in (folder / "guess.npz", better)]
    found = files.finish(jobs)["differences"][0]
    assert (found["method"], found["baseline"]) == ("better", "guess")
    own, other = (np.concatenate([piece["pve"] for piece in job.results()]) for job in reversed(jobs))
    sequences = true["sequences"]
    expected = paired(own, other, sequences=sequences)
    assert found["figures"]["pve"]["mean"] == pytest.approx((own - other).mean(), abs=1e-15)
    assert found["figures"]["pve"]["interval"] == pytest.approx([expected.low, expected.high], abs=1e-12)
    assert found["figures"]["pve"]["p"] == pytest.approx(paired_test(own, other, sequences=sequences), abs=1e-12)
    assert found["figures"]["pve"]["interval"][1] < 0
    page = (tmp_path / "out" / "evaluation.md").read_text()
    assert "| better |" in page.split("## better − guess")[1]


def test_measured_centres_are_compared(tmp_path, true, guessed, bodies):
    """A data set that says where the centres are: 30 mm beside the predicted ones, and 20 mm higher."""
    model, floor = ip.load_body("anny-lite"), ip.Ground.y_up()
    vertices = bodies[1].vertices
    mass = ip.center_of_mass(vertices, model.template).astype(float) + [0.03, 0.0, 0.0]
    pressure = ip.center_of_pressure(vertices, model.template, floor, alpha=100, gamma=10).astype(float)
    measured = {"center_of_mass": mass, "center_of_pressure": pressure + [0.0, 0.02, 0.03]}
    measured["standing"], measured["contact"] = (np.arange(files.FRAMES) % n == 0 for n in (2, 3))
    job = files.job(
        tmp_path / "out",
        files.save(tmp_path / "guess.npz", guessed),
        files.save(tmp_path / "truth.npz", true | measured),
    )
    found = files.finish([job])["methods"]["guess"]["figures"]
    assert found["com_error"]["mean"] == pytest.approx(0.03, abs=1e-7)  # of float32 centres
    assert found["cop_error"]["mean"] == pytest.approx(0.03, abs=1e-7)
    exact = ip.center_of_mass(vertices, model.template, "exact")
    assert found["com_error_exact"]["mean"] == pytest.approx(np.linalg.norm(exact - mass, axis=1).mean(), abs=1e-7)
    support = ip.base_of_support(vertices, model.template, floor, contact="released")
    verdict = np.where(support.has_contact, support.inside.astype(float), -1.0)
    label = np.where(measured["contact"], measured["standing"].astype(float), -1.0)
    assert found["bose_released"]["mean"] == (verdict == label).mean()
    assert 0.1 < found["bose_released"]["mean"] < 0.9


def test_a_pressure_mat_is_compared(evaluated):
    """A mat that measured what the predicted bodies press: the overlap is complete, the centre is theirs."""
    from dataclasses import replace

    from ipman_rs.data import Frames, PressureMaps
    from ipman_rs.evaluation import pressure_map

    _, job = evaluated
    model, floor = ip.load_body("anny-lite"), ip.Ground.y_up()
    guess = job.estimates[slice(0, 6)]
    vertices = job.body_models.posed(guess).vertices
    samples = ip.sample_surface(vertices, model.template)
    mat = PressureMaps(
        np.zeros((6, 90, 90)), np.array([-1.0, 0, -1.0]), np.array([1.0, 0, 0]), np.array([0, 0, 1.0]), 0.025
    )
    pressed = pressure_map(samples, ip.pressure(vertices, model.template, floor, alpha=100, gamma=10), mat)
    centers = ip.center_of_pressure(vertices, model.template, floor, alpha=100, gamma=10)
    true = replace(job.data[slice(0, 6)], pressure=replace(mat, values=pressed), center_of_pressure=centers)
    assert isinstance(true, Frames)
    found = frame_metrics.pair_metrics(true, guess, job.setup)
    assert found["cop_error"] == pytest.approx(np.zeros(6), abs=1e-5)
    assert (found["pressure_iou"] > 0.9).all()
    assert (found["pressure_iou_chosen"] >= found["pressure_iou"] - 0.2).all()


def test_the_joints_of_the_literature_by_a_regressor(tmp_path, true, guessed, bodies):
    weights = np.random.default_rng(5).dirichlet(np.ones(1229) * 0.01, size=17)
    np.save(tmp_path / "regressor.npy", weights)
    job = files.job(
        tmp_path / "out",
        files.save(tmp_path / "guess.npz", guessed),
        files.save(tmp_path / "truth.npz", true),
        regressors=(str(tmp_path / "regressor.npy"),),
    )
    found = files.finish([job])["methods"]["guess"]["figures"]
    counted = [6, 5, 4, 1, 2, 3, 16, 15, 14, 11, 12, 13, 8, 10]  # SPIN's H36M_TO_J14
    errors = []
    for k in range(files.FRAMES):
        own, real = (weights @ body.vertices[k].astype(float) for body in reversed(bodies))
        errors.append(np.linalg.norm((own - own[0])[counted] - (real - real[0])[counted], axis=1).mean())
    assert found["mpjpe"]["mean"] == pytest.approx(np.mean(errors), abs=1e-12)


def test_joints_alone_and_other_orders_are_compared(tmp_path, true, bodies):
    """A method that gives joints only, of other names and in another order; frames, too, in any order."""
    names = list(ip.load_body("anny-lite").joint_names)
    order = np.random.default_rng(3).permutation(files.FRAMES)
    picked = [names.index(name) for name in ("left_knee", "pelvis", "right_wrist", "head")]
    arrays = {
        "names": true["names"][order],
        "joints": bodies[1].joints[order][:, picked],
        "joint_names": np.array(["left_knee", "pelvis", "right_wrist", "crown"]),
    }
    job = files.job(
        tmp_path / "out", files.save(tmp_path / "guess.npz", arrays), files.save(tmp_path / "truth.npz", true)
    )
    found = files.finish([job])["methods"]["guess"]["figures"]
    assert set(found) == {"mpjpe", "pa_mpjpe", "mpjpe_world"}
    own, real = (body.joints[:, picked[:3]].astype(float) for body in reversed(bodies))
    expected = np.linalg.norm((own - own[:, [1]]) - (real - real[:, [1]]), axis=-1).mean()
    assert found["mpjpe"]["mean"] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("form", ["compressed", "double", "flat", "parquet", "vertices"])
def test_other_forms_of_the_same_predictions(form, tmp_path, evaluated, guessed, bodies):
    folder, job = evaluated
    path, arrays = tmp_path / "guess.npz", dict(guessed)
    if form == "compressed":
        np.savez_compressed(path, **arrays)
    elif form == "flat":
        files.save(path, arrays | {"pose": arrays["pose"].reshape(files.FRAMES, -1)})
    elif form == "double":
        files.save(path, {key: np.float64(value) if value_is(value) else value for key, value in arrays.items()})
    elif form == "vertices":
        files.save(path, {"names": arrays["names"], "body": "anny-lite", "vertices": bodies[1].vertices})
    else:
        path = parquet_of(tmp_path / "guess.parquet", arrays)
    other = files.job(tmp_path / "out", path, folder / "truth.npz")
    files.finish([other])
    for first, second in zip(job.results(), other.results(), strict=True):
        for name in second.keys() & METRICS.keys():
            if form == "double":  # posed and measured in float64
                near = np.isclose(first[name], second[name], atol=2e-6, equal_nan=True)
                assert near.mean() > 0.97, name
            else:
                np.testing.assert_array_equal(first[name], second[name], err_msg=name)


def value_is(value):
    return isinstance(value, np.ndarray) and value.dtype.kind == "f"


def parquet_of(path, arrays):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    columns = {"names": arrays["names"], "body": [arrays["body"]] * len(arrays["names"])}
    columns |= {key: list(arrays[key].reshape(len(arrays["names"]), -1)) for key in ("pose", "betas", "transl")}
    parquet.write_table(pyarrow.table(columns), path, row_group_size=70)
    return path


def test_models_are_found_in_a_folder(tmp_path):
    """SMPL under the names that it is downloaded with; a missing one is named."""
    from ipman_rs.evaluation.tables.models import Models

    with pytest.raises(
        ValueError, match=r"smpl \(male\) needs its model file, SMPL_MALE.npz or .pkl: there is none under"
    ):
        Models(tmp_path).get("smpl", "male")
    with pytest.raises(ValueError, match="no folder is named by `models`"):
        Models().get("smplx")


def test_what_is_read_is_the_common_form(evaluated):
    folder, _ = evaluated
    found = read(folder / "truth.npz", folder)
    assert len(found) == files.FRAMES
    frames = found[np.array([5, 3, 250])]
    assert frames.names.tolist() == ["walk0/0005", "walk0/0003", "walk25/0000"]
    assert frames.pose.shape == (3, 24, 3)
    assert frames.ground.normal.tolist() == [0.0, 1.0, 0.0]
    assert isinstance(Job("a", "b", Source("own", "c"), "d"), Job)
