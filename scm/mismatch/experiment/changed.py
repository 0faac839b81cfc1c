"""Experiments that change more than the commands, where no drive separates the explanations.

To add one: a function of the nominal car and the pace, and its line in `CHANGED`.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from scm.mismatch.experiment import manoeuvres
from scm.mismatch.experiment.manoeuvres import Manoeuvre
from scm.mismatch.experiment.pace import Pace
from scm.mismatch.experiment.plan import Change, Leg, Numbers
from scm.vehicles.car import Car

SLOPE, GENTLE = 0.1, 0.05
RAMP_M = 2.0
COOLING_S = 180.0  # a motor's heat is 95 % gone
HEADED = ("grade.slope", "wind.force_x_n", "surface_patch.x_m", "measure.pose_scale",
          "measure.camera_tilt_x_per_m")  # fmt: skip
HEATED = ("drive.fade", "drive.sag_per_min")
WHEELS = ("wheel.radius_m", "tyre_stiffness.scale", "tyre_grip.scale", "tyre_relaxation.length_m")


@dataclass(frozen=True, slots=True)
class Experiment:
    """What to do with the car.

    Attributes:
        preparation: What to do before the drive, the beginning of its sentence.
        only_for: Keys of numbers of which an explanation must have one; empty: for all.
    """

    name: str
    legs: tuple[Leg, ...]
    preparation: str = ""
    only_for: tuple[str, ...] = ()


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
    return Experiment("slope", (Leg(manoeuvres.circles, _tilted(GENTLE)),), text)


def _climb(pace: Pace) -> Manoeuvre:
    short = replace(pace, run_m=min(pace.run_m, RAMP_M))
    return replace(manoeuvres.straight_steps(short), name="throttle steps on a ramp")


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
    legs = (Leg(manoeuvres.straight_steps), Leg(manoeuvres.straight_steps, loaded))
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
    legs = (Leg(manoeuvres.shuttle), Leg(manoeuvres.shuttle, turned=True))
    return Experiment("rotated course", legs, text, HEADED)


def other_wheels(car: Car) -> Experiment:
    """The same drive on the wheels as they are, and on a set that was measured."""
    neutral = {"wheel.radius_m": car.value("wheel.radius_m"), "tyre_stiffness.scale": 1.0,
               "tyre_grip.scale": 1.0, "tyre_relaxation.length_m": 0.0}  # fmt: skip

    def change(numbers: Numbers, _yaw: float) -> Numbers:
        return {k: neutral.get(k, v) for k, v in numbers.items()}

    text = "drive twice, the second time on new wheels whose radius was measured; both times: "
    legs = (Leg(manoeuvres.circles), Leg(manoeuvres.circles, change))
    return Experiment("other wheels", legs, text, WHEELS)


def cooled(_car: Car) -> Experiment:
    """Laps, a rest in which motors cool, and the same laps."""

    def build(pace: Pace) -> Manoeuvre:
        laps = manoeuvres.long_laps(pace)
        before, drive, _, again, after = laps.pieces
        text = laps.text.replace("rest for 30 s", f"rest for {COOLING_S:g} s")
        return Manoeuvre(
            "laps, three minutes of rest, laps",
            (before, drive, (COOLING_S, 0.0, 0.0), again, after), text,
        )  # fmt: skip

    return Experiment("rest", (Leg(build),), "", HEATED)


CHANGED: Mapping[str, Callable[[Car], Experiment]] = {
    "ramp": ramp,
    "slope": slope,
    "known_mass": known_mass,
    "ramp_and_mass": ramp_and_mass,
    "rotated": rotated,
    "other_wheels": other_wheels,
    "cooled": cooled,
}
