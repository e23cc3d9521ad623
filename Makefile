# `make run` drives the default benchmark, `make test` runs the tests. Both install what is missing.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
ARGS ?=
# Folders that are installed as subpackages of drake_navbench.
SUBPACKAGES := analysis controllers models scenarios
TYPES := build/types

.PHONY: run test test-all fuzz lint types format bench docs clean

run: $(INSTALLED)
	$(BIN)/python -m drake_navbench.run $(ARGS)

test: $(INSTALLED)
	$(BIN)/python -m pytest $(ARGS)

test-all: $(INSTALLED)
	$(BIN)/python -m pytest -m "long or not long" $(ARGS)

fuzz: $(INSTALLED)
	FUZZ_CASES=10000 $(BIN)/python -m pytest tests/fuzz $(ARGS)

lint: $(INSTALLED) types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

# mypy looks for a subpackage in its package's folder, so it is given a folder of links.
types: $(INSTALLED)
	rm -rf $(TYPES)/drake_navbench
	mkdir -p $(TYPES)/drake_navbench
	ln -s $(abspath $(wildcard drake_navbench/*) $(SUBPACKAGES)) $(TYPES)/drake_navbench
	cd $(TYPES) && $(abspath $(BIN))/python -m mypy --config-file $(CURDIR)/pyproject.toml >found; \
	status=$$?; \
	sed -E 's:^drake_navbench/($(subst $() ,|,$(SUBPACKAGES)))/:\1/:' found; exit $$status

format: $(INSTALLED)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(INSTALLED)
	$(BIN)/python -m pytest tests/benchmarks --benchmark-only $(ARGS)

docs: $(INSTALLED)
	$(BIN)/python -m drake_navbench docs

$(INSTALLED): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	PYTHONWARNINGS=ignore $(BIN)/python -m pip install --quiet --editable ".[test]"
	touch $(INSTALLED)

clean:
	rm -rf $(VENV) build *.egg-info .pytest_cache .ruff_cache
