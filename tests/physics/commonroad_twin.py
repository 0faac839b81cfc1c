"""The F1TENTH car as CommonRoad's single-track and multi-body models of equal parameters.

All three get the steering angle that our servo made; the speed of ours is held by the models'
acceleration input, so that what differs is what the models make of it.
Source of the models: Althoff and Wuersching, "CommonRoad: Vehicle Models", 2020.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from vehiclemodels.init_mb import init_mb
from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb
from vehiclemodels.vehicle_dynamics_st import vehicle_dynamics_st

from scm.arrays import Floats
from scm.geometry import Pose2
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from tests.reality.in_commonroad import parameters
from tests.reality.numbers import nominal

STEP_S = 1e-3
HOLD = 40.0  # 1/s: how hard the models' acceleration follows our speed


@dataclass(frozen=True)
class Manoeuvre:
    """What the driver does: commands over time since the start, at a first speed [m/s]."""

    name: str
    speed: float
    seconds: float
    steering: Callable[[Floats], Floats]
    throttle: Callable[[Floats], Floats]


def _steps(before: float, after: float, at: float) -> Callable[[Floats], Floats]:
    return lambda t: np.where(t < at, before, after)


MANOEUVRES = (
    Manoeuvre("step steer", 2.5, 1.5, _steps(0.0, 0.2, 0.2), _steps(0.45, 0.45, 0.0)),
    Manoeuvre("sine sweep", 2.5, 4.0,
              lambda t: 0.15 * np.sin(2.0 * math.pi * (0.5 * t + 0.25 * t * t)),
              _steps(0.45, 0.45, 0.0)),
    Manoeuvre("braking in a turn", 2.5, 1.5, _steps(0.15, 0.15, 0.0), _steps(0.45, -0.15, 0.7)),
    Manoeuvre("beyond the grip", 3.5, 1.5, _steps(0.0, 0.6, 0.2), _steps(0.5, 0.5, 0.0)),
)  # fmt: skip


@dataclass(frozen=True)
class Motion:
    """One model's answer; arrays over time. Velocities and yaw rate at the centre of gravity."""

    t: Floats
    x: Floats
    y: Floats
    speed: Floats
    lateral_speed: Floats
    yaw_rate: Floats


def ours(manoeuvre: Manoeuvre) -> tuple[Motion, Floats]:
    """Drive our car; return its motion and its mean road-wheel angle [rad]."""
    car = load_car("f1tenth")
    back = car.value("body.cog_to_rear_axle_m")
    fleet = Fleet(car, 1)
    row = fleet.add(Pose2(0.0, 0.0, 0.0), speed=manoeuvre.speed)
    t = np.arange(round(manoeuvre.seconds / STEP_S)) * STEP_S
    throttle, steering = manoeuvre.throttle(t), manoeuvre.steering(t)
    rows = np.zeros((len(t), 7))
    for i in range(len(t)):
        x, y, yaw = fleet.pose(row)
        rows[i] = (
            x + back * math.cos(yaw),
            y + back * math.sin(yaw),
            fleet.speed[row],
            fleet.lateral_speed[row] + back * fleet.yaw_rate[row],
            fleet.yaw_rate[row],
            fleet.steer_angle[row],
            0.0,
        )
        fleet.throttle[row], fleet.steering[row] = throttle[i], steering[i]
        fleet.advance(STEP_S)
    x, y, speed, lateral, rate, angle, _ = rows.T
    return Motion(t, x, y, speed, lateral, rate), angle


def single_track(reference: Motion, angle: Floats) -> Motion:
    """Let CommonRoad's single-track model do the same."""
    p = parameters(nominal("f1tenth"))
    inputs = _Inputs(reference, angle)

    def slope(t: float, state: Floats) -> list[float]:
        state = state.copy()
        state[2] = inputs.angle(t)
        return list(vehicle_dynamics_st(state, inputs.at(t, state[3]), p))

    start = np.array([reference.x[0], 0.0, angle[0], reference.speed[0], 0.0, 0.0, 0.0])
    found = _solve(slope, reference.t, start)
    speed, slip = found[3], found[6]
    return Motion(
        reference.t, found[0], found[1], speed * np.cos(slip), speed * np.sin(slip), found[5]
    )


def multi_body(reference: Motion, angle: Floats) -> Motion:
    """Let CommonRoad's 29-state multi-body model do the same."""
    p = parameters(nominal("f1tenth"))
    inputs = _Inputs(reference, angle)

    def slope(t: float, state: Floats) -> list[float]:
        state = state.copy()
        state[2] = inputs.angle(t)
        return list(vehicle_dynamics_mb(state, inputs.at(t, state[3]), p))

    core = [reference.x[0], 0.0, angle[0], reference.speed[0], 0.0, 0.0, 0.0]
    found = _solve(slope, reference.t, np.array(init_mb(core, p)))
    return Motion(reference.t, found[0], found[1], found[3], found[10], found[5])


class _Inputs:
    """Steering velocity (unused: the angle is given) and the acceleration that holds our speed."""

    def __init__(self, reference: Motion, angle: Floats) -> None:
        self._t, self._angle, self._speed = reference.t, angle, reference.speed
        self._slope = np.gradient(reference.speed, reference.t)

    def angle(self, t: float) -> float:
        return float(np.interp(t, self._t, self._angle))

    def at(self, t: float, speed: float) -> list[float]:
        wanted = float(np.interp(t, self._t, self._speed))
        return [0.0, float(np.interp(t, self._t, self._slope)) + HOLD * (wanted - speed)]


def _solve(slope: Callable[[float, Floats], list[float]], t: Floats, start: Floats) -> Floats:
    found = solve_ivp(slope, (t[0], t[-1]), start, "BDF", t, max_step=5e-3, rtol=1e-6, atol=1e-8)
    if not found.success:
        msg = f"SciPy gave up: {found.message}"
        raise RuntimeError(msg)
    return np.asarray(found.y)
