"""The rows of a recording, screened before anything is compared: stamps, glitches and counters."""

from dataclasses import dataclass
from functools import partial

from scm.data_quality.bursts import without_bursts
from scm.data_quality.counters import repaired_counters
from scm.data_quality.limits import limits_of
from scm.data_quality.problem import DataProblem, Span
from scm.data_quality.spikes import without_spikes
from scm.data_quality.stamps import (
    in_order,
    in_seconds,
    with_numbers,
    without_repeats,
    without_strays,
)
from scm.recording.read import Recording
from scm.vehicles.car import Car


@dataclass(frozen=True, slots=True)
class Screened:
    """A recording whose rows are in order.

    Attributes:
        problems: Everything that was done to its rows.
        jumps: Spans over which its poses jump.
    """

    recording: Recording
    problems: tuple[DataProblem, ...]
    jumps: tuple[Span, ...]


def screen(recording: Recording, car: Car) -> Screened:
    """Return a recording with its rows in order, each possible for its car.

    Args:
        recording: As it was read; it is not changed.
        car: Says how fast it can go and turn.
    """
    limits = limits_of(car)
    now, problems = with_numbers(recording)
    for step in (
        partial(in_seconds, limits=limits),
        without_strays,
        in_order,
        without_bursts,
        without_repeats,
    ):
        now, found = step(now)
        problems += found
    now, found, jumps = without_spikes(now, limits)
    problems += found
    now, found = repaired_counters(now, limits)
    return Screened(now, (*problems, *found), jumps)
