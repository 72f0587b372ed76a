# make run    the paper's scenario, from nothing to a report
# make test   all fast tests
# make lint   formatter, linter and type checker
# make coverage  how much of the code the tests go through, against floors
# make docs   the documents as a site, in build/site
# make laws   the C of all that is run as C, in build/laws
# make dist   source distributions and wheels of fuzzy-arbiter and subreach, in dist/
# make packaging  what is shipped: its contents, and runs from the wheels in an empty environment
# make tour       every command of README and tutorial as printed, in fresh clones; most of an hour
# make lowest     tests with the lowest versions of all that is needed, on Python 3.11
# make portable   the fast tests with other kernels, processors and Pythons: an hour, or make portable PORTABLE='--only zen'
# make bench  what things cost, against peers in an environment of their own
# make mutation         whether the tests notice every changed sign of controller and plant; some hours
# make mutation-sample  the same of 40 signs, drawn with a fixed seed
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
comma := ,
# without a C compiler the ziglang package is one
COMPILER := $(if $(shell command -v cc),,build)
EXTRAS := dev$(addprefix $(comma),$(COMPILER))
PYTEST_FLAGS ?=
PORTABLE ?=
# uv takes seconds where pip takes minutes
INSTALL := $(if $(shell command -v uv),uv pip install --python $(BIN)/python,$(BIN)/python -m pip install \
	--disable-pip-version-check) --quiet
# two distributions: the arbiter's, and that of all the rest, which needs it
HERE := --editable ./fuzzy_arbiter --editable
# tests start hundreds of processes: where bytecode is not kept, each compiles what it imports again
export PYTHONDONTWRITEBYTECODE =

.PHONY: run test lint coverage coverage-fuzzy coverage-plant coverage-mathematics coverage-mavlink mutation mutation-sample docs laws bench dist packaging tour lowest portable clean

run: $(VENV)/installed
	$(BIN)/cosim run paper

test: $(VENV)/extras
	$(BIN)/python -m pytest -q --numprocesses auto --dist worksteal $(PYTEST_FLAGS)

lint: $(VENV)/extras
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

# what is run as C, or in other processes and browsers, goes unseen: only where the number means something
cover = mkdir -p build && COVERAGE_FILE=build/coverage $(BIN)/python -m coverage run --include='$(2)' --omit=plant_fmu/checking/drivers.py \
	-m pytest -q --medium $(3) && COVERAGE_FILE=build/coverage $(BIN)/python -m coverage report --fail-under=$(1)
csv = $(subst $(subst ,, ),$(comma),$(1))
MATHEMATICS := $(call csv,$(patsubst %,controller/%.py,allocation quadratic_program paper_law quaternion restoring \
	theory/conditions theory/equations_of_motion))
MATHEMATICS_TESTS := $(patsubst %,tests/controller/test_%.py,quadratic_program allocation paper_law quaternion) \
	tests/controller/theory/test_conditions.py tests/controller/theory/test_equations_of_motion.py
MAVLINK := $(call csv,$(addprefix cosim/mavlink/,wire/encode.py wire/framing.py wire/signing.py vehicle/row_layout.py \
	messages/* services/*))

coverage: coverage-fuzzy coverage-plant coverage-mathematics coverage-mavlink

coverage-fuzzy: $(VENV)/extras
	$(call cover,98,fuzzy_arbiter/*,tests/fuzzy_arbiter)

coverage-plant: $(VENV)/extras
	$(call cover,88,plant_fmu/*,tests/plant_fmu tests/security/test_fmu_files.py)

coverage-mathematics: export SUBREACH_INTERPRETED = 1
coverage-mathematics: $(VENV)/extras
	$(call cover,97,$(MATHEMATICS),$(MATHEMATICS_TESTS) -W ignore::RuntimeWarning)

coverage-mavlink: $(VENV)/extras
	$(call cover,96,$(MAVLINK),tests/cosim/mavlink/test_*.py)

mutation: $(VENV)/extras
	$(BIN)/python -m tests.mutation --results build/mutation.jsonl

mutation-sample: $(VENV)/extras
	$(BIN)/python -m tests.mutation --sample 40

docs: $(VENV)/extras
	$(INSTALL) $(HERE) '.[docs]'
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

bench: $(VENV)/extras
	$(BIN)/python -m benchmarks all
	$(BIN)/python -m benchmarks scaling

laws: $(VENV)/installed
	$(BIN)/python -m cosim.batch.shipped_functions build/laws

dist: $(VENV)/extras
	rm -rf dist
	$(BIN)/python -m build --outdir dist fuzzy_arbiter
	$(BIN)/python -m build --outdir dist
	$(PYTHON) -m venv build/twine
	build/twine/bin/python -m pip install --quiet --disable-pip-version-check twine
	build/twine/bin/twine check --strict dist/*

packaging: $(VENV)/extras
	$(BIN)/python -m pytest -q --slow --numprocesses=2 tests/packaging

tour: $(VENV)/extras
	$(BIN)/python -m tests.docs.tour

LOWEST := build/lowest
LOWEST_TESTS := tests/controller tests/fuzzy_arbiter tests/plant_fmu tests/cosim

lowest:
	$(PYTHON) -m venv $(LOWEST)/uv
	$(LOWEST)/uv/bin/python -m pip install --quiet --disable-pip-version-check uv
	echo ./fuzzy_arbiter > $(LOWEST)/arbiter.in
	$(LOWEST)/uv/bin/uv pip compile --quiet --resolution lowest-direct --python-version 3.11 --extra campaign --extra mcap --extra skfuzzy \
		--no-emit-package fuzzy-arbiter --output-file $(LOWEST)/requirements.txt \
		pyproject.toml fuzzy_arbiter/pyproject.toml $(LOWEST)/arbiter.in
	$(LOWEST)/uv/bin/uv venv --quiet --clear --python 3.11 $(LOWEST)/env
	VIRTUAL_ENV=$(LOWEST)/env $(LOWEST)/uv/bin/uv pip install --quiet --requirement $(LOWEST)/requirements.txt \
		hypothesis lief pytest pytest-timeout
	VIRTUAL_ENV=$(LOWEST)/env $(LOWEST)/uv/bin/uv pip install --quiet --no-deps $(HERE) .
	$(LOWEST)/env/bin/python -m pytest -q -o filterwarnings= $(LOWEST_TESTS) $(PYTEST_FLAGS) # old versions warn

portable: $(VENV)/extras
	$(BIN)/python -m tests.portability $(PORTABLE)

# the product alone: a run needs nothing of what the tests do
$(VENV)/installed: pyproject.toml fuzzy_arbiter/pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(None if sys.version_info >= (3, 11) else "Python 3.11 or later is needed")'
	@echo 'Setting up $(VENV); the first time some hundred MB are downloaded, which takes minutes'
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) $(HERE) '.$(addsuffix ],$(addprefix [,$(COMPILER)))'
	@touch $@

$(VENV)/extras: $(VENV)/installed
	$(INSTALL) $(HERE) '.[$(EXTRAS)]'
	@touch $@

clean:
	rm -rf $(VENV)
