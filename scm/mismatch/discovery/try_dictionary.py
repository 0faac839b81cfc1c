"""Tries the dictionary's effects: screens all of them, refits the best by free run.

Each is a hypothesis like any other: the same free run, the same loss, the same penalty for its
numbers and for the size of the dictionary it was chosen from.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Floats
from scm.mismatch.discovery.dictionary import dictionary
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect
from scm.mismatch.discovery.general_effect import THROTTLE
from scm.mismatch.discovery.impulse_response import (
    AMOUNTS,
    Cells,
    beside,
    by_turn,
    cells_of,
    respond,
    ripples,
)
from scm.mismatch.discovery.screen import Start, polished, screen
from scm.mismatch.discovery.sensor_effects import SensorEffect, sensor_effects, signatures_of
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.likelihood import Signatures

FALSE_ALARMS = 0.01  # one in a hundred
MAX_REFITTED, MAX_FOLLOWED, MAX_RENEWED, MAX_STARTS = 12, 3, 4, 18
LINEAR_ERROR = 15.0  # of a gain, which is a linear guess until a free run
Notify = Callable[[str], None]
_Begun = tuple[Candidate, tuple[float, ...], float]
_FLIPPED_BY = ("toward_rad", "phase_rad")


@dataclass(frozen=True, slots=True)
class DictionaryFits:
    """Effects of the dictionary that were tried, refitted by free run, best first.

    Attributes:
        base: What they were added to, `part` of its innovations fitted.
        criteria: Of each, lower is better; comparable with `criterion` of any hypothesis.
    """

    base: Hypothesis
    found: tuple[Hypothesis, ...]
    criteria: tuple[float, ...]
    part: Floats
    cells: Cells


def criterion(fitted: Hypothesis, events: int, catalogue: int = 45) -> float:
    """Return the score and what the effects must gain to be accepted.

    Those of the dictionary pay for its size, others for that of the catalogue.
    """
    total = fitted.score + len(fitted.values) * math.log(events)
    for effect in fitted.effects:
        outside = isinstance(effect, DictionaryEffect | SensorEffect)
        size = _entries() if outside else catalogue
        total += effect.rare + 2.0 * math.log(size / FALSE_ALARMS)
    return total


def _entries() -> int:
    """Return how many effects the dictionary has."""
    return len(dictionary()) + len(sensor_effects())


def try_dictionary(
    base: Hypothesis, part: Floats, notify: Notify = lambda _: None
) -> DictionaryFits:
    """Return effects of the dictionary beside a fitted hypothesis, each refitted by free run.

    Args:
        base: Its car carries the general effect.
        part: Weight of each innovation, 0 or 1, (events,).
        notify: Receives what is being tried.
    """
    notify("computing what a push at each moment would explain")
    signatures = signatures_of(base)
    base = replace(base, model=base.model.with_signatures(signatures))
    fitter = Fitter(base.model, part)
    cells = cells_of(base)
    channels = [c for c in AMOUNTS if c != "throttle_add" or THROTTLE in base.model.car.terms]
    responses = {channel: respond(fitter, base, cells, channel) for channel in channels}
    effects = dictionary()
    notify(f"screening {len(effects)} effects outside the catalogue")
    starts = _worthwhile(screen(effects, cells, responses), part)
    starts = [polished(s, cells, responses[s.effect.channel.response]) for s in starts]
    begun: list[_Begun] = [(s.effect, s.values, s.gain) for s in starts]
    begun += _of_sensors(fitter, base, signatures, part)
    begun += [
        (by_turn(), values, gain)
        for values, gain in ripples(fitter, base)
        if gain > _penalty(by_turn(), part) - LINEAR_ERROR
    ]
    begun.sort(key=lambda one: _penalty(one[0], part) - one[2])
    found = _refitted(fitter, base, begun[:MAX_STARTS], notify)
    events = int(part.sum())
    ranked = sorted(map(tidied, found), key=lambda f: criterion(f, events))
    return DictionaryFits(
        base, tuple(ranked), tuple(criterion(f, events) for f in ranked), part, cells
    )


def _penalty(effect: Candidate, part: Floats) -> float:
    """Return what an effect of the dictionary must gain to be accepted."""
    size = 2.0 * math.log(_entries() / FALSE_ALARMS)
    return effect.rare + len(effect.parameters) * math.log(float(part.sum())) + size


def _worthwhile(groups: list[list[Start]], part: Floats) -> list[Start]:
    """Return the starts worth a free run: the best of each effect, and more of the best effects."""
    groups = [g for g in groups if g and g[0].gain > _penalty(g[0].effect, part) - LINEAR_ERROR]
    groups.sort(key=lambda g: _penalty(g[0].effect, part) - g[0].gain)
    firsts = [g[0] for g in groups[:MAX_REFITTED]]
    return firsts + [start for g in groups[:MAX_FOLLOWED] for start in g[1:]]


def _of_sensors(
    fitter: Fitter, base: Hypothesis, signatures: Signatures, part: Floats
) -> list[_Begun]:
    """Return the sensor effects worth a free run, with amounts and what they would explain."""
    effects = [one for one in sensor_effects() if one.parameters[0].key in signatures]
    if not effects:
        return []
    changes = [
        base.model.weigh([[-r[:, None] for r in one] for one in signatures[e.parameters[0].key]])
        for e in effects
    ]
    response = beside(fitter, base, np.concatenate(changes, axis=1))
    found = list[_Begun]()
    for i, effect in enumerate(effects):
        slope, bend = float(response.slope[i]), max(float(response.bend[i, i]), 1e-12)
        gain = slope**2 / bend
        if gain > _penalty(effect, part) - LINEAR_ERROR:
            found.append((effect, (-slope / bend,), gain))
    return found


def _refitted(
    fitter: Fitter, base: Hypothesis, begun: Sequence[_Begun], notify: Notify
) -> list[Hypothesis]:
    """Return starts refitted together; of each effect the best fit stays."""
    if not begun:
        return []
    notify(f"refitting {len(begun)} effects outside the catalogue, such as {begun[0][0].name}")
    trials = [((*base.effects, one), np.append(base.values, values)) for one, values, _ in begun]
    fits = _one_each(fitter.refine(fitter.begin(base, trials), rounds=3))
    best = _one_each(fitter.refine(fits[:MAX_RENEWED], rounds=3, fresh=True))
    return [*best, *fits[MAX_RENEWED:]]


def _one_each(fits: list[Hypothesis]) -> list[Hypothesis]:
    """Return the best fit of each effect, best first."""
    found = dict[int, Hypothesis]()
    for fitted in sorted(fits, key=lambda f: f.score):
        found.setdefault(id(fitted.effects[-1]), fitted)
    return list(found.values())


def tidied(fitted: Hypothesis) -> Hypothesis:
    """Return a hypothesis whose last effect has an equivalent but smaller set of numbers.

    Angles lie in one turn, and waves have positive amounts.
    """
    effect = fitted.effects[-1]
    if not isinstance(effect, DictionaryEffect):
        return fitted
    names = [parameter.name for parameter in effect.parameters]
    known = len(fitted.values) - len(names)
    values = dict(zip(names, map(float, fitted.values[known:]), strict=True))
    wave = effect.shape.name in ("swing", "wave", "round")
    by = [name for name in (*_FLIPPED_BY, "against_rad") if name in values]
    sign = np.ones(len(fitted.z) + len(fitted.values))  # of what was differentiated
    if values[names[0]] < 0.0 and by and (wave or by[0] == "toward_rad"):
        values[names[0]] *= -1.0
        values[by[0]] += math.pi
        sign[len(fitted.z) + known] = -1.0
    for name in names:
        if name.endswith("_rad") and name != names[0]:
            values[name] = math.remainder(values[name], 2.0 * math.pi)
    return replace(
        fitted,
        values=np.append(fitted.values[:known], list(values.values())),
        jacobian=fitted.jacobian * sign if fitted.jacobian.size else fitted.jacobian,
        covariance=fitted.covariance * np.outer(sign, sign)
        if fitted.covariance.size
        else fitted.covariance,
    )
