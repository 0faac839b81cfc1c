"""Fits of many hypotheses at once: Gauss-Newton, all rollouts of a round in one batch.

A hypothesis is a tuple of effects. Its numbers are free; the car's own are free too, held by the
scatter that the car file states.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from scm.arrays import Bools, Floats
from scm.mismatch.effect_catalogue import Candidate, Parameter
from scm.mismatch.fit.likelihood import Likelihood

ROUNDS = 5
SMALL = 0.1  # a derivative's step of an ordinary number, in standard deviations
SHORTER = (0.5, 0.2, 0.05)
DAMPINGS = (0.03, 0.3)
FEW = 2  # fits whose trials leave room in a tile
ENOUGH = 0.5
SPOTS = 3  # places that an effect of some place is begun at
TAIL = 8.0  # degrees of freedom of the Student-t loss: a few wild moments prove nothing
FARTHEST = 2.0  # beyond twice its scatter a number is no longer ordinary
OF_OWN: Mapping[str, str] = {
    "payload.mass_kg": "body.mass_kg",
    "com_shift.shift_m": "body.cog_to_rear_axle_m",
    "tyre_stiffness.scale": "tyre.lateral_slip_extremum",
    "steering.rate_scale": "steering.rate_rad_s",
    "motor.gain": "drive.stall_torque_nm",
    "drive.delay_s": "clock.throttle_s",
}
"""Numbers of effects by the car's own number that means the same."""
Trial = tuple[tuple[Candidate, ...], Floats]


@dataclass(slots=True)
class Fitted:
    """A hypothesis with its best numbers so far.

    Attributes:
        z: The car's own numbers, standard deviations from the file's.
        values: The effects' numbers, in the order of their knobs.
        e: Unit innovations, (events,); `q`: their loss on the fitted part, and the prior's.
        jacobian: Of `e` by `z` and then by values over their knobs' steps, (events, n).
    """

    effects: tuple[Candidate, ...]
    z: Floats
    values: Floats
    e: Floats
    q: float
    jacobian: Floats
    done: bool = False
    covariance: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def names(self) -> tuple[str, ...]:
        """The effects' names."""
        return tuple(effect.name for effect in self.effects)

    @property
    def parameters(self) -> int:
        """How many numbers the effects have."""
        return len(self.values)


class Fitter:
    """Fits hypotheses on a part of the innovations.

    Attributes:
        part: Weight of each innovation, 0 or 1, (events,); a drive's first second never counts.
    """

    def __init__(self, model: Likelihood, part: Floats) -> None:
        self.model, self.part = model, part * model.settled

    def numbers(self, effects: Sequence[Candidate], z: Floats, values: Floats) -> dict[str, float]:
        """Return the numbers by key of a hypothesis."""
        found, at = self.model.numbers(z), 0
        for effect in effects:
            n = len(effect.parameters)
            found |= effect.numbers(tuple(values[at : at + n]))
            at += n
        return found

    def score(self, e: Floats, z: Floats) -> Floats:
        """Return Q of each column of innovations."""
        losses = self.part @ (TAIL * np.log1p(e * e / TAIL))
        return np.asarray(losses + self.prior_loss(z))

    def prior_loss(self, z: Floats) -> Floats:
        """Return what the car file makes of each row of the car's own numbers, (n,)."""
        rows = np.atleast_2d(z)
        return np.asarray(((rows @ self.model.prior) * rows).sum(axis=1))

    def weights(self, e: Floats) -> Floats:
        """Return how much each innovation counts in a least-squares step, (events,)."""
        return self.part / (1.0 + e * e / TAIL)

    def null(self, z: Floats | None = None) -> Fitted:
        """Return the car as its file says, not fitted yet."""
        z = np.zeros(len(self.model.nominal)) if z is None else z
        e, _ = self.model([self.numbers((), z, np.zeros(0))])
        return Fitted((), z, np.zeros(0), e[:, 0], float(self.score(e, z)[0]), np.zeros((0, 0)))

    def nominal(self, base: Fitted) -> Fitted:
        """Return a hypothesis with the car's own numbers where they are likeliest, unfitted."""
        return self.at(replace(base, z=np.zeros_like(base.z)))

    def at(self, base: Fitted) -> Fitted:
        """Return a hypothesis at its own numbers, with derivatives."""
        fitted = replace(base, values=base.values.copy())
        self._differentiate([fitted], {id(fitted)})
        return fitted

    def begin(
        self, base: Fitted, trials: Sequence[Trial], *, amplified: bool = False
    ) -> list[Fitted]:
        """Return hypotheses at trial values, the car's own numbers refitted linearly from `base`.

        A trial that leaves physical bounds has an infinite `q`.

        Args:
            base: Fitted, with derivatives.
            trials: Effects and their values.
            amplified: Try each last effect also as strong, and of such a sign, as its trials say
                that it suits best: one that is small or negative is not found by trials of 0.1.
        """
        sets = [
            self.numbers(effects, base.z * self._free(effects), values)
            for effects, values in trials
        ]
        e, ok = self.model(sets)
        weights = self.weights(base.e)
        jacobian = base.jacobian[:, : len(base.z)]
        normal = _normal(jacobian, weights) + self.model.prior
        slopes = (
            jacobian.T @ (weights[:, None] * np.nan_to_num(e))
            + (self.model.prior @ base.z)[:, None]
        )
        masked, found = dict[bytes, Floats](), list[Fitted]()
        better = dict[int, list[tuple[float, Trial]]]()
        for i, (effects, values) in enumerate(trials):
            column = e[:, i].copy()
            if not ok[i] or not np.isfinite(column).all():
                found.append(Fitted(effects, base.z, values, column, np.inf, jacobian))
                continue
            mine = self._free(effects)
            dz = -base.z * ~mine  # a number that an effect sets is not the car's to move
            low, high = (np.where(mine, limit - base.z, 0.0) for limit in (-FARTHEST, FARTHEST))
            own_normal = normal * np.outer(mine, mine)
            dz += _bounded(own_normal, slopes[:, i] * mine, low, high)
            alike = mine.tobytes()  # trials that set the same numbers share one large array
            if alike not in masked:
                masked[alike] = jacobian if mine.all() else jacobian * mine
            own = masked[alike]
            moved = column + own @ dz
            q = float(self.score(moved[:, None], base.z + dz)[0])
            found.append(Fitted(effects, base.z + dz, values, moved, q, own))
            if amplified:
                gain, by = self._amplitude(base, column - base.e, weights, own, own_normal)
                trial = effects, _amplified(effects, values, by)
                better.setdefault(id(effects[-1]), []).append((gain, trial))
        again = [trial for same in better.values() for trial in _most_gaining(same)]
        return [*found, *(self.begin(base, again) if again else ())]

    def _amplitude(
        self, base: Fitted, change: Floats, weights: Floats, jacobian: Floats, normal: Floats
    ) -> tuple[float, float]:
        """Return what a change of the innovations gains at its best amplitude, and that amplitude.

        The car's own numbers, and only those that are free, go along as they like.
        """
        own = np.linalg.pinv(normal) @ (jacobian.T @ (weights * change))
        left = weights * (change - jacobian @ own)
        slope = float(left @ base.e) - float(own @ self.model.prior @ base.z)
        size = float(left @ change)
        return (slope * slope / size, -slope / size) if size > 1e-9 else (0.0, 1.0)

    def _free(self, effects: Sequence[Candidate]) -> Bools:
        """Return which of the car's own numbers no effect sets, or means the same by."""
        taken = {parameter.key for effect in effects for parameter in effect.parameters}
        taken |= {OF_OWN[key] for key in taken & OF_OWN.keys()}
        return np.array([own.key not in taken for own in self.model.nominal])

    def refine(
        self, fits: Sequence[Fitted], rounds: int = ROUNDS, *, fresh: bool = False
    ) -> list[Fitted]:
        """Fit hypotheses together; `fresh` renews the derivatives by the car's own numbers too."""
        fits = [f for f in fits if np.isfinite(f.q)]
        for fitted in fits:
            fitted.done = False
            fitted.q = np.inf  # a linear guess is no fit: the first round says what it really is
            fitted.z = fitted.z * self._free(fitted.effects)
        stalled = set[int]()  # by derivatives that were not new: that says nothing yet
        for count in range(rounds):
            active = [f for f in fits if not f.done]
            if not active or (count and self.model.is_late()):
                break
            renewed = {id(f) for f in active if fresh and (count % 3 == 0 or id(f) in stalled)}
            self._differentiate(active, renewed)
            self._step(active)
            stalled = {id(f) for f in active if f.done and fresh and id(f) not in renewed}
            for f in active:
                f.done = f.done and (id(f) not in stalled or not np.isfinite(f.q))
        return list(fits)

    def _differentiate(self, fits: Sequence[Fitted], renewed: Collection[int]) -> None:
        """Renew `e` and the derivatives of each fit, all in one batch.

        `renewed` holds, by `id`, whose derivatives by the car's own numbers are to be new as well.
        """
        own = len(self.model.nominal)
        wanted = [self._moving(f, fresh=id(f) in renewed) for f in fits]
        sets = list[dict[str, float]]()
        for f, moving in zip(fits, wanted, strict=True):
            sets.append(self.numbers(f.effects, f.z, f.values))
            sets += self._beside(f, f.z, f.values, moving)
        e, ok = self.model(sets)
        e[:, ~ok] = np.nan
        at = 0
        for f, moving in zip(fits, wanted, strict=True):
            now, jacobian = e[:, at].copy(), np.zeros((len(e), own + f.parameters))
            at += 1
            if len(moving) < own:
                jacobian[:, :own] = f.jacobian[:, :own]
            for j in moving:
                jacobian[:, j] = (e[:, at] - now) / self._side(f, j)
                at += 1
            for j, step in enumerate(self._parameter_steps(f, f.values)):
                scale = _parameters(f)[j].step
                jacobian[:, own + j] = (e[:, at] - now) / (step / scale)
                at += 1
            if not np.isfinite(now).all():
                f.done, f.q = True, np.inf
                continue
            f.jacobian = np.nan_to_num(jacobian)
            f.e, f.q = now, float(self.score(now[:, None], f.z)[0])

    def _moving(self, f: Fitted, *, fresh: bool) -> list[int]:
        """Return which of the car's own numbers' derivatives are to be renewed."""
        own = len(self.model.nominal)
        return list(range(own)) if fresh or f.jacobian.shape[1] < own else []

    def _beside(
        self, f: Fitted, z: Floats, values: Floats, moving: Sequence[int]
    ) -> list[dict[str, float]]:
        """Return sets a small step away, in the car's own numbers named and in every knob."""
        sets = list[dict[str, float]]()
        for j in moving:
            other = z.copy()
            other[j] += self._side(f, j)
            sets.append(self.numbers(f.effects, other, values))
        for j, step in enumerate(self._parameter_steps(f, values)):
            moved = values.copy()
            moved[j] += step
            sets.append(self.numbers(f.effects, z, moved))
        return sets

    def _plan(self, f: Fitted) -> "_Plan":
        """Return the quadratic that one fit's next step is to lower; renew its covariance."""
        own, parameters = len(f.z), _parameters(f)
        prior = np.diag(np.concatenate((np.ones(own), np.full(f.parameters, 1e-6))))
        prior[:own, :own] = self.model.prior
        weights = self.weights(f.e)
        normal = _normal(f.jacobian, weights) + prior
        f.covariance = np.asarray(np.linalg.pinv(normal), dtype=np.float64)
        slope = f.jacobian.T @ (weights * f.e) + prior @ np.concatenate(
            (f.z, np.zeros(f.parameters))
        )
        bounds = [
            [(k.bounds[side] - v) / k.step for k, v in zip(parameters, f.values, strict=True)]
            for side in (0, 1)
        ]
        mine = self._free(f.effects)
        low = np.concatenate((np.where(mine, -FARTHEST - f.z, 0.0), bounds[0]))
        high = np.concatenate((np.where(mine, FARTHEST - f.z, 0.0), bounds[1]))
        scales = np.concatenate((np.ones(own), [k.step for k in parameters]))
        return _Plan(f, normal, slope, low, high, scales)

    def _side(self, f: Fitted, j: int) -> float:
        """Return a small step of an ordinary number that stays within its bounds."""
        o = self.model.nominal[j]
        return -SMALL if o.mean + (f.z[j] + SMALL) * o.std > o.bounds[1] else SMALL

    def _parameter_steps(self, f: Fitted, values: Floats) -> list[float]:
        """Return small steps of the effects' numbers that stay within their bounds."""
        return [
            -0.5 * k.step if v + 0.5 * k.step > k.bounds[1] else 0.5 * k.step
            for k, v in zip(_parameters(f), values, strict=True)
        ]

    def _step(self, fits: Sequence[Fitted]) -> None:
        """Move each fit along its Gauss-Newton step, by the best of a few lengths."""
        plans = [self._plan(f) for f in fits if not f.done]
        if not plans:
            return
        before = {id(f): f.q for f in fits}
        trials = [(plan, move) for plan in plans for move in (plan.whole, *plan.others())]
        self._try(trials, ahead=plans if len(plans) <= FEW else ())
        for f in fits:
            f.done = f.done or before[id(f)] - f.q < ENOUGH

    def _try(self, trials: Sequence[tuple["_Plan", Floats]], ahead: Sequence["_Plan"] = ()) -> None:
        """Move fits to the best of some moves, if any is better than where they are.

        Args:
            trials: Plans, each with a move.
            ahead: Whose next derivatives are driven too, about the whole step: a tile has room,
                and the model remembers them.
        """
        if not trials:
            return
        moved = [(plan.fitted, *plan.moved(move)) for plan, move in trials]
        sets = [self.numbers(f.effects, z, v) for f, z, v in moved]
        for plan in ahead:
            sets += self._beside(plan.fitted, *plan.moved(plan.whole), ())
        e, ok = self.model(sets)
        for i, (f, z, values) in enumerate(moved):
            if ok[i] and np.isfinite(e[:, i]).all():
                q = float(self.score(e[:, i : i + 1], z)[0])
                if q < f.q:
                    f.q, f.z, f.values, f.e = q, z, values, e[:, i].copy()


class _Plan:
    """A quadratic about a fit where it was, and the steps that should lower it.

    Attributes:
        whole: The Gauss-Newton step within bounds.
    """

    def __init__(
        self, fitted: Fitted, normal: Floats, slope: Floats, low: Floats, high: Floats,
        scales: Floats,
    ) -> None:  # fmt: skip
        self.fitted, self._z, self._values = fitted, fitted.z, fitted.values
        self._normal, self._slope, self._low, self._high = normal, slope, low, high
        self._scales = scales
        self.whole = _bounded(normal, slope, low, high)

    def others(self) -> list[Floats]:
        """Return shorter and more damped steps."""
        damped = [
            _bounded(
                self._normal + np.diag(damping * self._normal.diagonal()), self._slope, self._low,
                self._high,
            )
            for damping in DAMPINGS
        ]  # fmt: skip
        return [length * self.whole for length in SHORTER] + damped

    def moved(self, move: Floats) -> tuple[Floats, Floats]:
        """Return the numbers after a move."""
        own, by = len(self._z), move * self._scales
        return self._z + by[:own], self._values + by[own:]


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


def _bounded(normal: Floats, slope: Floats, low: Floats, high: Floats) -> Floats:
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


def _parameters(f: Fitted) -> list[Parameter]:
    return [parameter for effect in f.effects for parameter in effect.parameters]
