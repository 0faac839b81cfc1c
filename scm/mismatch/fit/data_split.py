"""Three disjoint parts of recordings: to fit numbers, to choose effects, and only to confirm.

Parts are blocks of a few seconds that take turns, so that each part sees all of a drive. The order
of the turns changes from four blocks to four, or laps as long as they would tie parts to places.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.data_quality.quality import Span
from scm.mismatch.fit.likelihood import Likelihood
from scm.replay.drive import Drive

BLOCK_S = 5.0
LEAST_BLOCKS = 4
WHOLE = 2.0  # blocks: drives that are shorter are not cut, where there are enough of them
NAMES = ("fit", "choose", "confirm")
_FIT, _CHOOSE, _CONFIRM = range(3)
_TURNS = (
    (_FIT, _CHOOSE, _FIT, _CONFIRM),
    (_CONFIRM, _FIT, _CHOOSE, _FIT),
    (_FIT, _CONFIRM, _FIT, _CHOOSE),
    (_CHOOSE, _FIT, _CONFIRM, _FIT),
)


@dataclass(frozen=True, slots=True)
class Part:
    """One part of all recordings.

    Attributes:
        weight: 1 for each innovation in it, else 0, (events,).
        spans: Its blocks in each drive, on the recording's clock.
    """

    weight: Floats
    spans: tuple[tuple[Span, ...], ...]


@dataclass(frozen=True, slots=True)
class Parts:
    """The three parts; every innovation is in one of them."""

    fit: Part
    choose: Part
    confirm: Part


def split(model: Likelihood, block_s: float = BLOCK_S) -> Parts:
    """Return about half, a quarter and a quarter of each recording; the same for the same ones.

    Of many recordings too short for four blocks, whole ones take turns.
    """
    weights = [list[Floats]() for _ in NAMES]
    spans = [list[tuple[Span, ...]]() for _ in NAMES]
    every = blocks(model.drives, block_s)
    for number, (cuts, whitener) in enumerate(zip(every, model.whiteners, strict=True)):
        whose = _whose(len(cuts) - 1, number)
        block = np.clip(np.searchsorted(cuts, whitener.t, side="right") - 1, 0, len(whose) - 1)
        for part in range(len(NAMES)):
            weights[part].append((whose[block] == part).astype(np.float64))
            spans[part].append(_spans(cuts, whose == part))
    return Parts(*(Part(np.concatenate(w), tuple(s)) for w, s in zip(weights, spans, strict=True)))


def blocks(drives: Sequence[Drive], block_s: float = BLOCK_S) -> list[Floats]:
    """Return where the blocks of each drive begin and end, all of a drive of one length.

    Short drives are one block each, where there are enough of them, or enough beside them.
    """
    spans = [(float(drive.edges[0]), float(drive.edges[-1])) for drive in drives]
    lengths = [last - first for first, last in spans]
    are_many = len(drives) >= LEAST_BLOCKS and max(lengths) < WHOLE * block_s
    cuts = []
    for (first, last), length in zip(spans, lengths, strict=True):
        others = sum(lengths) - length
        is_short = length < WHOLE * block_s and others >= LEAST_BLOCKS * block_s
        count = 1 if are_many or is_short else max(round(length / block_s), LEAST_BLOCKS)
        cuts.append(np.linspace(first, last, count + 1))
    return cuts


def _whose(count: int, first: int) -> Ints:
    """Return the part of each block; drives begin with different turns."""
    if count < LEAST_BLOCKS:
        return np.array([_TURNS[first // LEAST_BLOCKS % len(_TURNS)][first % LEAST_BLOCKS]])
    turns = [_TURNS[(first + i) % len(_TURNS)] for i in range(-(-count // LEAST_BLOCKS))]
    return np.array([part for turn in turns for part in turn])[:count]


def _spans(cuts: Floats, mine: Bools) -> tuple[Span, ...]:
    return tuple((float(cuts[i]), float(cuts[i + 1])) for i in range(len(cuts) - 1) if mine[i])
