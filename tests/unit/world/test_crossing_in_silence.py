"""Four cars, four stop signs: bad radio makes them stand, never touch."""

import importlib.util
import math
from pathlib import Path

import pytest

from scm.records.city_map import RadioChannel

EXAMPLE = Path(__file__).parents[3] / "examples" / "crossing_without_lights.py"


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("crossing_without_lights", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("loss", "seed", "over"), [(0.0, 0, 4), (0.6, 1, 4), (0.9, 3, None), (1.0, 0, 0)]
)
def test_nobody_touches_whatever_gets_lost_and_all_go_while_they_hear(example, loss, seed, over):
    crossed = example.run(RadioChannel(loss=loss), seed, 30.0)
    assert crossed.least_distance_m > 0.05
    assert crossed.collisions == 0
    went = sum(time < math.inf for time in crossed.across_s.values())
    assert went < 4 if over is None else went == over
