"""A recording as tools compare it with a car: screened row by row, cut at gaps, repaired."""

from dataclasses import dataclass

from scm.data_quality.check import check
from scm.data_quality.corrected import corrected
from scm.data_quality.problem import DataProblem
from scm.data_quality.stretches import stretches
from scm.data_quality.suspicion import Quality
from scm.errors import RecordingError
from scm.recording.read import Recording
from scm.vehicles.car import Car


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """A recording as it is compared with a car.

    Attributes:
        recordings: Its stretches without gaps, in time order, repaired.
        problems: All that was found in it.
        account: What was read, left out, repaired and cut, a line each.
        quality: Of the whole recording.
    """

    recordings: tuple[Recording, ...]
    problems: tuple[DataProblem, ...]
    account: tuple[str, ...]
    quality: Quality


def prepare(recording: Recording, car: Car, *, strict: bool = False) -> Prepared:
    """Return a recording screened row by row, cut at its gaps and repaired.

    Args:
        recording: As it was read; it is not changed.
        car: Whose recording it is: it says how fast a car can go and turn.
        strict: Refuse a recording in which anything has to be left out or repaired.

    Raises:
        RecordingError: when `strict` is set and the recording is not in order.
    """
    quality = check(recording, car)
    cut = stretches(corrected(recording, quality), car)
    problems = (*(p for p in quality.problems if not cut.explains(p)), *cut.problems)
    repairs = [p for p in problems if p.corrected]
    account = tuple(f"{p.channel}: {p.said} {p.corrected}" for p in repairs)
    if strict and account:
        raise RecordingError("\n".join(f"{recording.path}: {line}" for line in account))
    return Prepared(
        recordings=cut.recordings,
        problems=problems,
        account=account,
        quality=quality,
    )
