"""Which effects seem to change: a screen without any further rollout.

What an effect changes in the innovations at a time depends on its numbers shortly before. So an
effect that begins at a moment changes them as a constant one does after it, and not before; one
that comes and goes changes them between two moments; one that follows a variable, in proportion to
it. All moments, pairs of them and variables are compared by the one rollout of an effect.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from scm.arrays import Floats, Ints
from scm.mismatch.changing_effect import (
    LEAST_S,
    ChangingEffect,
    changing,
    may_change,
    moments_in,
    pairs_of,
)
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.findings import Course
from scm.mismatch.fit.fitter import Fitter, Trial
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.varying_effect import VaryingEffect, dependences_of
from scm.replay.recorded_variables import PLACES, VARIABLES

Penalty = Callable[[Sequence[Candidate]], float]
MAX_TRIALS = 12
MAX_VARYING = 6
SHOWS_LATER_S = 0.1  # than a number is so, in the innovations
SEARCHED = ((9.0, 1.5), (1.5, 0.25))  # about a moment, and between those tried [s]
AMPLITUDES = 0.02, 8.0  # of the strength that was simulated: farther, no line holds
STRONGER = 1.0, 1.5, 2.25  # times what the screen finds: it weighs disturbed events little


def span_of(base: Hypothesis) -> tuple[float, float] | None:
    """Return the span of the recording in which changes may be searched for, on its clock.

    None where there are several recordings: a moment of one means nothing in another. Stretches of
    one recording have one clock.
    """
    drives = base.model.drives
    if len({(drive.recording.path, drive.recording.name) for drive in drives}) > 1:
        return None
    first_s = min(float(drive.edges[0]) for drive in drives)
    last_s = max(float(drive.edges[-1]) for drive in drives)
    driven_s = sum(float(np.ptp(drive.edges)) for drive in drives)
    return (first_s, last_s) if driven_s >= LEAST_S else None


def changes_to_try(
    penalty: Penalty, fitter: Fitter, base: Hypothesis, begun: Sequence[Hypothesis]
) -> list[Trial]:
    """Return the effects that gain most as changes, with values to begin from, some of each.

    Args:
        penalty: Returns what effects must gain to be accepted.
        fitter: Under the noise of `base`.
        base: Without them, with derivatives.
        begun: Constant effects beside it, each once or more, as `Fitter.begin` returns them.
    """
    span = span_of(base)
    if span is None:
        return []
    screen = _Screen(fitter, base, span)
    found = list[tuple[float, Trial]]()
    for fitted in begun:
        effect = fitted.effects[-1]
        if may_change(effect) and np.isfinite(fitted.score):
            found += _simplest([(g - penalty((one[0][-1],)), one) for g, one in screen.of(fitted)])
    best = dict[int, Trial]()
    for _, trial in sorted(found, key=lambda one: -one[0]):
        best.setdefault(id(trial[0][-1]), trial)
    return [
        (effects, np.append(base.values, _times(effects[-1], values[len(base.values) :], by)))
        for effects, values in list(best.values())[:MAX_TRIALS]
        for by in STRONGER
    ]


def _times(effect: Candidate, values: Floats, by: float) -> Floats:
    """Return an effect's values as much stronger, within its bounds."""
    neutral = np.array([parameter.neutral for parameter in effect.parameters])
    low, high = np.array([parameter.bounds for parameter in effect.parameters]).T
    strong = np.where(effect.amounts, neutral + by * (values - neutral), values)
    return np.clip(strong, low, high)


def _simplest(tried: Sequence[tuple[float, Trial]]) -> list[tuple[float, Trial]]:
    """Return what one effect gains as a change; coming and going only where it gains the most."""
    best = max(tried, key=lambda one: one[0], default=None)
    return [one for one in tried if one is best or _moments(one[1][0][-1]) < 2]


def _moments(effect: Candidate) -> int:
    return effect.moments if isinstance(effect, ChangingEffect) else 0


def has_moments(fitted: Hypothesis) -> bool:
    """Return whether an effect of a hypothesis began or ended at a moment."""
    return any(map(_moments, fitted.effects))


def with_best_moments(fitter: Fitter, fits: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return fits, each moment moved to where it suits the other numbers best, not refitted.

    A score has a flat or a valley between any two events that show an effect: no derivative leads
    from one to the next.
    """
    return [_at_best_moment(fitter, fitted) for fitted in fits]


def _at_best_moment(fitter: Fitter, fitted: Hypothesis) -> Hypothesis:
    for effect, place in fitted.each():
        indices = range(place.stop - _moments(effect), place.stop)
        for (around_s, every_s), index in product(SEARCHED, indices):
            at, scores = moments_scored(fitter, fitted, index, around_s, every_s)
            values = fitted.values.copy()
            values[index] = at[int(np.argmin(scores))]
            fitted = replace(fitted, values=values)
    return fitted


def moments_scored(
    fitter: Fitter, fitted: Hypothesis, index: int, around_s: float, every_s: float
) -> tuple[Floats, Floats]:
    """Return moments about one of a change, and the score of the hypothesis with each.

    Args:
        fitter: Under the noise of `fitted`.
        fitted: With an effect that changes at it.
        index: Of the moment among its values.
        around_s: How far to either side.
        every_s: Between moments.
    """
    low, high = fitted.parameters[index].bounds
    count = round(around_s / every_s)
    at = np.clip(fitted.values[index] + every_s * np.arange(-count, count + 1), low, high)
    values = np.repeat(fitted.values[None], len(at), axis=0)
    values[:, index] = at
    e, ok = fitter.model([replace(fitted, values=one).numbers for one in values])
    scores = fitter.score(np.nan_to_num(e), np.repeat(fitted.z[None], len(at), axis=0))
    return at, np.where(ok, scores, np.inf)


def varying_to_try(
    penalty: Penalty, fitter: Fitter, base: Hypothesis, begun: Sequence[Hypothesis]
) -> list[Trial]:
    """Return the effects that gain most with a number that depends on a variable.

    Args: as of `changes_to_try`.
    """
    screen = _VaryingScreen(fitter, base)
    found = [
        (gain - penalty((trial[0][-1],)), trial)
        for fitted in begun
        if np.isfinite(fitted.score)
        for gain, trial in screen.of(fitted)
    ]
    best = dict[str, Trial]()
    for _, trial in sorted(found, key=lambda one: -one[0]):
        best.setdefault(trial[0][-1].name, trial)
    return list(best.values())[:MAX_VARYING]


class _VaryingScreen:
    """Compares all variables on which an effect's number may depend, one effect after the other."""

    def __init__(self, fitter: Fitter, base: Hypothesis) -> None:
        self._base, self._drives = base, base.model.drives
        self._prior = fitter.model.simulator.prior
        self._weights = fitter.weights(base.innovations)
        self._curves = dict[str, Floats]()
        self._effects = dict[int, list[VaryingEffect]]()

    def of(self, fitted: Hypothesis) -> Iterator[tuple[float, Trial]]:
        """Yield what an effect gains with each variable, and what to try."""
        base, effect = self._base, fitted.effects[-1]
        if id(effect) not in self._effects:
            self._effects[id(effect)] = list(dependences_of(effect, self._drives))
        varying = self._effects[id(effect)]
        if not varying:
            return
        own = fitted.jacobian[:, : len(base.z)]
        change = fitted.innovations - own @ (fitted.z - base.z) - base.innovations
        changes = np.stack([self._curve(one) * change for one in varying], axis=1)
        weighted = changes * self._weights[:, None]
        normal = own.T @ (own * self._weights[:, None]) + self._prior
        back = own.T @ (self._weights * base.innovations) + self._prior @ base.z
        moved = np.linalg.lstsq(normal, own.T @ weighted, rcond=1e-12)[0]
        slopes = weighted.T @ base.innovations - moved.T @ back
        sizes = (weighted * changes).sum(axis=0) - ((own.T @ weighted) * moved).sum(axis=0)
        sizes = np.maximum(sizes, 1e-9)
        for one, slope, size in zip(varying, slopes, sizes, strict=True):
            by = -slope / size
            if AMPLITUDES[0] < abs(by) < AMPLITUDES[1]:
                yield float(slope * slope / size), self._trial(fitted, one, float(by))

    def _curve(self, effect: VaryingEffect) -> Floats:
        """Return the variable over its usual most, at each innovation."""
        name = effect.by.name
        if name not in self._curves:
            recorded = VARIABLES[PLACES[name]]
            self._curves[name] = np.concatenate([
                np.interp(w.t - SHOWS_LATER_S, d.edges, recorded.curve(d)) / effect.usual_most
                for w, d in zip(self._base.model.whiteners, self._drives, strict=True)
            ])  # fmt: skip
        return self._curves[name]

    def _trial(self, fitted: Hypothesis, effect: VaryingEffect, by: float) -> Trial:
        (parameter,) = effect.parameters
        low, high = parameter.bounds
        value = parameter.neutral + by * (float(fitted.values[-1]) - parameter.neutral)
        start = np.append(self._base.values, min(max(value, low), high))
        return (*self._base.effects, effect), start


class _Screen:
    """Compares all moments of one effect after the other, all pairs of them, and its ramp.

    Sums over the spans between two moments, added up from the end, are those after each moment;
    the differences of two are those between them.
    """

    def __init__(self, fitter: Fitter, base: Hypothesis, span: tuple[float, float]) -> None:
        self._base, self._span = base, span
        self._prior = fitter.model.simulator.prior
        self._weights = fitter.weights(base.innovations)
        self._moments = moments_in(span)
        self._pairs = np.array(pairs_of(self._moments.tolist())).T
        t = base.model.t
        order = np.argsort(t, kind="stable")
        first = int(np.searchsorted(t[order], self._moments[0]))
        in_order = bool((order == np.arange(len(t))).all())
        self._later: slice | Ints = slice(first, None) if in_order else order[first:]
        self._cuts = np.searchsorted(t[self._later], self._moments)
        self._ramp = np.clip((t - span[0]) / (span[1] - span[0]), 0.0, 1.0)
        self._changing = dict[tuple[int, Course], ChangingEffect]()
        self._normals = dict[int, tuple[Floats, Floats]]()

    def of(self, fitted: Hypothesis) -> Iterator[tuple[float, Trial]]:
        """Yield an effect's best moment, its ramp, its best pair: gain each, and what to try."""
        base, effect = self._base, fitted.effects[-1]
        own = fitted.jacobian[:, : len(base.z)]
        change = fitted.innovations - own @ (fitted.z - base.z) - base.innovations
        normal, back = self._normal(own)
        weighted = self._weights * change
        ramped = self._ramp * weighted
        slopes = np.append(self._after(weighted * base.innovations), ramped @ base.innovations)
        sizes = np.append(self._after(weighted * change), ramped @ (self._ramp * change))
        moves = np.vstack((self._moves_after(own, weighted), own.T @ ramped))
        moved = np.linalg.lstsq(normal, moves.T, rcond=1e-12)[0]
        slopes -= moved.T @ (back + self._prior @ base.z)
        shared, (first, last), ramp = moves @ moved, self._pairs, len(self._moments)
        own_shares = shared.diagonal()
        both = own_shares[first] - 2.0 * shared[first, last] + own_shares[last]
        between = sizes[first] - sizes[last] - both
        slopes = np.append(slopes, slopes[first] - slopes[last])
        sizes = np.maximum(np.append(sizes - own_shares, between), 1e-9)
        gains, by = slopes * slopes / sizes, -slopes / sizes
        gains[(np.abs(by) < AMPLITUDES[0]) | (np.abs(by) > AMPLITUDES[1])] = -np.inf
        begins = int(np.argmax(gains[:ramp]))
        pair = int(np.argmax(gains[ramp + 1 :]))
        for course, place, at in (
            (Course.STEP, begins, [begins]),
            (Course.RAMP, ramp, []),
            (Course.INTERMITTENT, ramp + 1 + pair, self._pairs[:, pair]),
        ):
            if np.isfinite(gains[place]):
                moments = self._moments[at].tolist()
                trial = self._trial(fitted, effect, course, moments, float(by[place]))
                yield float(gains[place]), trial

    def _normal(self, own: Floats) -> tuple[Floats, Floats]:
        """Return J' W J with the prior, and J' W e; trials that set the same numbers share them."""
        key = id(own.base)
        if key not in self._normals:
            weighted = own * self._weights[:, None]
            normal, back = own.T @ weighted + self._prior, weighted.T @ self._base.innovations
            self._normals[key] = normal, back
        return self._normals[key]

    def _moves_after(self, own: Floats, values: Floats) -> Floats:
        """Return J' v of what comes after each moment."""
        own, values = own[self._later], values[self._later]
        ends = [*self._cuts[1:], len(values)]
        parts = [own[a:b].T @ values[a:b] for a, b in zip(self._cuts, ends, strict=True)]
        return np.asarray(np.cumsum(np.stack(parts)[::-1], axis=0)[::-1])

    def _after(self, values: Floats) -> Floats:
        """Return sums of what comes after each moment, of values (events,)."""
        until = np.concatenate(([0.0], np.cumsum(values[self._later])))
        return np.asarray(until[-1] - until[self._cuts])

    def _trial(
        self,
        fitted: Hypothesis,
        effect: Candidate,
        course: Course,
        moments: Sequence[float],
        by: float,
    ) -> Trial:
        strong = _times(effect, fitted.values[len(self._base.values) :], by)
        key = id(effect), course
        if key not in self._changing:
            self._changing[key] = changing(effect, course, self._span)
        start = np.concatenate((self._base.values, strong, moments))
        return (*self._base.effects, self._changing[key]), start
