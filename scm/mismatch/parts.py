"""Three disjoint parts of recordings: to fit numbers, to choose effects, and only to confirm.

Parts are blocks of a few seconds that take turns, so that each part sees all of a drive. The order
of the turns changes from four blocks to four, or laps as long as they would tie parts to places.
"""

from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.mismatch.findings import Span
from scm.mismatch.likelihood import Likelihood

BLOCK_S = 5.0
LEAST_BLOCKS = 4
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
    """Return about half, a quarter and a quarter of each recording; the same for the same ones."""
    weights = [list[Floats]() for _ in NAMES]
    spans = [list[tuple[Span, ...]]() for _ in NAMES]
    for number, (drive, whitener) in enumerate(zip(model.drives, model.whiteners, strict=True)):
        cuts = cuts_of(float(drive.edges[0]), float(drive.edges[-1]), block_s)
        whose = _whose(len(cuts) - 1, number)
        block = np.clip(np.searchsorted(cuts, whitener.t, side="right") - 1, 0, len(whose) - 1)
        for part in range(len(NAMES)):
            weights[part].append((whose[block] == part).astype(np.float64))
            spans[part].append(_spans(cuts, whose == part))
    return Parts(*(Part(np.concatenate(w), tuple(s)) for w, s in zip(weights, spans, strict=True)))


def cuts_of(first: float, last: float, block_s: float) -> Floats:
    """Return where blocks begin and end: at least four, all of one length."""
    blocks = max(round((last - first) / block_s), LEAST_BLOCKS)
    return np.linspace(first, last, blocks + 1)


def _whose(blocks: int, first: int) -> Ints:
    """Return the part of each block; drives begin with different turns."""
    turns = [_TURNS[(first + i) % len(_TURNS)] for i in range(-(-blocks // LEAST_BLOCKS))]
    return np.array([part for turn in turns for part in turn])[:blocks]


def _spans(cuts: Floats, mine: Bools) -> tuple[Span, ...]:
    return tuple((float(cuts[i]), float(cuts[i + 1])) for i in range(len(cuts) - 1) if mine[i])
