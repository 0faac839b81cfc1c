"""Judges a patched car on another drive of the same car: free runs against the recording.

A window of `scm replay` starts in the measured motion. Here the car drives through the whole
recording, and where a window starts only its pose is set to the measured one, and how far its
wheels have turned; its motion and actuators stay.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scm.arrays import Floats
from scm.errors import ScmError
from scm.geometry import Pose2
from scm.mismatch.effect_catalogue import identifications, params_of, terms_needed
from scm.mismatch.trial.labels import Case, Label
from scm.mismatch.validate.found_car import on
from scm.recording.motion import Motion, Poses
from scm.recording.read import Recording, read_recordings
from scm.replay.commands import Commands
from scm.vehicles.car import Car, load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.sensor_correction import without_faults
from scm.vehicles.sensor_fault import all_sensor_faults

STEP_S = 0.005
EVERY_S = 0.1
RUN_IN_S = 3.0
COUNTS, ENCODERS = "encoder.counts_per_revolution", ("encoder.left", "encoder.right")
SHIFT, POINT = "com_shift.shift_m", "measure.pose_point_x_m"
SHOWS = 1.2  # where the nominal car's error is below this times the true car's, nothing is to gain


def position_error(recording: Recording, car: Car, horizon_s: float = 3.0) -> float:
    """Return the root mean square distance from the measured position over all windows [m].

    The first seconds, in which the motion forgets how it began, do not count. Steps begin where
    commands that come at an even rate change: one that changes within a step would come late.
    """
    poses, commands = Poses(recording), Commands(recording, car)
    first, last = commands.span_s
    begin = first + STEP_S * math.ceil((max(first, float(poses.t[0]) + EVERY_S) - first) / STEP_S)
    end = min(last, float(poses.t[-1]) - EVERY_S)
    count = int((end - begin) / EVERY_S)
    t: Floats = np.linspace(begin, begin + EVERY_S * count, count + 1)
    measured = poses.motion(t)
    turned = _turned(recording, car, t)
    per_window = round(horizon_s / EVERY_S)
    fleet = _started(car, commands, first, measured)
    _drive(fleet, commands, first, begin)
    errors = np.full(len(t), np.nan)
    for k, now in enumerate(t):
        if k % per_window == 0 and measured.valid[k]:
            _carry(fleet, measured, k)
            if turned is not None:
                fleet.wheel_angle[0] += np.tile(turned[k] - fleet.wheel_angle[0, 2:], 2)
        errors[k] = np.hypot(fleet.x[0] - measured.x[k], fleet.y[0] - measured.y[k])
        _drive(fleet, commands, now, now + EVERY_S)
    counted = (t > begin + RUN_IN_S) & measured.valid
    return float(np.sqrt(np.nanmean(np.square(errors[counted]))))


def _started(car: Car, commands: Commands, first: float, measured: Motion) -> Fleet:
    k = int(np.argmax(measured.valid))
    fleet = Fleet(car, 1)
    moving = float(measured.speed[k]) if measured.t[k] - first < 1.0 else 0.0
    fleet.add(Pose2(float(measured.x[k]), float(measured.y[k]), float(measured.yaw[k])), moving)
    return fleet


def _turned(recording: Recording, car: Car, t: Floats) -> Floats | None:
    """Return how far the left and the right wheel have turned, (n, 2) [rad]; None: not counted."""
    counts = car.value(COUNTS) / (2.0 * math.pi) if car.has(COUNTS) else 0.0
    if not counts or not all(name in recording.channels for name in ENCODERS):
        return None
    both = (recording.channel(name) for name in ENCODERS)
    return np.stack([np.interp(t, c.t, c.values) / counts for c in both], axis=1)


def _drive(fleet: Fleet, commands: Commands, start: float, end: float) -> None:
    steps = round((end - start) / STEP_S)
    t: Floats = np.linspace(start, start + STEP_S * steps, steps, endpoint=False)
    throttle, steering = commands.at(t + 1e-9)
    fleet.rollout(throttle, steering, STEP_S, ())


def _carry(fleet: Fleet, measured: Motion, k: int) -> None:
    """Set the pose to the measured one; speeds along and across the body stay."""
    now = fleet.planar_cogs(np.array([0]))[0]
    turn = measured.yaw[k] - fleet.yaw[0]
    turn = float(np.arctan2(np.sin(turn), np.cos(turn)))
    c, s = np.cos(turn), np.sin(turn)
    arm_x, arm_y = now[0] - fleet.x[0], now[1] - fleet.y[0]
    change = (
        c * now[3] - s * now[4] - now[3],
        s * now[3] + c * now[4] - now[4],
        0.0,
        measured.x[k] + c * arm_x - s * arm_y - now[0],
        measured.y[k] + s * arm_x + c * arm_y - now[1],
        turn,
    )
    fleet.push_rows(np.array([0]), np.array([change]))


@dataclass(frozen=True, slots=True)
class Ratio:
    """Root mean square of free runs' position errors on the other drive [m].

    Attributes:
        true_m: Of the car with what was really concealed; None for laws outside the library.
        retuned_m: Of the car whose nominal parameters alone were fitted; None where none was kept.
    """

    case: str
    nominal_m: float
    found_m: float
    true_m: float | None
    retuned_m: float | None = None


def compare(case: Case, label: Label, folder: Path) -> Ratio | None:
    """Return the three cars' errors; None without a patched car, or where the effect does not show.

    Args:
        case: With its other drive.
        label: Opened.
        folder: Where the diagnosis wrote `car.toml`, and `retuned.toml` if it likes: the car with
            its nominal parameters fitted and no effect added.
    """
    patched = folder / "car.toml"
    if not label.names or not patched.is_file() or not case.again.is_dir():
        return None
    recording = read_recordings(case.again)[0]
    own = case.again / "car.toml"  # of an engine whose nominal car is another one
    base = _ready(load_car(own if own.is_file() else label.car))
    nominal = error(recording, base)
    found = error(recording, on(base, load_car(patched)))
    cars = true_cars(base, label)
    true = min((error(recording, car) for car in cars), default=None)
    if true is not None and nominal < SHOWS * true:
        return None
    retuned = folder / "retuned.toml"
    tuned = error(recording, on(base, load_car(retuned))) if retuned.is_file() else None
    return Ratio(case.name, nominal, found, true, tuned)


def error(recording: Recording, car: Car) -> float:
    """Return the root mean square position error of free runs [m], faults of measurement undone."""
    return position_error(without_faults(recording, car.faults), car)


def true_cars(base: Car, label: Label) -> list[Car]:
    """Return the car as it really was; empty where the library cannot say so.

    Two where a shifted centre of gravity may have taken the measured point with it.
    """
    if label.kind == "unlisted" or not all(params_of(name)[0] for name in label.names):
        return []
    if label.kind == "intermittent":
        label = replace(label, names=(), parameters=())  # by then it is gone
    values = dict(label.nominal)
    values |= {"drive.axle_lock": 1.0} if base.has("drive.axle_lock") else {}
    known, faults = identifications(), dict[str, float]()
    for name, parameters in zip(label.names, label.parameters, strict=True):
        params, _ = params_of(name)
        numbers = {params[key].key: value for key, value in parameters.items()}
        if name == "wheel_radius":
            values["wheel.radius_m"] = base.value("wheel.radius_m") * parameters["scale"]
        elif name in all_sensor_faults():
            faults |= numbers
        elif name in known and known[name].adds:
            values |= {key: base.value(key) + more for key, more in numbers.items()}
        else:
            values |= numbers
    measures = [
        name for name in label.names if name in all_sensor_faults() and name != "wheel_radius"
    ]
    try:
        car = base.with_terms([], values)
        car = car.with_measures(measures, faults) if measures else car
    except ScmError:
        return []
    shift = values.get(SHIFT)
    if shift is None:
        return [car]
    return [car, car.with_measures([*measures, "pose_point"], faults | {POINT: shift})]


def _ready(car: Car) -> Car:
    """Return a car with every effect at rest: all cars of one type then share one kernel."""
    return car.with_terms([*terms_needed(car), "drive_delay", "steer_delay"])
