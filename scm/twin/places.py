"""A place where the floor changed, noticed by all cars that drove there.

A few windows of each car show it, and their sum over its whole way hides it. So scores are summed
place by place, over cars: what each missed there since, less what it missed there before, and less
how it changed elsewhere. At least two cars have to show it: one that changed by itself, or that
drove as it never did before, is no place.
"""

import math
from collections import deque
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Bools, Floats
from scm.clock import nanoseconds
from scm.records.twins import TwinChange
from scm.twin.detector import LEARN
from scm.twin.evidence import Witness
from scm.twin.windows import WatchedNumber

MOST = 50  # places that are remembered
EFFECTS = ("rolling_resistance", "grade", "tyre_grip")  # what a floor does
RADIUS_M = 0.35
GRID_M = 0.2  # between the middles of places
SINCE_S = (60.0, 120.0, 240.0, 480.0)
ONSETS_S = 5.0  # between two moments at which it may have begun
NEARLY = 0.9  # of the highest score: it may as well have begun then
SHOWN = 2.5  # standard deviations: a car shows it
ALSO = 4.0  # that all cars but the plainest have to show
FEWEST = 6  # windows there, of all cars since, and of a car before
USUAL = 3.0  # windows of all driving before, that count beside those there
LEAST_STEPS, MOST_STEPS = 1.0, 20.0  # that a floor changes by, as far as it matters
NEW_S = 600.0  # so long after one was noticed, what is seen around it is the same
REACH_M = 0.5  # around a place that changed: the rest of it, and windows that touch it


@dataclass(frozen=True, slots=True)
class PlaceChange:
    """A place where cars drive otherwise.

    Attributes:
        x_m, y_m, radius_m: Of a circle, in the map frame.
        number: Of the floor, that shows it most.
        size: How far that changed, in its unit.
        score: In standard deviations.
        noticed_s: On the city's clock.
        since_s: Likeliest, and the ends of its interval, 90 %.
        vehicles: That show it, the plainest first.
    """

    x_m: float
    y_m: float
    radius_m: float
    number: WatchedNumber
    size: float
    score: float
    noticed_s: float
    since_s: tuple[float, float, float]
    vehicles: tuple[str, ...]

    def as_change(self) -> TwinChange:
        """Return it as a record, of the car that shows it most."""
        since_ns, low_ns, high_ns = (nanoseconds(max(t_s, 0.0)) for t_s in self.since_s)
        return TwinChange(
            noticed_ns=nanoseconds(self.noticed_s), since_ns=since_ns, since_low_ns=low_ns,
            since_high_ns=high_ns, effect=self.number.effect, parameter=self.number.name,
            size=self.size, unit=self.number.unit, score=self.score,
        )  # fmt: skip

    def in_words(self) -> str:
        """Return it in a sentence."""
        where = f"within {self.radius_m:.2g} m of ({self.x_m:.1f}, {self.y_m:.1f})"
        ago_s = self.noticed_s - self.since_s[0]
        *others, last = self.vehicles
        cars = f"{', '.join(others)} and {last} drive" if others else f"{last} drives"
        return f"{cars} otherwise {where}, since {ago_s:.0f} s: as by {self.number.effect}"


class PlaceWatch:
    """Watches all places where cars drive.

    Args:
        threshold: Score from which on a change is reported; see `threshold_of`.

    Attributes:
        found: Changes, the newest last.
    """

    def __init__(self, threshold: float) -> None:
        self._threshold = threshold
        self.found = deque[PlaceChange](maxlen=MOST)

    def look(self, cars: Mapping[str, Witness], now_s: float) -> PlaceChange | None:
        """Return the place that changed most, if one did since it last changed.

        Args:
            cars: Of the city; one that has just changed itself shows no place.
            now_s: On its clock; what was driven later does not count.
        """
        steady = {name: one for name, one in cars.items() if one.evidence.is_steady}
        rows = [_rows(name, one, self.found, now_s) for name, one in steady.items()]
        new = [one for one in self.found if now_s - one.noticed_s < NEW_S]
        found = _changed(rows, new, now_s, self._threshold)
        if found is not None:
            self.found.append(found)
        return found

    def has_found(self, change: TwinChange) -> bool:
        """Return whether a change is of a place, not of a car."""
        return any(change.noticed_ns == nanoseconds(one.noticed_s) for one in self.found)

    def is_off(self, places: Floats) -> Bools:
        """Return which windows (n, 2) lie off all places that changed, (n,)."""
        return ~_at_any(places, self.found)


def _at_any(places: Floats, changed: Collection[PlaceChange]) -> Bools:
    """Return which windows touch one of some places."""
    at = np.zeros(len(places), dtype=bool)
    for one in changed:
        away = np.hypot(places[:, 0] - one.x_m, places[:, 1] - one.y_m)
        at |= away < one.radius_m + REACH_M
    return at


@dataclass(frozen=True, slots=True)
class _Rows:
    """The windows of a car that count, n of them, of the floor's numbers.

    Attributes:
        is_usual: Which are off all places that changed, (n,).
        shown: Scores, information, and scores of windows however far they stray, over their
            spread, (3, n, numbers): the variance of sums of scores is the sum of their information.
    """

    name: str
    numbers: tuple[WatchedNumber, ...]
    t_s: Floats
    places: Floats
    is_usual: Bools
    shown: Floats


def _rows(name: str, car: Witness, changed: Collection[PlaceChange], now_s: float) -> _Rows:
    """Return the windows of a car until now; at a place that changed, only those after that."""
    evidence = car.evidence
    t_s = evidence.t_s + car.begin_s
    counts = (t_s >= car.first_s) & (t_s < min(car.last_s, now_s))
    for one in changed:
        counts &= ~(_at_any(evidence.places, [one]) & (t_s < one.noticed_s))
    columns = [k for k, one in enumerate(evidence.numbers) if one.effect in EFFECTS]
    every = np.stack((evidence.scores, evidence.information, evidence.whole))
    shown = every[:, counts][..., columns] / evidence.inflation[columns]
    places = evidence.places[counts]
    numbers = tuple(evidence.numbers[k] for k in columns)
    return _Rows(name, numbers, t_s[counts], places, ~_at_any(places, changed), shown)


def _changed(
    rows: list[_Rows], known: Collection[PlaceChange], now_s: float, threshold: float
) -> PlaceChange | None:
    """Return the place that changed most, not around a known one, where that is plain enough."""
    rows = [one for one in rows if len(one.t_s) and _names(one) == _names(rows[0])]
    places = _places(rows, now_s)
    places = places[~_at_any(places, known)]
    if len(rows) < 2 or not len(places):
        return None
    inside = [_inside(one.places, places) for one in rows]
    scores = np.array([_scores(rows, inside, now_s - ago_s) for ago_s in SINCE_S])
    best, place, number = np.unravel_index(int(np.argmax(scores)), scores.shape)
    score = float(scores[best, place, number])
    if score < threshold:
        return None
    there = [one[place : place + 1] for one in inside]
    return _described(rows, there, places[place].tolist(), int(number), score, now_s)


def _scores(rows: list[_Rows], inside: list[Bools], since_s: float) -> Floats:
    """Return how plainly each place changed by each number, (places, numbers); 0: it did not."""
    moved, variance = _moves(rows, inside, since_s)
    score, also = _pooled(moved[0], variance)
    steps = np.abs(_mean(moved[1], variance)) / np.array([one.step for one in rows[0].numbers])
    every = [np.ones((1, len(one.t_s)), dtype=bool) for one in rows]
    moved, variance = _moves(rows, every, since_s)
    shown = moved[0] / np.sqrt(variance)
    everywhere = np.maximum(_rest(shown), _rest(-shown))
    is_likely = (steps >= LEAST_STEPS) & (steps < MOST_STEPS)
    counts = (also >= ALSO) & is_likely & (np.abs(score) > everywhere.max())
    return np.asarray(np.where(counts, np.abs(score), 0.0))


def _described(
    rows: list[_Rows], there: list[Bools], at: Sequence[float], number: int, score: float,
    now_s: float,
) -> PlaceChange:  # fmt: skip
    """Return since when a place changed, how far, and which cars show it."""
    onsets = np.arange(now_s - SINCE_S[-1], now_s - ONSETS_S, ONSETS_S)
    moves = [_moves(rows, there, begin_s) for begin_s in onsets.tolist()]
    scores = np.array([_pooled(moved[0], spread)[0][0, number] for moved, spread in moves])
    shown = np.abs(scores)
    onset, near = int(np.argmax(shown)), onsets[shown > NEARLY * shown.max()]
    driven = np.concatenate([one.t_s[which[0]] for one, which in zip(rows, there, strict=True)])
    low_s = float(driven[driven < near[0]].max(initial=onsets[0]))
    high_s = float(driven[driven >= near[-1]].min(initial=now_s))
    moved, variance = moves[onset]
    by_cars = np.sign(scores[onset]) * moved[0, :, 0, number] / np.sqrt(variance[:, 0, number])
    plainest = np.argsort(-by_cars, kind="stable")
    also = [rows[k].name for k in plainest[1:] if by_cars[k] >= SHOWN]
    return PlaceChange(
        x_m=at[0], y_m=at[1], radius_m=RADIUS_M, number=rows[0].numbers[number],
        size=float(_mean(moved[1], variance)[0, number]), score=score, noticed_s=now_s,
        since_s=(float(onsets[onset]), low_s, high_s), vehicles=(rows[plainest[0]].name, *also),
    )  # fmt: skip


def _names(one: _Rows) -> list[tuple[str, str]]:
    return [(number.effect, number.name) for number in one.numbers]


def _places(rows: list[_Rows], now_s: float) -> Floats:
    """Return the middles of places where enough was driven lately, (places, 2) [m]."""
    driven = [one.places[one.t_s >= now_s - SINCE_S[-1]] for one in rows]
    if not driven or not sum(map(len, driven)):
        return np.empty((0, 2))
    return np.asarray(np.unique(np.round(np.concatenate(driven) / GRID_M), axis=0) * GRID_M)


def _inside(driven: Floats, places: Floats) -> Bools:
    """Return which windows were at each place, (places, windows)."""
    away = np.hypot(*(driven[None] - places[:, None]).transpose(2, 0, 1))
    return np.asarray(away < RADIUS_M)


def _moves(rows: list[_Rows], inside: list[Bools], since_s: float) -> tuple[Floats, Floats]:
    """Return how far the numbers of each car moved at each place, beyond how they did elsewhere.

    Returns:
        That, by limited and by whole scores, (2, cars, places, numbers), and its variance, (cars,
        places, numbers); infinite where nothing was driven.
    """
    moved, variance, count = list[Floats](), list[Floats](), np.zeros((len(inside[0]), 1))
    for one, there in zip(rows, inside, strict=True):
        after, before = one.t_s >= since_s, one.t_s < since_s
        now, then = _sums(one, there & after), _sums(one, there & before)
        rest = [_sums(one, ~there & which & one.is_usual) for which in (after, before)]
        mean = USUAL / max(int(before.sum()), 1)  # so many windows as they usually are
        usual = then + mean * _sums(one, (before & one.is_usual)[None])
        is_known = (there & before).sum(axis=1)[:, None] >= FEWEST
        usual = np.where(is_known & (before.sum() >= LEARN), usual, 0.0)
        count += (there & after).sum(axis=1)[:, None]
        here, shift = _change(now, usual), _change(*rest)  # by place, and elsewhere
        moved.append(here[0] - shift[0])
        variance.append(here[1] + np.where(np.isinf(shift[1]), 0.0, shift[1]))
    every = np.array(variance)
    return np.stack(moved, axis=1), np.where(count < FEWEST, math.inf, every)


def _sums(one: _Rows, which: Bools) -> Floats:
    """Return the sums of what some windows show, (3, places, numbers)."""
    return np.stack([which.astype(float) @ each for each in one.shown])


def _change(after: Floats, before: Floats) -> tuple[Floats, Floats]:
    """Return how far numbers moved between two sums, and its variance; infinite: not known."""
    is_known = (after[1] > 0.0) & (before[1] > 0.0)
    late, early = (np.where(is_known, each[1], 1.0) for each in (after, before))
    moved = np.where(is_known, after[::2] / late - before[::2] / early, 0.0)
    return moved, np.where(is_known, 1.0 / late + 1.0 / early, math.inf)


def _mean(moved: Floats, variance: Floats) -> Floats:
    """Return how far numbers moved by all cars, (places, numbers)."""
    weight = 1.0 / variance
    return np.asarray((moved * weight).sum(axis=0) / np.maximum(weight.sum(axis=0), 1e-30))


def _pooled(moved: Floats, variance: Floats) -> tuple[Floats, Floats]:
    """Return the score of all cars, with its sign, and what all but the plainest show of it.

    Both are standard deviations, (places, numbers).
    """
    mean = _mean(moved, variance)
    score = mean * np.sqrt(np.maximum((1.0 / variance).sum(axis=0), 1e-30))
    return score, _rest(np.sign(mean) * moved / np.sqrt(variance))


def _rest(shown: Floats) -> Floats:
    """Return what all cars but the plainest show, (...): none less by moving the other way.

    Args:
        shown: By each, in standard deviations, (cars, ...).
    """
    same = np.maximum(shown, 0.0)
    rest = np.maximum((same**2).sum(axis=0) - same.max(axis=0) ** 2, 0.0)
    return np.asarray(np.sqrt(rest))
