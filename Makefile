# `make run` starts a city, `make test` runs every test; both set up .venv first. `make docs` builds the site.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
MAP ?= driving_school
VENV := .venv
# What running takes is installed for `make run`; `make test` adds its tools, as much again.
RUNS := $(VENV)/.runs
TESTS := $(VENV)/.tests
INSTALL = $(VENV)/bin/pip install --quiet --disable-pip-version-check --no-compile
# Of what is installed, one module in eight is ever imported: those are compiled, once and not by each part of a city.
COMPILE := PYTHONDONTWRITEBYTECODE= $(VENV)/bin/python -c 'import importlib, pkgutil, scm; \
	[importlib.import_module(found.name) for found in pkgutil.walk_packages(scm.__path__, "scm.")]'
# A first world compiles the physics and the drivers; afterwards they are in the user's cache, for every process.
KERNELS := $(VENV)/bin/python -c 'from scm.maps.load import load_map; from scm.world.part import WorldPart; \
	WorldPart(load_map("driving_school"), 0, ())'

.PHONY: run test docs bench clean

run: $(RUNS)
	@echo "starting the city on $(MAP)"
	@$(VENV)/bin/scm up $(MAP) $(UP_ARGS)

test: $(TESTS)  # hundreds of processes are started: they share what the first compiled
	PYTHONDONTWRITEBYTECODE= $(VENV)/bin/python -m pytest -n auto --no-loadscope-reorder --max-worker-restart=0 $(PYTEST_ARGS)

docs: $(TESTS)
	@$(VENV)/bin/python -m sphinx -q -W -b html -d build/site_trees docs build/site
	@echo "open build/site/index.html"

bench: $(TESTS)
	$(VENV)/bin/pip install --quiet -e '.[bench]'
	$(VENV)/bin/python -m bench

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; v = sys.version_info; sys.exit(v < (3, 11) and f"scm needs Python 3.11 or newer; {sys.executable} is {v[0]}.{v[1]}: set PYTHON=/path/to/python3.11")'
	@$(PYTHON) -m venv $(VENV)

$(RUNS): pyproject.toml | $(VENV)/bin/python
	@echo "installing into $(VENV), 1 GB (once; half a minute to some minutes)"
	@$(INSTALL) -e '.[formats,postgres,ros2,study,sumo,v2x]'
	@echo "compiling its Python and physics (once; a minute or two)"
	@$(COMPILE)
	@$(KERNELS)
	@touch $@

$(TESTS): pyproject.toml | $(VENV)/bin/python
	@echo "installing into $(VENV) with the tests' tools, 3 GB (once; half a minute to some minutes)"
	@$(INSTALL) -e '.[dev]'
	@$(COMPILE)
	@$(KERNELS)
	@touch $(RUNS) $@

clean:
	rm -rf $(VENV) build dist *.egg-info
