"""Chooses the experiment that separates explanations most, and says it in a sentence.

Where no drive separates them, experiments change more than the commands. To add one: a function of
the nominal car, and its line in `CHANGED`.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from scm.mismatch.effect_catalogue import identifications
from scm.mismatch.experiment.manoeuvres import (
    MANOEUVRES,
    Floor,
    Manoeuvre,
    Pace,
    circles,
    long_laps,
    pace_of,
    shuttle,
    straight_steps,
)
from scm.mismatch.experiment.plan import (
    Change,
    Explanation,
    Leg,
    Numbers,
    Placed,
    Separation,
    linear_separation,
    place,
    planned,
    refitted_separation,
)
from scm.mismatch.findings import Undecided
from scm.mismatch.fit.hypothesis import numbers_of
from scm.mismatch.fit.likelihood import Likelihood
from scm.vehicles.car import Car

SLOPE, GENTLE = 0.1, 0.05
RAMP_M = 2.0
COOLING_S = 180.0  # a motor's heat is 95 % gone
MIN_LAMBDA, SURE_LAMBDA = 10.0, 25.0  # below nobody can tell, above anybody can
ENOUGH_LAMBDA = 400.0  # twenty sigma: a better drive need not be looked for
MAX_EXPLANATIONS = 4
MAX_REFITTED = 6
SLOPE_KEY = "grade.slope"
Notify = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Experiment:
    """What to do with the car.

    Attributes:
        preparation: What to do before the drive, the beginning of its sentence.
    """

    name: str
    legs: tuple[Leg, ...]
    preparation: str = ""


def drive_alone(build: Callable[[Pace], Manoeuvre], name: str) -> Experiment:
    """Return the experiment of one drive on the floor as it is."""
    return Experiment(name, (Leg(build),))


def ramp(_car: Car) -> Experiment:
    """Up and down a slope that is known."""
    text = (
        f"lay a ramp that rises {100.0 * SLOPE:g} cm a metre and tell the tool its slope "
        f"(grade.slope = {SLOPE:g}); up and down that ramp: "
    )
    return Experiment("ramp", (Leg(_climb, _tilted(SLOPE)),), text)


def slope(_car: Car) -> Experiment:
    """Circles on a slope that is known, for cars that roll when they stop."""
    text = (
        f"take the car to an even slope that rises {100.0 * GENTLE:g} cm a metre and tell the tool "
        f"(grade.slope = {GENTLE:g}); on that slope, starting uphill: "
    )
    return Experiment("slope", (Leg(circles, _tilted(GENTLE)),), text)


def _climb(pace: Pace) -> Manoeuvre:
    short = replace(pace, run_m=min(pace.run_m, RAMP_M))
    return replace(straight_steps(short), name="throttle steps on a ramp")


def _tilted(rise: float) -> Change:
    """Return the change to a floor that rises along the heading in which a leg starts."""

    def change(numbers: Numbers, yaw: float) -> Numbers:
        steep, up = numbers.get("grade.slope", 0.0), numbers.get("grade.uphill_rad", 0.0)
        x = steep * math.cos(up) + rise * math.cos(yaw)
        y = steep * math.sin(up) + rise * math.sin(yaw)
        return {**numbers, "grade.slope": math.hypot(x, y), "grade.uphill_rad": math.atan2(y, x)}

    return change


def known_mass(car: Car) -> Experiment:
    """The same drive twice, once with a weight that was weighed."""
    loaded = _load(car)
    text = (
        f"drive twice, first as the car is, then with a weighed {_mass(car):g} kg over its centre, "
        f"and tell the tool the mass; both times: "
    )
    legs = (Leg(straight_steps), Leg(straight_steps, loaded))
    return Experiment("known mass", legs, text)


def ramp_and_mass(car: Car) -> Experiment:
    """Up and down a known slope, without and with a known weight."""
    alone, loaded, tilted = ramp(car), _load(car), _tilted(SLOPE)

    def change(numbers: Numbers, yaw: float) -> Numbers:
        return loaded(tilted(numbers, yaw), yaw)

    text = alone.preparation + (
        f"drive twice, first as the car is, then with a weighed {_mass(car):g} kg over its centre; "
    )
    return Experiment("known mass on a ramp", (*alone.legs, Leg(_climb, change)), text)


def _mass(car: Car) -> float:
    return max(round(0.3 * car.value("body.mass_kg"), 1), 0.1)


def _load(car: Car) -> Change:
    mass = _mass(car)

    def change(numbers: Numbers, _yaw: float) -> Numbers:
        return {**numbers, "payload.mass_kg": numbers.get("payload.mass_kg", 0.0) + mass}

    return change


def rotated(_car: Car) -> Experiment:
    """The same drive along the floor and across it."""
    text = "drive the same course twice, the second time turned by 90 degrees on the floor: "
    legs = (Leg(shuttle), Leg(shuttle, turned=True))
    return Experiment("rotated course", legs, text)


def other_wheels(car: Car) -> Experiment:
    """The same drive on the wheels as they are, and on a set that was measured."""
    neutral = {"wheel.radius_m": car.value("wheel.radius_m"), "tyre_stiffness.scale": 1.0,
               "tyre_grip.scale": 1.0, "tyre_relaxation.length_m": 0.0}  # fmt: skip

    def change(numbers: Numbers, _yaw: float) -> Numbers:
        return {k: neutral.get(k, v) for k, v in numbers.items()}

    text = "drive twice, the second time on new wheels whose radius was measured; both times: "
    legs = (Leg(circles), Leg(circles, change))
    return Experiment("other wheels", legs, text)


def cooled(_car: Car) -> Experiment:
    """Laps, a rest in which motors cool, and the same laps."""

    def build(pace: Pace) -> Manoeuvre:
        laps = long_laps(pace)
        before, drive, _, again, after = laps.pieces
        text = laps.text.replace("rest for 30 s", f"rest for {COOLING_S:g} s")
        return Manoeuvre(
            "laps, three minutes of rest, laps",
            (before, drive, (COOLING_S, 0.0, 0.0), again, after), text,
        )  # fmt: skip

    return Experiment("rest", (Leg(build),))


CHANGED: Mapping[str, Callable[[Car], Experiment]] = {
    build.__name__: build
    for build in (ramp, slope, known_mass, ramp_and_mass, rotated, other_wheels, cooled)
}


@dataclass(frozen=True, slots=True)
class Weighed:
    """An experiment that fits the floor, and how far apart it brings the explanations.

    Attributes:
        sure: Whether explanations were refitted with all that is not linear.
    """

    experiment: Experiment
    legs: tuple[Placed, ...]
    separation: Separation
    sure: bool = False

    @property
    def least(self) -> float:
        """Lambda of the pair that comes apart least."""
        return self.separation.least


@dataclass(frozen=True, slots=True)
class Suggestion:
    """What to do next.

    Attributes:
        best: Whose drive tells most; None where no experiment fits the floor.
        weighed: All that were, best first.
    """

    undecided: Undecided
    best: Weighed | None
    weighed: tuple[Weighed, ...]
    floor: Floor


def suggest(
    model: Likelihood, explanations: Sequence[Explanation], floor: Floor | None = None,
    notify: Notify = lambda _: None,
) -> Suggestion:  # fmt: skip
    """Return the drive that would tell explanations apart, or that none can and what would.

    Args:
        model: Of the recording that leaves them undecided: its sensors, noise and car.
        explanations: Two or more explanations with their fitted values; the four likeliest count.
        floor: Free to drive on; None: where the recording was made, 0.3 m around it.
        notify: Receives what is being tried.
    """
    counted = explanations[:MAX_EXPLANATIONS]
    pace = pace_of(model.car, model.drives, floor)
    between = names_of(explanations)
    known = identifications().items()
    alike = (how.why_alike for name, how in known if set(between) <= {name, how.like})
    no_drive_helps = next(filter(None, alike), "")  # whatever a simulation's small print says
    weighed = list[Weighed]()
    if not no_drive_helps:
        notify(f"simulating {len(MANOEUVRES)} drives under each explanation")
        drives = [drive_alone(build, name) for name, build in MANOEUVRES.items()]
        weighed = _search(model, counted, pace, drives)
    best = weighed[0] if weighed and weighed[0].least >= MIN_LAMBDA else None
    if best:
        text, hoped = _sentence(best), best.least
    else:
        notify("no drive tells them apart: trying a ramp, a known mass, other changes")
        changed = _search(model, counted, pace, _changes(model, counted))
        best = changed[0] if changed and changed[0].least >= MIN_LAMBDA else None
        text = (no_drive_helps or _no_drive(weighed, pace)) + _instead(best, explanations)
        weighed = sorted([*weighed, *changed], key=lambda w: -w.least)
        hoped = best.least if best else max((w.least for w in weighed), default=0.0)
    undecided = Undecided(between=between, drive_this=text, expected_separation=_sigma(hoped))
    return Suggestion(undecided, best, tuple(weighed), pace.floor)


def _changes(model: Likelihood, explanations: Sequence[Explanation]) -> list[Experiment]:
    """Return the changed experiments that make sense for explanations."""
    known = identifications()
    mine = [known[e.name] for r in explanations for e in r.effects if e.name in known]
    only_for_some, wanted = (
        {name for how in effects for name in how.experiments} for effects in (known.values(), mine)
    )
    names = [name for name in CHANGED if name not in only_for_some or name in wanted]
    return [CHANGED[name](model.car) for name in names]


def names_of(explanations: Sequence[Explanation]) -> tuple[str, ...]:
    """Return what explanations differ in: each one's effects that not all have."""
    sets = [
        tuple(dict.fromkeys(e.name for e in explanation.effects)) for explanation in explanations
    ]
    common = set.intersection(*(set(s) for s in sets))
    return tuple(" and ".join(n for n in s if n not in common) or "none of these" for s in sets)


def _search(
    model: Likelihood,
    explanations: Sequence[Explanation],
    pace: Pace,
    experiments: Sequence[Experiment],
) -> list[Weighed]:
    """Return the experiments that fit, best first; refit the best until none can be better."""
    numbers = [numbers_of(r.effects, r.values) for r in explanations]
    found = list[Weighed]()
    for experiment in experiments:
        legs = [place(leg, model.car, pace, numbers) for leg in experiment.legs]
        placed = tuple(leg for leg in legs if leg is not None)
        if len(placed) == len(legs):
            apart = linear_separation(planned(model, placed, numbers[0]), explanations)
            found.append(Weighed(experiment, placed, apart))
            if apart.least > ENOUGH_LAMBDA:
                found[-1] = _refitted(model, explanations, found[-1])
                if found[-1].least > ENOUGH_LAMBDA:
                    break
    found.sort(key=lambda w: -w.least)
    for k in range(len(found)):
        known = max((w.least for w in found if w.sure), default=0.0)
        enough = found[k].least <= known or (k >= MAX_REFITTED and known >= MIN_LAMBDA)
        if enough or found[k].least < MIN_LAMBDA:
            break
        if not found[k].sure:
            found[k] = _refitted(model, explanations, found[k])
    sure = [w for w in found if w.sure]
    rest = [w for w in found if not w.sure]
    return [*sorted(sure, key=lambda w: -w.least), *rest]


def _refitted(model: Likelihood, explanations: Sequence[Explanation], weighed: Weighed) -> Weighed:
    def plan(right: Explanation) -> Likelihood:
        return planned(model, weighed.legs, numbers_of(right.effects, right.values))

    apart = refitted_separation(plan, explanations, weighed.separation)
    return Weighed(weighed.experiment, weighed.legs, apart, sure=True)


def _sigma(value: float) -> float:
    return round(math.sqrt(max(value, 0.0)), 1)


def _sentence(weighed: Weighed) -> str:
    """Return what to do, where to start, and how often."""
    leg = weighed.legs[0]
    drive = weighed.experiment.preparation + leg.manoeuvre.text
    start = leg.start
    where = (
        f"Start at x = {start.x:.2f} m, y = {start.y:.2f} m, heading "
        f"{math.degrees(start.yaw):.0f} degrees; it needs {leg.room[0]:.1f} x {leg.room[1]:.1f} m."
    )
    times = math.ceil(SURE_LAMBDA / max(weighed.least, 1e-9))
    often = f" Do it {times} times: once is {_sigma(weighed.least):g} sigma." if times > 1 else ""
    return f"{drive[0].upper()}{drive[1:]}. {where}{often}"


def _no_drive(drives: Sequence[Weighed], pace: Pace) -> str:
    """Return why driving alone does not help."""
    wide, deep = pace.floor.size
    best = max(drives, key=lambda w: w.least, default=None)
    how = (
        f" (the best, {best.legs[0].manoeuvre.name}: {_sigma(best.least):g} sigma)" if best else ""
    )
    return f"No drive on a level floor of {wide:.1f} x {deep:.1f} m tells these apart{how}."


def _instead(best: Weighed | None, explanations: Sequence[Explanation]) -> str:
    """Return what to do where driving alone does not help."""
    if best:
        return f" Change the experiment: {_sentence(best)}"
    slopes = [
        abs(slope)
        for r in explanations
        if (slope := numbers_of(r.effects, r.values).get(SLOPE_KEY))
    ]
    if slopes:
        return (
            " Lay a spirit level on the floor where the car drove: it is the floor if that rises "
            f"by {100.0 * slopes[0]:.1f} cm a metre, and not if it is level."
        )
    return " Nor does a ramp, a known mass or a turned course: weigh or measure the car itself."
