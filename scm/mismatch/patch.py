"""The given car with what was found, as the simulator loads it."""

from pathlib import Path

import numpy as np

from scm.mismatch.fit import Fitted
from scm.mismatch.laws.law import Law
from scm.mismatch.laws.sensed import LENS, Sensed
from scm.mismatch.laws.writing import as_term
from scm.mismatch.likelihood import Likelihood
from scm.vehicles.car import Car
from scm.vehicles.term import Term


def patched(car: Car, model: Likelihood, fitted: Fitted, folder: Path) -> Car:
    """Return the given car with effects found and with the numbers of its own that are known.

    A number that the recordings leave as uncertain as the file does keeps the file's value. A
    sensor's law outside the library has no place in a car file, but for the lens of a camera.

    Args:
        car: As given.
        model: That `fitted` belongs to.
        fitted: What was found.
        folder: Gets the files of laws outside the library; the car needs them while it is used.

    Raises:
        ScmError: when a law's file cannot be written.
    """
    spread = np.sqrt(np.maximum(fitted.covariance.diagonal(), 0.0))
    numbers = {
        o.key: model.numbers(fitted.z)[o.key]
        for o, std in zip(model.ordinary, spread, strict=False)
        if not o.key.startswith("clock.") and std < 0.8
    }
    terms, faults, at = list[str | Term](), list[str](), 0
    known = {term.name for term in car.terms}
    for effect in fitted.effects:
        values = tuple(float(v) for v in fitted.values[at : at + len(effect.knobs)])
        at += len(values)
        if isinstance(effect, Law):
            term, of_law = as_term(effect, values, folder)
            terms.append(term)
            numbers |= of_law
            continue
        if isinstance(effect, Sensed):
            if effect.fault:
                numbers[effect.fault] = values[0]
                faults.append(LENS)
            continue
        numbers |= effect.numbers(values)
        if effect.equation == "sensor" and effect.name != "wheel_radius":
            faults.append(effect.name)
        elif effect.name not in known and effect.name != "wheel_radius":
            terms.append(effect.name)
    if any(key.startswith("measure.pose_point") for key in numbers) and "pose_point" not in faults:
        faults.append("pose_point")
    sensed = {key: value for key, value in numbers.items() if key.startswith("measure.")}
    driven = {key: value for key, value in numbers.items() if key not in sensed}
    found = car.with_terms(terms, driven)
    return found.with_measures(list(dict.fromkeys(faults)), sensed) if faults else found
