# make run    the paper's scenario, from nothing to a report
# make test   all fast tests
# make lint   formatter, linter and type checker
# make bench  what things cost, against peers in an environment of their own
# make mutation         whether the tests notice every changed sign of controller and plant; hours
# make mutation-sample  the same of 40 signs, drawn with a fixed seed
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
comma := ,
# without a C compiler the ziglang package is one
EXTRAS := mavlink,importers,dev$(if $(shell command -v cc),,$(comma)build)
PYTEST_FLAGS ?=

.PHONY: run test lint bench mutation mutation-sample clean

run: $(VENV)/ready
	$(BIN)/cosim run paper

test: $(VENV)/ready
	$(BIN)/python -m pytest -q --numprocesses auto $(PYTEST_FLAGS)

lint: $(VENV)/ready
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

bench: $(VENV)/ready
	$(BIN)/python -m benchmarks all
	$(BIN)/python -m benchmarks scaling

mutation: $(VENV)/ready
	$(BIN)/python -m tests.mutation --results build/mutation.jsonl

mutation-sample: $(VENV)/ready
	$(BIN)/python -m tests.mutation --sample 40

$(VENV)/ready: pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(None if sys.version_info >= (3, 11) else "Python 3.11 or later is needed")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[$(EXTRAS)]'
	touch $@

clean:
	rm -rf $(VENV)
