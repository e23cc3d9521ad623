# `make run` drives the default benchmark, `make test` runs the tests. Both install what is missing;
# with LOCKED=1 exactly what requirements.lock says, each file checked against its hash.
PYTHON ?= python3
LOCKED ?=
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed$(if $(LOCKED),-locked)
# What `make run` needs: all extras, without the tools of the tests.
RUN_INSTALLED := $(if $(LOCKED),$(INSTALLED),$(VENV)/.installed-run)
# Python compiles what it imports; pip, which would compile all of every package, takes 17 s longer.
PIP_INSTALL := $(BIN)/python -m pip install --quiet --no-compile
unexport PYTHONDONTWRITEBYTECODE
LOCK := requirements.lock
TOOLS := .venv-tools
SITE := .venv-site
ROS := .venv-ros
ARGS ?=
# Tests run in so many processes at once, each of up to 2 GB. The long ones run alone: some measure
# their own memory or time.
TEST_JOBS ?= auto --maxprocesses 4
# Folders that are installed as subpackages of drake_navbench.
SUBPACKAGES := analysis controllers models scenarios
TYPES := build/types
REPLAYS := build/replays/.made

.PHONY: run test test-all fuzz lint types package-links format bench bench-compare docs docs-figures \
	site site-versions release wheel lock audit sbom test-ros clean

run: $(RUN_INSTALLED)
	$(BIN)/python -m drake_navbench.run $(ARGS)

test: $(INSTALLED)
	$(BIN)/python -m pytest -n $(TEST_JOBS) --dist worksteal $(ARGS)

test-all: $(INSTALLED)
	$(BIN)/python -m pytest -m "long or not long" $(ARGS)

# Drives with a stack of the real rclpy. ROS's wheels (264 MB) stand in an environment of their own,
# which plain `make test` uses where it is there. They exist for Python 3.11 alone.
test-ros: $(INSTALLED) $(ROS)/.installed
	$(BIN)/python -m pytest tests/live -m "long or not long" $(ARGS)

fuzz: $(INSTALLED)
	FUZZ_CASES=10000 $(BIN)/python -m pytest tests/fuzz $(ARGS)

lint: $(INSTALLED) types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

# mypy and mkdocstrings look for a subpackage in its package's folder: they get a folder of links.
package-links:
	rm -rf $(TYPES)/drake_navbench
	mkdir -p $(TYPES)/drake_navbench
	ln -s $(abspath $(wildcard drake_navbench/*) $(SUBPACKAGES)) $(TYPES)/drake_navbench

types: $(INSTALLED) package-links
	cd $(TYPES) && $(abspath $(BIN))/python -m mypy --config-file $(CURDIR)/pyproject.toml >found; \
	status=$$?; \
	sed -E 's:^drake_navbench/($(subst $() ,|,$(SUBPACKAGES)))/:\1/:' found; exit $$status

format: $(INSTALLED)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(INSTALLED)
	$(BIN)/python -m pytest tests/benchmarks --benchmark-only --benchmark-json=bench.json $(ARGS)

# Two trees with an environment each: make bench-compare BASE=../before HEAD=.
bench-compare: $(INSTALLED)
	$(BIN)/python tests/benchmarks/compare_trees.py $(BASE) $(HEAD) $(ARGS)

docs: $(INSTALLED)
	$(BIN)/python studies/documentation/documents.py

# Published figures that are older than the code that they speak of, with their commands.
docs-figures: $(INSTALLED)
	$(BIN)/python studies/figure_ages.py

# The site of docs/ in build/site, which loads nothing from other hosts. A dead link fails it (not
# with --quiet, which would drop the warnings that --strict counts).
site: $(SITE)/.installed $(REPLAYS) package-links
	NO_MKDOCS_2_WARNING=1 $(SITE)/bin/mkdocs build --strict

# A folder for the site of each tag v*, and one for today's, in build/versions.
site-versions: $(SITE)/.installed $(REPLAYS)
	$(BIN)/python studies/site_versions.py

# The trials of the gallery's replays are driven once; `make clean` forgets them.
$(REPLAYS): $(INSTALLED) studies/site_replays.py
	$(BIN)/python studies/site_replays.py
	touch $@

# Wheel and sdist of the tag at HEAD, checked, installed and tried, in dist/.
release:
	$(PYTHON) .ci/release.py

# A wheel for this platform and Python that brings compiled kernels, in dist/.
wheel: $(INSTALLED)
	$(BIN)/python .ci/wheel.py $(ARGS)

lock: $(TOOLS)/.installed
	$(TOOLS)/bin/uv pip compile pyproject.toml --extra test --universal \
		--python-version 3.11 --generate-hashes --no-header --no-annotate --no-emit-index-url \
		--quiet --output-file $(LOCK) $(ARGS)

audit: $(TOOLS)/.installed
	$(TOOLS)/bin/python .ci/audit.py $(LOCK)

sbom: $(TOOLS)/.installed
	$(TOOLS)/bin/cyclonedx-py requirements $(LOCK) --pyproject pyproject.toml --output-file sbom.json

$(VENV)/.installed-run: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	PYTHONWARNINGS=ignore $(PIP_INSTALL) --editable ".[all]"
	touch $@

$(VENV)/.installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	PYTHONWARNINGS=ignore $(PIP_INSTALL) --editable ".[test]"
	touch $(VENV)/.installed-run $@

# A new environment: what another installation has left in it would not be what the lock says.
$(VENV)/.installed-locked: pyproject.toml $(LOCK)
	$(PYTHON) -m venv --clear $(VENV)
	$(PIP_INSTALL) --require-hashes --requirement $(LOCK)
	$(PIP_INSTALL) --no-deps --no-build-isolation --editable .
	touch $@

$(TOOLS)/.installed: Makefile
	$(PYTHON) -m venv $(TOOLS)
	$(TOOLS)/bin/python -m pip install --quiet "cyclonedx-bom>=7" "pip-audit>=2.9" "uv>=0.8"
	touch $@

$(SITE)/.installed: pyproject.toml
	$(PYTHON) -m venv $(SITE)
	$(PYTHON) .ci/extra.py site | $(SITE)/bin/python -m pip install --quiet --requirement /dev/stdin
	touch $@

$(ROS)/.installed: pyproject.toml
	$(PYTHON) -m venv $(ROS)
	$(PYTHON) .ci/extra.py ros | $(ROS)/bin/python -m pip install --quiet --requirement /dev/stdin
	touch $@

clean:
	rm -rf $(VENV) $(TOOLS) $(SITE) $(ROS) build dist bench.json sbom.json *.egg-info .pytest_cache .ruff_cache
