# Every target prepares .venv first when it is missing or out of date.
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
DEV := $(VENV)/.installed-dev
WORKERS ?= 3
# Bytecode is kept whatever the environment says: a hundred Pythons are started, each would compile a thousand
# files anew.
# Two arenas of the C library's allocator, as the server takes: with one a thread a worker grows by 100 MB a server.
PYTEST := PYTHONDONTWRITEBYTECODE= MALLOC_ARENA_MAX=2 $(BIN)/python -m pytest
PORT ?= 8000
NAME ?= render
TESTS ?=
BASE ?= HEAD
RUN ?=

.PHONY: setup update packages kernels run test test-fast test-changed test-kernels coverage mutate lint lint-python lint-page bench figures clean

setup: $(DEV)

$(VENV)/bin/python:
	@command -v $(PYTHON) >/dev/null || { echo "Python 3.11 or newer is needed: not found as '$(PYTHON)'. Set PYTHON=/path/to/python3."; exit 1; }
	@$(PYTHON) -m venv $(VENV)

# uv installs in a fifth of pip's time: the one that is installed, else one in .venv; where it cannot be had, pip.
# First what the lock names, by its hashes; then the project, and of its requirements what the lock leaves to the
# machine (PyTorch). Python compiles what it loads: to compile everything ahead takes half a minute.
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
PIP_UNINSTALL := $(BIN)/python -m pip uninstall --quiet --quiet --yes --disable-pip-version-check
with_uv = $(1) pip install --quiet --python $(BIN)/python --require-hashes --no-deps --requirement requirements/$(2).txt \
	&& $(1) pip install --quiet --python $(BIN)/python --editable $(3)
with_pip = $(PIP) --no-compile --require-hashes --no-deps --requirement requirements/$(1).txt \
	&& $(PIP) --no-compile --editable $(2)
install = if command -v uv >/dev/null; then $(call with_uv,uv,$(1),$(2)); else \
	{ $(PIP) uv && $(call with_uv,$(BIN)/python -m uv,$(1),$(2)); } || { $(call with_pip,$(1),$(2)); }; fi

$(STAMP): pyproject.toml requirements/run.txt | $(VENV)/bin/python
	@echo "Installing into $(VENV) (half a minute the first time) ..."
	@$(call install,run,'.[figures]')
	@$(PIP_UNINSTALL) uv setuptools # 50 MB that nothing here runs
	@touch $@

$(DEV): pyproject.toml requirements/dev.txt | $(VENV)/bin/python
	@echo "Installing into $(VENV), with what tests and linters need (about a minute the first time) ..."
	@$(call install,dev,'.[dev]')
	@touch $(STAMP) $@

# Takes the newest releases into the lock, which is committed.
update: $(DEV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check uv
	$(BIN)/python .ci/update_lock.py

run: $(STAMP)
	@$(BIN)/foveacam serve --port $(PORT)

packages:
	@sh tests/system/install-chromium.sh
	@sh tests/system/install-aravis.sh
	@sh tests/system/install-compiler.sh
	@sh tests/system/install-nginx.sh

kernels: $(DEV)
	@PYTHONDONTWRITEBYTECODE= $(BIN)/python .ci/compile_kernels.py

test: $(DEV) packages kernels
	$(PYTEST) --numprocesses $(WORKERS) --dist loadfile --no-loadscope-reorder

# Unit and wire tests, which open no simulated rig, without those marked slow: at most 90 s on two quiet cores.
test-fast: $(DEV)
	$(PYTEST) --numprocesses $(WORKERS) --dist loadfile -m "not slow" tests/unit tests/wire

# The tests that what differs from BASE reaches by imports; the whole application's own are left to make test.
test-changed: $(DEV)
	@PYTHONDONTWRITEBYTECODE= $(BIN)/python .ci/changed_tests.py --base $(BASE) --numprocesses $(WORKERS) --dist loadfile

# Unit and paper tests, or those that TESTS names, once under every kernel of linear algebra that this processor runs.
test-kernels: $(DEV)
	$(BIN)/python .ci/test_kernels.py --numprocesses $(WORKERS) --dist loadfile $(or $(TESTS),tests/unit tests/paper)

# Line coverage of the five packages by the whole run, or by the folders that TESTS names; child processes are not counted.
coverage: $(DEV) packages
	$(PYTEST) --numprocesses $(WORKERS) --dist loadfile --no-loadscope-reorder --cov --cov-report=term:skip-covered $(TESTS)

# Small wrong changes of the product, one at a time: which does no test notice?
mutate: $(DEV) kernels
	@$(BIN)/python .ci/mutate.py $(LISTS)

lint: lint-python lint-page

# mypy ends with 2 where its workers do not start within 3 s, as on a busy machine.
lint-python: $(DEV)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy || { [ $$? -ne 1 ] && $(BIN)/mypy --num-workers 0; }
	$(BIN)/lint-imports
	$(BIN)/python .ci/dead_code.py
	$(BIN)/python .ci/generate_client.py --check
	$(BIN)/python .ci/figures.py check

lint-page: $(DEV)
	$(BIN)/hadolint docker/Dockerfile
	sh web/check-types.sh

bench: $(DEV)
	$(BIN)/foveacam bench $(NAME) --json

# Renders the tables of the pages from server/figures.json, and lists what has changed since it was measured;
# RUN="truth --seed 5" measures that first.
figures: $(DEV)
	@$(BIN)/python .ci/figures.py $(if $(RUN),run "$(RUN)",render)

clean:
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .import_linter_cache dist
