"""Where a law's curve may begin: periods, directions and places that a drive could show."""

import itertools
from collections.abc import Iterator, Mapping

import numpy as np

from scm.arrays import Floats
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect, Values
from scm.mismatch.discovery.impulse_response import Cells

FASTEST_HZ = 1.0
SHORTEST = 2.2  # cells in a wave


def grid_of(effect: DictionaryEffect, cells: Cells) -> Iterator[Values]:
    """Yield values of a law's knobs but for its amount, which is 1; a wave's phase is 0."""
    names = [parameter.name for parameter in effect.parameters][1:]
    if "length_m" in names:
        yield from ((1.0, length, way, 0.0) for length, way in _vectors(cells))
        return
    grids = _grids(cells)
    sizes = [grids[name] for name in names]
    for row in itertools.product(*sizes):
        yield (1.0, *map(float, row))


def _grids(cells: Cells) -> Mapping[str, Floats]:
    t, speed = cells.driven["time"], cells.driven["speed"]
    x, y = cells.driven["x"], cells.driven["y"]
    span, size = float(t.max()), float(np.hypot(x, y).max())
    slowest, fastest = 0.7 / span, min(FASTEST_HZ, 1.0 / (SHORTEST * cells.wide))
    centre_at = np.linspace(-0.8, 0.8, 25) * size
    return {
        "toward_rad": np.linspace(0.0, np.pi, 6, endpoint=False),
        "period_s": 1.0 / np.arange(slowest, fastest, 0.4 / span),
        "phase_rad": np.zeros(1),
        "from_s": np.linspace(0.05, 0.95, 37) * span,
        "against_rad": np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False),
        "way_rad": np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False),
        "beyond_m": centre_at,
        "memory_s": np.geomspace(0.5, 0.7 * span, 12),
        "above_mps": np.percentile(speed, [5, 20, 35, 50, 65, 80, 90]),
    }


def _vectors(cells: Cells) -> Iterator[tuple[float, float]]:
    """Yield (length, direction) of waves over the floor, no two alike where the car drove."""
    width, height = (max(float(np.ptp(cells.driven[k])), 0.1) for k in ("x", "y"))
    pace = float(np.percentile(cells.driven["speed"], 90)) * cells.wide
    most = 2.0 * np.pi / max(SHORTEST * pace, 0.06)
    kx = np.arange(0.0, most, 2.5 / width)
    ky = np.arange(-most, most, 2.5 / height)
    for a in kx:
        for b in ky:
            size = float(np.hypot(a, b))
            if 0.9 * 2.0 * np.pi / max(width, height) < size < most and (a > 0.0 or b > 0.0):
                yield 2.0 * np.pi / size, float(np.arctan2(b, a))
