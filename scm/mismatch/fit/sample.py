"""Of recordings that are too long for a budget, the pieces that are compared."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats
from scm.data_quality.problem import DataProblem
from scm.data_quality.stretches import between
from scm.mismatch.budget import needed_s
from scm.recording.read import Recording

PIECE_S = 30.0  # long enough for slow effects, short enough for several in any sample
STEP_S = 0.5  # of the way: shorter steps of a car that stands add up their noise
MOVES = 0.3  # of the usual way of a piece: one in which the car mostly stands shows little


class _Piece(NamedTuple):
    """A part of a recording: its number there, and in the order of all."""

    recording: int
    first_s: float
    last_s: float


def sampled(
    recordings: Sequence[Recording], allowed_s: float
) -> tuple[list[Recording], tuple[DataProblem, ...]]:
    """Return what of some recordings is compared in a budget, and what to say if it is not all.

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
    taken_s = sum(p.last_s - p.first_s for p in chosen)
    parts = [between(recordings[p.recording], p.first_s, p.last_s) for p in chosen]
    problem = DataProblem(
        channel="*",
        name="partly_compared",
        text=f"{taken_s:.0f} s of {whole_s:.0f} s are compared, in {len(parts)} pieces all over "
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
