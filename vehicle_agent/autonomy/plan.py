"""What planners return and what they must know of a car: path, trajectory, limits, outline."""

import math
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.errors import CarError
from scm.vehicles.car import Car

CIRCLES = 4  # that cover the outline, in a row from rear to front
SLOWEST_MPS = 0.03  # where the wheels turn far within a short way


@dataclass(frozen=True, slots=True)
class CarLimits:
    """How a car may move, and how much room it takes.

    Attributes:
        wheelbase_m: From the rear axle, where poses are, to the front one.
        steering_rad: Greatest angle of the front wheels, in the middle between them.
        steering_rate_radps: How fast they turn.
        speed_mps, reverse_mps: Greatest speeds that a planner uses, both positive.
        accel_mps2: Greatest change of speed.
        rear_m, front_m, right_m, left_m: Edges of the outline, rear and right negative.
    """

    wheelbase_m: float
    steering_rad: float
    steering_rate_radps: float
    rear_m: float
    front_m: float
    right_m: float
    left_m: float
    speed_mps: float = 0.2
    reverse_mps: float = 0.2
    accel_mps2: float = 0.15

    @property
    def radius_m(self) -> float:
        """Of the rear axle's path at full steering."""
        return self.wheelbase_m / math.tan(self.steering_rad)

    def circles(self) -> tuple[Floats, float]:
        """Return circles that cover the outline: middles ahead of the rear axle (n,), radius."""
        length = (self.front_m - self.rear_m) / CIRCLES
        middles = self.rear_m + length * (np.arange(CIRCLES, dtype=np.float64) + 0.5)
        return np.asarray(middles), math.hypot(0.5 * length, max(self.left_m, -self.right_m))


def limits_of(car: Car) -> CarLimits:
    """Return what a car file says of it.

    Raises:
        CarError: when the file lacks a wheelbase, a steering limit or an outline.
    """
    missing = [
        key
        for key in ("body.wheelbase_m", "steering.limit_rad", "body.footprint_x_m")
        if not car.has(key)
    ]
    if missing:
        raise CarError(f"{car.path}: planning needs {', '.join(missing)}, got none")
    (rear, front), (right, left) = (car.vector(f"body.footprint_{axis}_m") for axis in "xy")
    rate = car.value("steering.rate_rad_s") if car.has("steering.rate_rad_s") else math.inf
    return CarLimits(
        wheelbase_m=car.value("body.wheelbase_m"),
        steering_rad=car.value("steering.limit_rad"),
        steering_rate_radps=rate,
        rear_m=rear, front_m=front, right_m=right, left_m=left,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """Where to drive, without times; poses are some centimetres apart.

    Attributes:
        poses: (n, 3) x, y [m] and yaw [rad] of the rear axle, map frame.
        gears: (n,) +1: this pose is reached forward, -1: backward. The first has that of the next.
        curvatures: (n,) of the way to this pose, + = left [1/m].
    """

    poses: Floats
    gears: Floats
    curvatures: Floats

    @property
    def length_m(self) -> float:
        """Along the path, both ways counted."""
        return float(np.hypot(*np.diff(self.poses[:, :2], axis=0).T).sum())

    @property
    def cusps(self) -> int:
        """How often the car changes direction."""
        return int(np.count_nonzero(np.diff(self.gears)))


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Where to be when.

    Attributes:
        times_s: (n,) from its beginning, rising.
        poses: (n, 3) of the rear axle, map frame [m, m, rad].
        speeds_mps: (n,) at these times, + forward.
        steering_rad: (n,) of the front wheels at these times, + = left.
    """

    times_s: Floats
    poses: Floats
    speeds_mps: Floats
    steering_rad: Floats


def timed(path: Path, limits: CarLimits) -> Trajectory:
    """Return a path with the speeds that acceleration and the steering's rate allow.

    It stands at its ends and at cusps.
    """
    steering = np.arctan(limits.wheelbase_m * path.curvatures)
    way = np.hypot(*np.diff(path.poses[:, :2], axis=0).T)
    top = np.where(path.gears > 0.0, limits.speed_mps, limits.reverse_mps)
    turned = np.abs(np.diff(steering))
    servo = limits.steering_rate_radps * way / np.maximum(turned, 1e-9)
    top[1:] = np.minimum(top[1:], np.maximum(servo, SLOWEST_MPS))
    stands = np.concatenate(([True], path.gears[1:-1] != path.gears[2:], [True]))
    top[stands] = 0.0
    speeds = top.copy()
    for i in range(1, len(speeds)):
        gained = 2.0 * limits.accel_mps2 * way[i - 1]
        speeds[i] = min(speeds[i], math.sqrt(speeds[i - 1] ** 2 + gained))
    for i in range(len(speeds) - 2, -1, -1):
        lost = 2.0 * limits.accel_mps2 * way[i]
        speeds[i] = min(speeds[i], math.sqrt(speeds[i + 1] ** 2 + lost))
    mean = np.maximum(0.5 * (speeds[:-1] + speeds[1:]), 0.5 * SLOWEST_MPS)
    times = np.concatenate(([0.0], np.cumsum(way / mean)))
    return Trajectory(times, path.poses, speeds * path.gears, steering)
