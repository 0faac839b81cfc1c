"""The data step: recordings checked and repaired, and of too long ones the pieces compared."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from msgspec import structs

from scm.arrays import Floats
from scm.data_quality.pose_track import clean, recorded_s
from scm.data_quality.prepare import Prepared, between, prepare
from scm.data_quality.quality import DataProblem, Quality
from scm.mismatch.budget import needed_s
from scm.recorder.drives import SUFFIX
from scm.recording.read import Recording
from scm.vehicles.car import Car

POSE_X, SHORTEST_S = "pose.x", 20.0  # of several recordings together, where each is short
OF_SHORT = ("no_verdict", "too_short")
PIECE_S = 30.0  # long enough for slow effects, short enough for several in any sample
STEP_S = 0.5  # of the way: shorter steps of a car that stands add up their noise
MOVES = 0.3  # of the usual way of a piece: one in which the car mostly stands shows little


@dataclass(frozen=True, slots=True)
class Data:
    """What a diagnosis works with.

    Attributes:
        recordings: Stretches that can be used, repaired; empty: none can.
        problems: Everything that is wrong with any recording.
        account: Which rows were read, a line a recording.
        titles: Names of the recordings for a report.
    """

    recordings: tuple[Recording, ...]
    problems: tuple[DataProblem, ...]
    account: tuple[str, ...]
    titles: tuple[str, ...]


def check(
    recordings: Sequence[Recording], car: Car, compared_s: float, *, strict: bool = False
) -> Data:
    """Return the stretches of recordings that can be used, and what is wrong with any.

    Args:
        recordings: As they were read.
        car: That they are of.
        compared_s: At most so much of them is compared, see `Budget.compared_s`.
        strict: Refuse recordings in which anything has to be left out or repaired.

    Raises:
        ScmError: when a recording cannot be used as such a car's.
    """
    prepared = [prepare(recording, car, strict=strict) for recording in recordings]
    usable, problems = _usable(recordings, prepared)
    account = tuple(one.account[0] for one in prepared)  # what was done is in the problems
    chosen, partly = sampled(usable, compared_s) if usable else (usable, ())
    titles = titles_of(chosen or recordings)
    return Data(tuple(chosen), (*problems, *partly), account, titles)


def titles_of(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Return the names of recordings, each once: stretches of one have one."""
    return tuple(dict.fromkeys(map(_title, recordings)))


def _title(recording: Recording) -> str:
    path = recording.path
    if path.suffix == SUFFIX:
        return f"{recording.name} of {path.stem}"
    return path.parent.name if path.name == "recording.yaml" else path.stem


def _usable(
    recordings: Sequence[Recording], every: Sequence[Prepared]
) -> tuple[list[Recording], tuple[DataProblem, ...]]:
    """Return the recordings that can be used, repaired, and everything wrong with any."""
    usable, problems = list[Recording](), list[DataProblem]()
    length_s = _length_s([part for one in every for part in one.recordings])
    for recording, one in zip(recordings, every, strict=True):
        quality = one.quality
        together = length_s > SHORTEST_S and _is_only_short(quality)
        where = f"{_title(recording)}: " if len(recordings) > 1 else ""
        problems += [
            structs.replace(p, text=where + p.text)
            for p in one.problems
            if not together or p.name not in OF_SHORT
        ]
        if together or quality.usable.can_diagnose:
            usable += one.recordings
    return usable, tuple(problems)


def _length_s(recordings: Sequence[Recording]) -> float:
    """Return how long recordings with poses are together."""
    posed = [clean(r.channel(POSE_X)).t for r in recordings if POSE_X in r.channels]
    return sum(recorded_s(t) for t in posed if len(t))


def _is_only_short(quality: Quality) -> bool:
    """Return whether a recording lacks nothing but length, which several have together."""
    lacks = quality.usable.lacks
    return bool(lacks) and all(lack.startswith("only ") for lack in lacks)


class _Piece(NamedTuple):
    """A part of a recording: its number there, and in the order of all."""

    recording: int
    first_s: float
    last_s: float


def sampled(
    recordings: Sequence[Recording], allowed_s: float
) -> tuple[list[Recording], tuple[DataProblem, ...]]:
    """Return what of some recordings is compared in a budget, and a problem if it is not all.

    Args:
        recordings: Without gaps, with poses.
        allowed_s: So much of them, see `Budget.allowed_s`.
    """
    times = [recording.channel("pose.x").t for recording in recordings]
    whole_s = sum(float(t[-1] - t[0]) for t in times)
    if whole_s <= allowed_s:
        return list(recordings), ()
    pieces = [piece for i, t in enumerate(times) for piece in _pieces(i, t)]
    ways = np.array([_way(recordings[p.recording], p) for p in pieces])
    moving = [p for p, way in zip(pieces, ways, strict=True) if way >= MOVES * np.median(ways)]
    count = max(1, int(allowed_s / PIECE_S))
    rows = np.unique(np.linspace(0, len(moving) - 1, min(count, len(moving))).round().astype(int))
    chosen = _joined([moving[row] for row in rows])
    compared_s = sum(p.last_s - p.first_s for p in chosen)
    parts = [between(recordings[p.recording], p.first_s, p.last_s) for p in chosen]
    problem = DataProblem(
        channel="*",
        name="partly_compared",
        text=f"{compared_s:.0f} s of {whole_s:.0f} s are compared, in {len(parts)} pieces all over "
        f"the recording in which the car moves: the budget allows no more. All of it takes "
        f"`--budget-s {needed_s(whole_s):.0f}`.",
    )
    return parts, (problem,)


def _pieces(recording: int, t: Floats) -> list[_Piece]:
    """Return a recording in pieces of about one length."""
    count = max(1, round(float(t[-1] - t[0]) / PIECE_S))
    cuts = np.linspace(t[0], t[-1], count + 1)
    return [_Piece(recording, float(cuts[i]), float(cuts[i + 1])) for i in range(count)]


def _way(recording: Recording, piece: _Piece) -> float:
    """Return how far the car goes in a piece [m]."""
    at = np.arange(piece.first_s, piece.last_s, STEP_S)
    x, y = (recording.channel(name) for name in ("pose.x", "pose.y"))
    steps = (np.diff(np.interp(at, c.t, c.values)) for c in (x, y))
    return float(np.hypot(*steps).sum())


def _joined(pieces: Sequence[_Piece]) -> list[_Piece]:
    """Return pieces that follow one another without a break as one."""
    joined: list[_Piece] = []
    for piece in pieces:
        last = joined[-1] if joined else None
        if last and last.recording == piece.recording and last.last_s == piece.first_s:
            joined[-1] = last._replace(last_s=piece.last_s)
        else:
            joined.append(piece)
    return joined
