"""Whether the car moves at all: one that stands shows nothing but noise, and noise is no motion."""

from collections.abc import Iterable

import numpy as np

from scm.arrays import Floats
from scm.data_quality.problem import DataProblem
from scm.data_quality.track import Track
from scm.data_quality.way import Way

LEAST_M = 0.05
NOISES = 6.0
COUNTED_M = 0.1


def moves(poses: Track) -> bool:
    """Say whether the poses go anywhere, beyond their own noise."""
    reach = np.hypot(_reach(poses.x), _reach(poses.y))
    noise = np.hypot(_noise(poses.x), _noise(poses.y))
    return bool(reach > LEAST_M + NOISES * noise)


def stands(poses: Track, found: Iterable[Way]) -> bool:
    """Say whether neither the poses nor any other sensor see the car move."""
    return not moves(poses) and all(np.ptp(way.distance.values) < COUNTED_M for way in found)


def standing_problem() -> DataProblem:
    """Return what to say of a recording in which nothing moves."""
    return DataProblem(
        channel="pose.*",
        name="standing",
        text="The car does not move in this recording.",
        record_instead="Drive: straights, both turns, starts and stops.",
    )


def _reach(values: Floats) -> float:
    low, high = np.percentile(values, (1, 99))
    return float(high - low)


def _noise(values: Floats) -> float:
    return float(1.4826 * np.median(np.abs(np.diff(values))) / np.sqrt(2.0))
