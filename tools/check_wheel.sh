#!/usr/bin/env bash
# Proves a wheel: its tags hold, and installed alone into a clean environment it imports without torch and runs the demo.
#     tools/check_wheel.sh dist/ipman_rs-….whl        (from an environment with the `wheel` dependency group)
set -euo pipefail

[[ $# == 1 && -f $1 ]] || { echo "usage: $0 WHEEL" >&2; exit 2; }
wheel=$(realpath "$1")
room=$(mktemp -d)
trap 'rm -rf "$room"' EXIT

echo "$(basename "$wheel"): $(du -k "$wheel" | cut -f1) kB"
python -m zipfile -l "$wheel" | awk 'NR > 1 && $NF > 50000 { print "    " $1, int($NF / 1024) " kB unpacked" }'
abi3audit --strict --verbose "$wheel"
if [[ $(uname) == Linux ]]; then
    auditwheel show "$wheel"
    [[ $wheel == *abi3-manylinux* ]] || { echo "the wheel is not tagged abi3 and manylinux" >&2; exit 1; }
fi

# From here on nothing of the repository or of its environment is in reach.
python=$(python -c 'import sys; print(sys._base_executable)')
unset VIRTUAL_ENV PYTHONPATH PYTHONHOME PIP_CONSTRAINT UV_CONSTRAINT
cd "$room"
"$python" -m venv clean
clean/bin/python -m pip install --quiet --disable-pip-version-check "$wheel"
clean/bin/python - <<'CHECK'
import importlib.util
import sys

import ipman_rs

assert importlib.util.find_spec("torch") is None, "torch came along, so its absence is not tested"
assert "scipy" not in sys.modules, "import ipman_rs must need numpy alone"
assert ipman_rs.__file__.startswith(sys.prefix), ipman_rs.__file__
print("import ipman_rs", ipman_rs.__version__, "without torch: ok")
CHECK
clean/bin/ipman demo -o demo
for name in report.html report.json report.npz; do
    [[ -s demo/$name ]] || { echo "ipman demo wrote no $name" >&2; exit 1; }
done
du -k demo/* | awk '{ print "    " $2, $1 " kB" }'
echo "The wheel works alone: $wheel"
