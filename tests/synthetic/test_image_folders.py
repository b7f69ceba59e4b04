"""Folders of rendered images: the same bytes however they are made, resumed after a kill, read, damaged, refused."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tarfile
import time
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from torch.utils.data import DataLoader

import ipman_rs as ip
from ipman_rs import data
from ipman_rs.cli import main
from ipman_rs.data import rendered
from ipman_rs.data.rendered.torch_images import RenderedImages
from ipman_rs.synthetic.images import writer
from ipman_rs.synthetic.images.samples import RenderSettings

SETTINGS = RenderSettings(seed=2, size=32)
COUNTS = {"train": 9, "val": 2, "test": 1}


def command(folder, workers):
    options = "-n 9 --val 2 --test 1 --seed 2 --size 32 --shard-size 4"
    return ["data", "render", "-o", str(folder), *options.split(), "-j", str(workers)]


@pytest.fixture(scope="session")
def whole(tmp_path_factory):
    """A folder with shards of 4, 4, 1, 2 and 1 images, drawn in this process."""
    folder = tmp_path_factory.mktemp("rendered") / "images"
    assert writer.write(folder, SETTINGS, COUNTS, shard_size=4) == 12
    return folder


@pytest.fixture
def copy(whole, tmp_path):
    return Path(shutil.copytree(whole, tmp_path / "copy"))


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.slow
def test_any_number_of_workers_gives_the_same_bytes(whole, tmp_path):
    environment = {**os.environ, "OMP_NUM_THREADS": "3"}
    script = "from ipman_rs.cli import main; main()"
    subprocess.run([sys.executable, "-c", script, *command(tmp_path / "two", 2)], env=environment, check=True)
    assert contents(tmp_path / "two") == contents(whole)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="looks at /proc")
def test_goes_on_after_a_kill(whole, tmp_path):
    """SIGKILL once the first shard is there: its file is not touched again, workers end, the rest becomes the same."""
    folder = tmp_path / "killed"
    script = "from ipman_rs.cli import main; main()"
    process = subprocess.Popen([sys.executable, "-c", script, *command(folder, 2)], start_new_session=True)
    first = folder / "train-000000.tar"
    deadline = time.monotonic() + 240
    while not first.exists():
        assert time.monotonic() < deadline
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    while any_of_session(process.pid):
        assert time.monotonic() < deadline, "workers outlive the process that started them"
        time.sleep(0.05)
    before = first.stat()
    assert writer.write(folder, SETTINGS, COUNTS, shard_size=4) <= 8
    assert (first.stat().st_mtime_ns, first.stat().st_ino) == (before.st_mtime_ns, before.st_ino)
    assert contents(folder) == contents(whole)


def any_of_session(leader):
    """Whether a process of a session that `leader` began is alive and no zombie."""
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, session = stat.read_text().rpartition(")")[2].split()[:4]
        except (OSError, ValueError):
            continue
        if int(session) == leader and state != "Z":
            return True
    return False


@pytest.mark.slow
def test_goes_on_in_the_middle_of_a_shard(whole, tmp_path):
    def stop(done):
        if done == 6:
            raise KeyboardInterrupt

    folder = tmp_path / "stopped"
    with pytest.raises(KeyboardInterrupt):
        writer.write(folder, SETTINGS, COUNTS, 4, progress=stop)
    with pytest.raises(
        ValueError, match=r"train-000001.tar is missing, one of 4 of 5 shards; .* The same command again"
    ):
        rendered.open(folder)
    told = []
    assert writer.write(folder, SETTINGS, COUNTS, 4, progress=told.append) == 8
    assert told == list(range(4, 13))
    assert contents(folder) == contents(whole)
    assert writer.write(folder, SETTINGS, COUNTS, 4) == 0


def test_command(whole, tmp_path):
    done = CliRunner().invoke(main, command(tmp_path / "out", 1))
    assert done.exit_code == 0, done.output
    assert "9 train, 2 val, 1 test; 12 drawn now" in done.output
    assert contents(tmp_path / "out") == contents(whole)


def test_webdataset_reads_the_shards(whole):
    """The library whose layout it is."""
    import webdataset

    shards = sorted(str(path) for path in whole.glob("train-*.tar"))
    samples = list(webdataset.WebDataset(shards, shardshuffle=False).decode("rgb8"))
    assert [sample["__key__"] for sample in samples] == [f"train-{number:08d}" for number in range(9)]
    ours = rendered.open(whole, "train")
    for row, sample in enumerate(samples):
        assert (sample["jpg"] == ours.image(row)).all()
        assert sample["json"] == ours.labels(row).record
        for name, value in sample["npz"].items():
            np.testing.assert_array_equal(value, ours.labels(row).arrays[name])


def test_frames(whole):
    """The common form; its checks of units, axes, ground and cameras find nothing wrong."""
    assert [each for each in rendered.check(whole) if each.level != "ok"] == []
    frames = data.open("rendered", whole, split="train")[:]
    assert len(frames) == 9
    assert len(data.open("rendered", whole)) == 12
    assert frames.body == "anny-lite"
    posed = ip.load_body(frames.body)(frames.pose, frames.betas, frames.transl)
    np.testing.assert_allclose(posed.joints, frames.joints, atol=2e-6)  # float32 throughout
    assert (frames.ground.signed_height(posed.vertices).min(axis=1) > -2e-6).all()
    records = [rendered.open(whole, "train").labels(row).record for row in range(9)]
    assert frames.standing.tolist() == [record["static"] for record in records]
    assert frames.contact.tolist() == [record["kind"] != "jumping" for record in records]
    some = data.open("rendered", whole, split="train")[np.array([7, 2])]
    assert some.names.tolist() == ["train-00000007", "train-00000002"]
    np.testing.assert_array_equal(some.keypoints, frames.keypoints[[7, 2]])
    assert len(data.open("rendered", whole)[3:3]) == 0


def test_torch_images(whole):
    images = RenderedImages(whole, "train")
    batch = next(iter(DataLoader(images, batch_size=9, num_workers=0)))
    assert batch["image"].shape == (9, 3, 32, 32)
    assert (batch["image"][4].permute(1, 2, 0).numpy() == images.data.image(4)).all()
    assert batch["keypoints"].shape == (9, 52, 3)
    assert batch["static"].tolist() == images.data[:].standing.tolist()


def rewritten(path, change):
    """A shard whose files `change(name, content)` gives: another content, or None for none."""
    with tarfile.open(path) as archive:
        files = [(member.name, archive.extractfile(member).read()) for member in archive]
    with tarfile.open(path, "w", format=tarfile.USTAR_FORMAT) as archive:
        for name, content in files:
            content = change(name, content)
            if content is not None:
                writer.add_member(archive, name, content)


def with_nan(content):
    import io

    stored = dict(np.load(io.BytesIO(content)))
    stored["transl"][1] = np.nan
    stream = io.BytesIO()
    np.savez(stream, **stored)
    return stream.getvalue()


DAMAGES = {
    "train-00000001.jpg": (lambda content: content[:100], "image cannot be read"),
    "train-00000002.npz": (lambda content: None, "train-00000002.npz is not in train-000000.tar"),
    "train-00000004.npz": (with_nan, "transl: not finite"),
    "train-00000005.json": (lambda content: b"[1]", "json: expected static and kind"),
    "train-00000008.jpg": (lambda content: b"no image", "image cannot be read"),
}


def test_bad_samples_are_skipped_and_counted(copy, whole):
    def change(name, content):
        return DAMAGES[name][0](content) if name in DAMAGES else content

    for path in copy.glob("train-*.tar"):
        rewritten(path, change)
    images = RenderedImages(copy, "train")
    with pytest.warns(UserWarning, match="is skipped") as warned:
        batch = next(iter(DataLoader(images, batch_size=9)))
    good = [0, 3, 3, 3, 6, 6, 6, 7, 0]  # the next good one stands in
    assert batch["name"] == [f"train-{number:08d}" for number in good]
    assert images.data.bad.keys() == {name.partition(".")[0] for name in DAMAGES}
    for name, (_, why) in DAMAGES.items():
        assert why in images.data.bad[name.partition(".")[0]]
    assert len([each for each in warned if "is skipped" in str(each.message)]) == len(DAMAGES)
    untouched = rendered.open(whole, "train")
    for row in (0, 3, 6, 7):
        assert (images.data.image(row) == untouched.image(row)).all()

    with pytest.warns(UserWarning, match="is skipped"):
        frames = rendered.open(copy, "train")[:]
    assert np.isnan(frames.pose).all(axis=(1, 2)).nonzero()[0].tolist() == [2, 4, 5]  # bad images have good labels
    assert not (frames.standing | frames.contact)[[2, 4, 5]].any()
    np.testing.assert_array_equal(frames.pose[[0, 1, 3, 6, 7, 8]], untouched[:].pose[[0, 1, 3, 6, 7, 8]])

    with pytest.warns(UserWarning, match="is skipped"):
        findings = rendered.check(copy)
    assert sum(each.level == "wrong" for each in findings) == len(DAMAGES)


def test_cut_off_shard(copy):
    path = copy / "train-000001.tar"
    path.write_bytes(path.read_bytes()[:9000])
    found = rendered.open(copy, "train")
    with pytest.warns(UserWarning, match=r"is skipped|damaged after"):
        assert np.isnan(found[:].pose).any(axis=(1, 2)).tolist() == [False] * 4 + [False, True, True, True] + [False]


def test_nothing_left(copy):
    for path in copy.glob("val-*.tar"):
        rewritten(path, lambda name, content: b"")
    with pytest.warns(UserWarning, match="is skipped"), pytest.raises(ValueError, match="no sample can be read"):
        RenderedImages(copy, "val")[0]


def test_pickles_are_not_loaded(copy):
    import io

    stream = io.BytesIO()
    np.savez(stream, pose=np.array([{"a": 1}], dtype=object))
    rewritten(copy / "val-000000.tar", lambda name, content: stream.getvalue() if name.endswith("npz") else content)
    with pytest.warns(UserWarning, match="allow_pickle"), pytest.raises(rendered.BadSample):
        rendered.open(copy, "val").labels(0)


@pytest.mark.parametrize(
    ("prepare", "match"),
    [
        (lambda folder: folder.write_text("a file"), "expected a folder, got a file"),
        (
            lambda folder: (folder.mkdir(), (folder / "thesis.tex").touch()),
            "expected an empty folder .* got thesis.tex",
        ),
        (lambda folder: (folder.mkdir(), (folder / "index.json").write_text("{")), "index.json: is no JSON"),
    ],
    ids=["file", "others", "index"],
)
def test_folder_that_is_not_ours(prepare, match, tmp_path):
    folder = tmp_path / "there"
    prepare(folder)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(ValueError, match=match):
        writer.write(folder, SETTINGS, COUNTS, 4)
    done = CliRunner().invoke(main, command(folder, 1))
    assert done.exit_code == 1
    assert "ipman: error: " in done.output
    assert sorted(tmp_path.rglob("*")) == before


def test_folder_of_other_settings(whole):
    with pytest.raises(ValueError, match=r"holds other images \(settings: .*\"seed\": 2.* asked for .*\"seed\": 5"):
        writer.write(whole, RenderSettings(seed=5, size=32), COUNTS, 4)
    with pytest.raises(ValueError, match="holds other images"):
        writer.write(whole, SETTINGS, {**COUNTS, "train": 10}, 4)


def test_bad_requests(whole, tmp_path):
    with pytest.raises(ValueError, match="split: expected one of train, val, test, got 'dev'"):
        rendered.open(whole, "dev")
    with pytest.raises(ValueError, match=r"no index.json; expected a folder that `ipman data render` wrote"):
        rendered.open(tmp_path)
    writer.write(tmp_path / "one", SETTINGS, {"train": 1}, 4)
    with pytest.raises(ValueError, match="no images of the split val"):
        rendered.open(tmp_path / "one", "val")
    index = json.loads((tmp_path / "one" / "index.json").read_text())
    (tmp_path / "one" / "index.json").write_text(json.dumps({**index, "format": "another"}))
    with pytest.raises(ValueError, match="expected the format"):
        rendered.open(tmp_path / "one")


def test_without_embree(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "embreex", None)
    monkeypatch.setitem(sys.modules, "embreex.mesh_construction", None)
    done = CliRunner().invoke(main, command(tmp_path / "out", 1))
    assert done.exit_code == 1
    assert "pip install 'ipman_rs[render]'" in done.output


def test_worker_that_dies(tmp_path, monkeypatch):
    def die(*_):
        raise BrokenProcessPool("a child process terminated abruptly")

    monkeypatch.setattr(writer, "draw_files", die)
    done = CliRunner().invoke(main, command(tmp_path / "out", 1))
    assert done.exit_code == 1
    assert "a process ended too early" in done.output


def test_reading_labels_needs_neither_torch_nor_embree(whole):
    script = (
        "import sys; from ipman_rs import data; frames = data.open('rendered', sys.argv[1])[:];"
        "print(len(frames), {'torch', 'embreex', 'PIL'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", script, str(whole)], capture_output=True, text=True, check=True)
    assert done.stdout == "12 set()\n"
