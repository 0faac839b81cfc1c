"""Whether a recording can be of the car whose file was given: speed, turning circle, wheels."""

import math
from collections.abc import Iterator

import numpy as np

from scm.mismatch.doubt.driven import held
from scm.mismatch.doubt.suspicion import Relation
from scm.mismatch.doubt.track import Series, Track, clean, grid
from scm.mismatch.findings import DataProblem
from scm.recording.read import Recording
from scm.vehicles.car import Car

WIDTH_S = 0.3
STEP_S = 0.05
TOO_FAST = 1.4
TOO_SLOW = 0.3
TURNS = (0.55, 1.8)
ROLLS = (0.7, 1.4)
QUIET_MPS2 = 1.5


def other_car(
    recording: Recording, car: Car, movement: Series, poses: Track, travel: Relation | None
) -> Iterator[DataProblem]:
    """Yield the problem that the car file is another car's, with all that says so."""
    reasons = [
        reason
        for reason in (
            _speed(recording, car, movement),
            _turning(recording, car, movement, poses),
            _wheels(travel),
        )
        if reason
    ]
    if reasons:
        yield DataProblem(
            channel="*",
            name="other_car",
            said=f"The car file {car.name!r} does not fit this recording: {'; '.join(reasons)}. "
            "Effects found with it would make up for the wrong car.",
            record_instead="Nothing: give the file of the car that was driven.",
        )


def top_speed(car: Car) -> float | None:
    """Return the speed at full throttle without any loss [m/s]."""
    keys = ("drive.no_load_speed_rad_s", "wheel.radius_m")
    return car.value(keys[0]) * car.value(keys[1]) if all(car.has(k) for k in keys) else None


def _speed(recording: Recording, car: Car, movement: Series) -> str:
    top = top_speed(car)
    if top is None:
        return ""
    fast = float(np.percentile(np.abs(movement.values), 98))
    if fast > TOO_FAST * top:
        return f"it drives {fast:.2f} m/s, the car file's car at most {top:.2f} m/s"
    if "command.throttle" not in recording.channels:
        return ""
    throttle = clean(recording.channels["command.throttle"])
    if len(throttle.t) < 2 or np.abs(throttle.values).max() > 1.5:
        return ""
    on = grid(movement.t[0], movement.t[-1], STEP_S, WIDTH_S)
    asked = np.abs(on.smooth_even(held(throttle, on.t)))
    speed, push = np.abs(on.smooth(movement)), np.abs(on.smooth(movement, 1))
    steady = (asked > 0.3) & (push < 0.1 * max(fast, 1e-9)) & (speed > 0.3 * fast)
    if steady.sum() < 3.0 / STEP_S:
        return ""
    share = float(np.median(speed[steady] / (asked[steady] * top)))
    if share < TOO_SLOW:
        return (
            f"it drives {100.0 * share:.0f} % of the speed that the throttle asks of the file's car"
        )
    return ""


def _turning(recording: Recording, car: Car, movement: Series, poses: Track) -> str:
    """Compare the curve driven with the curve steered, where tyres hardly slip."""
    keys = ("steering.limit_rad", "body.wheelbase_m")
    if "command.steering" not in recording.channels or not all(car.has(k) for k in keys):
        return ""
    command = recording.channels["command.steering"]
    steering = clean(command)
    per_unit = 1.0 if command.dimension == "angle" else car.value(keys[0])
    if len(steering.t) < 20 or np.abs(steering.values * per_unit).max() > 1.3:
        return ""
    on = grid(poses.t[0], poses.t[-1], STEP_S, WIDTH_S)
    speed, rate = on.smooth(movement), on.smooth(Series(poses.t, poses.yaw), 1)
    late = round(0.15 / STEP_S)
    angle = on.smooth_even(held(steering, on.t)) * per_unit
    angle[late:] = angle[:-late]
    asked = speed * np.tan(angle) / car.value(keys[1])
    fast = np.percentile(np.abs(speed), 90)
    rows = (np.abs(speed) > 0.3 * fast) & (np.abs(speed * rate) < QUIET_MPS2)
    if rows.sum() < 5.0 / STEP_S or asked[rows].std() < 0.02:
        return ""
    a, b = asked[rows] - asked[rows].mean(), rate[rows] - rate[rows].mean()
    alike = float((a * b).sum() / math.sqrt((a * a).sum() * (b * b).sum() + 1e-30))
    gain = float((a * b).sum() / (a * a).sum())
    if alike < 0.7 or TURNS[0] < gain < TURNS[1]:
        return ""
    return (
        f"it turns {gain:.2f} times as tightly as the steering asks, as a wheelbase of "
        f"{car.value(keys[1]) / gain:.2f} m would instead of {car.value(keys[1]):.2f} m"
    )


def _wheels(travel: Relation | None) -> str:
    if travel is None or not travel.pair[1].startswith(("encoder", "wheel_speed")):
        return ""
    scale = travel.numbers["scale"].value
    if ROLLS[0] < scale < ROLLS[1]:
        return ""
    return f"the way driven is {scale:.2f} times what its wheels count"
