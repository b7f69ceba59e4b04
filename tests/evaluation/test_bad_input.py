"""What is wrong with a file is said: which one, what was expected, what was found. Nothing that was done is lost."""

from __future__ import annotations

import csv
import os
import zipfile

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs.evaluation.tables import read
from ipman_rs.evaluation.tables.metrics import METRICS
from tests.helpers import evaluate_files as files


def refused(path, expected, tmp_path):
    with pytest.raises(ValueError, match=expected) as caught:
        read(path, tmp_path / "unpacked")
    assert str(path) in str(caught.value)


def test_missing_and_foreign_files(tmp_path):
    refused(tmp_path / "none.npz", "there is no such file", tmp_path)
    refused(tmp_path, "is a folder", tmp_path)
    (tmp_path / "a.pkl").write_bytes(b"cos\nsystem\n(S'touch /tmp/hacked'\ntR.")
    refused(tmp_path / "a.pkl", r"expected predictions in .npz or .parquet, got .pkl", tmp_path)
    (tmp_path / "a.parquet").write_bytes(b"PAR1 and no more")
    pytest.importorskip("pyarrow")
    refused(tmp_path / "a.parquet", "not a Parquet file that can be read", tmp_path)


@pytest.mark.parametrize("packed", [False, True])
def test_half_a_file(packed, tmp_path, guessed):
    path = tmp_path / "half.npz"
    (np.savez_compressed if packed else np.savez)(path, **guessed)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    refused(path, "not a .npz file", tmp_path)


@pytest.mark.parametrize("packed", [False, True])
def test_a_file_whose_arrays_are_cut(packed, tmp_path, guessed):
    """An archive that is whole, with an array in it that claims more than it carries."""
    path, cut = tmp_path / "a.npz", tmp_path / "cut.npz"
    np.savez(path, **guessed)
    kind = zipfile.ZIP_DEFLATED if packed else zipfile.ZIP_STORED
    with zipfile.ZipFile(path) as whole, zipfile.ZipFile(cut, "w", kind) as archive:
        for name in whole.namelist():
            content = whole.read(name)
            archive.writestr(name, content[:-1000] if name == "pose.npy" else content)
    refused(cut, r"array 'pose' cannot be read: claims shape \(300, 24, 3\)", tmp_path)


def test_pickled_names_are_not_loaded(tmp_path, guessed):
    class Trap:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "hacked"),)

    path = tmp_path / "trap.npz"
    np.savez(path, **guessed | {"names": np.array([Trap()] * 300, dtype=object)})
    refused(path, "array 'names' cannot be read: holds Python objects", tmp_path)
    assert not (tmp_path / "hacked").exists()


CHANGES = {
    "no names": (lambda a: a.pop("names"), "expected names, the name of each frame"),
    "no bodies": (
        lambda a: [a.pop(k) for k in ("pose", "transl")],
        "expected pose .* vertices or joints; it has betas",
    ),
    "no body": (lambda a: a.pop("body"), "pose without body: add body, one of smpl"),
    "lengths": (lambda a: a.update(transl=a["transl"][:-1]), r"transl: expected 300 rows, .* got shape \(299, 3\)"),
    "names length": (lambda a: a.update(names=a["names"][:10]), r"pose: expected 10 rows|betas: expected 10 rows"),
    "shape": (lambda a: a.update(pose=np.zeros((300, 24, 4))), r"pose: expected \(300, n, 3\) or \(300, 3 n\)"),
    "text": (lambda a: a.update(betas=np.full((300, 10), "x")), "betas: expected numbers, got <U1"),
    "numbers": (lambda a: a.update(names=np.arange(300)), "names: expected text, got int64"),
    "ground": (lambda a: a.update(ground=np.zeros((300, 3))), r"ground: expected \(300, 4\), got \(300, 3\)"),
    "millimetres": (lambda a: a.update(transl=1000 * a["transl"] + 900_000), "transl: looks like millimetres"),
    "degrees": (lambda a: a.update(pose=a["pose"] * 57.3), "pose: looks like degrees"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_arrays_that_do_not_fit(change, tmp_path, guessed):
    arrays = dict(guessed)
    CHANGES[change][0](arrays)
    refused(files.save(tmp_path / "bad.npz", arrays), CHANGES[change][1], tmp_path)


def test_vertices_in_millimetres(tmp_path, guessed):
    arrays = {"names": guessed["names"][:8], "vertices": 1000 * np.random.default_rng(0).random((8, 99, 3))}
    refused(
        files.save(tmp_path / "mm.npz", arrays),
        "vertices: looks like millimetres: a body spans .* (divide by 1000|`units='mm'` if so)",
        tmp_path,
    )


def job_of(tmp_path, true, arrays, **options):
    tmp_path.mkdir(exist_ok=True)
    guess = files.save(tmp_path / "guess.npz", arrays)
    return files.job(tmp_path / "out", guess, files.save(tmp_path / "truth.npz", true), **options)


def test_people_who_lie_along_another_axis(tmp_path):
    """z up for y up: a method that gives standing people in other axes than the data set's."""
    model = ip.load_body("anny-lite")
    names, pose = np.array([f"f{k}" for k in range(20)]), np.zeros((20, 24, 3))
    pose += 0.05 * np.random.default_rng(0).standard_normal(pose.shape)
    joints = model(pose).joints
    turned = np.stack([joints[..., 0], -joints[..., 2], joints[..., 1]], axis=-1)
    true = {"names": names, "joints": joints, "joint_names": model.joint_names}
    true["ground"] = np.array([0.0, 1.0, 0.0, joints[..., 1].min()])
    job = job_of(tmp_path, true, {"names": names, "joints": turned, "joint_names": model.joint_names})
    said = r"guess.npz: joints: looks like \+z up: .* is said to be \(0, 1, 0\); turn them, or give the file a ground"
    with pytest.raises(ValueError, match=said):
        job.begin()


def test_other_units_and_degrees_are_mended_or_forced(tmp_path, true, guessed):
    """The figures are those of the same predictions in metres and radians."""
    plain = job_of(tmp_path / "plain", true, guessed)
    other = dict(guessed, transl=1000 * guessed["transl"] + [9e5, 0, 0], pose=np.degrees(guessed["pose"]))
    moved = dict(guessed, transl=guessed["transl"] + [900, 0, 0])
    with pytest.raises(ValueError, match=r"pose: looks like degrees.* --degrees if so|transl: .* `units='mm'` if so"):
        job_of(tmp_path / "wrong", true, other).begin()
    mended = job_of(tmp_path / "mended", true, other, unit=0.001, degrees=True, force=True)
    np.testing.assert_allclose(mended.estimates[:5].pose, plain.estimates[:5].pose, atol=1e-6)  # float32
    np.testing.assert_allclose(mended.estimates[:5].transl, moved["transl"][:5], atol=1e-3)  # float32, 900 m away
    mended.begin()
    assert mended.flags[0].startswith("transl: looks like millimetres: 9")
    assert mended.manifest["unit"] == 0.001
    assert plain.flags == ()
    with pytest.raises(ValueError, match="another evaluation"):
        job_of(tmp_path / "mended", true, other, unit=0.001, degrees=False, force=True).begin()


def test_too_few_frames_and_foreign_names(tmp_path, true, guessed):
    few = {key: value if key == "body" else value[:-1] for key, value in guessed.items()}
    with pytest.raises(ValueError, match=r"has 299 frames, but the data set own has 300; `partial` leaves out"):
        job_of(tmp_path, true, few).begin()
    foreign = dict(guessed, names=np.char.add("other/", guessed["names"]))
    job = job_of(tmp_path, true, foreign)
    job.begin()
    with pytest.raises(
        ValueError, match=r"no prediction for 40 of the frames walk0/0000 .* such as .*walk0/0000"
    ) as said:
        job.measure(0)
    assert "the file's names are like 'other/walk0/0000'" in str(said.value)


def test_a_name_twice(tmp_path, true, guessed):
    names = guessed["names"].copy()
    names[7] = names[3]
    job = job_of(tmp_path, true, dict(guessed, names=names))
    said = "names: 1 frames stand there more than once|1 frames share a name"  # in the sample that is looked at first
    with pytest.raises(ValueError, match=f"({said}), such as .*walk0/0003"):
        job.measure(0)


@pytest.mark.slow
def test_partial_leaves_out_what_is_not_predicted(tmp_path, true, guessed):
    some = np.flatnonzero(np.arange(300) % 7 > 0)[20:]  # none of the first frames of all
    arrays = {key: value if key == "body" else value[some] for key, value in guessed.items()}
    job = job_of(tmp_path, true, arrays, partial=True, piece=10)  # so the first pieces have none at all
    found = files.finish([job])
    assert found["methods"]["guess"]["frames"] == len(some)
    names = np.concatenate([piece["names"] for piece in job.results()])
    assert names.tolist() == true["names"][some].tolist()
    assert found["methods"]["guess"]["figures"]["mpjpe"]["frames"] == len(some)


@pytest.mark.slow
def test_a_frame_of_nan_touches_no_other(evaluated, tmp_path, true, guessed):
    pose = guessed["pose"].copy()
    pose[[5, 123]] = np.nan
    pose[200, 3, 1] = np.inf
    job = job_of(tmp_path, true, dict(guessed, pose=pose))
    found = files.finish([job])["methods"]["guess"]["figures"]
    assert found["pve"]["missing"] == {"prediction not finite": 3}
    assert found["bose"]["frames"] == 297
    bad = [5, 123, 200]
    good = np.setdiff1d(np.arange(300), bad)
    for name in METRICS:
        pieces = [
            np.concatenate([p[name] for p in each.results()]) for each in (evaluated[1], job) if name in each.result(0)
        ]
        if pieces and name != "skating":  # which looks at the frame before
            np.testing.assert_array_equal(pieces[0][good], pieces[1][good])
            assert np.isnan(pieces[1][bad]).all()


def test_a_truth_of_nan_is_said(tmp_path, true, guessed):
    transl = true["transl"].copy()
    transl[:30] = np.nan
    found = files.finish([job_of(tmp_path, dict(true, transl=transl), guessed)])["methods"]["guess"]["figures"]
    assert found["pve"]["missing"] == {"truth not finite": 30}
    assert found["bose"]["frames"] == 300


def test_an_empty_file(tmp_path, guessed):
    arrays = {key: value if key == "body" else value[:0] for key, value in guessed.items()}
    refused(files.save(tmp_path / "empty.npz", arrays), "no frame at all", tmp_path)


def test_the_wrong_body(tmp_path, true, guessed):
    job = job_of(tmp_path, true, dict(guessed, body="smplx", pose=np.zeros((300, 55, 3))))
    with pytest.raises(ValueError, match=r"smplx \(neutral\) needs its model file, SMPLX_NEUTRAL.npz"):
        job.begin()
    job = job_of(tmp_path, true, dict(guessed, body="anny", pose=np.zeros((300, 55, 3))))
    with pytest.raises(ValueError, match="pose: has 55 joints, but the body anny has 24"):
        job.begin()


def test_parquet_rows_that_do_not_fit(tmp_path, guessed):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    names, body = guessed["names"].tolist(), [guessed["body"]] * 300

    def bad(pose, **more):
        path = tmp_path / "bad.parquet"
        parquet.write_table(pyarrow.table({"names": names, "body": body, "pose": pose} | more), path)
        return path

    flat = list(guessed["pose"].reshape(300, -1))
    refused(bad([*flat[:-1], flat[0][:-3]]), "pose: rows of different lengths", tmp_path)
    refused(bad([*flat[:-1], None]), r"pose: a row is missing \(null\)", tmp_path)
    body[8] = "anny"
    refused(bad(flat), "body: expected one for all frames", tmp_path)


def test_names_that_a_spreadsheet_would_run(tmp_path):
    """Names of sequences and files become text in CSV, and numbers stay numbers."""
    true = files.truth(frames=40)
    names = np.array(['=HYPERLINK("http://x")', "+1", "-1", "@SUM(A1)"])[np.arange(40) // 10]
    guessed = files.predictions(true)
    saved = files.save(tmp_path / "=cmd.npz", guessed)
    job = files.job(tmp_path / "out", saved, files.save(tmp_path / "true.npz", dict(true, sequences=names)))
    files.finish([job])
    with (tmp_path / "out" / "sequences.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert {row["sequence"] for row in rows} == {f"'{name}" for name in names.tolist()}
    assert {row["method"] for row in rows} == {"'=cmd"}
    assert all(np.isfinite(float(row["mean"])) and int(row["frames"]) in range(1, 11) for row in rows)


@pytest.mark.parametrize(("turn", "said"), [(np.pi, "180 degrees"), (np.pi / 2, "90 degrees")])
def test_people_turned_against_a_truth_without_ground(tmp_path, turn, said):
    """Upside down or on their backs: PA-MPJPE is 0 all the same, and nothing says where up is."""
    draw = np.random.default_rng(0)
    true = {"names": np.array([f"f{k}" for k in range(12)]), "body": "anny-lite", "betas": np.zeros((12, 10))}
    true |= {"pose": 0.05 * draw.standard_normal((12, 24, 3)), "transl": np.zeros((12, 3))}
    true["pose"][:, 0] = 0.0
    guess = dict(true, pose=true["pose"].copy())
    guess["pose"][:, 0] = [turn, 0.0, 0.0]
    (flag,) = job_of(tmp_path, true, guess).flags
    found = f"predicted people are the true ones turned by {said} in the median, about (1, 0, 0)"
    assert flag == f"{found}; turn them back if their axes are other ones than the data set's"
    guess["pose"][:, 0] = [0.7, 0.0, 0.0]
    assert job_of(tmp_path / "less", true, guess).flags == ()


@pytest.mark.parametrize("kind", ["npz", "parquet"])
def test_what_no_figure_is_made_of_is_named(tmp_path, guessed, kind):
    few = {name: value[:12] if np.ndim(value) else value for name, value in guessed.items()}
    more = few | {"expression": np.zeros((12, 5)), "foo": np.arange(12)}
    if kind == "parquet":
        pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
        columns = {name: np.reshape(value, (12, -1)).tolist() for name, value in more.items() if name != "body"}
        columns |= {"names": more["names"].tolist(), "body": ["anny-lite"] * 12, "foo": list(range(12))}
        path = tmp_path / "guess.parquet"
        parquet.write_table(pyarrow.table(columns), path)
    else:
        path = files.save(tmp_path / "guess.npz", more)
    truth = files.save(tmp_path / "truth.npz", few | {"weights": np.ones(12)})
    job = files.job(tmp_path / "out", path, truth)
    assert job.flags == ("not used: expression, foo", f"the truth, {truth}: not used: weights")


def test_of_two_forms_of_a_body_one_is_compared(tmp_path, guessed):
    few = {name: value[:12] if np.ndim(value) else value for name, value in guessed.items()}
    posed = ip.load_body("anny-lite")(few["pose"], few["betas"], few["transl"]).vertices
    job = job_of(tmp_path, few, few | {"vertices": posed})
    assert job.flags == (
        "vertices are compared, not the bodies of pose, betas, transl beside them; leave one of the two out",
    )
