"""The documents say what the code says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import ipman_rs as ip

ROOT = Path(__file__).resolve().parents[1]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])


def conventions() -> str:
    return (ROOT / "docs" / "understand" / "conventions.md").read_text()


def test_table_of_presets():
    presets = ip.presets.PRESETS.values()

    def row(title, cell):
        return f"| {title} | " + " | ".join(cell(preset) for preset in presets) + " |"

    def first_term(p):
        return f"balance (gamma {p.balance_gamma:g}, sigma {p.sigma:g})" if p.stability == "balance" else "stability"

    table = "\n".join(
        [
            row("", lambda p: f"`{p.name}`").replace("|  |", "| |"),
            "|---" * (len(presets) + 1) + "|",
            row("alpha, gamma (1/m)", lambda p: f"{p.alpha:g}, {p.gamma:g}"),
            row("epsilon of the CoP", lambda p: f"{p.epsilon:g}"),
            row("alpha1, alpha2 (m)", lambda p: f"{p.alpha1:g}, {p.alpha2:g}"),
            row("beta1, beta2 (m)", lambda p: f"{p.beta1:g}, {p.beta2:g}"),
            row("threshold (m), contact", lambda p: f"{p.threshold:g}, {p.contact}"),
            row("first term", first_term),
            row("weights: first, pull, push", lambda p: ", ".join(f"{weight:g}" for weight in p.weights.values())),
        ]
    )
    assert conventions().split("<!-- begin presets -->\n")[1].split("\n<!-- end presets -->")[0] == table


def test_table_of_statuses():
    stated = {name: int(bit) for bit, name in re.findall(r"^\| (\d+) \| `(\w+)` \|", conventions(), re.MULTILINE)}
    assert stated == {"OK": 0, **{flag.name: flag.value for flag in ip.Status}}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links(document):
    links = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", document.read_text())
    assert [link for link in links if not (document.parent / link).exists()] == []


def test_the_index_lists_every_page():
    index = ROOT / "docs" / "README.md"
    linked = [(index.parent / link).resolve() for link in re.findall(r"\]\(([^)#]+)", index.read_text())]
    assert {page for page in DOCUMENTS if page.is_relative_to(index.parent)} - {index} <= set(linked)


def test_guide_names_real_files():
    """Every path in the guide exists, but for the two files that its reader is to write."""
    guide = (ROOT / "docs" / "extending" / "adding_a_loss.md").read_text()
    paths = re.findall(r"`((?:rust|python|tests)/[\w/.]+)`", guide)
    assert len(paths) > 8
    assert {path for path in paths if not (ROOT / path).exists()} == {
        "rust/core/src/losses/height.rs",
        "python/ipman_rs/torch/reference/height.py",
    }


def paper() -> str:
    return (ROOT / "docs" / "understand" / "paper.md").read_text()


FILE = re.compile(r"`((?:rust|python|tests|docs|examples|tools|benchmarks)/[\w/.-]+)`")


def numbers_of(text: str) -> set[int]:
    """The equations that a text names: Eq. 1, (Eq. 1), Eqs. 4, 6 and 7, Eqs. 5 to 7."""
    named: set[int] = set()
    for found in re.findall(r"Eqs?\.\s+(\d+(?:(?:, | and | to )\d+)*)", text):
        if " to " in found:
            first, last = map(int, found.split(" to "))
            named |= set(range(first, last + 1))
        else:
            named |= set(map(int, re.findall(r"\d+", found)))
    return named


def test_paper_names_real_files():
    """Every path in docs/understand/paper.md is a file of this repository."""
    paths = FILE.findall(paper())
    assert len(set(paths)) > 60
    assert [path for path in paths if not (ROOT / path).is_file()] == []


def test_equations_stand_at_their_formulas():
    """Each file that the page names for an equation has its number; Eqs. 1 to 7 have the core, numpy, torch and the
    plain formula."""
    rows = {int(n): line for n, line in re.findall(r"^\| \((\d+)\) (\|.*`(?:rust|python)/.*)$", paper(), re.MULTILINE)}
    assert sorted(rows) == list(range(1, 11))
    for number, line in rows.items():
        paths = FILE.findall(line)
        assert len(paths) >= (4 if number <= 7 else 1), number
        assert [path for path in paths if number not in numbers_of((ROOT / path).read_text())] == [], number
        if number <= 7:
            for room in ("rust/core/src/", "python/ipman_rs/torch/", "python/ipman_rs/torch/reference/"):
                assert any(path.startswith(room) for path in paths), (number, room)


def test_symbols_name_their_equations():
    """The column of conventions.md: the symbol of each equation, by its own."""
    rows = dict(
        re.findall(r"^\| (m̄|ρ, α, γ|s̄|L_stability|L_ground|BoSE) \| ([\d =+]+) \|", conventions(), re.MULTILINE)
    )
    assert rows == {
        "m̄": "1", "ρ, α, γ": "2", "s̄": "3", "L_stability": "4", "L_ground": "5 = 6 + 7", "BoSE": "10",
    }  # fmt: skip


def test_the_recipe_of_the_paper_is_the_file():
    recipe = (ROOT / "python/ipman_rs/training/recipes/ipman-r.yaml").read_text()
    assert f"```yaml\n# ipman-r.yaml\n{recipe}```" in (ROOT / "docs/use/training.md").read_text()
