"""Fits of many hypotheses at once: Gauss-Newton, all rollouts of a round in one batch.

The numbers of a hypothesis' effects are free; the car's own are free too, held by the standard
deviations that the car file states.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Bools, Floats
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.fit.hypothesis import Hypothesis, together
from scm.mismatch.fit.likelihood import Likelihood

ROUNDS = 5
SMALL = 0.1  # a derivative's step of a nominal parameter, in standard deviations
SHORTER = (0.5, 0.2, 0.05)
DAMPINGS = (0.03, 0.3)
MET = 0.7  # of the decrease that a quadratic expects: shorter steps would hardly gain more
FEW = 2  # fits whose trials leave room in a tile
ENOUGH = 0.5
SPOTS = 3  # places that an effect of some place is begun at
CATCHES_UP = 4.0
TAIL = 8.0  # degrees of freedom of the Student-t loss: a few wild moments prove nothing
FARTHEST = 2.0  # prior stds: beyond, it is no longer the number of the file
Trial = tuple[tuple[Candidate, ...], Floats]


@dataclass(frozen=True, slots=True)
class Race:
    """Ends fits of a screen early: those far behind that do not catch up.

    Attributes:
        cost: Of a fit, lower is better.
        best: The lowest cost that a fit has reached elsewhere.
        near: Cost behind the best within which a fit goes on.
        enough: Score by which a fit must be lowered in a round to go on.
    """

    cost: Callable[[Hypothesis], float]
    best: float = math.inf
    near: float = 40.0
    enough: float = 2.0

    def still_in(self, fits: Sequence[Hypothesis], lowered: Mapping[int, float]) -> list[int]:
        """Return which fits go on, of those that the last round lowered by so much.

        A fit far behind does if `CATCHES_UP` more such rounds would bring it near.
        """
        costs = {i: self.cost(fits[i]) for i in lowered}
        best = min([self.best, *(self.cost(fit) for fit in fits)])
        return [i for i, by in lowered.items() if costs[i] - best < self.near + CATCHES_UP * by]


class Fitter:
    """Fits hypotheses on a part of the innovations, under one noise model.

    Attributes:
        part: Weight of each innovation, 0 or 1, (events,); a drive's first second never counts.
    """

    def __init__(self, model: Likelihood, part: Floats) -> None:
        self.model, self.part = model, part * model.valid

    def under(self, model: Likelihood) -> "Fitter":
        """Return what fits the same part of the same recordings under another noise model."""
        return self if model is self.model else Fitter(model, self.part)

    def score(self, e: Floats, z: Floats) -> Floats:
        """Return the score of each column of innovations."""
        losses = self.part @ (TAIL * np.log1p(e * e / TAIL))
        return np.asarray(losses + self.prior_loss(z))

    def prior_loss(self, z: Floats) -> Floats:
        """Return what the car file makes of each row of the car's own numbers, (n,)."""
        rows = np.atleast_2d(z)
        return np.asarray(((rows @ self.model.simulator.prior) * rows).sum(axis=1))

    def weights(self, e: Floats) -> Floats:
        """Return how much each innovation counts in a least-squares step, (events,)."""
        return self.part / (1.0 + e * e / TAIL)

    def unfitted(self, z: Floats | None = None) -> Hypothesis:
        """Return the car as its file says, not fitted yet."""
        z = np.zeros(len(self.model.nominal)) if z is None else z
        e, _ = self.model([self.model.simulator.numbers(z)])
        score = float(self.score(e, z)[0])
        return Hypothesis(self.model, (), z, np.zeros(0), e[:, 0], score, np.zeros((0, 0)))

    def at(self, base: Hypothesis) -> Hypothesis:
        """Return a hypothesis at its own numbers, with derivatives."""
        return self._differentiated([base], [True])[0]

    def with_nominal_car(self, base: Hypothesis) -> Hypothesis:
        """Return a hypothesis with the car's own numbers where they are likeliest, unfitted."""
        return self.at(replace(base, z=np.zeros_like(base.z)))

    def begin(
        self, base: Hypothesis, trials: Sequence[Trial], *, amplified: bool = False
    ) -> list[Hypothesis]:
        """Return hypotheses at trial values, the car's own numbers refitted linearly from `base`.

        A trial that leaves physical bounds has an infinite score.

        Args:
            base: Hypothesis, with derivatives.
            trials: Effects and their values.
            amplified: Try each last effect also as strong, and of such a sign, as its trials say
                that it suits best: one that is small or negative is not found by trials of 0.1.
        """
        sets = [
            self._numbers(effects, base.z * self._free(effects), values)
            for effects, values in trials
        ]
        e, ok = self.model(sets)
        weights = self.weights(base.innovations)
        jacobian = base.jacobian[:, : len(base.z)]
        normal = _normal(jacobian, weights) + self.model.simulator.prior
        slopes = (
            jacobian.T @ (weights[:, None] * np.nan_to_num(e))
            + (self.model.simulator.prior @ base.z)[:, None]
        )
        masked, found = dict[bytes, Floats](), list[Hypothesis]()
        better = dict[int, list[tuple[float, Trial]]]()
        for i, (effects, values) in enumerate(trials):
            column = e[:, i].copy()
            if not ok[i] or not np.isfinite(column).all():
                found.append(
                    Hypothesis(self.model, effects, base.z, values, column, np.inf, jacobian)
                )
                continue
            mine = self._free(effects)
            dz = -base.z * ~mine  # a number that an effect sets is not the car's to move
            low, high = (np.where(mine, limit - base.z, 0.0) for limit in (-FARTHEST, FARTHEST))
            own_normal = normal * np.outer(mine, mine)
            dz += bounded_step(own_normal, slopes[:, i] * mine, low, high)
            alike = mine.tobytes()  # trials that set the same numbers share one large array
            if alike not in masked:
                masked[alike] = jacobian if mine.all() else jacobian * mine
            own = masked[alike]
            moved = column + own @ dz
            score = float(self.score(moved[:, None], base.z + dz)[0])
            found.append(Hypothesis(self.model, effects, base.z + dz, values, moved, score, own))
            if amplified:
                gain, by = self._amplitude(
                    base, column - base.innovations, weights, own, own_normal
                )
                trial = effects, _amplified(effects, values, by)
                better.setdefault(id(effects[-1]), []).append((gain, trial))
        again = [trial for same in better.values() for trial in _most_gaining(same)]
        return [*found, *(self.begin(base, again) if again else ())]

    def _amplitude(
        self, base: Hypothesis, change: Floats, weights: Floats, jacobian: Floats, normal: Floats
    ) -> tuple[float, float]:
        """Return what a change of the innovations gains at its best amplitude, and that amplitude.

        The car's own numbers, and only those that are free, go along as they like.
        """
        own = np.linalg.pinv(normal) @ (jacobian.T @ (weights * change))
        left = weights * (change - jacobian @ own)
        slope = float(left @ base.innovations) - float(own @ self.model.simulator.prior @ base.z)
        size = float(left @ change)
        return (slope * slope / size, -slope / size) if size > 1e-9 else (0.0, 1.0)

    def _free(self, effects: Sequence[Candidate]) -> Bools:
        """Return which of the car's own numbers no effect sets, or means the same by.

        What an effect only moves begins as the car's own.
        """
        parameters = [
            parameter
            for effect in effects
            if effect.replaces_own
            for parameter in effect.parameters
        ]
        set_by_effects = {key for one in parameters for key in (one.key, one.own)}
        return np.array([own.key not in set_by_effects for own in self.model.nominal])

    def _numbers(self, effects: Sequence[Candidate], z: Floats, values: Floats) -> dict[str, float]:
        return together(self.model.simulator.numbers(z), effects, values)

    def refine(
        self,
        fits: Sequence[Hypothesis],
        rounds: int = ROUNDS,
        *,
        fresh: bool = False,
        race: "Race | None" = None,
    ) -> list[Hypothesis]:
        """Return hypotheses fitted together; those beyond physical bounds are left out.

        Args:
            fits: To begin from; a linear guess is no fit: the first round computes its true score.
            rounds: At most.
            fresh: Renew the derivatives by the car's own numbers too.
            race: Ends fits that will not be the best; None: each goes on while it improves.
        """
        now = [
            replace(f, model=self.model, z=f.z * self._free(f.effects), score=np.inf)
            for f in fits
            if np.isfinite(f.score)
        ]
        active, stalled = list(range(len(now))), set[int]()
        enough = race.enough if race else ENOUGH
        for count in range(rounds):
            if not active or (count and self.model.simulator.budget.is_spent()):
                break
            renewed = [fresh and (count % 3 == 0 or i in stalled) for i in active]
            begun = self._differentiated([now[i] for i in active], renewed)
            going, stalled = dict[int, float](), set()
            for i, before, after, new in zip(
                active, begun, self._stepped(begun), renewed, strict=True
            ):
                now[i] = after
                if not np.isfinite(before.score):
                    continue
                lowered = before.score - after.score
                ends = lowered < enough
                if ends and fresh and not new:  # by derivatives that were not new: no proof yet
                    stalled.add(i)
                if not ends or i in stalled:
                    going[i] = lowered
            active = race.still_in(now, going) if race else list(going)
        return now

    def _differentiated(
        self, fits: Sequence[Hypothesis], renewed: Sequence[bool]
    ) -> list[Hypothesis]:
        """Return fits with innovations and derivatives renewed, all in one batch.

        `renewed` says of which the derivatives by the car's own numbers are to be new as well.
        """
        own = len(self.model.nominal)
        wanted = [
            list(range(own)) if new or f.jacobian.shape[1] < own else list[int]()
            for f, new in zip(fits, renewed, strict=True)
        ]
        sets = list[dict[str, float]]()
        for f, moving in zip(fits, wanted, strict=True):
            sets.append(f.numbers)
            sets += self._beside(f, f.z, f.values, moving)
        e, ok = self.model(sets)
        e[:, ~ok] = np.nan
        found, at = list[Hypothesis](), 0
        for f, moving in zip(fits, wanted, strict=True):
            now, jacobian = e[:, at].copy(), np.zeros((len(e), own + len(f.values)))
            at += 1
            if len(moving) < own:
                jacobian[:, :own] = f.jacobian[:, :own]
            for j in moving:
                jacobian[:, j] = (e[:, at] - now) / self._side(f, j)
                at += 1
            steps = zip(_small_steps(f, f.values), f.parameters, strict=True)
            for j, (step, parameter) in enumerate(steps):
                jacobian[:, own + j] = (e[:, at] - now) / (step / parameter.step)
                at += 1
            if not np.isfinite(now).all():
                found.append(replace(f, score=np.inf))
                continue
            score = float(self.score(now[:, None], f.z)[0])
            jacobian = np.nan_to_num(jacobian)
            found.append(replace(f, innovations=now, score=score, jacobian=jacobian))
        return found

    def _beside(
        self, f: Hypothesis, z: Floats, values: Floats, moving: Sequence[int]
    ) -> list[dict[str, float]]:
        """Return sets a small step away, in the car's own numbers named and in each parameter."""
        sets = list[dict[str, float]]()
        for j in moving:
            other = z.copy()
            other[j] += self._side(f, j)
            sets.append(self._numbers(f.effects, other, values))
        for j, step in enumerate(_small_steps(f, values)):
            moved = values.copy()
            moved[j] += step
            sets.append(self._numbers(f.effects, z, moved))
        return sets

    def _side(self, f: Hypothesis, j: int) -> float:
        """Return a small step of a nominal parameter that stays within its bounds."""
        o = self.model.nominal[j]
        return -SMALL if o.mean + (f.z[j] + SMALL) * o.std > o.bounds[1] else SMALL

    def _plan(self, f: Hypothesis) -> "_Plan":
        """Return the quadratic that one fit's next step is to lower."""
        own, parameters, inverse = len(f.z), f.parameters, self.model.simulator.prior
        prior = np.diag(np.concatenate((np.ones(own), np.full(len(f.values), 1e-6))))
        prior[:own, :own] = inverse
        weights = self.weights(f.innovations)
        normal = _normal(f.jacobian, weights) + prior
        z = np.concatenate((f.z, np.zeros(len(f.values))))
        slope = f.jacobian.T @ (weights * f.innovations) + prior @ z
        bounds = [
            [(k.bounds[side] - v) / k.step for k, v in zip(parameters, f.values, strict=True)]
            for side in (0, 1)
        ]
        mine = self._free(f.effects)
        low = np.concatenate((np.where(mine, -FARTHEST - f.z, 0.0), bounds[0]))
        high = np.concatenate((np.where(mine, FARTHEST - f.z, 0.0), bounds[1]))
        scales = np.concatenate((np.ones(own), [k.step for k in parameters]))
        covariance = np.asarray(np.linalg.pinv(normal), dtype=np.float64)
        return _Plan(replace(f, covariance=covariance), normal, slope, low, high, scales)

    def _stepped(self, fits: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return each fit moved along its Gauss-Newton step.

        Of a few fits, or where the whole step lowers the score less than its quadratic says, the
        best of several lengths and dampings counts.
        """
        plans = {i: self._plan(f) for i, f in enumerate(fits) if np.isfinite(f.score)}
        best = [plans[i].start if i in plans else f for i, f in enumerate(fits)]
        few = len(plans) <= FEW  # a tile has room: drive all lengths and the next derivatives too
        first = [
            (i, move) for i, plan in plans.items() for move in plan.moves()[: None if few else 1]
        ]
        more = [
            numbers
            for plan in plans.values()
            for numbers in self._beside(plan.start, *plan.moved(plan.whole), ())
        ]
        self._try(plans, best, first, more if few else ())
        short = [] if few else [i for i, plan in plans.items() if not plan.is_met(best[i])]
        self._try(plans, best, [(i, move) for i in short for move in plans[i].moves()[1:]])
        return best

    def _try(
        self,
        plans: Mapping[int, "_Plan"],
        best: list[Hypothesis],
        moves: Sequence[tuple[int, Floats]],
        cached: Sequence[dict[str, float]] = (),
    ) -> None:
        """Drive fits after moves, and `cached` for later; put those that are better into `best`."""
        if not moves:
            return
        moved = [(i, *plans[i].moved(move)) for i, move in moves]
        sets = [self._numbers(best[i].effects, z, values) for i, z, values in moved]
        e, ok = self.model([*sets, *cached])
        for column, (i, z, values) in enumerate(moved):
            if ok[column] and np.isfinite(e[:, column]).all():
                score = float(self.score(e[:, column : column + 1], z)[0])
                if score < best[i].score:
                    now = e[:, column].copy()
                    best[i] = replace(best[i], score=score, z=z, values=values, innovations=now)


class _Plan:
    """A quadratic about a fit where it was, and the steps that should lower it.

    Attributes:
        start: The fit, with the covariance that this quadratic gives.
        whole: The Gauss-Newton step within bounds.
    """

    def __init__(
        self, start: Hypothesis, normal: Floats, slope: Floats, low: Floats, high: Floats,
        scales: Floats,
    ) -> None:  # fmt: skip
        self.start = start
        self._normal, self._slope, self._low, self._high = normal, slope, low, high
        self._scales = scales
        self.whole = bounded_step(normal, slope, low, high)

    def is_met(self, after: Hypothesis) -> bool:
        """Return whether a fit after the whole step lowered the score about as expected."""
        whole = self.whole
        expected = -float(2.0 * self._slope @ whole + whole @ self._normal @ whole)
        return self.start.score - after.score > MET * expected - ENOUGH

    def moves(self) -> list[Floats]:
        """Return the whole step, then shorter and more damped ones."""
        damped = [
            bounded_step(
                self._normal + np.diag(damping * self._normal.diagonal()), self._slope, self._low,
                self._high,
            )
            for damping in DAMPINGS
        ]  # fmt: skip
        return [self.whole, *(length * self.whole for length in SHORTER), *damped]

    def moved(self, move: Floats) -> tuple[Floats, Floats]:
        """Return the numbers after a move."""
        own, by = len(self.start.z), move * self._scales
        return self.start.z + by[:own], self.start.values + by[own:]


def _most_gaining(same: Sequence[tuple[float, Trial]]) -> list[Trial]:
    """Return, of the (gain, trial) of one effect, the best trial, or those at the best places."""
    ranked = sorted((one for one in same if one[0] > 0.0), key=lambda one: -one[0])
    return [trial for _, trial in ranked[: SPOTS if same[0][1][0][-1].is_placed else 1]]


def _amplified(effects: Sequence[Candidate], values: Floats, by: float) -> Floats:
    """Return values with the last effect `by` times as strong, in bounds, at the same place."""
    parameters = effects[-1].parameters
    neutral = np.array([parameter.neutral for parameter in parameters])
    low, high = np.array([parameter.bounds for parameter in parameters]).T
    at = len(values) - len(parameters)
    amplified = np.clip(neutral + by * (values[at:] - neutral), low, high)
    last = np.where(effects[-1].amounts, amplified, values[at:])
    return np.concatenate((values[:at], last))


def _normal(jacobian: Floats, weights: Floats) -> Floats:
    """Return J' W J."""
    rooted = jacobian * np.sqrt(weights)[:, None]
    return np.asarray(rooted.T @ rooted)


def bounded_step(normal: Floats, slope: Floats, low: Floats, high: Floats) -> Floats:
    """Return the step that minimises a quadratic within bounds that hold 0: active sets."""
    n = len(slope)
    step, held = np.zeros(n), np.zeros(n, dtype=np.bool_)
    for _ in range(4 * n):
        free = np.flatnonzero(~held)
        wanted = -slope[free] - normal[np.ix_(free, np.flatnonzero(held))] @ step[held]
        best = np.linalg.lstsq(normal[np.ix_(free, free)], wanted, rcond=1e-12)[0]
        way = best - step[free]
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = np.where(way > 0.0, high[free] - step[free], low[free] - step[free]) / way
        reach = np.where(np.abs(way) > 1e-12, np.maximum(reach, 0.0), np.inf)
        if len(free) and reach.min() < 1.0:
            first = int(np.argmin(reach))
            step[free] += reach[first] * way
            held[free[first]] = True
            continue
        step[free] = best
        pull = normal @ step + slope
        outward = np.where(step >= high - 1e-12, -pull, pull)
        outward[~held] = np.inf
        if not held.any() or outward.min() >= -1e-9:
            break
        held[int(np.argmin(outward))] = False
    return step


def _small_steps(f: Hypothesis, values: Floats) -> list[float]:
    """Return small steps of the effects' numbers that stay within their bounds."""
    return [
        -0.5 * k.step if v + 0.5 * k.step > k.bounds[1] else 0.5 * k.step
        for k, v in zip(f.parameters, values, strict=True)
    ]
