"""A concealed effect, a drive, a diagnosis: does `scm mismatch` find what the simulator left out?

A Nigel with one more effect drives, its throttle and steering changed by hand every second or two;
an overhead camera records its pose 30 times a second. Then it is diagnosed as a plain Nigel. Car
and diagnosis have the same physics but for the effect: this tells how long to drive and how well to
measure. How right the diagnosis is on cars that another program simulates, `scm trial` tells.

A case takes about a second of processor time for each second of the recording.
"""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats
from scm.errors import StudyError, nearest
from scm.geometry import Pose2
from scm.mismatch.budget import Budget
from scm.mismatch.effect_catalogue import params_of
from scm.mismatch.findings import Diagnosis
from scm.mismatch.pipeline import diagnose_car
from scm.mismatch.trial.labels import Label
from scm.mismatch.trial.score import score
from scm.recording.read import Channel, Recording
from scm.study.case import Case
from scm.vehicles.car import Car, load_car
from scm.vehicles.fleet import Fleet

MAP = "driving_school"  # not used: the floor is level and without end
CAR = "nigel"
NONE = "none"


class Concealed(NamedTuple):
    """A parameter of an effect, and how far from neutral it is at strength 1."""

    parameter: str
    amount: float


EFFECTS = {
    "steer_trim": Concealed("offset_rad", 0.012),
    "steer_delay": Concealed("delay_s", 0.04),
    "steer_backlash": Concealed("width_rad", 0.02),
    "drive_gain": Concealed("gain", 0.05),
    "payload": Concealed("mass_kg", 2.0),
    "battery_sag": Concealed("fraction_per_min", 0.06),
    "stiction": Concealed("torque_nm", 0.02),
    "drive_deadband": Concealed("threshold", 0.01),
    "drive_lag": Concealed("time_constant_s", 0.02),
}
STEP_S, POSE_EVERY, COMMAND_EVERY = 0.01, 3, 5  # poses at 33 Hz, commands at 20 Hz
THROTTLE, THROTTLE_COMMANDS = (0.35, 0.95), 22  # the same for 1.1 s
STEERING, STEERING_COMMANDS = (-0.8, 0.8), 34
REST_S = 0.8  # without throttle before each launch: the car comes to rest
RISE_S = 1.0  # in which throttle rises evenly at a launch: what hinders it shows as a later start
YAW_RAD_PER_M = 0.0087 / 0.002  # heading noise of a camera that has 2 mm of noise


def run(
    case: Case,
    effect: str = "steer_trim",
    length_s: float = 60.0,
    pose_noise_m: float = 0.002,
    strength: float = 1.0,
    launches: int = 0,
) -> dict[str, float]:
    """Return whether a diagnosis finds and names a concealed effect, and what else it reports.

    Args:
        case: The case.
        effect: Which is concealed, of `EFFECTS`; `none`: nothing, to be found as such.
        length_s: Of the recording.
        pose_noise_m: Standard deviation of measured positions; headings have 0.25 deg a mm of it.
        strength: Of the effect, in multiples of its amount in `EFFECTS`.
        launches: How often the car rests and then starts gently; without, it starts once, at once.

    Raises:
        StudyError: when there is no such effect, or no time for so many launches.
    """
    if effect != NONE and effect not in EFFECTS:
        known = [*EFFECTS, NONE]
        msg = f"effect: no {effect!r}{nearest(effect, known)}; expected one of {', '.join(known)}"
        raise StudyError(msg)
    most = int(length_s / (REST_S + RISE_S))
    if not 0 <= launches <= most:
        msg = f"launches: {launches}; expected 0 to {most} in {length_s:g} s"
        raise StudyError(msg)
    plain = load_car(CAR)
    concealed = concealing(plain, effect, strength)
    recording = recorded(case, concealed, length_s, pose_noise_m, launches)
    # Without a clock no question is left open, as with the default budget, on slow computers too.
    diagnosis = diagnose_car([recording], plain, budget=Budget()).diagnosis
    return judged(diagnosis, effect)


def concealing(car: Car, effect: str, strength: float) -> Car:
    """Return a car with one more effect."""
    if effect == NONE:
        return car
    name, amount = EFFECTS[effect]
    params, neutral = params_of(effect)
    return car.with_terms([effect], {params[name].key: neutral[name] + strength * amount})


def recorded(
    case: Case, car: Car, length_s: float, pose_noise_m: float, launches: int = 0
) -> Recording:
    """Return the recording of a drive: commands, and poses with noise."""
    throttle, steering = _commands(case, length_s, launches)
    fleet = Fleet(car, 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    driven = fleet.rollout(
        np.repeat(throttle, COMMAND_EVERY), np.repeat(steering, COMMAND_EVERY), STEP_S
    )
    t: Floats = np.arange(COMMAND_EVERY * len(throttle)) * np.float64(STEP_S)
    given = t[::COMMAND_EVERY]
    channels = {
        "command.throttle": Channel(given, throttle, None, (0.0, 0.0), "ratio"),
        "command.steering": Channel(given, steering, None, (0.0, 0.0), "ratio"),
    }
    rng, seen = case.generator("noise"), slice(POSE_EVERY - 1, None, POSE_EVERY)
    for name, std, dimension in (
        ("x", pose_noise_m, "length"),
        ("y", pose_noise_m, "length"),
        ("yaw", YAW_RAD_PER_M * pose_noise_m, "angle"),
    ):
        values = np.unwrap(driven[name][:, 0])[seen]
        values += std * rng.standard_normal(len(values))
        after = t[seen] + STEP_S
        channels[f"pose.{name}"] = Channel(after, values, std, (0.0, 0.0), dimension)
    return Recording(Path("drive/recording.yaml"), CAR, channels)


def judged(diagnosis: Diagnosis, effect: str) -> dict[str, float]:
    """Return the measures of a diagnosis, by what was concealed."""
    concealed = () if effect == NONE else (effect,)
    label = Label(
        case="", kind="single" if concealed else NONE, names=concealed, car=CAR,
        parameters=tuple({} for _ in concealed), equations=frozenset(), needs=frozenset(),
    )  # fmt: skip
    outcome = score(label, diagnosis)
    gain = math.nan
    if diagnosis.fit is not None:
        unseen = diagnosis.fit.confirm
        gain = 1.0 - unseen.after["position_m"] / unseen.before["position_m"]
    return {
        "found": float(outcome.among if concealed else outcome.exact),
        "false_effects": len(outcome.false_names),
        "error_removed": gain,
    }


def _commands(case: Case, length_s: float, launches: int) -> tuple[Floats, Floats]:
    """Return throttle and steering of a drive, 20 a second; launches are spread evenly."""
    rng, k = case.generator("drive"), np.arange(round(length_s / (COMMAND_EVERY * STEP_S)))
    throttle = rng.uniform(*THROTTLE, len(k))[k // THROTTLE_COMMANDS]
    steering = rng.uniform(*STEERING, len(k))[k // STEERING_COMMANDS]
    rest, rise = (round(time_s / (COMMAND_EVERY * STEP_S)) for time_s in (REST_S, RISE_S))
    for launch in range(launches):
        at = rest + round(launch * len(k) / launches)
        throttle[at - rest : at] = 0.0
        begun = throttle[at : at + rise]
        begun *= np.linspace(0.0, 1.0, rise)[: len(begun)]
    return throttle, steering
