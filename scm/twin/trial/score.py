"""Judges what a city found by the labels of its scene: each change of each car, and false alarms.

A change of a place, a camera or everything is one of every car. What two things do to a car at one
time is one change of two causes; that something is gone again is a change, too.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import msgspec
import numpy as np

from scm.clock import seconds
from scm.mismatch.findings import Diagnosis, Effect, Equation, Estimate, Undecided, Verdict
from scm.mismatch.trial import labels
from scm.mismatch.trial.score import score
from scm.records.twins import TwinChange
from scm.twin.evidence import OWN
from scm.twin.trial.city import Adopted, CarFound, CityFound

WITHIN_S, EARLY_S = 600.0, 5.0  # of a change, in which an alarm is of it
STEP_OFF_S, RAMP_OFF = 5.0, 0.2  # by which an onset may be off; of a ramp, in parts of it
BETTER, WORSE = "better", "worse"
NEAR_M = 0.5  # of the edge of what was spilled, where a change of a place is
SEARCHED = (*OWN, "everywhere")  # of a place or a camera nothing is searched for in a car


class Outcome(msgspec.Struct, kw_only=True, frozen=True):
    """One change of one car, and what the city made of it.

    Attributes:
        whose: Kinds of what changed at once.
        effects: Names of what changed.
        is_over: It went away.
        at_s: When it began, since the city's begin.
        noticed_s: After how much driving of this car; None: not noticed.
        onset_off_s: By how much the moment stated in the end is off; `onset_off`: in parts of it,
            of one that came evenly.
        named: `exact`, `among` what was found or left undecided, or `wrong`; None: it was not
            noticed, or is of a place or a camera.
        cause: `right`, `undecided` or `wrong`; None: it was not noticed.
        version: `adopted`, `rejected`, `rolled_back`, `replaced` or `candidate`; empty: none.
        later: `better` or `worse` than the version before on later driving; empty: not known.
    """

    case: str
    car: str
    whose: tuple[str, ...]
    effects: tuple[str, ...]
    strength: tuple[float, ...]
    course: str
    is_over: bool
    at_s: float
    noticed_s: float | None = None
    onset_off_s: float | None = None
    onset_off: float | None = None
    named: str | None = None
    named_s: float | None = None
    cause: str | None = None
    version: str = ""
    later: str = ""
    text: str = ""


class FalseAlarm(msgspec.Struct, kw_only=True, frozen=True):
    """A change of a car that was none; `is_adopted`: a version of it was put in force."""

    case: str
    car: str
    at_s: float
    effect: str
    score: float
    cause: str
    is_adopted: bool


class Judged(msgspec.Struct, kw_only=True):
    """What cities were worth."""

    outcomes: list[Outcome] = []
    false_alarms: list[FalseAlarm] = []
    wrong_adoptions: int = 0
    driven_h: float = 0.0
    car_h: float = 0.0
    cpu_s: float = 0.0
    search_cpu_s: float = 0.0
    wall_s: float = 0.0
    contacts: int = 0


class _Moment(msgspec.Struct, kw_only=True):
    """What happens to one car at one time."""

    at_s: float
    is_over: bool
    changes: list[Mapping[str, Any]]

    @property
    def whose(self) -> tuple[str, ...]:
        return tuple(str(one["whose"]) for one in self.changes)


def judge_city(case: str, label: Mapping[str, Any], found: CityFound, judged: Judged) -> None:
    """Add what one city was worth."""
    for name, car in found.cars.items():
        moments = moments_of(name, label["changes"], found.lasted_s)
        of_moment = _matched(car, moments, found.begin_ns)
        for moment in moments:
            changes = of_moment.get(id(moment)) or _by_others(moment, found)
            judged.outcomes.append(_outcome(case, name, moment, moments, changes, car, found))
        for change in of_moment.get(0, []):
            judged.false_alarms.append(
                FalseAlarm(
                    case=case, car=name, at_s=seconds(change.noticed_ns - found.begin_ns),
                    effect=change.effect, score=change.score, cause=change.cause,
                    is_adopted=_adopted_of(change, car) is not None,
                )
            )  # fmt: skip
        judged.wrong_adoptions += sum(
            _is_wrong(one, car, of_moment, moments) for one in car.adopted if one.number > one.after
        )
        judged.driven_h += (car.driven[-1][1] if car.driven else 0.0) / 3600.0
    judged.car_h += len(found.cars) * found.lasted_s / 3600.0
    judged.cpu_s += found.cpu_s
    judged.search_cpu_s += found.search_cpu_s
    judged.wall_s += found.wall_s
    judged.contacts += found.contacts


def moments_of(car: str, changes: Iterable[Mapping[str, Any]], lasted_s: float) -> list[_Moment]:
    """Return what happens to a car until a city ends, in order of time."""
    found = dict[tuple[float, bool], _Moment]()
    for change in changes:
        if change["whose"] in OWN and change["of"] != car:
            continue
        for at_s, is_over in ((change["begins_s"], False), (change["ends_s"], True)):
            if at_s is not None and at_s < lasted_s:
                moment = _Moment(at_s=at_s, is_over=is_over, changes=[])
                found.setdefault((at_s, is_over), moment).changes.append(change)
    return [found[key] for key in sorted(found)]


def _matched(
    car: CarFound, moments: Sequence[_Moment], begin_ns: int
) -> dict[int, list[TwinChange]]:
    """Return the changes reported of each moment, by its identity; under 0, those of none."""
    found = dict[int, list[TwinChange]]()
    for noticed_ns in sorted(car.changes):
        at_s = seconds(noticed_ns - begin_ns)
        before = [one for one in moments if one.at_s - EARLY_S <= at_s <= one.at_s + WITHIN_S]
        key = id(before[-1]) if before else 0
        found.setdefault(key, []).append(car.changes[noticed_ns])
    return found


def _by_others(moment: _Moment, found: CityFound) -> list[TwinChange]:
    """Return the change of a place that another car reported, for all that drive there."""
    reported = (one for car in found.cars.values() for one in car.changes.values())
    there = [
        one for one in reported
        if -EARLY_S <= seconds(one.noticed_ns - found.begin_ns) - moment.at_s <= WITHIN_S
        and one.cause == "place" and any(_is_there(one, true) for true in moment.changes)
    ]  # fmt: skip
    return sorted(there, key=lambda one: one.noticed_ns)[:1]


def _outcome(
    case: str, name: str, moment: _Moment, moments: Sequence[_Moment],
    changes: Sequence[TwinChange], car: CarFound, found: CityFound,
) -> Outcome:  # fmt: skip
    first = moment.changes[0]
    outcome = Outcome(
        case=case, car=name, whose=moment.whose, course=str(first["course"]),
        effects=tuple(effect for one in moment.changes for effect in one["names"]),
        strength=tuple(size for one in moment.changes for size in one["strength"]),
        is_over=moment.is_over, at_s=moment.at_s,
    )  # fmt: skip
    if not changes:
        return outcome
    change = changes[0]
    noticed_s, since_s = (
        seconds(t_ns - found.begin_ns) for t_ns in (change.noticed_ns, change.since_ns)
    )
    is_ramp = first["course"] == "ramp"
    lasts_s = first["complete_s"] - first["begins_s"]
    named, named_s = _named(moment, changes, car)
    version = next((v for c in changes for v in car.versions.values() if _is_of(v.report, c)), None)
    return msgspec.structs.replace(
        outcome,
        noticed_s=max(driven_at(car, noticed_s) - driven_at(car, moment.at_s), 0.0),
        onset_off_s=None if is_ramp else since_s - moment.at_s,
        onset_off=(since_s - moment.at_s) / lasts_s if is_ramp else None,
        named=named,
        named_s=None if named_s is None else named_s - moment.at_s,
        cause=attribution(change, moment),
        version="" if version is None else version.state,
        later=_later([one for c in changes if (one := _adopted_of(c, car))], moment, moments),
        text=" ".join(filter(None, (change.effect, change.cause, *(c.text for c in changes)))),
    )


def driven_at(car: CarFound, at_s: float) -> float:
    """Return how long a car was driven until a time [s]."""
    if not car.driven:
        return 0.0
    t_s, driven_s = np.array(car.driven).T
    return float(np.interp(at_s, t_s, driven_s))


def attribution(change: TwinChange, moment: _Moment) -> str:
    """Return whether a change was attributed rightly."""
    if change.cause == "undecided":
        return "undecided"
    true = set(moment.whose)
    if true & set(OWN):
        true |= set(OWN)  # of a tag that looks like a car: the search decides
    if change.cause not in true:
        return "wrong"
    if change.cause == "place" and not any(_is_there(change, one) for one in moment.changes):
        return "wrong"
    return "right"


def _is_there(change: TwinChange, true: Mapping[str, Any]) -> bool:
    place = next(one for one in change.causes if one.kind == "place")
    if true["whose"] != "place" or place.x_m is None or place.y_m is None:
        return False
    (spot,) = true["parameters"]
    far_m = math.hypot(place.x_m - spot["x_m"], place.y_m - spot["y_m"])
    return bool(far_m <= spot["radius_m"] + NEAR_M)


def _named(
    moment: _Moment, changes: Sequence[TwinChange], car: CarFound
) -> tuple[str | None, float | None]:
    """Return how well a change that is of the car's file was named, and when the search ended."""
    own = [one for one in moment.changes if one["whose"] in SEARCHED]
    if not own:
        return None, None
    label = labels.label_of("", _together(own))
    best, when_s = "wrong", None
    for change in changes:
        outcome = score(label, diagnosis_of(change))
        got = "exact" if outcome.exact else "among" if outcome.among else "wrong"
        if got == "exact" or (got == "among" and best == "wrong"):
            best, when_s = got, car.ended_s.get(change.noticed_ns)
    return best, when_s


def _together(own: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the label of several effects that came at once."""
    return {
        "names": [name for one in own for name in one["names"]],
        "parameters": [values for one in own for values in one["parameters"]],
        "car": own[0]["car"],
        "listed": True,
        "equation": "+".join(one["equation"] for one in own),
        "depends_on": [word for one in own for word in one["depends_on"]],
    }


def diagnosis_of(change: TwinChange) -> Diagnosis:
    """Return what a search found of a change, as a diagnosis."""
    effects = tuple(
        Effect(
            name=one.name, is_known=True, equation=Equation.DRIVE, depends_on=(),
            parameters={
                p.name: Estimate(value=p.value, low=p.low, high=p.high, unit=p.unit)
                for p in one.parameters
            },
            probability=one.probability, text=one.text,
        )
        for one in change.effects
    )  # fmt: skip
    undecided = Undecided(
        between=change.between, drive_this=change.drive_this, expected_separation=0.0
    )
    verdict = Verdict.MISMATCH if effects else Verdict.UNDECIDED
    return Diagnosis(
        verdict=verdict, located=(), effects=effects, undecided=(undecided,), fit=None,
        runtime_s=math.nan,
    )  # fmt: skip


def _is_of(report: str, change: TwinChange) -> bool:
    return bool(report) and report == change.report


def _adopted_of(change: TwinChange, car: CarFound) -> Adopted | None:
    """Return the version that was put in force for a change."""
    return next(
        (
            one
            for one in car.adopted
            if one.number > one.after and _is_of(car.versions[one.number].report, change)
        ),
        None,
    )


def _later(adopted: Sequence[Adopted], moment: _Moment, moments: Sequence[_Moment]) -> str:
    """Return whether versions predict driving until the car's next change better."""
    if not adopted:
        return ""
    new = adopted[-1]
    ends_s = min((one.at_s for one in moments if one.at_s > moment.at_s), default=math.inf)
    chunks = [one for one in new.later if one.ends_s <= ends_s]
    if not chunks:
        return ""
    before, now = (
        sum(c.windows * error**2 for c, error in zip(chunks, errors, strict=True))
        for errors in ([c.before_m for c in chunks], [c.now_m for c in chunks])
    )
    return BETTER if now < before else WORSE


def _is_wrong(
    new: Adopted, car: CarFound, of_moment: Mapping[int, Sequence[TwinChange]],
    moments: Sequence[_Moment],
) -> bool:  # fmt: skip
    """Return whether a version was put in force for what no car file has, or predicts worse."""
    report = car.versions[new.number].report
    moment = next(
        (m for m in moments if any(_is_of(report, c) for c in of_moment.get(id(m), ()))), None
    )
    if moment is None or not set(moment.whose) & set(SEARCHED):
        return True
    return _later([new], moment, moments) == WORSE
