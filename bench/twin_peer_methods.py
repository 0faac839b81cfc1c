"""Ways to notice a change of a car: the twin's detector, and three peers of it.

Each has tests, whose scores `bench.twin_peers` scales and holds against one threshold.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Protocol

import numpy as np

from bench.twin import CAR
from bench.twin_kalman import NAMES, filtered
from scm.arrays import Floats
from scm.recording.read import Recording
from scm.twin.detector import Detector, joined
from scm.twin.watch import AFTER_S
from scm.twin.windows import EVERY_S, WatchedCar, Windows
from scm.vehicles.car import load_car

LEARN_S, SETTLED_S = 200.0, 100.0
SPANS_S = (10.0, 40.0, 160.0)
SLACKS = (0.25, 0.5)  # standard deviations a window that a cumulative sum forgives


@dataclass(frozen=True, slots=True)
class Drive:
    """One drive as all methods read it.

    Attributes:
        spans: Windows as the twin looked at them, ten seconds each.
    """

    name: str
    recording: Recording
    spans: tuple[Windows, ...]

    @property
    def windows(self) -> Windows:
        """All of them."""
        whole = self.spans[0]
        for more in self.spans[1:]:
            whole = joined(whole, more)
        return whole


class Method(Protocol):
    """A way to notice changes."""

    def fit(self, healthy: Sequence[Drive]) -> None:
        """Learn what is learned from cars that do not change."""

    def tests(self, one: Drive) -> tuple[Floats, Floats]:
        """Return times, (n,), and what each test shows then, (n, tests)."""

    def name(self, one: Drive, scores: Floats, thresholds: Floats) -> str:
        """Return the effect that the tests' scores, (tests,), show; empty: it has no name."""


class Ours:
    """The twin's detector, whose only test is its score."""

    def __init__(self) -> None:
        self._watched = WatchedCar(load_car(CAR)).watched

    def fit(self, healthy: Sequence[Drive]) -> None:
        """Nothing is learned from other cars."""

    def tests(self, one: Drive) -> tuple[Floats, Floats]:
        """Return times, (n,), and what each test shows then, (n, tests)."""
        detector, rows = Detector(math.inf), list[tuple[float, float]]()
        for span in one.spans:
            detector.update(span)
            rows.append((span.begin_s[-1] + EVERY_S + AFTER_S, detector.highest))
        t, scores = np.array(rows).T
        return t, scores[:, None]

    def name(self, one: Drive, scores: Floats, thresholds: Floats) -> str:
        """Return the effect that the detector reports."""
        detector = Detector(float(thresholds[0]))
        change = next(change for span in one.spans if (change := detector.update(span)))
        return self._watched[change.number].effect


class Cusum:
    """Cumulative sums on pose residuals alone."""

    def fit(self, healthy: Sequence[Drive]) -> None:
        """Nothing is learned from other cars."""

    def tests(self, one: Drive) -> tuple[Floats, Floats]:
        """Return times, (n,), and what each sum shows then, (n, tests)."""
        begin_s, misses = one.windows.begin_s[::2], one.windows.misses[::2, :3]
        learned = begin_s - begin_s[0] < LEARN_S
        unit = np.clip(_unit(misses, learned), -4.0, 4.0)
        square = _unit((unit**2).sum(axis=1, keepdims=True), learned)
        both = np.concatenate((unit, -unit, square), axis=1)
        sums = np.zeros((len(begin_s), both.shape[1] * len(SLACKS)))
        steps = np.concatenate([both - slack for slack in SLACKS], axis=1)
        for k in range(int(learned.sum()), len(begin_s)):
            sums[k] = np.maximum(sums[k - 1] + steps[k], 0.0)
        return begin_s + 1.0, sums

    def name(self, one: Drive, scores: Floats, thresholds: Floats) -> str:
        """Return nothing."""
        return ""


class Kalman:
    """Drift of a Kalman filter's parameters, and of its innovations."""

    def __init__(self) -> None:
        self._car, self._together = load_car(CAR), Together()

    def fit(self, healthy: Sequence[Drive]) -> None:
        """Learn how parameters of cars that do not change wander together."""
        self._together.fit([self._moved(one)[1] for one in healthy])

    def tests(self, one: Drive) -> tuple[Floats, Floats]:
        """Return times, (n,), and what each test shows then, (n, tests)."""
        t, moved = self._moved(one)
        return t, self._together.tests(moved)

    def name(self, one: Drive, scores: Floats, thresholds: Floats) -> str:
        """Return the effect of the parameter that drifts most."""
        drifts = scores.reshape(len(SPANS_S), -1)[:, : len(NAMES)]
        return NAMES[int(np.argmax(drifts.max(axis=0)))]

    def _moved(self, one: Drive) -> tuple[Floats, Floats]:
        t, values = filtered(one.recording, self._car)
        return t, departures(t, values, t[0] + SETTLED_S)


class Residual:
    """A learned residual: what the car file misses and regression cannot explain."""

    def __init__(self, ridge: float = 30.0) -> None:
        self._ridge, self._together = ridge, Together()
        self._weights = self._size = np.zeros((0, 0))

    def fit(self, healthy: Sequence[Drive]) -> None:
        """Learn what is missed of all cars, and how the rest wanders."""
        terms = np.concatenate([self._terms(one) for one in healthy])
        misses = np.concatenate([one.windows.misses for one in healthy])
        self._size = misses.std(axis=0)
        self._weights = _ridge(terms, misses / self._size, self._ridge)
        self._together.fit([self._moved(one)[1] for one in healthy])

    def tests(self, one: Drive) -> tuple[Floats, Floats]:
        """Return times, (n,), and what each test shows then, (n, tests)."""
        t, moved = self._moved(one)
        return t, self._together.tests(moved)

    def name(self, one: Drive, scores: Floats, thresholds: Floats) -> str:
        """Return nothing."""
        return ""

    def _moved(self, one: Drive) -> tuple[Floats, Floats]:
        t, terms = one.windows.begin_s + 1.0, self._terms(one)
        left = one.windows.misses / self._size - terms @ self._weights
        own = t - t[0] < LEARN_S
        left -= terms @ _ridge(terms[own], left[own], self._ridge)
        unit = np.clip(_unit(left, own), -4.0, 4.0)
        return t, departures(t, np.concatenate((unit, unit**2), axis=1), t[0])

    def _terms(self, one: Drive) -> Floats:
        """Return 1, commands and motion around each window, and their products, (n, terms)."""
        channels, begin_s = one.recording.channels, one.windows.begin_s
        plain = []
        for name in ("command.throttle", "command.steering"):
            t, values = channels[name].t, channels[name].values
            area = np.concatenate(([0.0], np.cumsum(values[:-1] * np.diff(t))))
            ends = np.interp(begin_s[:, None] + np.array((-1.0, -0.5, 0.0, 0.5, 1.0)), t, area)
            plain += [*np.diff(ends, axis=1).T / 0.5]
        x, y, yaw = (channels[f"pose.{axis}"] for axis in ("x", "y", "yaw"))
        ends = np.stack((begin_s - 0.5, begin_s))
        moved = [np.diff(np.interp(ends, c.t, c.values), axis=0)[0] for c in (x, y)]
        turned = np.diff(np.interp(ends, yaw.t, np.unwrap(yaw.values)), axis=0)[0]
        plain += [np.hypot(*moved) / 0.5 / 0.25, turned / 0.5]
        products = [a * b for a, b in combinations_with_replacement(plain, 2)]
        return np.stack((np.ones(len(begin_s)), *plain, *products), axis=1)


class Together:
    """Departures of several values, each alone and all together, scaled by healthy cars'."""

    def fit(self, healthy: Sequence[Floats]) -> None:
        """Learn how departures, (n, spans, values), of cars that do not change go together."""
        every = np.concatenate([one[np.isfinite(one).all(axis=(1, 2))] for one in healthy])
        covariance = np.einsum("nsi,nsj->sij", every, every) / len(every)
        size = np.sqrt(np.einsum("sii->si", covariance))
        alike = covariance / size[:, :, None] / size[:, None, :]
        self._size, self._inverse = size, np.linalg.inv(alike + 0.05 * np.eye(alike.shape[1]))

    def tests(self, moved: Floats) -> Floats:
        """Return each departure in its usual sizes, and the length of all, (n, tests)."""
        unit = np.nan_to_num(moved) / self._size
        far = np.sqrt(np.einsum("nsi,sij,nsj->ns", unit, self._inverse, unit))
        every = np.concatenate((np.abs(unit), far[:, :, None]), axis=2)
        return every.reshape(len(every), -1)


def departures(t: Floats, values: Floats, since_s: float) -> Floats:
    """Return means of the newest spans less means of all before, (n, spans, values); nan: none."""
    step_s = float(np.median(np.diff(t)))
    first = int(np.searchsorted(t, since_s))
    sums = np.concatenate((np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)))
    found = np.full((len(t), len(SPANS_S), values.shape[1]), np.nan)
    for k, span_s in enumerate(SPANS_S):
        span = round(span_s / step_s)
        ends = np.arange(max(first, round(LEARN_S / step_s)) + span, len(t)) + 1
        begins = ends - span
        before = (sums[begins] - sums[first]) / (begins - first)[:, None]
        found[ends - 1, k] = (sums[ends] - sums[begins]) / span - before
    return found


def _unit(values: Floats, learned: Floats) -> Floats:
    """Return values in standard deviations from their middle, both of the learned rows."""
    middle = values[learned].mean(axis=0)
    return np.asarray((values - middle) / np.maximum(values[learned].std(axis=0), 1e-12))


def _ridge(terms: Floats, targets: Floats, ridge: float) -> Floats:
    square = terms.T @ terms + ridge * np.diag((terms**2).mean(axis=0))
    return np.asarray(np.linalg.solve(square, terms.T @ targets))


METHODS: dict[str, Callable[[], Method]] = {
    "twin": Ours, "cusum": Cusum, "kalman": Kalman, "residual": Residual,
}  # fmt: skip
