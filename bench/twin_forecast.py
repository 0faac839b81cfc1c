"""Whether the stopping distance forecast for a changed car comes true, and red lights overrun.

    python -m bench twin_forecast [--cars 30] [--seed 3201] [--equations]
        [--any-effect | --red-lights]

Cars of `tests/reality`, whose ordinary numbers are not the file's, drive for 120 s with one effect
concealed. A car file is found as by `scm mismatch`, which need not search for the effect's name
(`--any-effect`: it must; 2 minutes of processor time a car instead of a quarter). Its forecast
has a 90 % interval. Then the same car loses its throttle at ordinary speed. `--equations`: each
car's tyres, springs, motors and friction obey other equations too (`tests/reality/family.py`).

Red lights: the yellow begins while a car is 0 to 0.5 m before the line. Its driver goes on where it
could not stop comfortably; else it lets go of the throttle as late as that allows. Who passes the
line after the yellow overran a red light. The driver reckons with the car as it came, or as the
version in force says; the yellow is as given by hand, or follows that version. With `--red-lights`
no car file is found: the version says what the car does, 10 % more or less.
"""

import argparse
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time

import numpy as np

from scm.arrays import Floats
from scm.errors import ScmError
from scm.maps.load import load_map
from scm.mismatch.budget import Budget
from scm.mismatch.findings import Fit
from scm.mismatch.select.round import extend, fit_with_noise
from scm.mismatch.select.search import Selection
from scm.mismatch.select.selected import Nominal, Selected, fit_nominal, select_effects
from scm.mismatch.usable_data import check
from scm.mismatch.validate.conclude import conclude
from scm.mismatch.validate.explain import effect_of
from scm.mismatch.validate.found_car import CarFiles
from scm.mismatch.validate.free_runs import judge
from scm.recorder.drives import recordings_of_one
from scm.records.twins import TwinParameter, TwinVersion
from scm.study.statistics import wilson
from scm.traffic.signals.changed_cars import ChangedCars
from scm.traffic.signals.program import whole_steps_ns
from scm.traffic.signals.timing import NIGEL, CarFacts, yellow_s
from scm.twin.abilities import CRUISE_THROTTLE, compared_abilities
from scm.v2x.messages.twin_status import TwinStatus
from scm.vehicles.car import Car, load_car
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.drivers.stop_lines import STOP_MARGIN
from tests.reality.cases import FAULTS, apply, draw_effects, nominal, scattered
from tests.reality.family import draw_family, equations
from tests.reality.motion import COMMAND_S, ROW, ROW_S, Moving
from tests.reality.recorded import record, write
from vehicle_agent.changed_car import changed_car

CAR, LASTS_S = "nigel", 120.0
STRENGTHS = {
    "drive_delay": (2.0, 35.0), "drive_lag": (2.0, 30.0), "drive_gain": (2.0, 6.0),
    "payload": (1.0, 4.0), "rolling_resistance": (1.0, 4.0), "viscous_drag": (1.0, 3.0),
}  # fmt: skip
"""In multiples of what 90 s can show; a delay has to be long for a car to need a yellow."""
APPROACHES_M = np.linspace(0.0, 0.5, 501)
MAP = load_map("driving_school")


@dataclass(frozen=True)
class Stop:
    """A car that loses its throttle at ordinary speed.

    Attributes:
        speed: When it does [m/s].
        way: From then on, every `ROW_S` (n,) [m].
    """

    speed: float
    way: Floats


def stop_of(numbers: dict[str, float]) -> Stop:
    """Let a car of `tests/reality` drive at the throttle of ordinary driving, and let go."""
    on, off = round(3.0 / COMMAND_S), round(3.0 / COMMAND_S)
    car = Moving(numbers, (0.0, 0.0, 0.0), on + off)
    rows = [car.command(k, CRUISE_THROTTLE if k < on else 0.0, 0.0) for k in range(on + off)]
    table = np.concatenate(rows)
    x, y = (table[:, ROW.index(name)] for name in "xy")
    let_go = sum(map(len, rows[:on])) - 1
    way = np.hypot(x[let_go:] - x[let_go], y[let_go:] - y[let_go])
    return Stop(float(table[let_go, ROW.index("vx")]), way)


def forecast(
    numbers: dict[str, float], faults: dict[str, float], name: str, rng: np.random.Generator,
    *, any_effect: bool,
) -> tuple[TwinParameter, ...]:  # fmt: skip
    """Return what the car file that is found says of a car; none: none was found."""
    car = load_car(CAR)
    with tempfile.TemporaryDirectory() as folder:
        write(record(CAR, numbers, faults, LASTS_S, rng), CAR, nominal(CAR), Path(folder))
        recordings = recordings_of_one(Path(folder))
        data = check(recordings, car, LASTS_S)
    try:
        found = fit_nominal(data.recordings, car, Budget(), lambda _: None)
        if any_effect:
            result = conclude(select_effects(found), lambda _: None)
            now, fit = result.found_car, result.diagnosis.fit
        else:
            now, fit = with_effect(found, name)
    except ScmError:
        return ()
    return () if now is None or now is car else compared_abilities(car, now, fit)


def with_effect(found: Nominal, name: str) -> tuple[Car, Fit]:
    """Return the car file with an effect's numbers fitted, and how well it follows the drive."""
    only = tuple(one for one in found.context.catalogue if one.name == name)
    context = replace(found.context, catalogue=only, changes=False)
    tried = extend(context, found.retuned)
    best = fit_with_noise(context, next(iter(tried.alternatives), found.retuned))
    selected = Selected(
        found.recordings, found.drives, found.car, context, found.parts,
        Selection(best, found.retuned, (tried,)), (),
    )  # fmt: skip
    effects = [effect_of(selected, best, effect) for effect in best.effects]
    now = CarFiles(found.car, ("drive",)).written(best, effects)
    return now, judge(found.drives, found.car, now, found.parts)[0]


def with_other_equations(numbers: dict[str, float], rng: np.random.Generator) -> dict[str, float]:
    """Return a car's numbers with those of equations drawn for it."""
    return numbers | equations(draw_family("drawn", (), rng), CAR, numbers, rng)


def overran(stop: Stop, decel_mps2: float, yellow: float) -> Floats:
    """Return for each approach whether the car passes the line after the yellow."""
    v, braking_m = stop.speed, stop.speed**2 / (2.0 * decel_mps2)
    goes = v * NIGEL.reaction_s + braking_m > APPROACHES_M
    begins_s = np.maximum(NIGEL.reaction_s, (APPROACHES_M - braking_m - STOP_MARGIN) / v)
    left_m = APPROACHES_M - v * begins_s
    rolls_s = ROW_S * np.searchsorted(stop.way, left_m)
    passes_s = np.where(goes, APPROACHES_M / v, begins_s + rolls_s)
    passes = goes | (stop.way[-1] > left_m)
    return np.asarray(passes & (passes_s > yellow))


def known(stop: Stop) -> tuple[TwinParameter, ...]:
    """Return what a version would say that knows the car to 10 %."""
    before = stop_of(nominal(CAR))
    rows = (
        ("cruise_mps", stop.speed, before.speed), ("stopping_m", stop.way[-1], before.way[-1])
    )  # fmt: skip
    return tuple(
        TwinParameter(name=name, low=0.9 * now, value=now, high=1.1 * now, before=was)
        for name, now, was in rows
    )


def yellow_of(facts: CarFacts) -> float:
    """Return the yellow that signals show [s]."""
    return whole_steps_ns(yellow_s(facts)) / 1e9


def red_lights(stop: Stop, abilities: tuple[TwinParameter, ...]) -> tuple[float, float, float]:
    """Return the shares of approaches that overrun: before, signals follow, and the driver too."""
    version = TwinVersion(
        number=1, car=CAR, file="", made_ns=0, state="adopted", abilities=abilities
    )
    status = TwinStatus(
        vehicle="n", t_ns=0, car=CAR, state="watching", driven_s=0.0, version=1, versions=(version,)
    )
    cars = ChangedCars(NIGEL)
    cars.receive(status)
    given = limits_of(load_car(CAR))
    driver = changed_car(status, given, MAP)
    follows = yellow_of(cars.worst)
    rows = (
        (given.decel, yellow_of(NIGEL)), (given.decel, follows), (driver.limits.decel, follows)
    )  # fmt: skip
    before, signals, both = (float(overran(stop, *row).mean()) for row in rows)
    return before, signals, 0.0 if driver.unfit else both


@dataclass(frozen=True)
class Driven:
    """A car whose stop was forecast.

    Attributes:
        way, speed: Forecast.
        reds: Shares of approaches that overrun, as `red_lights` returns.
    """

    stop: Stop
    way: TwinParameter
    speed: TwinParameter
    reds: tuple[float, float, float]

    @property
    def is_inside(self) -> bool:
        """Whether the way lies in the interval."""
        return self.way.low <= self.stop.way[-1] <= self.way.high

    def __str__(self) -> str:
        return (
            f"forecast {1e3 * self.way.low:.1f} to {1e3 * self.way.high:.1f}"
            f"{'' if self.is_inside else ' MISSED'}; {self.stop.speed:.4f} m/s, forecast "
            f"{self.speed.low:.4f} to {self.speed.high:.4f}; "
            f"red {', '.join(f'{share:.3f}' for share in self.reds)}"
        )


def drive(given: argparse.Namespace, number: int) -> Driven | None:
    """Print how a car's stop was forecast; return it, or None where no car file was found."""
    rng, begun_s, names = np.random.default_rng([given.seed, number]), process_time(), [*STRENGTHS]
    name = names[number % len(names)]
    usual = scattered(nominal(CAR), rng)
    if given.equations:
        usual = with_other_equations(usual, rng)
    effects = draw_effects((name,), CAR, STRENGTHS[name], rng)
    numbers, faults = apply(usual, effects), apply(FAULTS, effects)
    stop = stop_of(numbers)
    abilities = (
        known(stop)
        if given.red_lights
        else forecast(numbers, faults, name, rng, any_effect=given.any_effect)
    )
    by_name = {one.name: one for one in abilities}
    found = None
    if abilities:
        way, speed = by_name["stopping_m"], by_name["cruise_mps"]
        found = Driven(stop, way, speed, red_lights(stop, abilities))
    head = f"{number:<4}{name:<20}{effects[0][1]:5.1f}  needs {1e3 * stop.way[-1]:6.1f} mm"
    text = "no car file was found" if found is None else str(found)
    print(f"{head}, {text}; {process_time() - begun_s:.0f} s", flush=True)
    return found


def summarise(cars: list[Driven]) -> None:
    """Print what all cars are together."""
    inside = sum(one.is_inside for one in cars)
    fast = sum(one.speed.low <= one.stop.speed <= one.speed.high for one in cars)
    _, low, high, _ = wilson(inside, len(cars))
    widths = np.array([one.way.high - one.way.low for one in cars])
    shares = widths / [one.stop.way[-1] for one in cars]
    before, signals, both = np.mean([one.reds for one in cars], axis=0)
    print(
        f"\nin the interval of 90 %: {inside} of {len(cars)} ({low:.2f} to {high:.2f}), as wide as "
        f"{1e3 * np.median(widths):.1f} mm, {np.median(shares):.2f} of the way (medians); "
        f"speeds: {fast} of {len(cars)}\n"
        f"approaches that overrun a red light: {before:.4f} before, {signals:.4f} when signals "
        f"follow, {both:.4f} when the driver does too"
    )


def main() -> None:
    """Print a row a car, and what they are together."""
    parser = argparse.ArgumentParser(prog="python -m bench twin_forecast", description=__doc__)
    parser.add_argument("--cars", type=int, default=30)
    parser.add_argument("--seed", type=int, default=3201)
    parser.add_argument("--equations", action="store_true", help="draw each car's equations")
    only = parser.add_mutually_exclusive_group()
    only.add_argument("--any-effect", action="store_true", help="search for the effect as well")
    only.add_argument("--red-lights", action="store_true", help="find no car file")
    given = parser.parse_args()
    cars = [one for number in range(given.cars) if (one := drive(given, number)) is not None]
    if cars:
        summarise(cars)


if __name__ == "__main__":
    main()
