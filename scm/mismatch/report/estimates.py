"""Which number of a car file each estimate of a diagnosis is about, in that number's measure."""

from collections.abc import Iterator

from msgspec import structs

from scm.mismatch.evidence import Evidence
from scm.mismatch.findings import Diagnosis, Effect, Estimate
from scm.mismatch.report.own_files import own_terms
from scm.vehicles.car import Car
from scm.vehicles.describe_effects import all_effects, params_of
from scm.vehicles.sensor_fault import all_sensor_faults

_SAME = 0.01  # of a number: nearer than that, two are one


def estimates_by_key(
    diagnosis: Diagnosis, evidence: Evidence, car: Car, patched: Car
) -> dict[str, Estimate]:
    """Return every estimate by the `section.key` at which a car file holds its number."""
    found = {ordinary.key: ordinary.found for ordinary in evidence.refitted}
    for effect in diagnosis.effects:
        for key, estimate in _of_effect(effect, car, patched):
            found[key] = _in_place(estimate, key, car, patched)
    return found


def _of_effect(effect: Effect, car: Car, patched: Car) -> Iterator[tuple[str, Estimate]]:
    measure = all_sensor_faults().get(effect.name)
    if measure and measure.stands_for and measure not in [f.kind for f in patched.measures]:
        share = effect.parameters.get(measure.params[0].reported)
        if share is not None and car.has(measure.stands_for):
            yield measure.stands_for, _times(share, car.value(measure.stands_for))
        return
    known = all_effects()
    own = [param for term in own_terms(patched) for param in params_of(term)]
    for param in params_of(known[effect.name]) if effect.name in known else own:
        if param.reported in effect.parameters:
            yield param.key, effect.parameters[param.reported]


def _in_place(estimate: Estimate, key: str, car: Car, patched: Car) -> Estimate:
    """Return an estimate of what is added to a car's own number as one of the sum."""
    if not (car.has(key) and patched.has(key)):
        return estimate
    given, now = car.value(key), patched.value(key)
    near = _SAME * abs(now)
    if abs(now - estimate.value) <= near or abs(now - given - estimate.value) > near:
        return estimate
    return structs.replace(
        estimate,
        value=estimate.value + given,
        low=estimate.low + given,
        high=estimate.high + given,
    )


def _times(share: Estimate, number: float) -> Estimate:
    return structs.replace(
        share, value=share.value * number, low=share.low * number, high=share.high * number
    )
