"""The page in a real browser: it draws, turns, plays, complains about nothing and asks nobody."""

from __future__ import annotations

import numpy as np
import pytest

import ipman_rs as ip
from ipman_rs import view
from tests.helpers import browser
from tests.helpers.cli_files import walk_parameters

PINK, GREEN, YELLOW = (255, 79, 163), (22, 179, 100), (224, 168, 0)


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    program = browser.find()
    if program is None:
        pytest.skip("no Chromium on this machine (Debian: apt install chromium-headless-shell)")
    page = browser.Browser(program, tmp_path_factory.mktemp("profile"))
    yield page
    page.close()


@pytest.fixture
def page(chromium):
    chromium.requests.clear()
    chromium.complaints.clear()
    return chromium


def count(pixels, color, tolerance=12):
    return int((np.abs(pixels.astype(int) - color).max(axis=-1) <= tolerance).sum())


def is_quiet(page):
    outside = [url for url in page.requests if not url.startswith(("file:", "data:", "about:"))]
    assert (outside, page.complaints) == ([], [])


@pytest.mark.slow
def test_the_guard_sees_what_it_guards_against(page, tmp_path):
    path = tmp_path / "loud.html"
    script = 'console.error("loud"); nothing.here()'
    path.write_text(f'<script src="http://outside.invalid/a.js"></script><script>{script}</script>')
    page.open(path)
    assert any("outside.invalid" in url for url in page.requests)
    assert any("loud" in text for text in page.complaints)
    assert any("ReferenceError" in text for text in page.complaints)


@pytest.mark.slow
def test_poses(page, tmp_path, lite_body):
    names = ("standing", "tree", "lean_past_toes")
    vertices = np.stack([ip.body.posed(lite_body, name) for name in names])
    study = view.study("poses", vertices, lite_body.template, ip.Ground(), labels=names)
    (tmp_path / "report.html").write_text(view.page([study]), encoding="utf-8")
    page.open(tmp_path / "report.html")
    first = page.pixels("#scene")
    # A body of pink, green, yellow and heat on a white page: thousands of colours, not one flat canvas.
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 1000
    assert first.std() > 10
    assert min(count(first, PINK), count(first, GREEN)) > 50  # dots of 9 and 7 pixels radius, soft at the edge
    assert count(first, YELLOW, 40) > 50
    page.drag((400, 400), (560, 430))
    turned = page.pixels("#scene")
    assert (np.abs(first.astype(int) - turned).max(axis=-1) > 30).mean() > 0.02
    page.run("document.querySelectorAll('#table tbody tr')[2].click()")
    page.settle()
    assert page.run("document.getElementById('label').textContent") == "lean_past_toes"
    assert "outside" in page.run("document.getElementById('badges').textContent")
    shown = page.run("document.getElementById('numbers').innerText").replace("\u2212", "-")
    assert f"{study.numbers['margin'][2] * 1000:.1f} mm" in shown
    page.run("document.querySelector('[name=skin][value=parts]').click(), document.getElementById('clear').click()")
    page.settle()
    assert (np.abs(page.pixels("#scene").astype(int) - turned).max(axis=-1) > 30).mean() > 0.02
    is_quiet(page)


@pytest.mark.slow
def test_a_sequence_has_curves_and_a_slider(page, tmp_path, run):
    np.savez(tmp_path / "walk.npz", **walk_parameters(60))
    assert run("analyze", tmp_path / "walk.npz", "--body", "anny-lite", "-o", tmp_path / "out").code == 0
    page.open(tmp_path / "out" / "report.html")
    assert page.run("document.querySelectorAll('#plots svg').length") == 8
    assert page.run("document.getElementById('slider').max") == "59"
    assert "48 of 60 frames" in page.run("document.getElementById('drawn').textContent")
    page.run("((s) => { s.value = 59; s.oninput({ target: s }); })(document.getElementById('slider'))")
    page.settle()
    assert page.run("document.getElementById('frame').textContent") == "2.95 s"
    curve = page.run("document.querySelector('#plots svg path[stroke]').getAttribute('d')")
    assert curve.count("L") == 59
    is_quiet(page)


def test_several_bodies_and_hostile_names(page, tmp_path, lite_body, standing):
    name = "</script><script>console.error('taken over')</script><img src=http://outside.invalid/x onerror=alert(1)>"
    studies = [
        view.study(name, standing, lite_body.template, ip.Ground(), source=name, notes=[name]),
        view.study("broken", standing * np.nan, lite_body.template, ip.Ground()),
    ]
    (tmp_path / "report.html").write_text(view.page(studies, [(name, name)]), encoding="utf-8")
    page.open(tmp_path / "report.html")
    assert page.run("document.getElementById('title').textContent") == name
    assert page.run("document.querySelectorAll('#bodies option').length") == 2
    page.run("((s) => { s.value = 1; s.onchange({ target: s }); })(document.getElementById('bodies'))")
    page.settle()
    assert page.run("document.getElementById('badges').textContent").startswith("not measurable")
    is_quiet(page)
