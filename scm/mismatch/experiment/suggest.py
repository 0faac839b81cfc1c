"""Chooses the experiment that separates rivals most, and says it in a sentence."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from scm.mismatch.experiment.changed import CHANGED, Experiment, drive_alone
from scm.mismatch.experiment.manoeuvres import MANOEUVRES
from scm.mismatch.experiment.pace import Floor, Pace, pace_of
from scm.mismatch.experiment.plan import Placed, Planned, Rival, numbers_of, place
from scm.mismatch.experiment.separation import Apart, exact, quick
from scm.mismatch.findings import Undecided
from scm.mismatch.fit.likelihood import Likelihood

NOBODY, ANYBODY = 10.0, 25.0
PLENTY = 400.0  # twenty sigma: what would be better still need not be looked for
TWINS: Mapping[frozenset[str], str] = {
    frozenset({"payload", "motor_gain"}):
        "On a level floor these do the same to the car: no drive there tells them apart.",
    frozenset({"grade", "wind"}):
        "Both push the car one way wherever it heads: no drive on this floor tells them apart.",
}  # fmt: skip
"""By algebra the same, whatever a simulation's small print says; why no drive helps."""
MOST_RIVALS = 4
MOST_EXACT = 6
SLOPE = "grade.slope"
Notify = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Weighed:
    """An experiment that fits the floor, and how far apart it brings the rivals.

    Attributes:
        sure: Whether rivals were refitted with all that is not linear.
    """

    experiment: Experiment
    legs: tuple[Placed, ...]
    apart: Apart
    sure: bool = False

    @property
    def least(self) -> float:
        """Lambda of the pair that comes apart least."""
        return self.apart.least


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
    model: Likelihood, rivals: Sequence[Rival], floor: Floor | None = None,
    notify: Notify = lambda _: None,
) -> Suggestion:  # fmt: skip
    """Return the drive that would tell rivals apart, or that none can and what would.

    Args:
        model: Of the recording that leaves them undecided: its sensors, noise and car.
        rivals: Two or more explanations with their fitted values; the four likeliest count.
        floor: Free to drive on; None: where the recording was made, 0.3 m around it.
        notify: Hears what is being tried.
    """
    counted = rivals[:MOST_RIVALS]
    pace = pace_of(model.car, model.drives, floor)
    between = names_of(rivals)
    twins = next((why for pair, why in TWINS.items() if set(between) <= pair), "")
    weighed = list[Weighed]()
    if not twins:
        notify(f"simulating {len(MANOEUVRES)} drives under each rival")
        drives = [drive_alone(build, name) for name, build in MANOEUVRES.items()]
        weighed = _search(model, counted, pace, drives)
    best = weighed[0] if weighed and weighed[0].least >= NOBODY else None
    if best:
        said, hoped = _sentence(best), best.least
    else:
        notify("no drive tells them apart: trying a ramp, a known mass, other changes")
        changed = _search(model, counted, pace, _changes(model, counted))
        best = changed[0] if changed and changed[0].least >= NOBODY else None
        said = (twins or _no_drive(weighed, pace)) + _instead(best, rivals)
        weighed = sorted([*weighed, *changed], key=lambda w: -w.least)
        hoped = best.least if best else max((w.least for w in weighed), default=0.0)
    undecided = Undecided(between=between, drive_this=said, expected_separation=_sigma(hoped))
    return Suggestion(undecided, best, tuple(weighed), pace.floor)


def _changes(model: Likelihood, rivals: Sequence[Rival]) -> list[Experiment]:
    """Return the changed experiments that make sense for rivals."""
    keys = {key for r in rivals for key in numbers_of(r.effects, r.values)}
    found = [build(model.car) for build in CHANGED.values()]
    return [e for e in found if not e.asks or keys & set(e.asks)]


def names_of(rivals: Sequence[Rival]) -> tuple[str, ...]:
    """Return what rivals differ in: each one's effects that not all have."""
    sets = [tuple(dict.fromkeys(e.name for e in rival.effects)) for rival in rivals]
    common = set.intersection(*(set(s) for s in sets))
    return tuple(" and ".join(n for n in s if n not in common) or "none of these" for s in sets)


def _search(
    model: Likelihood, rivals: Sequence[Rival], pace: Pace, experiments: Sequence[Experiment]
) -> list[Weighed]:
    """Return the experiments that fit, best first; refit the best until none can be better."""
    numbers = [numbers_of(r.effects, r.values) for r in rivals]
    found = list[Weighed]()
    for experiment in experiments:
        legs = [place(leg, model.car, pace, numbers) for leg in experiment.legs]
        placed = tuple(leg for leg in legs if leg is not None)
        if len(placed) == len(legs):
            apart = quick(Planned(model, placed, numbers[0]), rivals)
            found.append(Weighed(experiment, placed, apart))
            if apart.least > PLENTY:
                found[-1] = _refitted(model, rivals, found[-1])
                if found[-1].least > PLENTY:
                    break
    found.sort(key=lambda w: -w.least)
    for k in range(len(found)):
        known = max((w.least for w in found if w.sure), default=0.0)
        enough = found[k].least <= known or (k >= MOST_EXACT and known >= NOBODY)
        if enough or found[k].least < NOBODY:
            break
        if not found[k].sure:
            found[k] = _refitted(model, rivals, found[k])
    sure = [w for w in found if w.sure]
    rest = [w for w in found if not w.sure]
    return [*sorted(sure, key=lambda w: -w.least), *rest]


def _refitted(model: Likelihood, rivals: Sequence[Rival], weighed: Weighed) -> Weighed:
    def plan(right: Rival) -> Planned:
        return Planned(model, weighed.legs, numbers_of(right.effects, right.values))

    apart = exact(plan, rivals, weighed.apart)
    return Weighed(weighed.experiment, weighed.legs, apart, sure=True)


def _sigma(value: float) -> float:
    return round(math.sqrt(max(value, 0.0)), 1)


def _sentence(weighed: Weighed) -> str:
    """Return what to do, where to start, and how often."""
    leg = weighed.legs[0]
    drive = weighed.experiment.said + leg.manoeuvre.said
    start = leg.start
    where = (
        f"Start at x = {start.x:.2f} m, y = {start.y:.2f} m, heading "
        f"{math.degrees(start.yaw):.0f} degrees; it needs {leg.room[0]:.1f} x {leg.room[1]:.1f} m."
    )
    times = math.ceil(ANYBODY / max(weighed.least, 1e-9))
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


def _instead(best: Weighed | None, rivals: Sequence[Rival]) -> str:
    """Return what to do where driving alone does not help."""
    if best:
        return f" Change the experiment: {_sentence(best)}"
    slopes = [abs(slope) for r in rivals if (slope := numbers_of(r.effects, r.values).get(SLOPE))]
    if slopes:
        return (
            " Lay a spirit level on the floor where the car drove: it is the floor if that rises "
            f"by {100.0 * slopes[0]:.1f} cm a metre, and not if it is level."
        )
    return " Nor does a ramp, a known mass or a turned course: weigh or measure the car itself."
