# make demo   install into .venv and remesh a sample; results in demo/
# make test   install what the tests need as well and run every test
# make docs   build the documentation into site/ and report broken links
# make check  the tests and all linters, as in continuous integration

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo docs test install check clean

demo: $(VENV)/.installed-picture
	$(BIN)/anisomesh demo --out demo

test: install
	$(BIN)/python -m pytest

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

# The installation is editable, so only a change of the dependencies asks for a new one.
$(VENV)/.installed-%: pyproject.toml constraints.txt | $(BIN)/python
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable ".[$*]"
	touch $@
