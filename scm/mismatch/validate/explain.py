"""What is said of a model that was found: its effects, their rivals, what stays undecided."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from scm.arrays import Floats
from scm.mismatch.discovery.decide import is_discovered
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect
from scm.mismatch.discovery.seek import Sought
from scm.mismatch.discovery.sensor_effects import SensorEffect
from scm.mismatch.effect_catalogue import Candidate, Parameter
from scm.mismatch.evidence import RefittedParameter, Tried
from scm.mismatch.experiment.plan import Explanation
from scm.mismatch.experiment.suggest import Suggestion, suggest
from scm.mismatch.findings import Alternative, Effect, Equation, Estimate
from scm.mismatch.fit.fitter import OF_OWN, Fitted
from scm.mismatch.fit.likelihood import LEAST_SCATTER, LOCK, TIMING_S, UNKNOWN, Likelihood
from scm.mismatch.report.wording import joined, percent, quantity, short
from scm.mismatch.select.alternatives import TIE, Standing, against, alternatives_to_discovered
from scm.mismatch.select.search import Search
from scm.vehicles.car import Car

NINETY = 1.645
WORTH_SAYING = 1.1  # times what was stated
WHY = {
    "body.mass_kg": "cars are weighed without cables, tape and battery",
    LOCK: "no data sheet tells a locked axle from an open one",
}
WIDER = 1.3  # intervals from curvature alone are too narrow for what any model leaves out
LAW = 0.03  # of an effect's size: no equation of an effect is exactly that of the car
SHARES = {
    "slope", "difference", "fraction", "fraction_per_min", "gain", "scale", "left", "right",
    "threshold",
}  # fmt: skip
"""Numbers that a sentence holds in percent."""
OPPOSITE: Mapping[str, str] = {
    "to the left": "to the right", "left": "right", "ahead": "behind", "too much.": "too little.",
    "further forward": "further back", "higher": "lower",
    "more than nominal, the right one as much less":
        "less than nominal, the right one as much more",
}  # fmt: skip
"""Words after a number of a sentence, and what they are when it is negative."""
Notify = Callable[[str], None]


def ordinary_of(model: Likelihood, best: Fitted, car: Car) -> tuple[RefittedParameter, ...]:
    """Return the car's own numbers, as the file gives them and as the recordings do.

    No recording makes a number less sure than its file, or unphysical.
    """
    found, covariance = [], covariance_of(best)
    for j, own in enumerate(model.nominal):
        if own.key.startswith("clock."):
            continue
        std = math.sqrt(min(max(covariance[j, j], 0.0), 1.0)) * own.std
        value = model.numbers(best.z)[own.key]
        unit = model.unit(own.key)
        least, most = own.bounds
        estimate = Estimate(
            value=value, low=max(value - NINETY * std, least), high=min(value + NINETY * std, most),
            unit=unit,
        )  # fmt: skip
        given = car.value(own.key) if car.has(own.key) else own.mean
        found.append(
            RefittedParameter(
                key=own.key,
                given=given,
                given_std=own.std,
                found=estimate,
                found_std=std,
                bounds=own.bounds,
            )
        )
    return tuple(found)


def covariance_of(best: Fitted) -> Floats:
    """Return the covariance of a model's numbers; where none was worked out, the car file's."""
    return best.covariance if best.covariance.size else np.eye(len(best.z) + best.parameters)


def widened_of(model: Likelihood, car: Car) -> tuple[str, ...]:
    """Return what was believed less firmly than car file and recording state it, a sentence each.

    Args:
        model: With its belief about noise.
        car: As given.
    """
    sentences = list[str]()
    for own in model.nominal:
        stated = car.quantity(own.key).std if car.has(own.key) else None
        now = f"{short(own.std)} {model.unit(own.key)}".rstrip(" 1")
        if stated and own.std > WORTH_SAYING * stated:
            share = percent(LEAST_SCATTER[own.key])
            sentences.append(
                f"The car file's std of {own.key}, {short(stated)}, was taken as {now}, {share} of "
                f"the value: {WHY[own.key]}."
            )
        elif own.key in UNKNOWN and not stated:
            sentences.append(
                f"The car file states no std of {own.key}: it was taken as {short(own.mean)} ± "
                f"{now}, because {WHY[own.key]}."
            )
    sentences.append(
        f"Stamps of poses and commands may be off by {short(1e3 * TIMING_S)} ms, because no "
        "recording's are better."
    )
    sentences += _noise_sentences(model)
    return tuple(sentences)


def _noise_sentences(model: Likelihood) -> Iterator[str]:
    """Yield which stated noise of the recordings was taken for another."""
    alike = dict[tuple[float, float], list[str]]()
    for drive in model.drives[:1]:
        for stream in drive.streams:
            stated = drive.recording.channels[stream.name].std
            scale = model.noise.scale.get(stream.name, 1.0)
            if stated and stream.name.startswith("encoder."):
                scale *= stream.std / stated
            if stated and not 1.0 / WORTH_SAYING < scale < WORTH_SAYING:
                alike.setdefault((stated, scale * stated), []).append(stream.name)
    for (stated, taken), names in alike.items():
        yield (
            f"The recording's std of {joined(names)}, {short(stated)}, was taken as "
            f"{short(taken)}, because its rows differ from any car's motion by as much."
        )


def tried_of(search: Search) -> tuple[Tried, ...]:
    """Return every effect tried beside the re-tuned car, best first."""
    best: dict[str, Tried] = {}
    for step in search.steps[:1]:
        # a rival's own q is none of then: the one that was taken has been settled since
        for fitted, criterion in zip(step.rivals, step.criteria, strict=True):
            name = fitted.names[-1]
            needed = search.price(fitted.effects)
            one = Tried(name=name, gain=step.base.q + needed - criterion, needed=needed)
            if name not in best or best[name].gain < one.gain:
                best[name] = one
    return tuple(sorted(best.values(), key=lambda tried: -tried.gain))


def effect_of(
    search: Search, best: Fitted, i: int, held: Standing | None = None, sought: Sought | None = None
) -> Effect:
    """Return what is reported of one effect of the model found.

    Args:
        search: That found the model.
        best: The model, of which effect number `i` is told.
        i: From 0.
        held: What a law was held against, among the listed; `sought`: among the laws.
        sought: None, like `held`, where no law was looked for.
    """
    candidate = best.effects[i]
    at = sum(len(effect.parameters) for effect in best.effects[:i])
    own, estimates = len(best.z), dict[str, Estimate]()
    mine = upright(candidate, best.values[at : at + len(candidate.parameters)].tolist())
    for j, parameter in enumerate(candidate.parameters):
        value, place = mine[j], own + at + j
        spread_of_fit = (
            WIDER * parameter.step * math.sqrt(max(covariance_of(best)[place, place], 0.0))
        )
        spread = NINETY * math.hypot(
            spread_of_fit, _scatter(search.model, parameter, value), LAW * _size(candidate, j, mine)
        )
        low, high = parameter.bounds if not _wraps(parameter) else (-math.inf, math.inf)
        estimates[parameter.name] = Estimate(
            value=value, low=max(value - spread, low), high=min(value + spread, high),
            unit=parameter.unit,
        )  # fmt: skip
    probability, rivals = _rivals(search, candidate)
    if is_discovered(candidate) and held is not None and sought is not None:
        probability, rivals = alternatives_to_discovered(search, best, candidate, held, sought)
    return Effect(
        name=candidate.name,
        is_known=not is_discovered(candidate),
        equation=candidate.equation,
        depends_on=candidate.depends_on,
        parameters=estimates,
        probability=probability,
        text=sentence_of(candidate, estimates),
        formula=candidate.formula(mine)
        if isinstance(candidate, DictionaryEffect | SensorEffect)
        else None,
        alternatives=rivals,
    )


def upright(candidate: Candidate, values: Sequence[float]) -> tuple[float, ...]:
    """Return an effect's numbers with a direction in which its amount is positive.

    A floor that falls towards one side rises towards the other.
    """
    wraps = [_wraps(parameter) for parameter in candidate.parameters]
    if len(set(wraps)) < 2 or is_discovered(candidate) or values[wraps.index(False)] >= 0.0:
        return tuple(values)
    return tuple(
        math.remainder(value + math.pi, 2.0 * math.pi) if turns else -value
        for value, turns in zip(values, wraps, strict=True)
    )


def _wraps(parameter: Parameter) -> bool:
    """Say whether a number is a direction, which does not end where its bounds are."""
    return parameter.unit == "rad" and parameter.bounds[1] - parameter.bounds[0] > 1.99 * math.pi


def _size(candidate: Candidate, j: int, values: Sequence[float]) -> float:
    """Return what an error of a number is measured by: how far it is from doing nothing.

    A fault of a sensor has no equation that could be wrong.
    """
    parameter = candidate.parameters[j]
    if candidate.equation is Equation.SENSOR:
        return 0.0
    if _wraps(parameter):
        return 1.0
    radius = [v for k, v in zip(candidate.parameters, values, strict=True) if k.name == "radius_m"]
    return radius[0] if radius and parameter.unit == "m" else abs(values[j] - parameter.neutral)


def _scatter(model: Likelihood, parameter: Parameter, value: float) -> float:
    """Return how far the car's own number that means the same may be from the file's."""
    own = next((o for o in model.nominal if o.key == OF_OWN.get(parameter.key)), None)
    if own is None:
        return 0.0
    return own.std * abs(value / own.mean) if parameter.unit == "1" else own.std


def sentence_of(candidate: Candidate, estimates: dict[str, Estimate]) -> str:
    """Return an effect's sentence with its numbers, shares in percent, amounts without signs."""
    sentence = candidate.sentence
    words = {name: _number(name, e.value, e.unit) for name, e in estimates.items()}
    if "scale" in estimates:
        words["scale_cm"] = f"{quantity(100.0 * estimates['scale'].value, '1')} cm"
    for name, estimate in estimates.items():
        turned = _turned(sentence, name) if estimate.value < 0.0 else ""
        if turned:
            sentence, words[name] = turned, _number(name, -estimate.value, estimate.unit)
    return sentence.format(**words)


def _turned(sentence: str, name: str) -> str:
    """Return a sentence in which one number counts the other way; empty where no word does."""
    for way, other in OPPOSITE.items():
        if f"{{{name}}} {way}" in sentence:
            return sentence.replace(f"{{{name}}} {way}", f"{{{name}}} {other}")
    return ""


def _number(name: str, value: float, unit: str) -> str:
    """Return a number as a sentence holds it; sentences say themselves what is a minute's."""
    if name in SHARES:
        return f"{quantity(100.0 * value, '1')} %"
    return quantity(value, "1" if unit == "1/min" else unit)


def _rivals(search: Search, candidate: Candidate) -> tuple[float, tuple[Alternative, ...]]:
    """Return an effect's probability among all that were tried in its place, and the next ones."""
    step = search.step_of(candidate)
    if step is not None:
        tried = list(zip(step.rivals, step.criteria, strict=True))
        lowest = min(c for _, c in tried)
        weights = {id(f): math.exp(-0.5 * min(c - lowest, 1400.0)) for f, c in tried}
        total = sum(weights.values())
        mine = sum(weights[id(f)] for f, _ in tried if f.names[-1] == candidate.name)
        others = [(f, c) for f, c in tried if f.names[-1] != candidate.name][:5]
        return mine / total, tuple(
            Alternative(name=f.names[-1], probability=weights[id(f)] / total,
                  ruled_out_by=against(c - lowest))
            for f, c in others
        )  # fmt: skip
    return 1.0, ()


def undecided_of(
    model: Likelihood, search: Search, best: Fitted, notify: Notify
) -> tuple[Suggestion, ...]:
    """Return which effects found could as well be others, and the drives that would tell."""
    found = []
    for effect in best.effects:
        step = search.step_of(effect)
        if step is None:
            continue
        lowest = next(
            c for f, c in zip(step.rivals, step.criteria, strict=True) if f.names[-1] == effect.name
        )
        near = [
            Explanation(f.effects, f.values)
            for f, c in zip(step.rivals, step.criteria, strict=True)
            if c - f.effects[-1].rare < lowest + TIE and f.names[-1] not in best.names
        ]
        if near:
            notify("designing the drive that would tell")
            mine = next(f for f in step.rivals if f.names[-1] == effect.name)
            explanations = [Explanation(mine.effects, mine.values), *near]
            found.append(suggest(model, explanations, notify=notify))
    return tuple(found)
