# Everything a newcomer needs: `make demo` and `make test` do their own set-up.
# `make` alone lists the targets.

# The interpreter to build the environment from; an existing environment keeps its own.
PYTHON ?= $(or $(shell sed -n 's/^executable = //p' .venv/pyvenv.cfg 2>/dev/null),python3)
BIN := .venv/bin
# Test processes at a time; the tests that need the machine to themselves follow alone.
WORKERS ?= 2
# Further arguments for the command or tests, e.g. make test ARGS="-k kinematics"
ARGS ?=

# A sourced ROS installation or an inherited library path of other wheels would mix with .venv.
unexport PYTHONPATH AMENT_PREFIX_PATH COLCON_PREFIX_PATH CMAKE_PREFIX_PATH
ifneq ($(ROS_DISTRO)$(_ROS_WHEELS_BOOTSTRAP_COMPLETE),)
unexport LD_LIBRARY_PATH
endif
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE RMW_IMPLEMENTATION ROS_DISCOVERY_SERVER

# Nothing leaves this machine; ROS_DOMAIN_ID may be chosen, so that other tools can join in.
export ROS_AUTOMATIC_DISCOVERY_RANGE := LOCALHOST
export ROS_DOMAIN_ID ?= 30
export FASTRTPS_DEFAULT_PROFILES_FILE := $(CURDIR)/config/fastdds.xml

SHELL := /bin/bash
.SHELLFLAGS := -o pipefail -c
# What pip is at, on one line.
PROGRESS := while read -r first name _; do case $$first in \
    Collecting) printf '\r\033[K  %s' "$${name%%[=<>~!]*}";; \
    Installing) printf '\r\033[K  unpacking';; esac; done && printf '\r\033[K'

# Versions stay as they are where they may; `make lock ARGS=--upgrade` takes the newest.
LOCK := .venv/lock/bin/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
    --no-strip-extras --no-annotate --no-emit-index-url --custom-compile-command 'make lock'

# Small recordings that come with the repository, by the mission that they record.
BAGS := square circle_encoder_lost
PACKAGES := $(patsubst %/package.xml,%,$(wildcard src/*/package.xml))
# What calls for another install: a change of these, or a file more or less of those. Sources,
# launch files and data are linked, not copied.
MANIFESTS := $(wildcard $(addprefix src/*/,package.xml setup.py setup.cfg resource/*))
LINKED := $(sort $(MANIFESTS) $(wildcard src/*/launch/*.launch.py \
    $(addprefix src/*/tomr_*/,robots/*.yaml missions/*.yaml weights/*)))

.PHONY: help setup demo test attack soak audit lock lint format bench docs figures train bags clean FORCE
.DELETE_ON_ERROR:

help: ## list the targets
	@echo "TOMR: fault diagnosis of three-wheeled omni robots from the power of their motors."
	@echo
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sort | \
	    sed -E 's/^([a-z]+):.*## (.*)/  make \1\t\2/' | expand -t 16
	@echo
	@echo "The commands are in $(BIN)/ after any of these; each explains itself with --help."
	@echo "Another Python (3.11, 3.12 or 3.13): make PYTHON=python3.12 test"

setup: .venv/workspace ## make .venv, install the pinned dependencies, build the workspace

demo: setup ## watch a simulated robot drive, fail and be diagnosed
	@$(BIN)/tomr_demo $(ARGS)

test: lint ## run every check and test
	$(BIN)/pytest -n $(WORKERS) -m "not serial" $(ARGS)
	$(BIN)/pytest -m serial $(ARGS) || [ $$? -eq 5 ] # 5: none was selected

attack: setup ## feed all commands with 20,000 hostile inputs (hours; resumed where it was)
	$(BIN)/python bench/attack.py --tries 20000 --out attack $(ARGS)

soak: setup ## drive for an hour with faults, gaps, floods and killed nodes
	$(BIN)/python bench/soak.py --out soak $(ARGS)

audit: setup ## look for known vulnerabilities in the installed packages (needs the Internet)
	@[ -x .venv/audit/bin/pip-audit ] || { $(BIN)/python -m venv .venv/audit && \
	    .venv/audit/bin/pip install --disable-pip-version-check --quiet pip-audit==2.10.1; }
	.venv/audit/bin/pip-audit --path "$$($(BIN)/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')" $(ARGS)

lock: .venv/origin ## pin what the requirements bring along anew, with the hashes of all their files
	@[ -x .venv/lock/bin/uv ] || { $(BIN)/python -m venv .venv/lock && \
	    .venv/lock/bin/pip install --disable-pip-version-check --quiet uv==0.13.9; }
	$(LOCK) -o requirements-dev.lock requirements-dev.txt $(ARGS)
	$(LOCK) -o requirements-fleet.lock -c requirements-dev.lock requirements-fleet.txt $(ARGS)

lint: setup ## ruff, mypy and import-linter only
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache --no-logo

format: setup ## rewrite the sources in the house format
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

bench: setup ## measure CPU, latency and offline speed, as ratios (not a test)
	$(BIN)/python bench/run.py $(ARGS)

figures: .venv/training ## draw the figures of docs/experiments.md anew (installs torch)
	$(BIN)/python bench/experiments.py all --out docs/figures

docs: setup ## write the table of keys in docs/keys.md anew
	$(BIN)/python -m tomr_fault_diag.diagnosis.key_table > docs/keys.md

train: .venv/training ## train the classifier anew, in three quarters of an hour (installs torch)
	$(BIN)/tomr_train --out src/tomr_fault_diag/tomr_fault_diag/weights/window.npz $(ARGS)

bags: setup ## record the small recordings in bags/ anew
	rm -rf $(BAGS:%=bags/%)
	for mission in $(BAGS); do $(BIN)/tomr_simulate $$mission --out bags/$$mission || exit; done

clean: ## remove all that was made: .venv, build, install, log, caches
	rm -rf .venv build install log .mypy_cache .ruff_cache .pytest_cache .hypothesis
	rm -rf src/*/*.egg-info src/*/build
	find src test bench bags config -name __pycache__ -type d -prune -exec rm -rf {} + 2>/dev/null || true

# An environment holds absolute paths: another interpreter or another place calls for a new one.
.venv/origin: FORCE
	@origin="$$($(PYTHON) -c 'import os, sys; \
	    ok = (3, 11) <= sys.version_info[:2] <= (3, 13); \
	    print(os.getcwd(), sys.version) if ok else sys.exit(1)')" || { \
	    echo "error: '$(PYTHON)' is not Python 3.11, 3.12 or 3.13;" \
	        "name one, e.g. make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 2; }; \
	if [ "$$origin" != "$$(cat $@ 2>/dev/null)" ]; then \
	    echo "Making .venv of $$($(PYTHON) --version)"; \
	    rm -rf .venv build install log; \
	    $(PYTHON) -m venv .venv || { rm -rf .venv; \
	        echo "error: the venv module does not work (Debian, Ubuntu: apt install python3-venv)" >&2; \
	        exit 2; }; \
	    echo "$$origin" > $@; \
	fi

.venv/dependencies: .venv/origin requirements-dev.lock
	@echo "Installing the pinned dependencies (about 250 MB to download, a minute or so)"
	@$(BIN)/python -m pip install --disable-pip-version-check --require-hashes \
	    -r requirements-dev.lock | $(PROGRESS)
	@touch $@

.venv/training: .venv/workspace requirements-train.txt
	@echo "Installing torch (large: up to several GB where a GPU build is chosen)"
	@$(BIN)/python -m pip install --disable-pip-version-check -r requirements-train.txt | $(PROGRESS)
	@touch $@

.venv/linked: .venv/origin FORCE
	@[ "$(LINKED)" = "$$(cat $@ 2>/dev/null)" ] || echo "$(LINKED)" > $@

# Twice: pip puts the commands into .venv/bin for use without sourcing anything, colcon makes
# install/ for `ros2 run` and `ros2 launch`. Both link to the sources. All packages are taken out
# first: pip would replace them one by one, and a command that has moved from one to another would
# go with the old package after it has come with the new one.
.venv/workspace: .venv/dependencies .venv/linked $(MANIFESTS)
	@echo "Building the workspace"
	@$(BIN)/python -m pip list --disable-pip-version-check --editable --format=freeze | cut -d= -f1 \
	    | xargs -r $(BIN)/python -m pip uninstall --quiet --yes
	@$(BIN)/python -m pip install --disable-pip-version-check --quiet --no-deps --use-pep517 \
	    --no-build-isolation --config-settings editable_mode=compat $(PACKAGES:%=-e %)
	@rm -rf build install log
	@$(BIN)/colcon build --symlink-install --base-paths src
	@$(BIN)/python -m compileall -q src
	@touch $@
