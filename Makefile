# `make run` drives the default benchmark, `make test` runs the tests. Both install what is missing.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
ARGS ?=

.PHONY: run test test-all fuzz lint format bench docs clean

run: $(INSTALLED)
	$(BIN)/python -m drake_navbench.run $(ARGS)

test: $(INSTALLED)
	$(BIN)/python -m pytest $(ARGS)

test-all: $(INSTALLED)
	$(BIN)/python -m pytest -m "long or not long" $(ARGS)

fuzz: $(INSTALLED)
	FUZZ_CASES=10000 $(BIN)/python -m pytest tests/fuzz $(ARGS)

lint: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

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
