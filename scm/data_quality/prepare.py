"""A recording as tools compare it with a car: screened row by row, cut at gaps, repaired."""

from collections.abc import Iterable
from dataclasses import dataclass

from scm.data_quality.check import check
from scm.data_quality.corrected import corrected
from scm.data_quality.problem import DataProblem
from scm.data_quality.suspicion import Quality
from scm.errors import RecordingError
from scm.recording.columns import LeftOut
from scm.recording.read import Recording
from scm.vehicles.car import Car

MOST_LISTED = 10  # reasons: whoever reads more has the wrong file


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
    repairs = [p for p in quality.problems if p.corrected]
    account = (
        *lines_left_out(recording.left_out),
        *(f"{p.channel}: {p.said} {p.corrected}" for p in repairs),
    )
    if strict and account:
        raise RecordingError("\n".join(f"{recording.path}: {line}" for line in account))
    return Prepared(
        recordings=(corrected(recording, quality),),
        problems=quality.problems,
        account=account,
        quality=quality,
    )


def lines_left_out(left_out: Iterable[LeftOut]) -> tuple[str, ...]:
    """Return what a recording's files hold that was not read: what is alike in one sentence."""
    alike: dict[tuple[str, str], list[LeftOut]] = {}
    for one in left_out:
        alike.setdefault((one.file, one.why), []).append(one)
    said = []
    for (file, why), some in list(alike.items())[:MOST_LISTED]:
        first = ", ".join(str(one.line) for one in some[:3])
        more = f" and {len(some) - 3} more" if len(some) > 3 else ""
        said.append(f"{file}: lines {first}{more}: {why}" if len(some) > 1 else str(some[0]))
    rest = sum(map(len, list(alike.values())[MOST_LISTED:]))
    return (*said, f"and {rest} more lines that are no rows") if rest else tuple(said)
