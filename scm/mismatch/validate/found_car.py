"""The given car with what was found, as a car file says it: written, and read back.

What a report claims of a car is computed from that file, never from the numbers of a search.
"""

import math
import shutil
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
from msgspec import structs

from scm.arrays import Bools
from scm.errors import ScmError
from scm.mismatch.changing_effect import ChangingEffect
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect, as_term, number_keys
from scm.mismatch.discovery.sensor_effects import LENS, PREFIX, SensorEffect
from scm.mismatch.evidence import Evidence, RefittedParameter
from scm.mismatch.findings import Course, Diagnosis, Effect, Verdict
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.recorded_range import recorded_range
from scm.mismatch.report.car_file import FILE, write_car
from scm.mismatch.validate.explain import NINETY, refitted
from scm.mismatch.validate.stages import (
    BEFORE,
    DURING,
    RECORDED,
    Stage,
    as_it_was,
    at_shares,
    is_of_recording,
    lasting,
    moments_of,
    shares_at,
    spans_of,
)
from scm.mismatch.varying_effect import VaryingEffect, as_own_term, own_key
from scm.vehicles.car import Car, load_car
from scm.vehicles.correlated import Correlated
from scm.vehicles.term import Term

INFORMED = 0.8  # a posterior std over its prior, below which the recording says something
STRONG = 0.3  # a correlation below which numbers are as good as independent
LOOSER = 0.01  # keeps a matrix rounded to three digits positive definite
CLOCKS = "clock."  # numbers of a recording's stamps, not of the car


class CarFiles:
    """Writes cars that a search finds into a folder of its own, and reads them back.

    The folder lives as long as this object: effects outside the catalogue are files in it. Pickled,
    it takes the files along, and has another folder.
    """

    def __init__(self, car: Car, recordings: tuple[str, ...]) -> None:
        self._car, self._recordings = car, recordings
        self._folder = Path(mkdtemp(prefix="scm-found-"))
        weakref.finalize(self, shutil.rmtree, self._folder, ignore_errors=True)
        self._count = 0
        self._sent_from = self._folder

    def __reduce__(self) -> tuple[Any, ...]:
        files = (path for path in self._folder.rglob("*") if path.is_file())
        content = {str(path.relative_to(self._folder)): path.read_bytes() for path in files}
        return _received, (self._car, self._recordings, self._folder, content, self._count)

    def reread(self, car: Car | None) -> Car | None:
        """Return a car that was written before this object was pickled, from its present folder."""
        if car is None or self._sent_from not in car.path.parents:
            return car
        return load_car(self._folder / car.path.relative_to(self._sent_from))

    def written(
        self, fitted: Hypothesis, effects: Sequence[Effect], *, of_recording: bool = False
    ) -> Car:
        """Return the car with what was found, as its written file says.

        A law against the recording's own time is left out, unless the car is `of_recording`.

        Where all its numbers together contradict one another, those that the recordings say nothing
        about stay as they were given, or else all but those of the effects.

        Raises:
            ScmError: when it cannot be written so that it loads.
        """
        fitted = fitted if of_recording else lasting(fitted)
        std = np.sqrt(np.maximum(fitted.covariance.diagonal(), 0.0))
        known = std if len(std) >= len(fitted.z) else np.full(len(fitted.z), math.inf)
        for most in (math.inf, INFORMED):
            try:
                return self._written(fitted, effects, known[: len(fitted.z)] <= most)
            except ScmError:
                continue
        return self._written(fitted, effects, np.zeros(len(fitted.z), dtype=np.bool_))

    def stages(
        self, fitted: Hypothesis, effects: Sequence[Effect], found: Car
    ) -> tuple[Stage, ...]:
        """Return the car as it was in each part of the recording; `found` is how it is in the end.

        Raises:
            ScmError: as `written`.
        """
        if any(map(is_of_recording, fitted.effects)):
            found = self.written(fitted, effects, of_recording=True)
            end = RECORDED
        else:
            end = FILE
        own = fitted.model.simulator.numbers(fitted.z)
        cars, names = {shares_at(fitted, math.inf): (found, end)}, list[str]()
        for *_, shares in spans_of(fitted):
            if shares in cars:
                continue
            was = [
                as_it_was(effect, candidate, fitted.values[place].tolist(), share, own)
                for effect, (candidate, place), share in zip(
                    effects, fitted.each(), shares, strict=True
                )
            ]
            mine = self.written(at_shares(fitted, shares), [*filter(None, was)], of_recording=True)
            names.append(_stage_name(fitted, shares))
            number = names.count(names[-1])
            cars[shares] = mine, f"{names[-1]}{f'_{number}' if number > 1 else ''}.toml"
        moments = moments_of(fitted)
        return tuple(
            Stage(*cars[shares], from_s, until_s, at_once=from_s in moments)
            for from_s, until_s, shares in spans_of(fitted)
        )

    def _written(self, fitted: Hypothesis, effects: Sequence[Effect], own: Bools) -> Car:
        self._count += 1
        folder = self._folder / f"{self._count}"
        folder.mkdir()
        at_end = at_shares(fitted, shares_at(fitted, math.inf))
        found = patched(self._car, at_end, folder, own)
        diagnosis = Diagnosis(
            verdict=Verdict.NONE, located=(), effects=tuple(effects), undecided=(), fit=None,
            runtime_s=0.0,
        )  # fmt: skip
        evidence = Evidence(
            vehicle=self._car.name,
            recordings=self._recordings,
            refitted=refitted(fitted, self._car),
        )
        write_car(diagnosis, evidence, self._car, found, folder)
        return load_car(folder / FILE)


def _stage_name(fitted: Hypothesis, shares: Sequence[float]) -> str:
    """Return a stage's name: by whether anything is there that came and went."""
    there = (
        isinstance(effect, ChangingEffect) and effect.course is Course.INTERMITTENT and share > 0.0
        for effect, share in zip(fitted.effects, shares, strict=True)
    )
    return DURING if any(there) else BEFORE


def _received(
    car: Car,
    recordings: tuple[str, ...],
    folder: Path,
    content: Mapping[str, bytes],
    count: int,
) -> CarFiles:
    """Return car files that another process wrote in a folder, in one of this process."""
    files = CarFiles(car, recordings)
    files._sent_from, files._count = folder, count  # noqa: SLF001
    for name, data in content.items():
        path = files._folder / name  # noqa: SLF001
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return files


def as_written(found: Sequence[RefittedParameter], car: Car) -> tuple[RefittedParameter, ...]:
    """Return the car's own numbers as its file says them, where it says other than was found."""
    written = list[RefittedParameter]()
    for one in found:
        value = car.value(one.key) if car.has(one.key) else one.found.value
        if not math.isclose(value, one.found.value, rel_tol=1e-4, abs_tol=1e-12):
            spread = NINETY * one.given_std
            stays = structs.replace(one.found, value=value, low=value - spread, high=value + spread)
            written.append(replace(one, found=stays, found_std=one.given_std))
        else:
            written.append(one)
    return tuple(written)


def on(base: Car, car: Car) -> Car:
    """Return a car on the effects of another that has all of its own, or itself where none has.

    Effects at their neutral numbers leave the motion as it was, so that all cars of one search
    share one compiled kernel.
    """
    if not {term.name for term in car.terms} <= {term.name for term in base.terms}:
        return car
    moved: Mapping[str, float] = {
        key: quantity.value
        for key, quantity in car.values.items()
        if isinstance(quantity.value, float) and base.has(key) and quantity != base.quantity(key)
    }
    same = base.with_terms([], moved)
    return replace(same, path=car.path, measures=car.measures, values={**same.values, **car.values})


def patched(car: Car, fitted: Hypothesis, folder: Path, own: Bools | None = None) -> Car:
    """Return the given car with effects found and with its own numbers refitted.

    A discovered error of a sensor has no place in a car file, except the lens of a camera.

    Args:
        car: As given.
        fitted: What was found.
        folder: Gets the files of discovered effects; the car needs them while it is used.
        own: Which of the car's own numbers are refitted; None: all.

    Raises:
        ScmError: when an effect's file cannot be written.
    """
    nominal = fitted.model.nominal
    which = [True] * len(nominal) if own is None else list(own)
    of_car = fitted.model.simulator.numbers(fitted.z)
    numbers = {
        o.key: number
        for o, moves in zip(nominal, which, strict=True)
        if moves and not o.key.startswith(CLOCKS)
        for number in (of_car[o.key],)
        if not car.has(o.key) or not math.isclose(number, car.value(o.key), rel_tol=1e-9)
    }
    terms, faults = list[str | Term](), list[str]()
    known = {term.name for term in car.terms}
    for effect, place in fitted.each():
        values = tuple(float(v) for v in fitted.values[place])
        if isinstance(effect, DictionaryEffect):
            term, more = as_term(effect, values, folder, recorded_range(fitted, effect))
            terms.append(term)
            numbers |= more
            continue
        if isinstance(effect, VaryingEffect):
            term, more = as_own_term(effect, values, folder, of_car, recorded_range(fitted, effect))
            terms.append(term)
            numbers |= more
            continue
        if isinstance(effect, SensorEffect):
            if effect.fault:
                numbers[effect.fault] = values[0]
                faults.append(LENS)
            continue
        numbers |= {k: v for k, v in effect.numbers(values).items() if "@" not in k}
        if effect.equation == "sensor" and effect.name != "wheel_radius":
            faults.append(effect.name)
        elif effect.name not in known and effect.name != "wheel_radius":
            terms.append(effect.name)
    if any(key.startswith("measure.pose_point") for key in numbers) and "pose_point" not in faults:
        faults.append("pose_point")
    sensed = {key: value for key, value in numbers.items() if key.startswith("measure.")}
    driven = {key: value for key, value in numbers.items() if key not in sensed}
    found = car.with_terms(terms, driven)
    found = found.with_measures(list(dict.fromkeys(faults)), sensed) if sensed else found
    return replace(found, correlated=correlated(fitted, which))


def correlated(fitted: Hypothesis, own: Sequence[bool]) -> tuple[Correlated, ...]:
    """Return the groups of numbers whose errors come together, as the recordings leave them.

    Args:
        fitted: What was found.
        own: Which of the car's own numbers count.
    """
    covariance = fitted.covariance
    if not covariance.size:
        return ()
    keys = [o.key if moves else CLOCKS for o, moves in zip(fitted.model.nominal, own, strict=True)]
    for effect in fitted.effects:
        named = number_keys(effect) if isinstance(effect, DictionaryEffect) else {}
        if isinstance(effect, VaryingEffect):
            named = {effect.parameters[0].name: own_key(effect)}
        keys += [named.get(parameter.name, parameter.key) for parameter in effect.parameters]
    std = np.sqrt(np.maximum(covariance.diagonal(), 0.0))
    counts = np.array([not key.startswith((CLOCKS, "measure.", PREFIX)) for key in keys])
    counts &= (std > 0.0) & np.array([keys.count(key) == 1 for key in keys])
    between = covariance / np.where(std > 0.0, np.outer(std, std), 1.0)
    strong = (np.abs(between) >= STRONG) & np.outer(counts, counts)
    groups, left = list[Correlated](), [int(i) for i in np.flatnonzero(counts)]
    while left:
        group = [left.pop(0)]
        while more := [i for i in left if strong[i, group].any()]:
            group += more
            left = [i for i in left if i not in more]
        if len(group) > 1:
            matrix = (1.0 - LOOSER) * between[np.ix_(group, group)] + LOOSER * np.eye(len(group))
            rows = tuple(tuple(round(float(v), 3) for v in row) for row in matrix)
            groups.append(Correlated(tuple(keys[i] for i in group), rows))
    return tuple(groups)
