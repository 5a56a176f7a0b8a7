# `make fly` and `make test` need Python 3.11 or newer and make; the rest they set up themselves.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
READY  := $(VENV)/.ready

.DEFAULT_GOAL := help
.PHONY: help fly test lint units bench setup clean

help:   ## say what can be made
	@sed -n 's/^\([a-z]*\):.*## \(.*\)/make \1	\2/p' $(MAKEFILE_LIST)

fly: $(READY)   ## fly the default mission and draw its movie
	$(BIN)/staniel fly --movie

test: $(READY)   ## run the checks and the tests, side by side
	$(MAKE) --jobs=2 lint units

units: $(READY)   ## run the tests alone, a little of every sweep; STANIEL_FULL=1: all of it
	$(BIN)/pytest -n 2 --dist loadfile --no-loadscope-reorder

lint: $(READY)   ## run the checks alone: style, types, import contracts
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(READY)   ## measure time per tick and stage, and the real-time factor
	$(BIN)/python benchmarks/bench.py

setup: $(READY)   ## make the virtual environment

# The interpreter is asked first: its own message about an old version is hard to read. An
# environment that is there already is kept and brought to the pinned versions.
$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "staniel needs Python 3.11 or newer, $(PYTHON) is `$(PYTHON) --version`; try make PYTHON=python3.11" >&2; exit 2; }
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

clean:   ## remove the virtual environment and all caches
	rm -rf $(VENV) build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find src tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +
