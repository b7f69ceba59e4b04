"""The documents say what the code says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import ipman_rs as ip

ROOT = Path(__file__).resolve().parents[1]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")])


def conventions() -> str:
    return (ROOT / "docs" / "conventions.md").read_text()


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


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links(document):
    links = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", document.read_text())
    assert [link for link in links if not (document.parent / link).exists()] == []


def test_guide_names_real_files():
    """Every path in the guide exists, but for the two files that its reader is to write."""
    guide = (ROOT / "docs" / "adding_a_loss.md").read_text()
    paths = re.findall(r"`((?:rust|python|tests)/[\w/.]+)`", guide)
    assert len(paths) > 8
    assert {path for path in paths if not (ROOT / path).exists()} == {"rust/core/src/losses/height.rs"}


def test_the_recipe_of_the_paper_is_the_file():
    recipe = (ROOT / "python/ipman_rs/training/recipes/ipman-r.yaml").read_text()
    assert f"```yaml\n# ipman-r.yaml\n{recipe}```" in (ROOT / "docs/training.md").read_text()
