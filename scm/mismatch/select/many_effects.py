"""The search for what a simulator lacks of a car that it is far from: many effects at once.

A car that nobody has measured differs in more ways than one, and its residuals are no noise with
one effect in it. What is left is then judged by strides, and each round takes every effect that
pays beside those before it, until what the others make needless is taken back.
"""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from scm.arrays import Floats
from scm.mismatch.budget import Budget
from scm.mismatch.effect_catalogue import Candidate, Parameter
from scm.mismatch.findings import Equation
from scm.mismatch.fit.data_split import Parts, split
from scm.mismatch.fit.fitter import Fitted
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.noise import usual_noise
from scm.mismatch.fit.residual_windows import WindowedLikelihood, independent_share, learn_sizes
from scm.mismatch.select.search import FALSE_ALARMS, Search, Step, sought
from scm.replay.drive import Drive, is_led
from scm.vehicles.car import Car

MOST_EFFECTS = 10
CLOSE = 25.0  # two effects that no screening tells apart
AT_ONCE, MARGIN = 4, 10.0  # effects of one round; what each beside the first gains beyond its price
MOST_DOUBLINGS, FAR_DOUBLINGS = 9.0, 16.0
SETTLES_FAR = 2
HELD = Candidate(
    "drive_saturation", Equation.DRIVE, ("throttle",),
    (Parameter("forward", "drive.limit_forward", "1", (0.02, 1.0), 1.0, 0.02),),
    ((0.7,), (0.4,), (0.15,)),
    "Whatever is asked for, the drive takes no more than {forward} of full throttle.",
)  # fmt: skip
"""A speed that is commanded may be more than a car is allowed to drive."""
Notify = Callable[[str], None]


def strays(model: Likelihood) -> bool:
    """Say whether a car differs in so many ways that what its best model leaves is no noise.

    That is so where the least disturbances had to be doubled very often to explain it.
    """
    return doublings(model) >= MOST_DOUBLINGS


def is_far(search: Search) -> bool:
    """Say whether a re-tuned car is so far off that one effect after another would not find it."""
    return search.retuned is not None and doublings(search.model) >= FAR_DOUBLINGS


def doublings(model: Likelihood) -> float:
    """Return how often the least disturbances were doubled, summed over their kinds."""
    now, least = model.noise, usual_noise(model.drives)
    kinds = ("speed", "side", "yaw_rate", "launch", "turn")
    return float(sum(np.log2(getattr(now, k) / getattr(least, k)) for k in kinds))


def by_windows(
    drives: Sequence[Drive], car: Car, library: Sequence[Candidate], notify: Notify, budget: Budget
) -> tuple[Likelihood, Parts, "ManyEffectsSearch"]:
    """Return a model that judges by strides, its parts, and the search that goes with it.

    Where the measured speed drives the car, neither drive nor tyres are proposed.
    """
    notify("judging by strides: the car differs in many ways")
    extras, have = list[Candidate](), {term.name for term in car.terms}
    if any(is_led(drive) for drive in drives):
        known = (Equation.STEERING, Equation.SENSOR)
        library = [c for c in library if c.equation in known]
    elif "speed_control" in have and HELD.name not in have:
        car, extras = car.with_terms([HELD.name]), [HELD]
    model = WindowedLikelihood(drives, car)
    parts = split(model)
    seen = parts.fit.weight + parts.choose.weight
    return model, parts, ManyEffectsSearch(model, seen, (*library, *extras), notify, budget)


class ManyEffectsSearch(Search):
    """Looks for many effects at once, by strides.

    None is begun as strong as suits it best: it would take what belongs to the others.
    """

    holds, amplifies, keeps = 0.0, False, True

    def __init__(
        self, model: Likelihood, part: Floats, library: Sequence[Candidate], notify: Notify,
        budget: Budget | None = None,
    ) -> None:  # fmt: skip
        super().__init__(model, part, library, notify, learn_sizes, budget)

    def price(self, effects: Sequence[Candidate]) -> float:
        """Return what effects must gain: `ln n` a number, for strides hold more than noise."""
        parameters = sum(len(effect.parameters) for effect in effects)
        rare = sum(effect.rare for effect in effects)
        size = 2.0 * math.log(len(self.listed) / FALSE_ALARMS)
        return rare + parameters * math.log(self.events) + len(effects) * size

    def run(self, is_over: Callable[[], bool] = lambda: False) -> Fitted:
        """Return the model that explains the recordings best, see `Search.run`."""
        best = self.retuned
        while len(best.effects) < MOST_EFFECTS and not is_over():
            more = self.within(sought(best), partial(self._more, best))
            if more is None or set(more.names) <= set(best.names):
                break
            best = more
        return best

    def _more(self, best: Fitted) -> Fitted:
        """Return the model after one round more; the same where no effect pays."""
        steps = self._at_once(self._compared(self.extend(best)))
        if not steps:
            return best
        self.steps += steps
        more = self._joined(best, [step.rivals[0] for step in steps])
        return self._usually(self.prune(self.settle(more)), best.names)

    def _usually(self, best: Fitted, known: Collection[str]) -> Fitted:
        """Return the model with usual effects in place of a new rare one, where these explain more.

        A rare one may do alone what two usual ones do together: added one by one it comes first,
        and beside it neither of them pays. Compared are models with the noise that each leaves.

        Args:
            best: Settled.
            known: Names of effects that stood already.
        """
        for rare in [e for e in best.effects if e.rare and e.name not in known]:
            if rare not in best.effects:
                continue
            noise, listed, cost = self.model.noise, self.listed, self._with_noise(best)
            base = self._without_each(best)[best.effects.index(rare)]
            self.notify(f"looking for usual effects in place of {rare.name}")
            self.listed = tuple(c for c in listed if not c.rare)
            try:
                steps = self._at_once(self._compared(self.extend(base)))
            finally:
                self.listed = listed
            if steps:
                usual = self._joined(base, [step.rivals[0] for step in steps])
                usual = self.prune(self.settle(usual))
                if self._with_noise(usual) < cost:
                    best, noise, self.steps = usual, self.model.noise, [*self.steps, *steps]
            self.model.believe(noise)
        return best

    def confirmed(self, best: Fitted, unseen: Floats) -> Fitted:
        """Return the model without effects that do not help on an unseen part, or no longer.

        Its intervals know how much of what is left comes together.
        """
        best = self.prune(super().confirmed(best, unseen))
        best.covariance = best.covariance / independent_share(self.model, best.e)
        return best

    def _compared(self, step: Step) -> Step:
        """Return a round whose two best effects, if close, stand as their settled models do."""
        close = len(step.rivals) > 1 and step.criteria[1] < step.criteria[0] + CLOSE
        if not close or step.criteria[1] > self.criterion(step.base):
            return step
        noise, costs = self.model.noise, list[float]()
        for rival in step.rivals[:2]:
            self.notify(f"comparing {step.rivals[0].names[-1]} and {step.rivals[1].names[-1]}")
            self.model.believe(noise)
            settled = self.settle(replace(rival, done=False))
            sizes = float(self.fitter.part @ self.model.log_size)
            costs.append(self.criterion(settled) + sizes)
        self.model.believe(noise)
        if costs[0] <= costs[1]:
            return step
        first, second, *rest = step.rivals
        return Step(step.base, (second, first, *rest), step.criteria)

    def _at_once(self, step: Step) -> list[Step]:
        """Return a round for each effect that pays beside those before it, best first.

        The first was refitted; what another adds to it is a linear guess from its derivatives.
        """
        base, first = step.base, step.rivals[0]
        if step.criteria[0] > self.criterion(base):
            return []
        rounds, known = [step], len(base.z) + len(base.values)
        e, columns = first.e, first.jacobian
        while len(rounds) < min(AT_ONCE, MOST_EFFECTS - len(base.effects)):
            taken = {one.rivals[0].names[-1] for one in rounds}
            left = [f for f in step.rivals if f.names[-1] not in taken]
            beside = [np.hstack((columns, f.jacobian[:, known:])) for f in left]
            costs = [
                self._cost(f) - self._gain(e, all_) for f, all_ in zip(left, beside, strict=True)
            ]
            order = sorted(range(len(left)), key=costs.__getitem__)
            if not order or costs[order[0]] > -MARGIN:
                break
            columns = beside[order[0]]
            e = e + columns @ self._move(e, columns)
            rounds.append(Step(
                base, tuple(left[k] for k in order),
                tuple(self.criterion(base) + costs[k] for k in order),
            ))  # fmt: skip
        return rounds

    def _cost(self, fitted: Fitted) -> float:
        return self.price(fitted.effects[-1:])

    def _gain(self, e: Floats, columns: Floats) -> float:
        """Return how much less the loss would be, were everything linear."""
        weights = self.fitter.weights(e)
        moved = e + columns @ self._move(e, columns)
        return float(weights @ (e * e - moved * moved))

    def _move(self, e: Floats, columns: Floats) -> Floats:
        """Return the least-squares move of all numbers; the car's own are held a little."""
        weights = self.fitter.weights(e)
        rooted = columns * np.sqrt(weights)[:, None]
        held = np.full(columns.shape[1], 1e-6)
        held[: len(self.model.nominal)] = 1.0
        normal = rooted.T @ rooted + np.diag(held)
        return np.asarray(-np.linalg.solve(normal, columns.T @ (weights * e)))

    def _joined(self, base: Fitted, found: Sequence[Fitted]) -> Fitted:
        """Return one hypothesis with the last effect of each of several, not refitted yet."""
        first, known = found[0], len(base.values)
        values = np.concatenate((first.values[:known], *(f.values[known:] for f in found)))
        return Fitted(
            effects=(*base.effects, *(f.effects[-1] for f in found)),
            z=first.z.copy(), values=values, e=first.e, q=first.q,
            jacobian=np.zeros((len(first.e), len(base.z) + len(values))),
        )  # fmt: skip
