"""Free runs that never forget: one drive through all commands, carried to the measured pose.

A window of `scm replay` begins in the measured motion. Here the car drives through the whole
recording, and where a window begins only its pose is set to the measured one, and how far its
wheels have turned; its motion and actuators stay.
"""

import math

import numpy as np

from scm.arrays import Floats
from scm.geometry import Pose2
from scm.recording.motion import Motion, Poses
from scm.recording.read import Recording
from scm.replay.commands import Commands
from scm.vehicles.car import Car
from scm.vehicles.fleet import Fleet

STEP_S = 0.005
EVERY_S = 0.1
SETTLED_S = 3.0
COUNTS, ENCODERS = "encoder.counts_per_revolution", ("encoder.left", "encoder.right")


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
    counted = (t > begin + SETTLED_S) & measured.valid
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
