# Every target sets itself up in .venv: GNU make and a Python 3.11 or newer are all that a fresh machine needs.
#   make PYTHON=python3.13 test      chooses the interpreter

MAKEFLAGS += --no-print-directory
VENV := .venv
BENCH_VENV := .venv-bench
OLD := import sys; sys.exit(sys.version_info < (3, 11))

ifeq ($(OS),Windows_NT)
  BIN := $(VENV)/Scripts
  PYTHON ?= python
else
  BIN := $(VENV)/bin
  PYTHON ?= $(shell for p in python3 python python3.14 python3.13 python3.12 python3.11; do \
    if $$p -c '$(OLD)' >/dev/null 2>&1; then echo $$p; exit; fi; done; echo python3)
endif
PY := $(BIN)/python
STAMP = @$(PY) -c "import pathlib; pathlib.Path('$@').touch()"
INSTALL = $(PY) -m pip install --quiet --disable-pip-version-check --editable
# For the first minute: a module is compiled when it is first imported, not each of them before.
LAZY = $(patsubst --editable,--no-compile --editable,$(INSTALL))

# What pip builds and installs: the core in C is compiled again when one of its files changed.
PACKAGE := pyproject.toml build_core.py $(wildcard contextdb/core/*.[ch])

.DEFAULT_GOAL := help
# A set-up that failed half-way is done again from its start.
.DELETE_ON_ERROR:
.PHONY: help demo play edit test cover check format docs site bench fuzz mutate clean

help:
	@$(info make demo     the whole way on the sample tables: read, ask, explain, search)
	@$(info make play     a game whose characters obey tables, and their editor beside it)
	@$(info make edit     the editor alone on the tables of that game)
	@$(info make test     run the tests; EXAMPLES=full draws all examples from a new seed, SEED=1 draws the same ones again)
	@$(info make cover    run the tests and list the lines and branches of the code that none of them reaches)
	@$(info make check    formatting, lint, types and import contracts)
	@$(info make format   format the code and mend what lint can mend)
	@$(info make docs     run the commands of README.md and docs/ and write down what they print now)
	@$(info make site     the pages of docs/ as a site in build/site, with a search; open build/site/index.html)
	@$(info make fuzz     damage files at random for SECONDS=60 and read them; SEED=1 tries the same ones again)
	@$(info make mutate   change an engine at random for SECONDS=600 and list the changes that no test notices; SEED=1 draws the same)
	@$(info make bench    measure against other engines)
	@$(info make clean    remove what was made, .venv and .venv-bench too)
	@cd .

demo play edit: export PYTHONDONTWRITEBYTECODE :=
demo: $(VENV)/.runtime
	@$(PY) -m contextdb demo

play: $(VENV)/.playground
	@$(PY) -m contextdb play $(if $(CLIPS),--clips "$(CLIPS)")

edit: $(VENV)/.runtime
	@$(PY) -m contextdb edit examples/playground/tables --follow playground

test: export EXAMPLES := $(EXAMPLES)
test: export PYTHONDONTWRITEBYTECODE :=
test: $(VENV)/.dev   # one worker more than cores: many tests wait for a terminal or another process
	$(PY) -m pytest --numprocesses $$($(PY) -c "import os; print((os.cpu_count() or 1) + 1)") --dist worksteal $(if $(SEED),--hypothesis-seed=$(SEED))

cover: $(VENV)/.dev
	$(PY) -m pytest --numprocesses auto --dist worksteal --cov

check: $(VENV)/.dev
	$(PY) -m ruff format --check .
	$(PY) -m ruff check .
	$(PY) -m mypy
	$(BIN)/lint-imports

format: $(VENV)/.dev
	$(PY) -m ruff check --fix .
	$(PY) -m ruff format .

docs: $(VENV)/.dev
	$(PY) tests/test_docs.py --update
	$(PY) tests/test_api.py --update
	$(PY) docs/keys.py
	$(PY) docs/commands.py
	$(PY) docs/settings.py
	$(PY) docs/pictures.py
	$(PY) docs/playground_pictures.py

site: $(VENV)/.site
	$(PY) docs/site/build.py

mutate: $(VENV)/.dev
	$(PY) tests/mutate.py --seconds $(or $(SECONDS),600) $(if $(SEED),--seed $(SEED))

fuzz: $(VENV)/.dev
	$(PY) tests/fuzz.py --seconds $(or $(SECONDS),60) $(if $(SEED),--seed $(SEED))

# An environment of its own: what the bench extra brings would change what the tests see.
bench:
	@$(MAKE) VENV=$(BENCH_VENV) measure

measure: $(VENV)/.bench
	$(PY) benchmarks/query.py
	$(PY) benchmarks/casting.py
	$(PY) benchmarks/contracts.py
	$(PY) benchmarks/reload.py
	$(PY) benchmarks/live_link.py
	$(PY) benchmarks/network.py
	$(PY) benchmarks/prepare.py
	$(PY) benchmarks/clip_formats.py
	$(PY) benchmarks/many_clips.py --clips 500 1000
	$(PY) benchmarks/c_header.py
	$(PY) benchmarks/search.py
	$(PY) benchmarks/crowd.py
	$(PY) benchmarks/poses.py
	$(PY) benchmarks/motion_quality.py
	$(PY) benchmarks/playground.py
	$(PY) benchmarks/editor.py
	$(PY) benchmarks/start.py

clean:
	$(PYTHON) -c "import shutil; [shutil.rmtree(p, ignore_errors=True) for p in '$(VENV) $(BENCH_VENV) build dist .hypothesis .mypy_cache .pytest_cache .ruff_cache .import_linter_cache'.split()]"

$(VENV)/pyvenv.cfg:
	@$(PYTHON) -c "$(OLD)" || (echo "contextdb needs Python 3.11 or newer; '$(PYTHON)' is none. Try: make PYTHON=python3.12"; exit 1)
	@$(PYTHON) -m venv $(VENV) || (echo "'$(PYTHON) -m venv' failed. On Debian and Ubuntu: apt install python3-venv"; exit 1)

$(VENV)/.runtime: $(PACKAGE) | $(VENV)/pyvenv.cfg
	$(LAZY) .
	$(STAMP)

$(VENV)/.playground: $(PACKAGE) | $(VENV)/pyvenv.cfg
	$(LAZY) ".[playground]"
	$(STAMP)

$(VENV)/.dev: $(PACKAGE) | $(VENV)/pyvenv.cfg
	$(INSTALL) ".[dev]"
	$(STAMP)

$(VENV)/.site: $(PACKAGE) | $(VENV)/pyvenv.cfg
	$(INSTALL) ".[site]"
	$(STAMP)

$(VENV)/.bench: $(PACKAGE) | $(VENV)/pyvenv.cfg
	$(INSTALL) ".[bench]"
	$(STAMP)
