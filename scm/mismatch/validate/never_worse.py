"""Whether a car found may be handed out: never worse than others on driving that no fit has seen.

Others are the car as given, the re-tuned one, and the kinematic bicycle that is their witness.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from scm.mismatch.evidence import FreeRuns
from scm.mismatch.findings import Dropped, Equation, Fit
from scm.mismatch.fit.fitter import FARTHEST
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.report.wording import (
    bicycle_name,
    capital,
    error_name,
    joined,
    percent,
    quantities,
    quantity,
    short,
    title_of,
    unit_text,
)
from scm.mismatch.validate.free_runs import MAX_NOISE_RATIO, chance_of, got_worse
from scm.mismatch.validate.locate import strayed
from scm.replay.numbers import COMMAND_CLOCK, POSE_CLOCK, THROTTLE_CLOCK
from scm.vehicles.car import Car

POSE = ("position_m", "yaw_rad")
LIKE_OTHER_EQUATIONS = {
    "steer_delay", "steer_lag", "steer_rate", "drive_delay", "drive_lag", "stiction",
    "load_transfer", "payload",
}  # fmt: skip
"""What other equations of the same servo, motor, friction and suspension look like, as tyres do."""
WORSE_THAN_WITNESS = 1.05
NEARER = 0.95  # an error of a car that follows better, over the other one's
NEAR_END = 0.95  # of the way to an end of a number's scatter, or to a bound
UNSEEN = "on parts that no fit has seen"
GIVEN, RETUNED = "as given", "with its own numbers refitted alone"
CLOCKS = {COMMAND_CLOCK: "commands", THROTTLE_CLOCK: "the throttle", POSE_CLOCK: "poses"}
SIDES = {Equation.DRIVE: "along", Equation.STEERING: "across"}
TWICE = 2.0


@dataclass(frozen=True, slots=True)
class Worse:
    """A pose error that grew: its name, the other car, and both errors."""

    name: str
    other: str
    was: float
    now: float


def worse_than(fit: Fit, beside: Fit | None) -> Worse | None:
    """Return what a found car does worse than the given one or the re-tuned one; None if nothing.

    Args:
        fit: Of the given car and the found one.
        beside: Of the re-tuned car and the found one.
    """
    for other, one in ((GIVEN, fit), (RETUNED, beside)):
        part = None if one is None else one.confirm
        for name in POSE:
            if part and name in part.before and got_worse(part, name, part.before[name]):
                return Worse(name, other, part.before[name], part.after[name])
    return None


def dropped(names: Sequence[str], worse: Worse, horizon_s: float) -> list[Dropped]:
    """Return effects that were dropped because the car with them got worse."""
    title, unit = error_name(worse.name)
    now, was = quantities((worse.now, worse.was), unit)
    return [
        Dropped(
            name=name,
            text=f"{capital(title_of(name))} explains what was fitted, but does not hold "
            f"{UNSEEN}: after {quantity(horizon_s, 's')} the car with it is {now} off in {title}, "
            f"and {was} {worse.other}.",
        )
        for name in names
    ]


def useless(names: Sequence[str], beside: Fit) -> list[Dropped]:
    """Return effects that were dropped because the car with them is hardly nearer.

    Args:
        names: Of the effects.
        beside: Of the car without them and of the one with them.
    """
    part, name = beside.confirm, POSE[0]
    title, unit = error_name(name)
    now, was = quantities((part.after[name], part.before[name]), unit)
    return [
        Dropped(
            name=one,
            text=f"{capital(title_of(one))} explains some of what the sensors measured, but brings "
            f"the car hardly nearer {UNSEEN}: after {quantity(beside.horizon_s, 's')} it is {now} "
            f"off in {title} with it, and {was} without.",
        )
        for one in names
    ]


def denied(names: Sequence[str]) -> list[Dropped]:
    """Return effects that unseen data deny before any car is written."""
    why = f"explains what was fitted, but nothing of what was measured {UNSEEN}."
    return [Dropped(name=one, text=f"{capital(title_of(one))} {why}") for one in names]


def unwritten(names: Sequence[str]) -> list[Dropped]:
    """Return effects that were dropped because the car with them cannot be written as a file."""
    why = "lets the car's numbers contradict one another: it could not be written as a car file."
    return [Dropped(name=one, text=f"{capital(title_of(one))} {why}") for one in names]


def is_nearer(beside: Fit, share: float = NEARER) -> bool:
    """Return whether a car follows better than another, by position or heading.

    To that share of the error, and by a quarter of what noise may change the square of an error.
    """
    part = beside.confirm
    for name in POSE:
        was, now, floor = (x.get(name, 0.0) for x in (part.before, part.after, part.noise_floor))
        if now < share * was and was**2 - now**2 > 0.25 * chance_of(part) * floor**2:
            return True
    return False


def is_behind(fit: Fit) -> bool:
    """Return whether the bicycle follows the car better, where noise is not all that is left."""
    part, name = fit.confirm, POSE[0]
    if fit.witness is None or name not in part.after:
        return False
    now = part.after[name]
    return now > MAX_NOISE_RATIO * part.noise_floor[name] and now > fit.witness.position_m


def loses(fit: Fit) -> bool:
    """Return whether the bicycle follows the car so much better that the car was not found.

    Beyond what noise may change, and what the choice of windows may: they overlap by half, and the
    square of an error scatters by as much as its mean.
    """
    if fit.witness is None or not is_behind(fit):
        return False
    part, plain = fit.confirm, fit.witness.position_m
    by_choice = part.after[POSE[0]] ** 2 > (1.0 + chance_of(part)) * plain**2
    return by_choice and got_worse(part, POSE[0], plain, WORSE_THAN_WITNESS)


def failure_sentence(fit: Fit, effects: Sequence[str], handed_out: str) -> str:
    """Return by how much the bicycle is better, and which car is handed out instead.

    Args:
        fit: With a witness.
        effects: Names of those that were found.
        handed_out: Says of the given car what was done to it.
    """
    if fit.witness is None:
        return ""
    now, plain = fit.confirm.after[POSE[0]], fit.witness.position_m
    far, near = quantities((now, plain), "m")
    ratio = now / plain
    beyond = f"{100.0 * (ratio - 1.0):.0f} % farther than"
    beyond = beyond if ratio < TWICE else f"{short(ratio)} times as far as"
    with_them = f"with {joined([title_of(name) for name in effects])}"
    text = (
        f"The fit failed: after {quantity(fit.horizon_s, 's')} {UNSEEN}, the car "
        f"{with_them if effects else handed_out} is {far} off, "
        f"{beyond} a {bicycle_name(fit.witness)} ({near})."
    )
    return f"{text} It is not handed out: `car.toml` is the car {handed_out}." if effects else text


def reasons_of(best: Hypothesis, car: Car, fit: Fit, runs: FreeRuns) -> tuple[str, ...]:
    """Return what can be read off a fit that failed: numbers at their ends, and what is left."""
    return (*_at_ends(best, car), *_left(fit, runs))


def _at_ends(best: Hypothesis, car: Car) -> Iterator[str]:
    own, clocks = list[str](), list[str]()
    values = best.model.simulator.numbers(best.z)
    for number, z in zip(best.model.nominal, best.z, strict=True):
        value, low_high = values[number.key], number.bounds
        at_bound = abs(z) > 0.5 and value in low_high
        if abs(z) < NEAR_END * FARTHEST and not at_bound:
            continue
        if number.key in CLOCKS:
            clocks.append(f"{CLOCKS[number.key]} {quantity(abs(value), 's')}")
            continue
        given = car.value(number.key) if car.has(number.key) else number.mean
        unit = unit_text(best.model.simulator.unit(number.key))
        now = f"{short(value)} {unit}".rstrip()
        own.append(f"`{number.key}` {now} ({short(given)} ± {short(number.std)})")
    if own:
        yield (
            f"At an end of what the car file allows: {joined(own)}. The true numbers may lie "
            "beyond: give what nobody has measured a wider `std`."
        )
    if clocks:
        yield (
            f"At its bound: the clock of {joined(clocks)}. Stamps may be off by more, or a delay "
            "is missing."
        )


def _left(fit: Fit, runs: FreeRuns) -> Iterator[str]:
    shares = [
        f"{percent(one.share_of_error)} lies {SIDES[one.equation]} the way driven"
        for one in strayed(runs, fit)
    ]
    if shares:
        yield f"Of the position error that is left, {joined(shares)}."
    part = fit.confirm
    ratios = {
        _with_sensor(error_name(name)[0]): now / part.noise_floor[name]
        for name, now in part.after.items()
        if part.noise_floor.get(name, 0.0) > 0.0
    }
    order = sorted(ratios, key=lambda name: -ratios[name])
    far = [f"{name} {ratios[name]:.0f} times" for name in order if ratios[name] > MAX_NOISE_RATIO]
    if far:
        yield f"Far beyond measurement noise: {joined(far)}."


def _with_sensor(title: str) -> str:
    """Return an error's title whose sensor, if it names one, stands in brackets."""
    what, _, sensor = title.partition(", ")
    return f"{what} ({sensor})" if sensor else what
