"""Run the same commands with two trees of the package, and say which files differ.

    python tools/same_bits.py BEFORE AFTER              # folders with python/ipman_rs and its compiled module

The commands are those of tools/kill_tests.py, and `ipman demo` on all named poses. Inputs are made once, by this tree.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from kill_tests import COMMANDS, compared, run


def main() -> None:
    words = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    words.add_argument("before", type=Path)
    words.add_argument("after", type=Path)
    asked = words.parse_args()
    different = False
    for name in ("demo", *COMMANDS):
        with tempfile.TemporaryDirectory(prefix="same_bits") as scratch:
            folder = Path(scratch)
            arguments = ["demo", "-o", "OUT"] if name == "demo" else COMMANDS[name].prepare(folder)
            runs = []
            for tree in (asked.before, asked.after):
                shutil.rmtree(folder / "out", ignore_errors=True)
                os.environ["PYTHONPATH"] = str((tree / "python").resolve())
                runs.append(run(folder, arguments))
            what = compared(*runs)
            different |= bool(what)
            print(f"{name}: {what or f'the same {len(runs[0].files)} files'}", flush=True)
    sys.exit(different)


if __name__ == "__main__":
    main()
