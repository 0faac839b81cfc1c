# Two commands: `make run` starts a city, `make test` runs every test. Both set up .venv first.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
MAP ?= driving_school
VENV := .venv
STAMP := $(VENV)/.installed
# Of what is installed, one module in eight is ever imported: those are compiled, once and not by each part of a city.
COMPILE := PYTHONDONTWRITEBYTECODE= $(VENV)/bin/python -c 'import importlib, pkgutil, scm; \
	[importlib.import_module(found.name) for found in pkgutil.walk_packages(scm.__path__, "scm.")]'

.PHONY: run test bench clean

run: $(STAMP)
	@$(VENV)/bin/scm up $(MAP) $(UP_ARGS)

test: $(STAMP)  # hundreds of processes are started: they share what the first compiled
	PYTHONDONTWRITEBYTECODE= $(VENV)/bin/python -m pytest -n auto --no-loadscope-reorder --max-worker-restart=0 $(PYTEST_ARGS)

bench: $(STAMP)
	$(VENV)/bin/pip install --quiet -e '.[bench]'
	$(VENV)/bin/python -m bench

$(STAMP): pyproject.toml
	@$(PYTHON) -c 'import sys; v = sys.version_info; sys.exit(v < (3, 11) and f"scm needs Python 3.11 or newer; {sys.executable} is {v[0]}.{v[1]}: set PYTHON=/path/to/python3.11")'
	@echo "installing into $(VENV) (once; half a minute to some minutes)"
	@$(PYTHON) -m venv $(VENV)
	@$(VENV)/bin/pip install --quiet --disable-pip-version-check --no-compile -e '.[dev]'
	@$(COMPILE)
	@touch $(STAMP)

clean:
	rm -rf $(VENV) build dist *.egg-info
