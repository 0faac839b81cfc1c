"""Which effects explain a recording: screen all, refit the best, add one at a time, take back.

An effect must gain more than chance gives the best of so many tried one time in fifty: what
chi-squared with as many degrees of freedom as it has numbers exceeds so seldom.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache, cached_property, partial
from statistics import NormalDist
from typing import TypeVar

import numpy as np

from scm.arrays import Bools, Floats
from scm.mismatch.budget import Budget, Question
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.findings import Equation
from scm.mismatch.fit.fitter import FARTHEST, OF_OWN, SPOTS, Fitted, Fitter
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.noise import Noise, calmed
from scm.mismatch.fit.noise_fit import learn_noise
from scm.mismatch.select.starts import best_of_each, from_each, next_starts, preferred

MOST_EFFECTS = 4
REFITTED, AFRESH, AGAIN = 16, 10, 6
TO_THE_END = 5, 8  # rounds of a fit that others are held against, of all starts and of the near
DEEPER = 5.0
CHANCES = 3
FINALISTS, CLOSE = 3, 100.0
DOUBTFUL = 60.0
CHANCE = 4.0  # times the root of what is expected of unseen parts: two standard deviations of it
PLENTY = 10.0  # gained where nothing was fitted, it is enough for any effect
OFF = 0.125  # two simulators' equations of the same effect differ by as much
REMAINDER, COVERED = OFF * OFF, 0.2
FALSE_ALARMS = 0.02
NEAR = 40.0
DRIFTED, BACK = 8.0, 1.0  # what a number at its limit counts; within its scatter again
HALF_BELIEVED = 4.0  # of that, where an effect is not told from another but from nothing
WRITTEN = 12.0  # two simulators' tyres, both right, differ by as much on a drive of 90 s
TWINS: Mapping[str, str] = {
    "payload": "motor_gain", "motor_gain": "payload", "grade": "wind", "wind": "grade",
}  # fmt: skip
"""Effects that a level floor cannot tell apart: one of them undoes the other."""
Notify = Callable[[str], None]
Learn = Callable[[Likelihood, Sequence[Sequence[Floats]], int], Noise]
_Answer = TypeVar("_Answer")


@dataclass(frozen=True, slots=True)
class Step:
    """One round of the search: the model before, and every single effect added to it.

    Attributes:
        rivals: Refitted alternatives, best first; `criteria` of each, lower is better.
    """

    base: Fitted
    rivals: tuple[Fitted, ...]
    criteria: tuple[float, ...]


def price(effects: Sequence[Candidate], library: int) -> float:
    """Return what effects must gain to be believed, the best of so many in a library.

    Of one that has a place, each that it was begun at counts as one more that was tried. Effects of
    tyres pay more: they first make good how the simulator writes its tyres.
    """
    total = 0.0
    for effect in effects:
        tried = library * (len(effect.starts) if effect.is_placed else 1)
        written = WRITTEN * (effect.equation is Equation.TYRE)
        total += effect.rare + written + exceeded(len(effect.parameters), FALSE_ALARMS / tried)
    return total


@cache
def exceeded(degrees: int, chance: float) -> float:
    """Return what chi-squared exceeds with a small chance (Wilson and Hilferty, 1931)."""
    spread = 2.0 / (9.0 * degrees)
    at = NormalDist().inv_cdf(1.0 - chance)
    return degrees * (1.0 - spread + at * math.sqrt(spread)) ** 3


class Search:
    """Looks for missing effects in one model's recordings.

    Attributes:
        steps: What was tried, round by round.
        holds: Share of an effect's gain that must hold where nothing was fitted.
        amplifies: Whether effects are begun as strong as suits them, and at several places.
        explained: Says of a model whose last effect hardly paid its price whether something else
            explains so much more that no further effect need be looked for.
        keeps: Whether alternatives keep their derivatives, of which a fit afresh makes new ones.
        settles: How often a hypothesis is settled: disturbances that were believed to be huge leave
            it in the wrong valley the first time.
    """

    holds, amplifies, keeps, settles = 0.4, True, False, 1

    def __init__(
        self,
        model: Likelihood,
        part: Floats,
        library: Sequence[Candidate],
        notify: Notify,
        learn: Learn = learn_noise,
        budget: Budget | None = None,
    ) -> None:
        self.model, self.listed, self.notify = model, tuple(library), notify
        self._learn, self.budget = learn, budget or Budget()
        model.asked, model.is_late = self.budget.check, self.budget.is_spent
        self.fitter = Fitter(model, part)
        self.events = int(part.sum())
        self.steps: list[Step] = []
        self.explained: Callable[[Fitted], bool] = lambda _: False

    def price(self, effects: Sequence[Candidate]) -> float:
        """Return what effects must gain to be believed."""
        return price(effects, len(self.listed))

    def criterion(self, fitted: Fitted) -> float:
        """Return Q and the price of its effects."""
        return fitted.q + self.price(fitted.effects)

    def run(self, is_over: Callable[[], bool] = lambda: False) -> Fitted:
        """Return the model that explains the recordings best without inventing anything.

        What the budget ends in the midst of is given up: the model is the one before.

        Args:
            is_over: Says when no further effect is to be looked for.
        """
        best = self.retuned
        while len(best.effects) < MOST_EFFECTS and not is_over():
            noise, found = self.model.noise, self.within(sought(best), partial(self._round, best))
            if found is None:
                break
            before, margin, best = found
            if not before.effects:
                self.retuned = before
            doubtful = margin < DOUBTFUL and (margin >= 0.0 or not before.effects)
            if doubtful and self.within(Question.LAWS, partial(self.explained, best)):
                break
            if not before.effects and margin < DOUBTFUL:
                calm = self.within(Question.CALM, partial(self._calmly, best, noise))
                best = calm or best
            if len(best.effects) == len(before.effects):
                break
        return best

    def within(
        self, question: Question, work: Callable[[], _Answer], *renewed: Fitted
    ) -> _Answer | None:
        """Return what work finds; None where the budget ends before, then all is as it was.

        Args:
            question: That is left then.
            work: What the model believes of noise, and `steps`, are put back after it.
            renewed: Fits that it renews in place.
        """
        noise, steps, kept = self.model.noise, list(self.steps), [replace(f) for f in renewed]
        found = self.budget.attempt(question, work)
        if found is None:
            self.model.believe(noise)
            self.steps = steps
            for fitted, was in zip(renewed, kept, strict=True):
                for one in fields(was):
                    setattr(fitted, one.name, getattr(was, one.name))
        return found

    def _round(self, best: Fitted) -> tuple[Fitted, float, Fitted]:
        """Return the model before a round, its best effect's margin, and the model after it."""
        step = self.extend(best)
        self.steps.append(step)
        margin = self._margin(step)  # settling renews the rival
        if margin < 0.0:
            return step.base, margin, step.base
        return step.base, margin, self.prune(self.settle(step.rivals[0]))

    def _margin(self, step: Step) -> float:
        """Return by how much the best effect of a round gains more than its price."""
        if not step.rivals:
            return -math.inf
        drifted = self.criterion(step.rivals[0]) - step.criteria[0]
        return self.criterion(step.base) - step.criteria[0] - min(drifted, HALF_BELIEVED)

    def _calmly(self, best: Fitted, learned: Noise) -> Fitted:
        """Return the best effect that a calm belief about noise shows, or what was found without.

        Noise that was learned without an effect may have swallowed it. So effects are tried where
        nothing is put down to disturbances, and judged each under the noise that it leaves: the
        more of it a hypothesis needs, the more it pays.

        Args:
            best: What was found, or the re-tuned car, under the present belief.
            learned: What was believed of noise before anything was found.
        """
        self.notify("trying again under a calm belief about noise")
        calm = calmed(learned, self.model.drives)
        if calm == learned:
            return best
        least, found, noise = self._with_noise(best), best, self.model.noise
        self.model.believe(calm)
        (base,) = self.fitter.refine([replace(self.retuned, done=False)], rounds=4, fresh=True)
        step = self.extend(base)
        for rival in step.rivals[:CHANCES]:
            if self.criterion(rival) > self.criterion(step.base):
                break
            self.model.believe(calm)
            settled = self.settle(rival)
            cost = self._with_noise(settled)
            if cost < least:
                found, least, noise = settled, cost, self.model.noise
        self.model.believe(noise)
        if found is not best:
            self.steps[-1:] = [step]
        return found

    def _with_noise(self, fitted: Fitted) -> float:
        """Return the criterion and what the noise that is believed now costs."""
        return self.criterion(fitted) + float(self.fitter.part @ self.model.log_size)

    @cached_property
    def retuned(self) -> Fitted:
        """The car with its own numbers refitted alone, under the noise that this leaves."""
        self.notify("fitting the car's own numbers")
        return self.settle(self.fitter.null())

    def step_of(self, effect: Candidate) -> Step | None:
        """Return the round in which an effect was found."""
        found = [s for s in self.steps if any(f.effects[-1] is effect for f in s.rivals)]
        chosen = [s for s in found if s.rivals[0].effects[-1] is effect]
        return chosen[0] if chosen else None

    def settle(self, fitted: Fitted) -> Fitted:
        """Fit a hypothesis and the noise, one after the other, twice; so often as `settles`."""
        for _ in range(self.settles):
            for _ in range(2):
                (fitted,) = self.fitter.refine([fitted], rounds=4, fresh=True)
                numbers = self.fitter.numbers(fitted.effects, fitted.z, fitted.values)
                residuals, _ = self.model.residuals([numbers])
                self._learn(self.model, residuals, 1)
            fitted = self._to_the_end(fitted, [fitted.z, np.zeros_like(fitted.z)])
        return fitted

    def _to_the_end(self, fitted: Fitted, starts: Sequence[Floats]) -> Fitted:
        """Return a hypothesis fitted from several values of the car's own numbers, the best one."""
        return self._all_to_the_end([(fitted, starts)])[0]

    def _all_to_the_end(self, every: Sequence[tuple[Fitted, Sequence[Floats]]]) -> list[Fitted]:
        """Return the best of each hypothesis, together: rollouts are cheap in large batches.

        Valleys are long, and some are dead ends: a comparison is fair only between the deepest.
        """
        groups = [from_each(fitted, starts) for fitted, starts in every]
        begun = [f for group in groups for f in group]
        self.fitter.refine(begun, rounds=TO_THE_END[0], fresh=True)
        near = list[list[Fitted]]()
        for group in groups:
            least = min(f.q for f in group)
            near.append([f for f in group if f.q < least + NEAR])
        self.fitter.refine([f for g in near for f in g], rounds=TO_THE_END[1], fresh=True)
        return [min(group, key=lambda f: f.q) for group in near]

    def extend(self, base: Fitted) -> Step:
        """Try every effect beside those of `base`, but none that undoes one of them.

        Where the car's own numbers that came with an effect suit the model without it better than
        those it had, that one is tried again from there: an effect must not earn what a fit missed.
        """
        step = self._extended(base)
        if not step.rivals:
            return step
        others = [f.z for f in step.rivals]
        e, ok = self.model([self.fitter.numbers(base.effects, z, base.values) for z in others])
        costs = np.where(ok, self.fitter.score(np.nan_to_num(e), np.stack(others)), np.inf)
        best = int(np.argmin(costs))
        if costs[best] > base.q - DEEPER:
            return step
        return self._extended(self._to_the_end(base, [others[best]]))

    def _extended(self, base: Fitted) -> Step:
        taken = {*base.names, *(TWINS[name] for name in base.names if name in TWINS)}
        trials = [
            ((*base.effects, candidate), np.concatenate((base.values, start)))
            for candidate in self.listed
            if candidate.name not in taken
            for start in candidate.starts
        ]
        self.notify(f"trying {len(self.listed)} effects from {len(trials)} starts")
        nominal = self.fitter.nominal(base)  # a re-tuned car bends towards what is missing
        every = [
            self.fitter.begin(start, trials, amplified=self.amplifies) for start in (base, nominal)
        ]
        begun = [best_of_each(fits, SPOTS if self.amplifies else 1) for fits in every]

        def cost(fitted: Fitted) -> float:
            return self.criterion(fitted) - self._drifted(fitted.effects[-1], base)

        near, far = (sorted(fits, key=cost)[:REFITTED] for fits in begun)
        near += [f for one in near[:AGAIN] for f in next_starts(one, every[0])]
        self.notify("refitting " + ", ".join(f.names[-1] for f in near[:4]) + " ...")
        del every, begun  # they hold innovations of every start
        near, far = (
            self._lighter(self.fitter.refine(fits, rounds=4)) for fits in (near, far[:AFRESH])
        )
        ranked = preferred(near, far)
        for f in ranked:
            self._not_worse(f, base)
        ranked = sorted(ranked, key=cost)
        near = [f for f in ranked if cost(f) < cost(ranked[0]) + NEAR]
        if cost(ranked[0]) < self.criterion(base) + NEAR:
            near = self.fitter.refine(near[:6], rounds=3, fresh=True)
        ranked = sorted([*near, *(f for f in ranked if all(f is not n for n in near))], key=cost)
        ranked = self._lighter(self._deepened(ranked, base, cost))
        costs = {id(f): cost(f) + self._let_go(f, ranked, base) for f in ranked}
        ranked = sorted(ranked, key=lambda f: costs[id(f)])
        return Step(base, tuple(ranked), tuple(costs[id(f)] for f in ranked))

    def _lighter(self, fits: list[Fitted]) -> list[Fitted]:
        """Return fits without their derivatives, unless these are kept: they fill memory."""
        if not self.keeps:
            for fitted in fits:
                fitted.jacobian = np.zeros((0, 0))
        return fits

    def _deepened(
        self, ranked: Sequence[Fitted], base: Fitted, cost: Callable[[Fitted], float]
    ) -> list[Fitted]:
        """Return fits, the first of them fitted to the end where more than one would be taken."""
        most = min(self.criterion(base), cost(ranked[0]) + CLOSE)
        first = [f for f in ranked[:FINALISTS] if cost(f) < most]
        if len(first) > 1:
            self.notify("fitting to the end: " + ", ".join(f.names[-1] for f in first))
            deep = self._all_to_the_end([(f, [f.z, np.zeros_like(f.z)]) for f in first])
            return [*deep, *ranked[len(first) :]]
        return list(ranked)

    def _drifted(self, effect: Candidate, base: Fitted) -> float:
        """Return what speaks for an effect because the car's own number for it is at its limit.

        A number that the recording pulls as far as its scatter allows is most likely the cause.
        """
        return DRIFTED * bool(self._pulled(effect, base))

    def _let_go(self, fitted: Fitted, rivals: Sequence[Fitted], base: Fitted) -> float:
        """Return what does not speak for an effect after all: another may have pulled its number.

        That is so where one that explains the recordings better brings the number back.
        """
        pulled = self._pulled(fitted.effects[-1], base)
        mine = self.criterion(fitted)
        gone = (self.criterion(f) < mine and np.all(np.abs(f.z[pulled]) < BACK) for f in rivals)
        return DRIFTED * (bool(pulled) and any(gone))

    def _pulled(self, effect: Candidate, base: Fitted) -> list[int]:
        """Return which of the car's own numbers that an effect means are at their limit."""
        keys = {OF_OWN.get(parameter.key, parameter.key) for parameter in effect.parameters}
        own = enumerate(zip(self.model.nominal, base.z, strict=True))
        return [j for j, (o, z) in own if o.key in keys and abs(z) > 0.85 * FARTHEST]

    def confirmed(self, best: Fitted, unseen: Floats) -> Fitted:
        """Return the model without effects that do not help on a part that no fit has seen.

        Of what an effect gains where it was fitted, a share must come out there too, by length, or
        plenty; of one that pays its price and hardly acts there, no more than it can show. One that
        gains next to nothing beside another, and where that one acts, is what its equation leaves.
        """
        share = float(unseen.sum()) / max(self.events, 1)
        while best.effects:
            others = self._without_each(best)
            fitter = Fitter(self.model, unseen)
            own = float(fitter.prior_loss(best.z)[0])
            seen = fitter.score(best.e[:, None], best.z)[0] - own
            seen_gains = np.array([max(f.q - best.q, 0.0) for f in others])
            losses = [fitter.score(f.e[:, None], f.z) - fitter.prior_loss(f.z) for f in others]
            gains = np.concatenate(losses) - seen
            shown = np.array([float(fitter.weights(best.e) @ (f.e - best.e) ** 2) for f in others])
            least = np.where(self._pays(best, seen_gains), shown - CHANCE * np.sqrt(shown), np.inf)
            asked = self.holds * np.minimum(share * seen_gains, least)
            gains -= np.minimum(np.minimum(asked, least), PLENTY)
            gains[self._remainders(best, others, seen_gains)] = -np.inf
            if gains.min() > 0.0:
                return best
            best = others[int(np.argmin(gains))]
        return best

    def _pays(self, best: Fitted, gains: Floats) -> Bools:
        """Return which effects gain their price where they were fitted."""
        prices = [self.price((effect,)) for effect in best.effects]
        return np.asarray(gains > prices)

    def _remainders(self, best: Fitted, others: Sequence[Fitted], gains: Floats) -> Bools:
        """Return which effects are no more than an error in the equation of the largest.

        Args:
            best: With all effects; `others`: without each.
            others: In the effects' order.
            gains: Of each effect.
        """
        most = int(np.argmax(gains))
        large = (OFF * (others[most].e - best.e)) ** 2
        small = gains < REMAINDER * gains[most]
        for i in np.flatnonzero(small).tolist():
            mine = (others[i].e - best.e) ** 2
            covered = self.fitter.part @ np.minimum(mine, large)
            small[i] = covered > COVERED * float(self.fitter.part @ mine)
        return np.asarray(small)

    def _not_worse(self, fitted: Fitted, base: Fitted) -> None:
        """Let an effect that found nothing do nothing: it contains the model without it."""
        if fitted.q > base.q:
            neutral = np.array([parameter.neutral for parameter in fitted.effects[-1].parameters])
            fitted.z, fitted.values = base.z.copy(), np.concatenate((base.values, neutral))
            fitted.e, fitted.q = base.e, base.q

    def prune(self, fitted: Fitted) -> Fitted:
        """Take back every effect that the others make needless."""
        while len(fitted.effects) > 1:
            fewer = sorted(self._without_each(fitted), key=self.criterion)
            if not fewer or self.criterion(fewer[0]) > self.criterion(fitted):
                return fitted
            fitted = fewer[0]
        return fitted

    def without_one(self, fitted: Fitted) -> Fitted:
        """Return the best model that lacks one of the effects, fitted to the end.

        It begins from the re-tuned car's own numbers as well: with an effect more than that car it
        explains no less.
        """
        best = min(self._without_each(fitted), key=self.criterion)
        return self._to_the_end(best, [best.z, self.retuned.z]) if best.effects else best

    def _without_each(self, fitted: Fitted) -> list[Fitted]:
        """Return refitted models that lack one effect each, in the effects' order."""
        if len(fitted.effects) == 1:
            return [self.retuned_now(fitted.z)]
        fewer, at, own = list[Fitted](), 0, len(fitted.z)
        for i, effect in enumerate(fitted.effects):
            gone = slice(at, at + len(effect.parameters))
            columns = np.delete(
                np.arange(fitted.jacobian.shape[1]), slice(own + gone.start, own + gone.stop)
            )
            fewer.append(
                Fitted(
                    (*fitted.effects[:i], *fitted.effects[i + 1 :]),
                    fitted.z.copy(),
                    np.delete(fitted.values, gone),
                    fitted.e,
                    fitted.q,
                    fitted.jacobian[:, columns],
                )
            )
            at = gone.stop
        return self.fitter.refine(fewer, rounds=4, fresh=True)

    def retuned_now(self, *others: Floats) -> Fitted:
        """Return the car with its own numbers refitted, under the present belief about noise.

        Args:
            others: Values of these numbers to begin from as well.
        """
        start = self.fitter.null(self.retuned.z)
        return self._to_the_end(start, [start.z, *others])


def sought(best: Fitted) -> Question:
    """Return what a round beside a model asks."""
    return Question.FURTHER if best.effects else Question.EFFECTS
