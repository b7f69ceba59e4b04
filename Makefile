# On a machine with Rust, Python >= 3.10 and make: `make demo` and `make test` do all their own set-up, in .venv.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

VENV := .venv
BIN := $(VENV)/bin
OUT ?= out/demo
FIT_OUT ?= out/demo-fit
IMAGE ?= # a photo to draw under the keypoints of demo-fit
KEYPOINTS := python/ipman_rs/fitting/examples/basketball.json

# PYTHON=python3.12 make … chooses for a new .venv; otherwise the first of these that is new enough.
NEW_ENOUGH := import sys; sys.exit(sys.version_info < (3, 10))
ifndef PYTHON
PYTHON := $(shell for python in python3 python3.14 python3.13 python3.12 python3.11 python3.10; do \
	$$python -c '$(NEW_ENOUGH)' 2>/dev/null && echo $$python && break; done)
endif

# Cargo and maturin must see our environment, whichever one is active in the shell.
export VIRTUAL_ENV := $(CURDIR)/$(VENV)
export PYO3_PYTHON := $(CURDIR)/$(BIN)/python
export PATH := $(CURDIR)/$(BIN):$(PATH)
unexport CONDA_PREFIX PYTHONHOME PYTHONPATH
MATURIN_DEVELOP = maturin develop --release --locked $$([ -x $(BIN)/uv ] && echo --uv)
# What is installed does not differ by day: `make lock` writes these versions anew.
LOCK := requirements.lock
export PIP_CONSTRAINT := $(CURDIR)/$(LOCK)
export UV_CONSTRAINT := $(CURDIR)/$(LOCK)
PIP = $$([ -x $(BIN)/uv ] && echo uv pip || echo python -m pip)

# What the compiled module is made of; the folders too, so that a deleted file counts.
SOURCES := Cargo.toml Cargo.lock pyproject.toml $(wildcard rust-toolchain.toml) \
	$(shell find rust -type d -o -name '*.rs' -o -name Cargo.toml)
BINARY := python/ipman_rs/_core.abi3.so

.PHONY: help demo demo-poses demo-fit check test test-rust test-python test-levels fuzz fuzz-rust fuzz-python lint format \
	wheel bench lock audit deny clean FORCE

help:
	@echo 'make demo     demo-poses: the named poses of the embedded body, analysed, report in $(OUT); and'
	@echo '              demo-fit: a body fitted to the keypoints of a photo, report in $(FIT_OUT) (IMAGE=photo.png draws it'
	@echo '              under them; installs torch, some minutes the first time, and takes ten seconds afterwards)'
	@echo 'make check    the fast Python tests, a good minute on two cores (installs torch and the test tools)'
	@echo 'make test     every test, Rust and Python (installs torch and the test tools)'
	@echo 'make lint     formats and lints checked, nothing changed'
	@echo 'make format   sources formatted'
	@echo 'make wheel    one wheel for all Pythons >= 3.10 in dist/, tried alone in a clean environment'
	@echo 'make bench    every peer, into docs/results/performance.md (QUICK=1: the most important ones, in three minutes)'
	@echo 'make fuzz     damaged files and odd calls, Rust and Python: FUZZ_SECONDS=60 of each, FUZZ_SEED=0; hours by hand'
	@echo 'make lock     requirements.lock, the versions of all that the other targets install, written anew (needs a network)'
	@echo 'make audit    known faults, licences and sources of what is installed and linked: pip-audit and cargo deny'
	@echo '              (needs a network)'
	@echo 'make clean    remove what was built (.venv, target, out, dist)'
	@echo 'PYTHON=python3.12 make …   chooses the interpreter of a new .venv'

demo: demo-poses demo-fit

demo-poses: $(VENV)/built
	ipman demo -o $(OUT)
	@echo
	@echo 'The report: $(abspath $(OUT))/report.html   (numbers: report.json and report.npz, pictures: *.png)'

demo-fit: $(VENV)/fit-tools | $(if $(filter demo,$(MAKECMDGOALS)),demo-poses)
	ipman fit $(KEYPOINTS) -o $(FIT_OUT) $(if $(strip $(IMAGE)),--image '$(strip $(IMAGE))')
	@echo
	@echo 'The fitted body: $(abspath $(FIT_OUT))/report.html   (parameters, mesh and pictures: $(FIT_OUT)/basketball)'

# One process a core, one thread each: torch would otherwise start its threads in every process.
PYTEST := OMP_NUM_THREADS=1 python -m pytest -n auto

check: $(VENV)/test-tools
	$(PYTEST) -m 'not slow' $(PYTEST_ARGS)

test: test-rust test-python test-levels fuzz
	@echo
	@echo 'All tests passed: Rust (cargo) and Python (pytest).'

test-rust:
	if cargo nextest --version >/dev/null 2>&1; then \
		cargo nextest run --locked --features simulation && cargo test --locked --features simulation --doc; \
	else cargo test --locked --features simulation; fi

test-python: $(VENV)/test-tools $(VENV)/browser | test-rust
	$(PYTEST) $(PYTEST_ARGS)

# The numbers once more on every other CPU level that this machine has (IPMAN_SIMD).
LEVEL_TESTS := $(addprefix tests/,$(patsubst %,physics/test_%.py,volume_mass sampling pressure support losses analysis \
	real_bodies) $(patsubst %,torch/test_%.py,against_reference gradients bodies) body/test_skinning.py)

test-levels: $(VENV)/test-tools | test-python
	for level in $$(python -c 'from ipman_rs import _core; print(*_core.simd_levels()[1:])'); do \
		echo "CPU level $$level"; \
		IPMAN_SIMD=$$level $(PYTEST) $(LEVEL_TESTS); done

# FUZZ_SECONDS of each target. The same FUZZ_SEED tries the same cases; one that went wrong is repeated with --case.
FUZZ_SECONDS ?= 60
FUZZ_SEED ?= 0

fuzz: fuzz-rust fuzz-python

# On stable Rust, with overflow checks; rust/fuzz/src/lib.rs says how cargo-fuzz runs the same targets.
fuzz-rust: | test-rust
	cargo run --locked -p ipman-fuzz -- all $(FUZZ_SECONDS) $(FUZZ_SEED)

fuzz-python: $(VENV)/test-tools | test-python
	OMP_NUM_THREADS=1 python tools/fuzz_readers.py --seconds $(FUZZ_SECONDS) --seed $(FUZZ_SEED)
	OMP_NUM_THREADS=1 python tools/fuzz_api.py --seconds $(FUZZ_SECONDS) --seed $(FUZZ_SEED)

lint: $(VENV)/test-tools $(VENV)/lint-tools
	cargo fmt --all --check
	cargo clippy --locked --workspace --all-targets -- -D warnings
	ruff check
	ruff format --check
	pyright
	lint-imports
	python tools/third_party_notices.py --check

format: $(VENV)/lint-tools
	cargo fmt --all
	ruff check --fix
	ruff format

wheel: $(VENV)/wheel-tools
	rm -rf dist
	maturin build --release --locked --out dist $(if $(filter Linux,$(shell uname)),--zig --compatibility manylinux2014)
	tools/check_wheel.sh dist/*.whl

bench: $(VENV)/bench-tools
	python -m benchmarks $(if $(QUICK),--quick)

lock: $(VENV)/created
	env -u PIP_CONSTRAINT -u UV_CONSTRAINT uv pip compile pyproject.toml --quiet --no-header --universal --upgrade \
		--python-version 3.10 $(addprefix --extra ,fit c3d train render evaluate figures) \
		$(addprefix --group ,test bench lint wheel build audit) -o $(LOCK)

audit: deny $(VENV)/audit-tools
	pip-audit --requirement $(LOCK) --no-deps --disable-pip

deny:
	cargo deny --version >/dev/null 2>&1 || cargo install --locked cargo-deny
	cargo deny --locked check licenses bans sources advisories

clean:
	rm -rf $(VENV) target out dist $(BINARY)

# Set-up: each stamp stands for a step that need not be done again until what it depends on changes.

$(VENV)/created:
	@[ -n "$(PYTHON)" ] && $(PYTHON) -c '$(NEW_ENOUGH)' || \
		{ echo 'Python 3.10 or newer is needed (found: $(or $(PYTHON),none)); name one: PYTHON=python3.12 make …' >&2; exit 1; }
	@command -v cargo >/dev/null || { echo 'Rust is needed: cargo is not on the PATH' >&2; exit 1; }
	[ -x $(BIN)/python ] || $(PYTHON) -m venv $(VENV)
	python -m pip install --quiet --upgrade 'pip>=25.1' 'maturin>=1.9.4,<2'
	python -m pip install --quiet uv || echo 'uv is not to be had here: going on with pip, which is slower'
	touch $@

$(VENV)/built: $(SOURCES) $(if $(wildcard $(BINARY)),,FORCE) | $(VENV)/created
	$(MATURIN_DEVELOP)
	touch $@

$(VENV)/fit-tools: pyproject.toml $(LOCK) | $(VENV)/built
	$(MATURIN_DEVELOP) --extras fit
	touch $@

$(VENV)/test-tools: pyproject.toml $(LOCK) | $(VENV)/built
	$(MATURIN_DEVELOP) --extras fit,c3d,render,train,evaluate --group test
	touch $@

$(VENV)/bench-tools: pyproject.toml $(LOCK) | $(VENV)/test-tools
	$(PIP) install --quiet --group bench
	touch $@

$(VENV)/lint-tools: pyproject.toml $(LOCK) | $(VENV)/created
	$(PIP) install --quiet --group lint
	touch $@

$(VENV)/audit-tools: pyproject.toml $(LOCK) | $(VENV)/created
	$(PIP) install --quiet --group audit
	touch $@

$(VENV)/wheel-tools: pyproject.toml $(LOCK) | $(VENV)/created
	$(PIP) install --quiet --group wheel
	touch $@

# The report is looked at in a headless Chromium. It is a system package, so only root can have it installed here.
$(VENV)/browser: | $(VENV)/created
	if ! command -v chromium-headless-shell chromium chromium-browser google-chrome chrome >/dev/null; then \
		{ [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null && apt-get update -qq && \
			DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium-headless-shell; } || \
		echo 'No Chromium here (Debian: apt install chromium-headless-shell): the browser test will be skipped'; fi
	touch $@
