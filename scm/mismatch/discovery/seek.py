"""The search for a law that the library does not have: screen the dictionary, refit the best.

Whatever it returns is a hypothesis like any other: the same free run, the same loss, the same price
for its numbers and for the size of the dictionary it was chosen from.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Floats
from scm.mismatch.discovery.dictionary import dictionary
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect
from scm.mismatch.discovery.general_effect import THROTTLE, learned_terms
from scm.mismatch.discovery.impulse_response import AMOUNTS, Cells, cells_of, respond
from scm.mismatch.discovery.screen import Start, polished, screen
from scm.mismatch.discovery.sensor_effects import SensorEffect, SensorLikelihood, sensor_effects
from scm.mismatch.discovery.tidy import tidied
from scm.mismatch.discovery.wheel_ripple import beside, by_turn, ripples
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.fit.fitter import Fitted, Fitter
from scm.mismatch.fit.likelihood import Likelihood

FALSE_ALARMS = 0.01
LISTED = 45
REFITTED, FOLLOWED, FRESH = 12, 3, 4
UNSURE = 15.0  # of the gain, which is a linear guess until a free run
MOST = 18
Notify = Callable[[str], None]
_Begun = tuple[Candidate, tuple[float, ...], float]


@dataclass(frozen=True, slots=True)
class Sought:
    """Laws that were tried, refitted by free run, best first.

    Attributes:
        model: With the general effect, under the noise that was believed.
        base: What the laws were added to, in that model; `part` of it was fitted.
        criteria: Of each, lower is better; comparable with `criterion` of any listed hypothesis.
    """

    model: Likelihood
    base: Fitted
    found: tuple[Fitted, ...]
    criteria: tuple[float, ...]
    part: Floats
    cells: Cells


def criterion(fitted: Fitted, events: int, listed: int = LISTED) -> float:
    """Return Q and what its effects must gain to be believed, laws at the dictionary's price."""
    laws = len(dictionary()) + len(sensor_effects())
    total = fitted.q + fitted.parameters * math.log(events)
    for effect in fitted.effects:
        size = laws if isinstance(effect, DictionaryEffect | SensorEffect) else listed
        total += effect.rare + 2.0 * math.log(size / FALSE_ALARMS)
    return total


def with_general_effect(model: Likelihood) -> SensorLikelihood:
    """Return a model whose car can carry laws, under the same belief about noise."""
    if isinstance(model, SensorLikelihood):
        return model
    have = {term.name for term in model.car.terms}
    wanted = [term for term in learned_terms(model.car) if term.name not in have]
    return SensorLikelihood(model, model.car.with_terms(wanted))


def seek(model: Likelihood, base: Fitted, part: Floats, notify: Notify = lambda _: None) -> Sought:
    """Return laws beside a model that was fitted, each refitted by free run.

    Args:
        model: Of the recordings.
        base: The best listed model so far, or the car with its own numbers refitted.
        part: Weight of each innovation, 0 or 1, (events,).
        notify: Is told what is being tried.
    """
    model = with_general_effect(model)
    fitter = Fitter(model, part)
    base = _carried(base, model)
    notify("asking what a push at each moment would explain")
    model.learn(fitter.numbers(base.effects, base.z, base.values))
    cells = cells_of(model, fitter, base)
    asked = [c for c in AMOUNTS if c != "throttle_add" or THROTTLE in model.car.terms]
    responses = {channel: respond(model, fitter, base, cells, channel) for channel in asked}
    laws = dictionary()
    notify(f"laying {len(laws)} laws over them")
    starts = _worth(screen(laws, cells, responses), part)
    starts = [polished(s, cells, responses[s.law.channel.response]) for s in starts]
    begun = [(s.law, s.values, s.gain) for s in starts] + _of_sensors(model, fitter, base, part)
    begun += [
        (by_turn(), values, gain)
        for values, gain in ripples(model, fitter, base)
        if gain > _price(by_turn(), part) - UNSURE
    ]
    begun.sort(key=lambda one: _price(one[0], part) - one[2])
    found = _refitted(fitter, base, begun[:MOST], notify)
    events = int(part.sum())
    ranked = sorted(map(tidied, found), key=lambda f: criterion(f, events))
    return Sought(
        model, base, tuple(ranked), tuple(criterion(f, events) for f in ranked), part, cells
    )


def _carried(base: Fitted, model: Likelihood) -> Fitted:
    """Return a fit of a car without the general effect as one of a car with it."""
    return replace(base, z=base.z.copy(), values=base.values.copy())


def _price(law: Candidate, part: Floats) -> float:
    """Return what a law must gain to be believed."""
    size = 2.0 * math.log((len(dictionary()) + len(sensor_effects())) / FALSE_ALARMS)
    return law.rare + len(law.parameters) * math.log(float(part.sum())) + size


def _worth(groups: list[list[Start]], part: Floats) -> list[Start]:
    """Return the starts worth a free run: the best of each law, and more of the best laws."""
    groups = [g for g in groups if g and g[0].gain > _price(g[0].law, part) - UNSURE]
    groups.sort(key=lambda g: _price(g[0].law, part) - g[0].gain)
    firsts = [g[0] for g in groups[:REFITTED]]
    return firsts + [start for g in groups[:FOLLOWED] for start in g[1:]]


def _of_sensors(
    model: SensorLikelihood, fitter: Fitter, base: Fitted, part: Floats
) -> list[_Begun]:
    """Return the sensor laws worth a free run, with amounts and what they would explain."""
    laws = [law for law in sensor_effects() if law.parameters[0].key in model.learned]
    if not laws:
        return []
    slope, bend = beside(fitter, base, np.stack([model.felt(law) for law in laws], axis=1))
    found = list[_Begun]()
    for i, law in enumerate(laws):
        least = max(float(bend[i, i]), 1e-12)
        gain = float(slope[i]) ** 2 / least
        if gain > _price(law, part) - UNSURE:
            found.append((law, (-float(slope[i]) / least,), gain))
    return found


def _refitted(
    fitter: Fitter, base: Fitted, begun: Sequence[_Begun], notify: Notify
) -> list[Fitted]:
    """Refit starts together; of each law the best fit stays."""
    if not begun:
        return []
    notify(f"refitting {len(begun)} laws, such as {begun[0][0].name}")
    trials = [((*base.effects, law), np.append(base.values, values)) for law, values, _ in begun]
    fits = _one_each(fitter.refine(fitter.begin(base, trials), rounds=3))
    best = _one_each(fitter.refine(fits[:FRESH], rounds=3, fresh=True))
    return [*best, *fits[FRESH:]]


def _one_each(fits: list[Fitted]) -> list[Fitted]:
    """Return the best fit of each law, best first."""
    found = dict[int, Fitted]()
    for fitted in sorted(fits, key=lambda f: f.q):
        found.setdefault(id(fitted.effects[-1]), fitted)
    return list(found.values())
