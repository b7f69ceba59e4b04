"""Pages of docs/extending, carried out in a copy: what they add works, and takes as many files as they say."""

from __future__ import annotations

import json
import re

import pytest

from tests.helpers.extending import ROOT, Page, ipman, run

PAGES = ("a_body_model.md", "a_keypoint_format.md", "a_data_set.md")


@pytest.mark.parametrize("name", PAGES)
def test_as_many_files_as_the_page_says(name):
    page = Page.read(name)
    assert (len(page.files), len(page.edits)) == page.claim
    assert page.claim <= {"a_data_set.md": (3, 2), "a_body_model.md": (1, 3), "a_keypoint_format.md": (1, 2)}[name]
    assert [path for path in page.files if (ROOT / path).exists()] == []
    assert [path for path in page.edits if not (ROOT / path).is_file()] == []


@pytest.mark.slow
def test_a_body_model(tmp_path):
    page = Page.read("a_body_model.md")
    copy = page.carry_out(tmp_path)
    run(copy, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/body/test_formats.py", "-k", "mannequin")
    (_, script), (_, command) = page.tries
    margin = float(run(copy, "-c", script))
    # m: the centre of mass of a person who stands lies over the middle of the feet.
    assert 0.03 < margin < 0.1
    ipman(copy, f"{command.strip()} -o out")
    report = json.loads((copy / "out" / "report.json").read_text())
    (body,) = report["bodies"]
    assert len(body["frames"]) == 2
    assert body["frames"][0]["margin"] == pytest.approx(margin, abs=1e-5)  # poses of files are float32


@pytest.mark.slow
def test_a_keypoint_format(tmp_path):
    pytest.importorskip("torch")
    from ipman_rs.data import keypoints

    page = Page.read("a_keypoint_format.md")
    copy = page.carry_out(tmp_path)
    run(copy, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/data/test_keypoints.py", "-k", "deeplabcut")
    # The points of a photo, as DeepLabCut would write them.
    seen = keypoints.read(ROOT / "python/ipman_rs/fitting/examples/basketball.json")
    columns = [[name] * 3 for name in seen.names]
    numbers = [f"{number:.3f}" for point in zip(*seen.points[0].T, seen.confidence[0], strict=True) for number in point]
    rows = [
        ["scorer", *["network"] * len(numbers)],
        ["bodyparts", *sum(columns, [])],
        ["coords", *["x", "y", "likelihood"] * len(columns)],
        ["0", *numbers],
    ]
    (copy / "walk.csv").write_text("".join(",".join(row) + "\n" for row in rows))
    ((_, command),) = page.tries
    size = "{:.0f}x{:.0f}".format(*seen.image_size[0])
    ipman(copy, f"{re.sub('[0-9]+x[0-9]+', size, command.strip())} --pictures 0")
    (body,) = json.loads((copy / "out" / "report.json").read_text())["bodies"]
    assert body["name"] == "walk"
    assert body["fit"]["reprojection"]["median_percent"] < 2.0  # of the image's diagonal: the fit explains the points


@pytest.mark.slow
def test_a_data_set(tmp_path):
    page = Page.read("a_data_set.md")
    copy = page.carry_out(tmp_path)
    run(copy, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/data/test_aist.py")
    dance = "aist.dance(pathlib.Path('motions/gBR_d04.pkl'))"
    run(copy, "-c", f"import pathlib; from tests.helpers.miniatures import aist; {dance}")
    (_, commands), (_, script) = page.tries
    listed, layout, checked = (ipman(copy, line) for line in commands.splitlines())
    assert "aist" in listed.split()
    assert "smpl_scaling" in layout
    assert "1 dances" in checked
    assert run(copy, "-c", script).startswith("(30, 24, 3)")
