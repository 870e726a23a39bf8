# make demo       install into .venv and remesh a sample; results in demo/
# make test       install what the tests need as well and run every test
# make test-fast  run only the quick tests, with fewer random examples
# make docs       build the documentation into site/ and report broken links
# make check      the tests and all linters, as in continuous integration

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# The tests share one process per core: make test WORKERS=4
WORKERS ?= auto
# Python keeps what it has compiled of the modules, also where the environment forbids it: else every process of the tests
# compiles NumPy, SciPy, Numba and all else that it imports.
unexport PYTHONDONTWRITEBYTECODE
PYTEST := $(BIN)/python -m pytest --numprocesses $(WORKERS) --dist worksteal

.PHONY: demo docs test test-fast install check clean

demo: $(VENV)/.installed-picture
	$(BIN)/anisomesh demo --out demo

test: install
	HYPOTHESIS_PROFILE=ci $(PYTEST)

test-fast: install
	$(PYTEST) -m "not slow"

install: $(VENV)/.installed-test

docs: $(VENV)/.installed-docs
	$(BIN)/python -m mkdocs build --strict

check:
	.ci/run

clean:
	rm -rf $(VENV) demo site .cache

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit("anisomesh needs Python 3.11 or newer; try: make PYTHON=python3.12" if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv $(VENV)

# The installation is editable, so only a change of the dependencies asks for a new one. Python compiles the few modules
# that are imported when they are; compiling all of them takes half of the time of the installation.
$(VENV)/.installed: pyproject.toml constraints.txt | $(BIN)/python
	$(BIN)/python -m pip install --quiet --no-compile --constraint constraints.txt --editable .
	touch $@

$(VENV)/.installed-%: pyproject.toml constraints.txt | $(BIN)/python
	$(BIN)/python -m pip install --quiet --no-compile --constraint constraints.txt --editable ".[$*]"
	touch $@
