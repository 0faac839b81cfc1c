"""What a report states of a hypothesis: its effects, their alternatives, what stays undecided."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from scm.arrays import Floats
from scm.mismatch.changing_effect import BEFORE_NAME, SINCE_NAME, UNTIL_NAME, ChangingEffect
from scm.mismatch.discovery.decide import TIE, against, alternatives_to, is_discovered
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect
from scm.mismatch.discovery.sensor_effects import SensorEffect
from scm.mismatch.effect_catalogue import Candidate, Parameter
from scm.mismatch.evidence import RefittedParameter
from scm.mismatch.experiment.plan import Explanation
from scm.mismatch.experiment.suggest import Suggestion, suggest
from scm.mismatch.findings import Alternative, Course, Effect, Equation, Estimate
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.likelihood import LOCK, MIN_RELATIVE_STD, TIMING_S, UNKNOWN, Likelihood
from scm.mismatch.recorded_range import recorded_range
from scm.mismatch.report.wording import capital, joined, percent, quantity, short
from scm.mismatch.select.changes import moments_scored
from scm.mismatch.select.round import Notify
from scm.mismatch.select.search import Selection
from scm.mismatch.select.selected import Selected
from scm.mismatch.validate.stages import at_shares
from scm.mismatch.varying_effect import SLOPE, VaryingEffect
from scm.vehicles.car import Car

NINETY = 1.645
REPORTED_ABOVE = 1.1  # times what was stated
WHY = {
    "body.mass_kg": "cars are weighed without cables, tape and battery",
    LOCK: "no data sheet tells a locked axle from an open one",
}
WIDER = 1.3  # intervals from curvature alone are too narrow for what any model leaves out
EQUATION_ERROR = 0.03  # of an effect's size: no equation of an effect is exactly the car's
MAX_ALTERNATIVES = 5
AROUND_S, EVERY_S = 12.0, 0.5  # of a moment, and between those compared with it
SHARES = {
    "slope", "difference", "fraction", "fraction_per_min", "gain", "scale", "left", "right",
    "threshold",
}  # fmt: skip
"""Numbers that a sentence holds in percent."""
_COURSES = {
    Course.CONSTANT: "an effect that was always there", Course.STEP: "a change at one moment",
    Course.RAMP: "an even change over all of it",
    Course.INTERMITTENT: "an effect that came and went",
}  # fmt: skip
OPPOSITE: Mapping[str, str] = {
    "to the left": "to the right", "left": "right", "ahead": "behind", "too much.": "too little.",
    "further forward": "further back", "higher": "lower",
    "more than nominal, the right one as much less":
        "less than nominal, the right one as much more",
}  # fmt: skip
"""Words after a number of a sentence, and what they are when it is negative."""


def refitted(best: Hypothesis, car: Car) -> tuple[RefittedParameter, ...]:
    """Return the car's own numbers, as the file gives them and as the recordings do.

    No recording makes a number less sure than its file, or unphysical.
    """
    model, found, covariance = best.model, list[RefittedParameter](), covariance_of(best)
    values = model.simulator.numbers(best.z)
    for j, own in enumerate(model.nominal):
        if own.key.startswith("clock."):
            continue
        std = math.sqrt(min(max(covariance[j, j], 0.0), 1.0)) * own.std
        value, unit = values[own.key], model.simulator.unit(own.key)
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


def covariance_of(best: Hypothesis) -> Floats:
    """Return the covariance of a model's numbers; where none was worked out, the car file's."""
    return best.covariance if best.covariance.size else np.eye(len(best.z) + len(best.values))


def widened_of(model: Likelihood, car: Car) -> tuple[str, ...]:
    """Return a sentence for each standard deviation that was used wider than it is stated."""
    sentences = list[str]()
    for own in model.nominal:
        stated = car.quantity(own.key).std if car.has(own.key) else None
        now = f"{short(own.std)} {model.simulator.unit(own.key)}".rstrip(" 1")
        if stated and own.std > REPORTED_ABOVE * stated:
            least = MIN_RELATIVE_STD.get(own.key, 0.0)
            why = ": the recordings put the number at an end of what that allows"
            if own.std <= REPORTED_ABOVE * least * abs(own.mean):
                why = f", {percent(least)} of the value: {WHY[own.key]}"
            sentences.append(
                f"The car file's std of {own.key}, {short(stated)}, was taken as {now}{why}."
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
    """Yield which stated noise of the recordings was replaced by another."""
    alike = dict[tuple[float, float], list[str]]()
    for drive in model.drives[:1]:
        for stream in drive.streams:
            stated = drive.recording.channels[stream.name].std
            scale = model.noise.scale.get(stream.name, 1.0)
            if stated and stream.name.startswith("encoder."):
                scale *= stream.std / stated
            if stated and not 1.0 / REPORTED_ABOVE < scale < REPORTED_ABOVE:
                alike.setdefault((stated, scale * stated), []).append(stream.name)
    for (stated, used), names in alike.items():
        yield (
            f"The recording's std of {joined(names)}, {short(stated)}, was taken as "
            f"{short(used)}, because its rows differ from any car's motion by as much."
        )


def effect_of(selected: Selected, best: Hypothesis, candidate: Candidate) -> Effect:
    """Return what a report states of one effect of a hypothesis."""
    place = best.place_of(candidate)
    mine = upright(candidate, best.values[place].tolist())
    spreads = _spreads(best, candidate, mine)
    estimates = dict[str, Estimate]()
    for parameter, value, spread in zip(candidate.parameters, mine, spreads, strict=True):
        low, high = parameter.bounds if not _wraps(parameter) else (-math.inf, math.inf)
        estimates[parameter.name] = Estimate(
            value=value, low=max(value - spread, low), high=min(value + spread, high),
            unit=parameter.unit,
        )  # fmt: skip
    if isinstance(candidate, VaryingEffect):
        estimates[SLOPE] = _slope(best, candidate, *estimates.values())
    if isinstance(candidate, ChangingEffect):
        moments = range(place.stop - candidate.moments, place.stop)
        for name, index in zip((SINCE_NAME, UNTIL_NAME), moments, strict=False):
            estimates[name] = _moment(best, index)
    probability, alternatives = _alternatives(selected.selection, candidate)
    discovered, offered, discovery = is_discovered(candidate), selected.offered, selected.discovery
    is_outside = discovered and not isinstance(candidate, VaryingEffect)
    if is_outside and offered is not None and discovery is not None:
        probability, alternatives = alternatives_to(
            selected.context, best, candidate, offered, discovery
        )
    probability = min(probability, _beyond_neutral(candidate, mine, spreads))
    stated = stated_of(selected.car, candidate)
    return Effect(
        name=candidate.name,
        is_known=not discovered,
        equation=candidate.equation,
        depends_on=candidate.depends_on,
        parameters={
            name: one for name, one in estimates.items()
            if name not in {SINCE_NAME, UNTIL_NAME} and not name.endswith(BEFORE_NAME)
        },
        probability=probability,
        text=(
            sentence_of(candidate, estimates)
            + _stated_sentence(stated, estimates)
            + _other_course_sentence(selected.selection, candidate)
        ),
        stated=stated,
        recorded_range=recorded_range(best, candidate),
        course=_course_of(candidate),
        since_s=estimates.get(SINCE_NAME),
        until_s=estimates.get(UNTIL_NAME),
        before={
            name.removesuffix(BEFORE_NAME): one
            for name, one in estimates.items()
            if name.endswith(BEFORE_NAME)
        },
        formula=_formula(best, candidate, mine),
        alternatives=alternatives,
    )  # fmt: skip


def _spreads(best: Hypothesis, candidate: Candidate, values: Sequence[float]) -> list[float]:
    """Return half of the 90 % interval of each of an effect's numbers."""
    std = np.sqrt(np.maximum(covariance_of(best).diagonal(), 0.0))[len(best.z) :]
    return [
        NINETY * math.hypot(
            WIDER * parameter.step * each,
            _prior_std(best.model, parameter, value),
            EQUATION_ERROR * _size(candidate, j, values),
        )
        for j, (parameter, value, each) in enumerate(
            zip(candidate.parameters, values, std[best.place_of(candidate)], strict=True)
        )
    ]  # fmt: skip


def _beyond_neutral(
    candidate: Candidate, values: Sequence[float], spreads: Sequence[float]
) -> float:
    """Return how likely an effect's surest number lies on its side of no effect.

    Args:
        candidate: The effect.
        values: Of its parameters.
        spreads: Half of each 90 % interval.
    """
    stds = [
        NINETY * abs(value - parameter.neutral) / spread if spread > 0.0 else math.inf
        for parameter, value, spread, is_amount in zip(
            candidate.parameters, values, spreads, candidate.amounts, strict=True
        )
        if is_amount
    ]
    return 0.5 + 0.5 * math.erf(max(stds, default=math.inf) / math.sqrt(2.0))


def includes_none(candidate: Candidate, stated: Effect) -> bool:
    """Return whether the intervals of an effect's numbers include those of no effect."""
    return all(
        stated.parameters[one.name].low <= one.neutral <= stated.parameters[one.name].high
        for one, is_amount in zip(candidate.parameters, candidate.amounts, strict=True)
        if is_amount and one.name in stated.parameters
    )


def _slope(best: Hypothesis, candidate: VaryingEffect, most: Estimate) -> Estimate:
    """Return how much a number grows with one unit of its variable; `most` is the number."""
    own = best.model.simulator.numbers(best.z)
    value, low, high = (candidate.slope((v,), own) for v in (most.value, most.low, most.high))
    return Estimate(value=value, low=low, high=high, unit=candidate.slope_unit)


def _formula(best: Hypothesis, candidate: Candidate, values: tuple[float, ...]) -> str | None:
    """Return the formula of an effect outside the catalogue, with its numbers."""
    if isinstance(candidate, VaryingEffect):
        return candidate.formula(values, best.model.simulator.numbers(best.z))
    if isinstance(candidate, DictionaryEffect | SensorEffect):
        return candidate.formula(values)
    return None


def _moment(best: Hypothesis, index: int) -> Estimate:
    """Return when a change was, with the moments that explain all parts about as well."""
    fitter = Fitter(best.model, np.ones(len(best.model.t)))
    at, scores = moments_scored(fitter, best, index, AROUND_S, EVERY_S)
    near = at[scores < scores.min() + (NINETY * WIDER) ** 2]
    value = float(best.values[index])
    low, high = min(value, float(near.min())), max(value, float(near.max()))
    return Estimate(value=value, low=low - EVERY_S, high=high + EVERY_S, unit="s")


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
    """Return whether a number is a direction, which does not end where its bounds are."""
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


def _prior_std(model: Likelihood, parameter: Parameter, value: float) -> float:
    """Return the prior std of the car's own number that means the same."""
    own = next((o for o in model.nominal if o.key == parameter.own), None)
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


def stated_of(car: Car, candidate: Candidate) -> dict[str, float]:
    """Return an effect's parameters as a car file states them; empty where it lacks the effect.

    So it is in a car that was found before: what is found now is what changed since.
    """
    have = {term.name for term in car.terms} | {fault.kind.name for fault in car.measures}
    if candidate.name not in have or isinstance(candidate, ChangingEffect):
        return {}
    stated = {
        one.name: car.value(one.key) / one.per_unit
        for one in candidate.parameters
        if car.has(one.key) and not one.given  # what is added to a number is no number of its own
    }
    at_rest = {one.name: one.neutral for one in candidate.parameters}
    acts = any(not math.isclose(value, at_rest[name]) for name, value in stated.items())
    return stated if acts else {}


def _stated_sentence(stated: Mapping[str, float], estimates: Mapping[str, Estimate]) -> str:
    """Return a sentence with what the car file states, empty where it states nothing."""
    words = [_number(name, value, estimates[name].unit) for name, value in stated.items()]
    return f" The car file states {joined(words)}." if words else ""


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


def _alternatives(found: Selection, candidate: Candidate) -> tuple[float, tuple[Alternative, ...]]:
    """Return an effect's probability among all that were tried in its place, and the next ones."""
    its_round = found.round_of(candidate)
    if its_round is None:
        return 1.0, ()
    tried = list(zip(its_round.alternatives, its_round.criteria, strict=True))
    lowest = min(c for _, c in tried)
    weights = {id(f): math.exp(-0.5 * min(c - lowest, 1400.0)) for f, c in tried}
    total = sum(weights.values())
    mine = sum(weights[id(f)] for f, _ in tried if f.names[-1] == candidate.name)
    others = [(f, c) for f, c in tried if f.names[-1] != candidate.name][:MAX_ALTERNATIVES]
    return mine / total, tuple(
        Alternative(name=f.names[-1], probability=weights[id(f)] / total,
                    ruled_out_by=against(c - lowest))
        for f, c in others
    )  # fmt: skip


def _other_course_sentence(found: Selection, candidate: Candidate) -> str:
    """Return which other course of a change explains a recording about as well; empty if none."""
    its_round = found.round_of(candidate)
    if its_round is None or not isinstance(candidate, ChangingEffect):
        return ""
    tried = [
        (_course_of(fitted.effects[-1]), criterion)
        for fitted, criterion in zip(its_round.alternatives, its_round.criteria, strict=True)
        if fitted.names[-1] == candidate.name
    ]
    limit = next(c for course, c in tried if course is candidate.course) + TIE
    others = {course: None for course, c in tried if c < limit and course is not candidate.course}
    text = capital(joined([_COURSES[course] for course in others], "or"))
    return f" {text} explains the recording about as well." if text else ""


def _course_of(candidate: Candidate) -> Course:
    return candidate.course if isinstance(candidate, ChangingEffect) else Course.CONSTANT


def _at_the_end(fitted: Hypothesis) -> Explanation:
    """Return what a hypothesis says of the car that would drive next, with what may come again."""
    now = at_shares(fitted, [1.0] * len(fitted.effects))
    return Explanation(now.effects, now.values)


def undecided_of(selected: Selected, best: Hypothesis, notify: Notify) -> tuple[Suggestion, ...]:
    """Return which effects found could as well be others, and the drives that would decide."""
    found = list[Suggestion]()
    for effect in best.effects:
        its_round = selected.selection.round_of(effect)
        if its_round is None:
            continue
        tried = list(zip(its_round.alternatives, its_round.criteria, strict=True))
        mine, lowest = next((f, c) for f, c in tried if f.names[-1] == effect.name)
        near = [
            _at_the_end(f)
            for f, c in tried
            if c - f.effects[-1].rare < lowest + TIE
            and f.names[-1] not in best.names
            and not _is_of(f.effects[-1], effect)
        ]
        if near:
            notify("designing the drive that would decide")
            explanations = [_at_the_end(mine), *near]
            found.append(suggest(best.model, explanations, notify=notify))
    return tuple(found)


def _is_of(candidate: Candidate, effect: Candidate) -> bool:
    """Return whether a candidate is an effect with a number that depends on a variable."""
    return isinstance(candidate, VaryingEffect) and candidate.of.name == effect.name
