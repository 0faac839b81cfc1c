"""The catalogue of known effects: every term and sensor fault that recordings can identify.

What a search needs of an effect stands in the effect's own file, as its `identification`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from scm.arrays import Bools
from scm.mismatch.findings import Equation
from scm.replay.drive import Drive, has_distance, has_odometer
from scm.vehicles.car import Car, all_terms
from scm.vehicles.identification import Identification
from scm.vehicles.param import Param
from scm.vehicles.sensor_fault import SensorFault, all_sensor_faults
from scm.vehicles.term import Term, flat

PATCH, SPOTS_ACROSS = "surface_patch", 7
FIRST = (
    "drive_delay", "drive_lag", "drive_soft_start", "drive_deadband", "drive_gain", "motor_gain",
    "drive_curve", "drive_asymmetry", "battery_sag", "motor_fade", "rolling_resistance", "stiction",
    "viscous_drag", "aero_drag", "corner_drag", "payload", "grade", "wind", "com_shift",
    "load_transfer", "surface_patch", "steer_trim", "steer_gain", "steer_saturation",
    "steer_backlash", "steer_delay", "steer_lag", "steer_rate", "steer_compliance", "understeer",
    "tyre_stiffness", "tyre_grip", "tyre_relaxation", "pose_latency", "clock_offset",
    "clock_drift", "pose_scale", "camera_tilt", "pose_point", "pose_heading", "wheel_radius",
    "encoder_loss", "gyro_bias", "gyro_scale", "speed_scale", "accel_bias", "imu_misalignment",
)  # fmt: skip
"""The order in which effects are tried; others follow by name. No result depends on it."""


NEARLY_ALL = 0.95  # of a number that stays above 0


@dataclass(frozen=True, slots=True)
class Parameter:
    """One free number of an effect.

    Attributes:
        name: As it is reported; `key` of the car file that it moves, times `per_unit`.
        neutral: Where the effect does nothing.
        step: A change that shows, for derivatives.
        given: What the car file says of the key; an effect is reported as what is added to it.
        ties: Other keys that move with it, and how much for one unit.
        own: Key of the car's own number that means the same; empty: there is none.
    """

    name: str
    key: str
    unit: str
    bounds: tuple[float, float]
    neutral: float
    step: float
    per_unit: float = 1.0
    given: float = 0.0
    ties: tuple[tuple[str, float], ...] = ()
    own: str = ""


@dataclass(frozen=True, slots=True)
class Candidate:
    """One effect that may be missing.

    Attributes:
        starts: Values of its parameters to begin from, in their order.
        sentence: One sentence for a mechanic; braces take the parameters by name.
        rare: What it must gain beyond others: it looks like something that happens more often.
        like: The effect that cancels it on a level floor.
        shared: What several cars may share of it: `camera`, `tags` or `floor`.
    """

    name: str
    equation: Equation
    depends_on: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    starts: tuple[tuple[float, ...], ...]
    sentence: str
    rare: float = 0.0
    like: str = ""
    shared: str = ""

    @property
    def is_placed(self) -> bool:
        """Whether a parameter is a place or direction rather than an amount."""
        return not self.amounts.all()

    @property
    def amounts(self) -> Bools:
        """Which parameters say how much, and not where or which way, (parameters,)."""
        where = {"uphill_rad", "since_s", "until_s"}
        if any(parameter.name == "radius_m" for parameter in self.parameters):
            where |= {"x_m", "y_m", "radius_m"}
        return np.array([parameter.name not in where for parameter in self.parameters])

    @property
    def replaces_own(self) -> bool:
        """Whether its numbers take the place of the car's own of the same key."""
        return True

    def numbers(self, values: tuple[float, ...]) -> dict[str, float]:
        """Return the numbers by key that its parameters at these values mean."""
        found = dict[str, float]()
        for parameter, value in zip(self.parameters, values, strict=True):
            found[parameter.key] = parameter.given + value * parameter.per_unit
            for key, factor in parameter.ties:
                found[key] = value * factor
        return found


def shown_by(found: tuple[Candidate, ...], drives: Sequence[Drive]) -> tuple[Candidate, ...]:
    """Return the candidates that these drives are fast enough, and measured enough, to show."""
    fast, hard = 0.0, 0.0
    for drive in drives:
        speed, yaw = drive.pose_speed, drive.smoothed["pose.yaw"]
        turning = np.abs(yaw.rate_at(drive.smoothed["pose.x"].t))
        fast = max(fast, float(np.percentile(speed, 95)))
        hard = max(hard, float(np.percentile(speed * turning, 95)))
    odometer = any(map(has_odometer, drives))
    distance = any(map(has_distance, drives))
    known = identifications()
    return tuple(
        c for c in found
        for needs in (known[c.name],)
        if fast >= needs.needs_mps and hard >= needs.needs_m_s2
        and (odometer or not needs.needs_odometer)
        and (distance or not needs.needs_distance)
    )  # fmt: skip


def placed(found: Sequence[Candidate], drives: Sequence[Drive]) -> tuple[Candidate, ...]:
    """Return candidates with a spot of floor given spots to begin from, where the car was."""
    return tuple(p for c in found for p in (_spots(c, drives) if c.name == PATCH else (c,)))


def _spots(patch: Candidate, drives: Sequence[Drive]) -> tuple[Candidate, ...]:
    """Return a spot of other grip and one of other rolling resistance, from cells of the way."""
    x, y = (
        np.concatenate([d.smoothed[name].at(d.stream("pose.x").t) for d in drives])
        for name in ("pose.x", "pose.y")
    )
    cell = max(float(np.ptp(x)), float(np.ptp(y))) / SPOTS_ACROSS
    cells = np.stack((np.round(x / cell), np.round(y / cell)))
    centres = np.unique(cells, axis=1).T * cell
    parameters = {parameter.name: parameter for parameter in patch.parameters}
    where = (
        replace(parameters["x_m"], bounds=(float(x.min()), float(x.max()))),
        replace(parameters["y_m"], bounds=(float(y.min()), float(y.max()))),
        replace(parameters["radius_m"], bounds=(0.3 * cell, 3.0 * cell)),
    )
    return tuple(
        replace(
            patch,
            parameters=(*where, parameters[name]),
            starts=tuple((float(cx), float(cy), cell, value) for cx, cy in centres),
            sentence=f"A spot of floor near ({{x_m}}, {{y_m}}), {{radius_m}} in radius, {words}.",
        )
        for name, value, words in (
            ("grip", 0.6, "has {grip} of the grip around it"),
            ("rolling", 0.04, "has a rolling resistance {rolling} above the rest"),
        )
    )


@cache
def identifications() -> Mapping[str, Identification]:
    """Return how each effect of the catalogue is identified, by name, in the order of trying."""
    every: dict[str, Term | SensorFault] = {**all_terms(), **all_sensor_faults()}
    names = [*FIRST, *sorted(every.keys() - set(FIRST))]
    return {n: one for n in names if n in every and (one := every[n].identification)}


def terms_needed(car: Car) -> list[str]:
    """Return the effects that a car must have, at neutral numbers, for every candidate to act.

    Delays are left out: they are laid on the recorded commands.
    """
    known, have = all_terms(), {term.name for term in car.terms}
    names = [
        name for name, how in identifications().items()
        if name in known and name not in have and not how.only_with
    ]  # fmt: skip
    setters = {t.sets for t in car.terms if t.sets}
    return [
        name
        for name in names
        if name not in ("drive_delay", "steer_delay")
        and not setters & {t.sets for t in flat([known[name]]) if t.sets}
    ]


@cache
def params_of(name: str) -> tuple[Mapping[str, Param], Mapping[str, float]]:
    """Return an effect's parameters and where they do nothing, by reported name; {}: unknown."""
    every: dict[str, Term | SensorFault] = {**all_terms(), **all_sensor_faults()}
    one = every.get(name)
    parts = () if one is None else (one,) if isinstance(one, SensorFault) else flat([one])
    params = {p.reported: p for part in parts for p in part.params}
    at_rest = {key: value for part in parts for key, value in (part.neutral or {}).items()}
    return params, {n: at_rest.get(p.name, p.default) for n, p in params.items()}


def candidates(car: Car, *, beside: bool = False) -> tuple[Candidate, ...]:
    """Return every candidate that makes sense for a car.

    Args:
        car: Given.
        beside: Instead those that it lacks and that are searched for only beside one that it has.
    """
    found, have = list[Candidate](), {term.name for term in car.terms}
    for name, how in identifications().items():
        if bool(how.only_with) != beside or (
            beside and (how.only_with not in have or name in have)
        ):
            continue
        params, neutral = params_of(name)
        wanted = [p for n, p in params.items() if p.fit and n in (how.parameters or params)]
        parameters = tuple(
            _parameter(car, name, how, param, neutral[param.reported], step)
            for param, step in zip(wanted, how.steps, strict=True)
        )
        equation = Equation(how.equation)
        one = Candidate(
            name, equation, how.depends_on, parameters, how.starts, how.sentence, how.rare,
            how.like, how.shared,
        )  # fmt: skip
        found.append(one)
        if how.also_moves:
            tied = replace(parameters[0], ties=tuple(how.also_moves.items()))
            found.append(replace(one, parameters=(tied, *parameters[1:]), rare=0.0))
    return tuple(found)


def _parameter(
    car: Car, name: str, how: Identification, param: Param, neutral: float, step: float
) -> Parameter:
    key, per_unit, given = param.key, 1.0, 0.0
    fault = all_sensor_faults().get(name)
    if fault is not None and fault.stands_for:
        key, per_unit = fault.stands_for, car.value(fault.stands_for)
    if how.adds and car.has(param.key):
        given, neutral = car.value(param.key), 0.0
    low, high = how.bounds.get(param.reported, param.bounds)
    if how.stays_above and car.has(how.stays_above):
        low = max(low, -NEARLY_ALL * car.value(how.stays_above))
    return Parameter(
        param.reported, key, param.unit, (low - given, high - given), neutral, step, per_unit,
        given, own=how.own,
    )  # fmt: skip
