"""How a car answers to commands, found by driving its car file: speeds, steering angles, delays.

Cars of the file are driven on the level, each with another command. So whatever effects the file
lists, a dead-band or a lag among them, are in the answer, and a better file makes a better driver.

    speed after `STEADY_S` at each throttle; curvature at each steering command
    a step's times to 28 % and 63 %: lag = 1.5 (t63 - t28), delay = t63 - lag

Holds: a flat, even floor; a full battery.
Source: two-point method for first order plus dead time, Sundaresan and Krishnaswamy, 1978.
"""

from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Floats
from scm.geometry import Pose2
from scm.vehicles.car import Car
from scm.vehicles.fleet import Fleet
from vehicle_agent.autonomy.plan import CarLimits

STEADY_S, STEP_S = 3.0, 0.01
THROTTLES = np.linspace(-1.0, 1.0, 41)
STEERINGS = np.linspace(-1.0, 1.0, 21)
SLOW_MPS = 0.1  # at which steering is tried
SMALL_STEP = 0.1  # of steering: a servo of limited rate shows its delay
SLOWEST_MPS = 0.005  # a car that is slower stands
SPARE = 0.9  # share of the top speed to plan with: the rest is for control


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """What commands do.

    Attributes:
        speeds_mps: (41,) steady ones at `THROTTLES`, rising.
        angles_rad: (21,) of the front wheels at `STEERINGS`, by the path's curvature, rising.
        drive_delay_s, drive_lag_s: Until the speed begins to follow a throttle, and as it does.
        steer_delay_s: Until the front wheels begin to follow a command.
    """

    speeds_mps: Floats
    angles_rad: Floats
    drive_delay_s: float
    drive_lag_s: float
    steer_delay_s: float

    def limited(self, limits: CarLimits) -> CarLimits:
        """Return limits that the car can keep to: it may reach less than its file states."""
        return replace(
            limits,
            steering_rad=float(min(limits.steering_rad, self.angles_rad[-1], -self.angles_rad[0])),
            speed_mps=float(min(limits.speed_mps, SPARE * self.speeds_mps[-1])),
            reverse_mps=float(min(limits.reverse_mps, -SPARE * self.speeds_mps[0])),
        )

    def throttle_for(self, speed_mps: float) -> float:
        """Return the throttle that holds a speed; 0 for none."""
        if abs(speed_mps) < SLOWEST_MPS:
            return 0.0
        side = THROTTLES * speed_mps > 0.0
        return float(np.interp(speed_mps, self.speeds_mps[side], THROTTLES[side]))

    def speed_of(self, throttle: float) -> float:
        """Return the steady speed at a throttle [m/s]."""
        return float(np.interp(throttle, THROTTLES, self.speeds_mps))

    def angle_of(self, steering: float) -> float:
        """Return the front wheels' angle at a steering command [rad]."""
        return float(np.interp(steering, STEERINGS, self.angles_rad))

    def steering_for(self, angle_rad: float) -> float:
        """Return the command that brings the front wheels to an angle, -1 to 1."""
        return float(np.interp(angle_rad, self.angles_rad, STEERINGS))


def response_of(car: Car) -> Response:
    """Return how a car of this file answers to commands."""
    speeds = _final(_driven(car, THROTTLES, np.zeros(1), STEADY_S)["speed"])
    slow = float(np.interp(SLOW_MPS, np.maximum.accumulate(speeds), THROTTLES))
    turned = _driven(car, np.array([slow]), STEERINGS, STEADY_S)
    wheelbase = car.value("body.wheelbase_m")
    curvatures = _final(turned["yaw_rate"]) / np.maximum(_final(turned["speed"]), SLOWEST_MPS)
    step = _driven(car, np.array([0.6]), np.zeros(1), STEADY_S)["speed"][:, 0]
    drive_delay, drive_lag = _delay_and_lag(step)
    small = _driven(car, np.array([slow]), np.array([0.0, SMALL_STEP]), STEADY_S, after_s=1.0)
    steer_delay, _ = _delay_and_lag(small["yaw_rate"][:, 1] - small["yaw_rate"][:, 0])
    return Response(
        np.maximum.accumulate(speeds),
        np.maximum.accumulate(np.arctan(wheelbase * curvatures)),
        drive_delay, drive_lag, steer_delay,
    )  # fmt: skip


def _driven(
    car: Car, throttles: Floats, steerings: Floats, lasts_s: float, after_s: float = 0.0
) -> dict[str, Floats]:
    """Return speed and yaw rate (T, n) of cars with these commands, from `after_s` on."""
    count = max(len(throttles), len(steerings))
    fleet = Fleet(car, count)
    for row in range(count):
        fleet.add(Pose2(0.0, float(row), 0.0))
    steps, rolling = round(lasts_s / STEP_S), round(after_s / STEP_S)
    throttle = np.tile(np.resize(throttles, count), (steps + rolling, 1))
    steering = np.tile(np.resize(steerings, count), (steps + rolling, 1))
    steering[:rolling] = 0.0
    driven = fleet.rollout(throttle, steering, STEP_S, ("speed", "yaw_rate"))
    return {name: values[rolling:] for name, values in driven.items()}


def _final(values: Floats) -> Floats:
    """Return the means of the last tenth."""
    final: Floats = values[-len(values) // 10 :].mean(axis=0)
    return final


def _delay_and_lag(values: Floats) -> tuple[float, float]:
    """Return the delay and time constant of a step's answer [s]."""
    share = values / (values[-1] or 1.0)
    at_28, at_63 = (STEP_S * (float(np.argmax(share >= part)) + 1.0) for part in (0.283, 0.632))
    lag = 1.5 * (at_63 - at_28)
    return max(0.0, at_63 - lag), lag
