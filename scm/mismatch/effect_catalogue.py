"""The effects that a search may propose, each with where it acts, where to begin, and its sentence.

Numbers, bounds and units are those of the effect's own file; what stands here is what only a search
needs. A sentence's braces take the effect's reported parameters.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from scm.arrays import Bools
from scm.errors import TermError
from scm.mismatch.findings import Equation
from scm.replay.drive import Drive, has_odometer
from scm.replay.numbers import Numbers
from scm.vehicles.car import Car, all_terms
from scm.vehicles.param import Param
from scm.vehicles.sensor_fault import all_sensor_faults
from scm.vehicles.term import flat

PATCH, SPOTS_ACROSS = "surface_patch", 7
POINT_X = "measure.pose_point_x_m"


@dataclass(frozen=True, slots=True)
class Parameter:
    """One free number of an effect.

    Attributes:
        name: As it is reported; `key` of the car file that it moves, times `per_unit`.
        neutral: Where the effect does nothing.
        step: A change that shows, for derivatives.
        given: What the car file says of the key; an effect is told as what is added to it.
        ties: Other keys that move with it, and how much for one unit.
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


@dataclass(frozen=True, slots=True)
class Candidate:
    """One effect that may be missing.

    Attributes:
        starts: Values of its knobs to begin from, in their order.
        sentence: One sentence for a mechanic; braces take the knobs by name.
        rare: What it must gain beyond others: twins of something that happens more often.
    """

    name: str
    equation: Equation
    depends_on: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    starts: tuple[tuple[float, ...], ...]
    sentence: str
    rare: float = 0.0

    @property
    def is_placed(self) -> bool:
        """Whether a knob says where or which way, and not how much."""
        return not self.amounts.all()

    @property
    def amounts(self) -> Bools:
        """Which knobs say how much, and not where or which way, (knobs,)."""
        where = {"uphill_rad"}
        if any(parameter.name == "radius_m" for parameter in self.parameters):
            where |= {"x_m", "y_m", "radius_m"}
        return np.array([parameter.name not in where for parameter in self.parameters])

    def numbers(self, values: tuple[float, ...]) -> dict[str, float]:
        """Return the numbers by key that its knobs at these values mean."""
        found = dict[str, float]()
        for parameter, value in zip(self.parameters, values, strict=True):
            found[parameter.key] = parameter.given + value * parameter.per_unit
            for key, factor in parameter.ties:
                found[key] = value * factor
        return found


D, S, T, B, F, M = Equation
_SIX = ((0.02,), (-0.02,), (0.08,), (-0.08,))
_TIMES, _PLAYS = ((0.02,), (0.04,), (0.08,), (0.16,)), ((0.015,), (0.04,), (0.1,))
_GAINS = ((0.9,), (1.1,), (0.75,), (1.3,))
_Row = tuple[str, Equation, tuple[str, ...], tuple[tuple[float, ...], ...], tuple[float, ...], str]
_TABLE: tuple[_Row, ...] = (
    ("drive_delay", D, ("throttle",), _TIMES, (0.01,),
     "The motor answers the throttle {delay_s} late."),
    ("drive_lag", D, ("throttle",), _TIMES, (0.01,),
     "The motor follows the throttle sluggishly, with a time constant of {time_constant_s}."),
    ("drive_deadband", D, ("throttle",), _PLAYS, (0.01,),
     "Throttle below {threshold} does nothing."),
    ("drive_gain", D, ("throttle",), _GAINS, (0.02,),
     "The car drives as if the throttle were {gain} of the command."),
    ("motor_gain", D, ("torque",), _GAINS, (0.03,),
     "The motors give {gain} of their torque."),
    ("drive_curve", D, ("throttle",), ((0.2,), (-0.2,)), (0.03,),
     "Throttle and drive are not proportional: curvature {curvature}."),
    ("drive_asymmetry", D, ("side",), ((0.05,), (-0.05,), (0.15,), (-0.15,)), (0.02,),
     "The left motor pulls {difference} more than nominal, the right one as much less."),
    ("battery_sag", D, ("time",), ((0.03,), (0.12,)), (0.01,),
     "The drive weakens by {fraction_per_min} a minute, as a battery that runs down."),
    ("motor_fade", D, ("load", "time"), ((0.1,), (0.3,)), (0.03,),
     "The motors lose up to {fraction} of their drive as they warm up."),
    ("rolling_resistance", D, ("constant",), ((0.01,), (0.03,), (0.08,)), (0.005,),
     "Rolling resistance is {coefficient} of the weight."),
    ("stiction", D, ("speed",), ((0.02,), (0.06,), (0.15,)), (0.01,),
     "Near standstill the driven wheels stick with {torque_nm} more than the model knows."),
    ("viscous_drag", B, ("speed",), ((0.4,), (1.5,), (4.0,)), (0.1,),
     "Something brakes the car in proportion to its speed, {coefficient}."),
    ("aero_drag", B, ("speed",), ((0.1,), (0.5,)), (0.05,),
     "Something brakes the car with the square of its speed, {coefficient}."),
    ("corner_drag", B, ("steering angle", "speed"), ((0.3,), (1.0,)), (0.1,),
     "Turning the wheels brakes the car: coefficient {coefficient}."),
    ("payload", B, ("acceleration",), ((0.3,), (1.0,), (2.5,)), (0.1,),
     "The car carries {mass_kg} more than its file says."),
    ("grade", B, ("heading",), tuple((0.02, a) for a in (0.0, 1.57, 3.14, -1.57)), (0.005, 0.1),
     "The floor rises by {slope} towards {uphill_rad} from world x."),
    ("wind", B, ("heading",), ((0.2, 0.0), (-0.2, 0.0), (0.0, 0.2), (0.0, -0.2)), (0.05, 0.05),
     "A steady push of {force_x_n} and {force_y_n} along the floor's x and y."),
    ("com_shift", B, ("lateral acceleration",), ((0.015,), (-0.015,), (0.05,), (-0.05,)), (0.005,),
     "The centre of gravity lies {shift_m} further forward than the file says."),
    ("load_transfer", T, ("lateral acceleration",), ((0.05,), (-0.03,)), (0.01,),
     "Load moves between the wheels as if the centre of gravity were {height_m} higher."),
    ("surface_patch", F, ("position",), (), (0.1, 0.1, 0.05, 0.1, 0.01),
     "A spot of floor near ({x_m}, {y_m}), {radius_m} in radius, has grip {grip} and rolling "
     "resistance {rolling}."),
    ("steer_trim", S, ("constant",), _SIX, (0.005,),
     "The wheels stand {offset_rad} to the left when the command is straight ahead."),
    ("steer_gain", S, ("steering",), _GAINS, (0.02,),
     "The wheels turn by {gain} of the commanded angle."),
    ("steer_saturation", S, ("steering",), ((0.7, 1.0), (1.0, 0.7), (0.7, 0.7)), (0.02, 0.02),
     "The steering ends at {left} of full lock on the left and {right} on the right."),
    ("steer_backlash", S, ("steering history",), _PLAYS, (0.01,),
     "The steering has {width_rad} of play."),
    ("steer_delay", S, ("steering",), _TIMES, (0.01,),
     "The steering answers {delay_s} late."),
    ("steer_lag", S, ("steering",), _TIMES, (0.01,),
     "The steering follows sluggishly, with a time constant of {time_constant_s}."),
    ("steer_rate", S, ("steering",), ((0.5,), (0.75,), (1.5,)), (0.05,),
     "The steering servo turns at {scale} of its nominal rate."),
    ("steer_compliance", S, ("lateral force",), ((0.03,), (0.1,), (0.3,)), (0.01,),
     "The front wheels give way under side force, {rad_per_weight} for the car's weight."),
    ("understeer", S, ("lateral acceleration",), ((0.01,), (0.05,)), (0.003,),
     "The car turns less the faster it corners: {gradient}."),
    ("tyre_stiffness", T, ("slip",), ((0.4,), (0.7,), (1.5,)), (0.05,),
     "The tyres answer side slip with {scale} of their nominal stiffness."),
    ("tyre_grip", T, ("slip",), ((0.7,), (1.2,)), (0.05,),
     "The tyres hold {scale} of their nominal side force."),
    ("tyre_relaxation", T, ("slip history",), ((0.05,), (0.15,), (0.4,)), (0.02,),
     "The tyres build up side force only after rolling {length_m}."),
    ("pose_latency", M, ("speed",), _TIMES, (0.01,),
     "The camera's poses are {delay_s} old when they are stamped."),
    ("clock_offset", M, ("speed",), ((-0.02,), (-0.04,), (-0.1,)), (0.01,),
     "The poses' clock is {offset_s} against the car's: commands and sensors are stamped late."),
    ("clock_drift", M, ("time",), ((0.003,), (-0.003,)), (0.0005,),
     "The camera's clock runs fast by {rate}."),
    ("pose_scale", M, ("position",), ((1.02,), (0.98,)), (0.005,),
     "The camera shows {scale_cm} for every 100 cm on the floor."),
    ("camera_tilt", M, ("position",), ((0.03, 0.0), (-0.03, 0.0), (0.0, 0.03), (0.0, -0.03)),
     (0.005, 0.005),
     "The camera looks askew: its scale changes by {tilt_x} along x and {tilt_y} along y."),
    ("pose_point", M, ("yaw rate",), ((0.03, 0.0), (-0.03, 0.0), (0.0, 0.02)), (0.005, 0.005),
     "The tracked point lies {x_m} ahead and {y_m} left of where it is said to be."),
    ("pose_heading", M, ("constant",), ((0.02,), (-0.02,)), (0.005,),
     "The camera's heading is off by {offset_rad}."),
    ("wheel_radius", M, ("wheel",), ((1.03,), (0.97,)), (0.005,),
     "The wheels roll as if their radius were {scale} of the nominal one."),
    ("encoder_loss", M, ("wheel",), ((0.03,), (0.1,)), (0.01,),
     "The encoders lose {fraction} of their counts."),
    ("gyro_bias", M, ("constant",), ((0.02,), (-0.02,)), (0.005,),
     "The gyro reads {bias_rad_s} too much."),
    ("gyro_scale", M, ("yaw rate",), ((1.03,), (0.97,)), (0.01,),
     "The gyro shows {scale} of the true yaw rate."),
    ("speed_scale", M, ("speed",), ((1.03,), (0.97,)), (0.005,),
     "The speed sensor shows {scale} of the true speed."),
    ("accel_bias", M, ("constant",), ((0.1, 0.0), (0.0, 0.1)), (0.02, 0.02),
     "The accelerometer reads {x_mps2} and {y_mps2} too much along and across."),
    ("imu_misalignment", M, ("acceleration",), ((0.05,), (-0.05,)), (0.01,),
     "The IMU is turned by {angle_rad} in the car."),
)  # fmt: skip
LIMITS: Mapping[str, tuple[float, float]] = {
    "steering.stop_left": (0.3, 1.0), "steering.stop_right": (0.3, 1.0),
    "tyre_stiffness.scale": (0.2, 4.0), "tyre_grip.scale": (0.2, 2.0),
    "measure.clock_offset_s": (-0.3, 0.0),  # its other sign is the camera's latency
    "payload.mass_kg": (0.0, 20.0), "wind.force_x_n": (-20.0, 20.0),
}  # fmt: skip


SHOWS_ABOVE: Mapping[str, tuple[float, float]] = {
    "load_transfer": (0.0, 1.0), "tyre_stiffness": (0.0, 1.0), "tyre_grip": (0.0, 1.0),
    "tyre_relaxation": (0.0, 0.5), "com_shift": (0.0, 1.0), "steer_compliance": (0.0, 0.5),
    "understeer": (0.0, 0.5), "aero_drag": (0.5, 0.0),
}  # fmt: skip
"""Speed [m/s] and side acceleration [m/s^2] that a drive must reach to show an effect at all."""


RARE: Mapping[str, float] = {
    "motor_gain": 14.0,
    "drive_curve": 10.0,
    "load_transfer": 6.0,
    "grade": 4.0,  # of which wheels askew are a twin, for a car that drives one way
    "wind": 10.0,
    "tyre_grip": 4.0,
}


def shown_by(found: tuple[Candidate, ...], drives: Sequence[Drive]) -> tuple[Candidate, ...]:
    """Return the candidates that these drives are fast enough to show."""
    fast, hard = 0.0, 0.0
    for drive in drives:
        speed, yaw = drive.pose_speed, drive.smoothed["pose.yaw"]
        turning = np.abs(yaw.rate_at(drive.smoothed["pose.x"].t))
        fast = max(fast, float(np.percentile(speed, 95)))
        hard = max(hard, float(np.percentile(speed * turning, 95)))
    needs = {c.name: SHOWS_ABOVE.get(c.name, (0.0, 0.0)) for c in found}
    return tuple(
        c for c in found
        if fast >= needs[c.name][0] and hard >= needs[c.name][1]
        and (c.name != "speed_scale" or any(has_odometer(drive) for drive in drives))
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


def terms_needed(car: Car) -> list[str]:
    """Return the effects that a car must have, at neutral numbers, for every candidate to act.

    Delays are left out: they are laid on the recorded commands.
    """
    known = all_terms()
    have = {term.name for term in car.terms}
    names = [row[0] for row in _TABLE if row[0] in known and row[0] not in have]
    setters = {t.sets for t in car.terms if t.sets}
    return [
        name
        for name in names
        if name not in ("drive_delay", "steer_delay")
        and not setters & {t.sets for t in flat([known[name]]) if t.sets}
    ]


@cache
def _params(name: str) -> tuple[dict[str, Param], Mapping[str, float]]:
    if name in all_sensor_faults():
        measure = all_sensor_faults()[name]
        return {p.reported: p for p in measure.params}, measure.neutral
    term = all_terms()[name]
    parts = flat([term])
    neutral = {key: value for part in parts for key, value in part.neutral.items()}
    params = {p.reported: p for part in parts for p in part.params if p.fit}
    return params, neutral


def candidates(car: Car) -> tuple[Candidate, ...]:
    """Return every candidate that makes sense for a car."""
    found = []
    for name, equation, depends_on, starts, steps, sentence in _TABLE:
        params, neutral = _params(name)
        wanted = [p for p in params.values() if _is_own(name, p)]
        parameters = tuple(
            _parameter(car, name, param, neutral.get(param.name, param.default), step)
            for param, step in zip(wanted, steps, strict=True)
        )
        found.append(
            Candidate(name, equation, depends_on, parameters, starts, sentence, RARE.get(name, 0.0))
        )
        if name == "com_shift":
            tied = replace(parameters[0], ties=((POINT_X, 1.0),))
            found.append(Candidate(name, equation, depends_on, (tied,), starts, sentence))
    return tuple(found)


def _is_own(name: str, param: Param) -> bool:
    """Say whether a parameter belongs to the effect alone, not to the tyre's curve."""
    return name != "tyre_relaxation" or param.name == "length"


def _parameter(car: Car, name: str, param: Param, neutral: float, step: float) -> Parameter:
    key, per_unit, given = param.key, 1.0, 0.0
    if name == "wheel_radius":
        key, per_unit = "wheel.radius_m", car.value("wheel.radius_m")
    if name in ("viscous_drag", "aero_drag", "rolling_resistance") and car.has(param.key):
        given, neutral = car.value(param.key), 0.0
    low, high = LIMITS.get(param.key, param.bounds)
    return Parameter(
        param.reported, key, param.unit, (low - given, high - given), neutral, step, per_unit, given
    )


def by_name(found: tuple[Candidate, ...], name: str) -> Candidate:
    """Return a candidate.

    Raises:
        TermError: when there is none of that name.
    """
    for candidate in found:
        if candidate.name == name:
            return candidate
    msg = f"no candidate {name!r}"
    raise TermError(msg)


def numbers_of(models: Mapping[Candidate, tuple[float, ...]]) -> Numbers:
    """Return the numbers that several effects at given values mean together."""
    return {k: v for c, values in models.items() for k, v in c.numbers(values).items()}
