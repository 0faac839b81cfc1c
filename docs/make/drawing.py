"""matplotlib for the scripts beside, set to draw into files; where it is missing, it says so."""

import sys

try:
    import matplotlib as mpl
except ModuleNotFoundError as error:
    if error.name != "matplotlib":
        raise
    sys.exit("matplotlib is missing; install it with: .venv/bin/pip install -e '.[docs]'")

mpl.use("Agg")

import matplotlib.pyplot as plt

__all__ = ["plt"]
