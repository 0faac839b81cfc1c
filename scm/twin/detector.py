"""Sequential detection of a change in what a car file misses: generalised likelihood ratios.

A change of a known number by `d` moves the misses of every window after it by slopes times `d`. For
each number and several spans of driving, `d` is estimated from the windows of the newest span and
from all before it; their difference, in standard deviations, is the score. So a car file need not
be right: what it has missed from the beginning is no change. How far windows stray, by themselves
and together, and for how long they stray the same way, is learned from the first minutes.

The onset is where the likelihood of the number with the highest score is greatest, and its interval
all places that are at least e^-1.35 times as likely (90 %), and a window more on either side. A
change at once and one that grows evenly since then are compared at each place.
Source: Willsky and Jones, A generalized likelihood ratio approach to the detection and estimation
of jumps in linear systems, IEEE Transactions on Automatic Control 21 (1976).
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Floats
from scm.errors import RunError
from scm.mismatch.fit.residual_windows import LENGTH_S
from scm.twin.windows import EVERY_S, Windows

LIMITED, NEAR, WHOLE, INFORMATION = range(4)  # what windows show of a number
LEARN, LEARN_WELL = 400, 1200  # windows: 200 and 600 s of driving
EARLY = 1.2  # factor on the threshold between the two: 200 s show scatter less well
SPANS_S = (10.0, 20.0, 40.0, 80.0, 160.0, 320.0)
MEMORY = 1200  # windows in which an onset is searched for
FORGET = 1.0 / 14400.0  # of all before them, for each window: two hours
LIMIT = 2.5  # standard deviations that a window counts for at most, over all streams
LIMIT_OF_NUMBER = 3.0  # likewise, of what it shows of one number beyond what is usual
LEVERAGE = 90.0  # percentile of the windows' information beyond which one counts no more
ROUNDS = 20  # of an estimate that is bounded so
TRUST = 0.05  # added to the misses' correlations: sensors are never as alike as a short drive shows
TOGETHER = 80  # windows: longest span whose scatter 200 s can show
LIKELY = 1.35  # of the log likelihood: 90 %
RARER = 1.0  # a change that grows than one at once, as a log likelihood
TINY = 1e-12  # no information: the score is 0 as well
HOURLY, PER_FOLD = 6.0, 0.7  # highest score of an hour; more for e times as many hours
ALIKE, MOST_ALIKE = 0.8, 5  # of the highest score; other numbers that are named


def threshold_of(false_alarm_h: float) -> float:
    """Return the score that a car which does not change reaches once in so many hours of driving.

    From the highest scores of 6.5 minutes each of 20 cars of `tests/reality` that do not change, 8
    hours in all: beyond those that come twice an hour they spread as an exponential distribution.

    Raises:
        RunError: when that is not more than 0.
    """
    if not false_alarm_h > 0.0:
        raise RunError(f"false_alarm_h: expected more than 0, got {false_alarm_h:g}")
    return HOURLY + PER_FOLD * math.log(false_alarm_h)


@dataclass(frozen=True, slots=True)
class Change:
    """A change that was detected.

    Attributes:
        number: Of the watched number that shows it most.
        score: In standard deviations, with its sign.
        size: How far that number changed, in its unit.
        noticed_s: On the clock of the windows.
        onset_s: Likeliest, and the ends of its interval, 90 %.
        alike: Further numbers that show it nearly as well, the best first, each with the size of
            its change.
    """

    number: int
    score: float
    size: float
    noticed_s: float
    onset_s: tuple[float, float, float]
    alike: tuple[tuple[int, float], ...]


@dataclass(frozen=True, slots=True)
class Usual:
    """How a car's windows stray while nothing changes.

    Attributes:
        size: Of each stream's misses, (streams,).
        weight: Inverse of the covariance of the misses over their sizes, (streams, streams).
        most: Information of one window that counts at most, (numbers,).
        off: How far each number seems to be from the file's all the time, (numbers,).
        inflation: Variance of a span's score over that of independent windows, (spans, numbers).
    """

    size: Floats
    weight: Floats
    most: Floats
    off: Floats
    inflation: Floats


class Detector:
    """Watches the windows of one car.

    Args:
        threshold: Score from which on a change is reported; see `threshold_of`.

    Attributes:
        driven_s: How long the car was watched.
        highest: Score that the newest windows reach, to be held against the threshold.
    """

    def __init__(self, threshold: float) -> None:
        self._threshold = threshold
        self._learned: Windows | None = None  # all, until there are enough to learn from
        self._history: History | None = None
        self.driven_s = self.highest = 0.0

    @property
    def is_learning(self) -> bool:
        """Whether it does not yet know how the car strays."""
        return self._history is None

    @property
    def usual(self) -> Usual | None:
        """How the car strays; None: not known yet."""
        return None if self._history is None else self._history.usual

    def update(self, windows: Windows) -> Change | None:
        """Take new windows; return the change that they show, if they do.

        A change stays one: afterwards, give the car another detector.
        """
        newest, began = len(windows.begin_s), self.is_learning
        self.driven_s += EVERY_S * newest
        self.highest = 0.0
        if self._history is not None:
            self._history.add(windows)
        self._learn(windows)
        if self._history is None or began:
            return None
        scores = self._history.scores(newest)
        if not scores.size:
            return None
        highest = np.unravel_index(np.argmax(np.abs(scores)), scores.shape)
        self.highest = float(abs(scores[highest])) / (1.0 if self._learned is None else EARLY)
        if self.highest < self._threshold:
            return None
        return self._history.change(scores[highest[:-1]])

    def _learn(self, windows: Windows) -> None:
        """Learn how the car strays, once from few windows and once from more."""
        before = 0 if self._learned is None else len(self._learned.begin_s)
        if self._learned is None and self._history is not None:
            return
        self._learned = windows if self._learned is None else joined(self._learned, windows)
        now = len(self._learned.begin_s)
        if any(before < enough <= now for enough in (LEARN, LEARN_WELL)):
            self._history = History(usual_of(self._learned), self._learned)
        if now >= LEARN_WELL:
            self._learned = None


class History:
    """What windows have shown of each number: of the newest each, of those before in sum.

    Args:
        usual: How the car strays.
        windows: By which that was learned.
    """

    def __init__(self, usual: Usual, windows: Windows) -> None:
        self.usual = usual
        self._t = windows.begin_s
        self._shown = weighed(windows, usual)
        self._before = np.zeros_like(self._shown[:, 0])  # the sum of those that left its memory
        self._gone = 0

    def add(self, windows: Windows) -> None:
        """Add new windows; those that leave its memory are added up."""
        self._t = np.concatenate((self._t, windows.begin_s))
        self._shown = np.concatenate((self._shown, weighed(windows, self.usual)), axis=1)
        gone = max(0, len(self._t) - MEMORY)
        self._before *= (1.0 - FORGET) ** gone
        self._before += self._shown[:, :gone].sum(axis=1)
        self._t, self._shown = self._t[gone:], self._shown[:, gone:]
        self._gone += gone

    def scores(self, newest: int) -> Floats:
        """Return the scores at each of the newest windows, (newest, spans, numbers)."""
        sums = np.cumsum(np.concatenate((self._before[:, None], self._shown), axis=1), axis=1)
        ends = np.arange(len(self._t) - newest + 1, len(self._t) + 1)
        found = np.zeros((newest, len(SPANS_S), sums.shape[2]))
        for k, span_s in enumerate(SPANS_S):
            begins = ends - round(span_s / EVERY_S)
            there = begins + self._gone >= LEARN  # what came before has to show as much
            there &= begins >= 0
            before = sums[:, begins[there]]
            moved, variance = _moved(sums[:, ends[there]] - before, before, LIMITED)
            found[there, k] = moved / np.sqrt(self.usual.inflation[k] * variance)
        return found

    def change(self, scores: Floats) -> Change:
        """Return the change that scores (numbers,) show; its onset is where that is likeliest.

        A plain change reaches what a window counts at most in many numbers alike: which one it is,
        windows say that are limited altogether only.
        """
        first = int(np.argmax(np.abs(scores)))
        after = np.cumsum(self._shown[:, ::-1], axis=1)[:, ::-1]  # from each window on
        before = self._before[:, None] + after[:, :1] - after
        likelihood = self._likelihood(first)
        onset = int(np.argmax(likelihood))
        near = np.flatnonzero(likelihood > likelihood[onset] - LIKELY)
        low, high = self._t[near[0]] - EVERY_S, self._t[near[-1]] + LENGTH_S
        moved, variance = _moved(after[:, onset], before[:, onset], NEAR)
        shown = np.abs(moved) / np.sqrt(self.usual.inflation.max(axis=0) * variance)
        best, *others = np.argsort(-shown, kind="stable")
        sizes, _ = _moved(after[:, onset], before[:, onset], WHOLE)
        alike = [(int(k), float(sizes[k])) for k in others if shown[k] > ALIKE * shown[best]]
        return Change(
            number=int(best), score=float(np.copysign(np.abs(scores).max(), sizes[best])),
            size=float(sizes[best]), noticed_s=float(self._t[-1] + LENGTH_S),
            onset_s=(float(self._t[onset]), float(low), float(high)),
            alike=tuple(alike[:MOST_ALIKE]),
        )  # fmt: skip

    def _likelihood(self, number: int) -> Floats:
        """Return the log likelihood that a number began to change at each window, (windows,).

        Of a change at once, or of one that grows evenly since: whichever is likelier there.
        """
        gone, shown = self._before[:, number], self._shown[..., number]
        since, at = np.arange(shown.shape[1]), np.arange(1.0, shown.shape[1] + 1.0)

        def later(values: Floats) -> Floats:
            return np.asarray(np.cumsum(values[::-1])[::-1])

        score, information = shown[LIMITED], shown[INFORMATION]
        whole, known = gone[LIMITED] + score.sum(), gone[INFORMATION] + information.sum()
        by_one, by_time = later(information), later(at * information)
        growing = by_time - since * by_one
        squared = later(at * at * information) - 2.0 * since * by_time + since**2 * by_one
        at_once = later(score), by_one, by_one
        evenly = later(at * score) - since * later(score), growing, squared
        inflation = self.usual.inflation[:, number].max()
        found = [
            0.5 * (seen - mixed * whole / known) ** 2
            / np.maximum((own - mixed * mixed / known) * inflation, TINY)
            for seen, mixed, own in (at_once, evenly)
        ]  # fmt: skip
        return np.asarray(np.maximum(found[0], found[1] - RARER))


def _moved(after: Floats, before: Floats, score: int) -> tuple[Floats, Floats]:
    """Return how far numbers moved between two spans, and that variance for independent windows.

    Where a span shows nothing of a number, it did not move, and its variance is infinite.

    Args:
        after: What the later span shows, (4, ...), as `weighed` has it.
        before: Likewise, the earlier one.
        score: By which of the scores.
    """
    is_shown = (after[INFORMATION] > 0.0) & (before[INFORMATION] > 0.0)
    late, early = (np.where(is_shown, each[INFORMATION], 1.0) for each in (after, before))
    moved = np.where(is_shown, after[score] / late - before[score] / early, 0.0)
    return moved, np.where(is_shown, 1.0 / late + 1.0 / early, math.inf)


def joined(first: Windows, then: Windows) -> Windows:
    """Return windows one after the other."""
    return replace(
        first,
        begin_s=np.concatenate((first.begin_s, then.begin_s)),
        places=np.concatenate((first.places, then.places)),
        misses=np.concatenate((first.misses, then.misses)),
        slopes=np.concatenate((first.slopes, then.slopes)),
    )


def usual_of(windows: Windows) -> Usual:
    """Return how the windows of a car that does not change stray."""
    misses = windows.misses
    middle = np.median(misses, axis=0)
    size = np.maximum(1.4826 * np.median(np.abs(misses - middle), axis=0), 0.5 * misses.std(axis=0))
    size = np.where(size > 0.0, size, 1.0)
    apart = np.clip((misses - misses.mean(axis=0)) / size, -4.0, 4.0)
    covariance = apart.T @ apart / len(apart) + TRUST * np.eye(len(size))
    spans, numbers = len(SPANS_S), windows.slopes.shape[2]
    usual = Usual(
        size, np.linalg.inv(covariance), np.full(numbers, math.inf), np.zeros(numbers),
        np.ones((spans, numbers)),
    )  # fmt: skip
    _, _, information = _scores(windows, usual)
    usual = replace(usual, most=np.percentile(information, LEVERAGE, axis=0))
    near, _, information = _scores(windows, usual)
    known, off = np.maximum(information.sum(axis=0), 1e-30), usual.off
    for _ in range(ROUNDS):
        off = _limited(near, information, off).sum(axis=0) / known
    inflation = _inflation(_limited(near, information, off), information)
    return replace(usual, off=off, inflation=inflation)


def _inflation(score: Floats, information: Floats) -> Floats:
    """Return how much more the sums over spans scatter than independent windows would."""
    known = np.maximum(information.sum(axis=0), 1e-30)
    left = score - score.sum(axis=0) / known * information
    zero = np.zeros((1, left.shape[1]))
    score_sums = np.concatenate((zero, np.cumsum(left, axis=0)))
    info_sums = np.concatenate((zero, np.cumsum(information, axis=0)))
    found = []
    for span_s in SPANS_S:
        span = min(round(span_s / EVERY_S), TOGETHER, len(left) // 2)
        scores, infos = (sums[span:] - sums[:-span] for sums in (score_sums, info_sums))
        found.append((scores**2).sum(axis=0) / np.maximum(infos.sum(axis=0), 1e-30))
    most: Floats = np.maximum(np.array(found), 1.0)
    return most


def weighed(windows: Windows, usual: Usual) -> Floats:
    """Return each window's scores and information of each number, (4, n, numbers).

    In the first score, a window that strays far counts as if it strayed less, altogether and in
    what it shows of one number: it may be a stone, a bad pose, or driving such as there was none
    before. In the second it does so altogether, in the third it counts whole. None counts much more
    than others by what it shows.
    """
    near, whole, information = _scores(windows, usual)
    return np.stack((_limited(near, information, usual.off), near, whole, information))


def _scores(windows: Windows, usual: Usual) -> tuple[Floats, Floats, Floats]:
    """Return scores of windows that stray not too far altogether, whole ones, and information."""
    misses = windows.misses / usual.size
    slopes = windows.slopes / usual.size[:, None]
    far = np.sqrt(np.einsum("ni,ij,nj->n", misses, usual.weight, misses) / misses.shape[1])
    near = misses * np.minimum(1.0, LIMIT / np.maximum(far, LIMIT))[:, None]
    weighted = np.einsum("ij,njk->nik", usual.weight, slopes)
    information = np.einsum("nik,nik->nk", slopes, weighted)
    share = np.sqrt(np.minimum(1.0, usual.most / np.maximum(information, 1e-30)))
    near, whole = (share * np.einsum("ni,nik->nk", each, weighted) for each in (near, misses))
    return near, whole, information * share**2


def _limited(scores: Floats, information: Floats, off: Floats) -> Floats:
    """Return scores that are at most so far from what the numbers' usual errors make of them."""
    usual, most = off * information, LIMIT_OF_NUMBER * np.sqrt(information)
    return np.asarray(usual + np.clip(scores - usual, -most, most))
