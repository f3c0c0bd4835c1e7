# rille: `make` alone lists the verbs.
.DEFAULT_GOAL := help
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.ONESHELL:
.DELETE_ON_ERROR:

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
CPP    := build/Release
OUT    := out
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export RILLE_DATA ?= $(abspath ../shared)

# System packages, by what needs them: compiler and tools; solver; Python headers; off-screen rendering (EGL, no X, no GPU).
PACKAGES := build-essential cmake ninja-build pkg-config \
            libbullet-dev libsqlite3-dev libsqlitecpp-dev libeigen3-dev libfmt-dev libcli11-dev nlohmann-json3-dev libmuparser-dev doctest-dev \
            python3-venv python3-dev \
            libegl1 libgl1 libgl1-mesa-dri libx11-6 libxrender1 libexpat1

CPP_SOURCES := $(shell find solver schema/schema.sql -type f \( -name '*.cpp' -o -name '*.hpp' -o -name '*.in' -o -name '*.sql' -o -name CMakeLists.txt \))

.PHONY: help setup build demo demo-proof prove test cpp-test sanitize fuzz examples maneuvers bench bench-diagnosis check format clean

help:  ## list the verbs
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 12

setup: build  ## install what a bare machine lacks, and build

.setup-system: Makefile
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "rille needs Python 3.11 or newer, $(PYTHON) is older; set PYTHON=..."; exit 1; }
	missing=$$(for p in $(PACKAGES); do dpkg-query -W -f='$${db:Status-Status}' $$p 2>/dev/null | grep -qx installed || echo $$p; done)
	if [ -n "$$missing" ]; then
	  echo "installing system packages: $$missing" | tr '\n' ' '; echo
	  if [ "$$(id -u)" = 0 ]; then become=""; elif command -v sudo >/dev/null; then become=sudo; else
	    echo "they need root: apt-get install" $$missing; exit 1
	  fi
	  $$become apt-get update -q >/dev/null
	  DEBIAN_FRONTEND=noninteractive $$become apt-get install -y -q --no-install-recommends $$missing >/dev/null
	fi
	touch $@

$(VENV)/.installed: .setup-system pyproject.toml pipeline/constraints.txt
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	echo "installing Python packages into $(VENV) (first time: 1-2 minutes)"
	$(BIN)/python -m pip install -q -c pipeline/constraints.txt nanobind scikit-build-core
	touch $@

$(VENV)/.built: $(VENV)/.installed $(CPP_SOURCES)
	@echo "building the solver"
	$(BIN)/python -m pip install -q -c pipeline/constraints.txt --no-build-isolation \
	  --config-settings=cmake.define.RILLE_TESTS=ON --config-settings=cmake.define.RILLE_BENCHMARK=ON -e '.[dev]'
	touch $@

build: $(VENV)/.built  ## build the solver and the package into .venv

demo: build  ## drive the example rover for 60 s over a composed terrain; table, pictures, paths
	@mkdir -p $(OUT)/demo && rm -f $(OUT)/demo/rover.db*
	$(BIN)/rille cad build examples/rover/rover.toml -o $(OUT)/demo/rover.db
	$(BIN)/rille terrain build examples/terrain/composed.toml -o $(OUT)/demo/rover.db
	$(BIN)/rille run $(OUT)/demo/rover.db --scenario examples/first_drive/traverse.toml
	$(BIN)/rille view $(OUT)/demo/rover.db -o $(OUT)/demo

# Pages are tested in a browser. Where no such package exists (Ubuntu has a snap instead), those tests are skipped and say so.
.setup-browser: .setup-system
	@missing=$$(for p in chromium; do dpkg-query -W -f='$${db:Status-Status}' $$p 2>/dev/null | grep -qx installed || echo $$p; done)
	if [ -n "$$missing" ]; then
	  echo "installing a browser for the tests of pages:" $$missing
	  if [ "$$(id -u)" = 0 ]; then become=""; else become=sudo; fi
	  DEBIAN_FRONTEND=noninteractive $$become apt-get install -y -q --no-install-recommends $$missing >/dev/null 2>&1 \
	    || { $$become apt-get update -q >/dev/null && DEBIAN_FRONTEND=noninteractive $$become apt-get install -y -q --no-install-recommends $$missing >/dev/null; } \
	    || echo "no browser could be installed; tests of pages will be skipped"
	fi
	touch $@

test: build .setup-browser cpp-test sanitize fuzz  ## run all tests
	@$(BIN)/python -m pytest -n auto --maxprocesses 4

cpp-test: build
	@ctest --test-dir $(CPP) --output-on-failure

# The C++ tests and the fuzz target once more, with the address and undefined-behaviour sanitizers.
build/sanitize/.built: $(VENV)/.installed $(CPP_SOURCES)
	@echo "building the C++ tests with sanitizers"
	cmake -S solver -B build/sanitize -G Ninja -DRILLE_TESTS=ON -DRILLE_SANITIZE=ON >/dev/null
	cmake --build build/sanitize --target rille-solver-tests rille-fuzz | tail -1
	touch $@

sanitize: build/sanitize/.built  ## run the C++ tests with address and undefined-behaviour sanitizers
	@build/sanitize/tests/rille-solver-tests --no-version

# The tests fuzz with one random seed, so that the same code gives the same verdict; FUZZ_RANDOM= (empty) draws a new one: that is how
# findings are made, and each found so far is a fixed bug.
FUZZ_SECONDS ?= 60
FUZZ_RANDOM  ?= 3465277576
fuzz: build build/sanitize/.built  ## feed mutated databases to the solver for FUZZ_SECONDS (default 60); FUZZ_RANDOM= for a new seed
	@$(BIN)/python solver/tests/fuzz_seed.py build/sanitize/seed.db
	build/sanitize/tests/rille-fuzz build/sanitize/seed.db $(FUZZ_SECONDS) $(FUZZ_RANDOM)

maneuvers: build  ## climb, cross, slide, park, reverse, turn: pictures in out/maneuvers
	@$(BIN)/python -m pytest tests/scenarios

examples: build  ## run every example
	@$(BIN)/python -m pytest tests/house/test_examples.py

bench: build  ## measure steps per second, real-time factor and step-size error
	@$(BIN)/python solver/benchmark/bench.py

# QUICK=--quick takes a few trials of every sort. It goes on where it was interrupted; remove out/bench-diagnosis to begin anew.
bench-diagnosis: build  ## diagnose recordings with one known thing wrong: confusion matrix, tables (hours; QUICK=--quick: a few trials)
	@$(BIN)/python benchmark/diagnosis/bench.py run $(QUICK)

# Another sentence draws other trials. Both go on where they were interrupted; remove the folder to begin anew.
BEACON ?= rille
demo-proof: build  ## 16 sealed trials of an independent generator: concealed, diagnosed, opened, scored, verified (BEACON="any sentence")
	@$(BIN)/rille prove --beacon "$(BEACON)" --quick -o $(OUT)/demo-proof
	$(BIN)/rille prove verify $(OUT)/demo-proof/ledger.db

REAL = $(if $(wildcard $(or $(RILLE_DATA),../shared)/data/recordings),$(addprefix --real ,$(wildcard examples/*/*_trial.toml)))
prove: build  ## all 330 sealed trials, hours on 2 cores, and those of the real data if they are there (BEACON="any sentence")
	@$(BIN)/rille prove --beacon "$(BEACON)" $(REAL) -o $(OUT)/proof
	$(BIN)/rille prove verify $(OUT)/proof/ledger.db

check: build  ## lint, types, tests
	@$(BIN)/ruff check pipeline tests solver benchmark examples terrain_library
	$(BIN)/ruff format --check pipeline tests solver benchmark examples terrain_library
	$(BIN)/pyright
	$(MAKE) test

format: build  ## format the Python code
	@$(BIN)/ruff check --fix pipeline tests solver benchmark examples terrain_library
	$(BIN)/ruff format pipeline tests solver benchmark examples terrain_library

clean:  ## remove everything that was built
	rm -rf build $(VENV) $(OUT) .setup-*
