"""What a car knows of itself and its surroundings: odometry, the particle filter, obstacles."""

import math
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.clock import NS_PER_S
from scm.geometry import Pose2
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import Car
from vehicle_agent.autonomy.grid_map import GridMap
from vehicle_agent.autonomy.obstacles import ObstacleLayer
from vehicle_agent.autonomy.odometry import OdometryFilter, Seen, mount_of
from vehicle_agent.autonomy.particle_filter import FOUND_SHARE, Localised, ParticleFilter
from vehicle_agent.autonomy.sweep import Sweep, deskewed, noise_of, sweep_of

KNOWN_STD_M, KNOWN_STD_RAD = 0.05, 0.1
"""Of a pose that is good enough to plan from."""
JUMP_NS = NS_PER_S  # of a clock, in either direction
NOISE_M = 0.025  # of a range, at first, where the car file has none
NEWER = 0.2  # part of the noise measured in one sweep


@dataclass(frozen=True, slots=True)
class Whereabouts:
    """Where a car is now, and how it moves.

    Attributes:
        pose: Of the rear axle, map frame.
        speed_mps: + forward.
        yaw_rate_radps: + = left.
        is_known: Whether the pose is good enough to drive by.
    """

    t_ns: int
    pose: Pose2
    speed_mps: float
    yaw_rate_radps: float
    is_known: bool


class Perception:
    """Of one car on one map.

    Args:
        car: Its file; `grid`: the map; `seed`: of the particles.

    Attributes:
        localised: After the last sweep; None before one.
        obstacles: What is not on the map.
        noise_m: Standard deviation of a range, as it was measured.
        clock_jump_s: The last jump of the car's clock; None: none yet.
        steering_rad: Of the front wheels, as measured last.
        is_turned: The first echoes fit the start only where the scanner looks backward.
    """

    def __init__(self, car: Car, grid: GridMap, seed: int = 0) -> None:
        self._car, self._grid = car, grid
        self._mount = mount_of(car)
        self.noise_m = car.value("lidar.noise_m") if car.has("lidar.noise_m") else NOISE_M
        self._filter = ParticleFilter(grid, self.noise_m, seed)
        self._odometry = OdometryFilter(car)
        self._last: Pose2 | None = None
        self._newest_ns: int | None = None
        self.localised: Localised | None = None
        self.obstacles = ObstacleLayer(grid, self.noise_m)
        self.clock_jump_s: float | None = None
        self.steering_rad = 0.0
        self._has_sensors = False
        self._start: Pose2 | None = None
        self.is_turned = False

    def begin(self, pose: Pose2 | None) -> None:
        """Start at a pose that is roughly known; None: look for the car everywhere."""
        self._start, self.is_turned = pose, False
        if pose is None:
            self._filter.begin_anywhere()
        else:
            self._filter.begin(pose)

    def sensors(self, measured: VehicleSensors) -> None:
        """Take what the car's other sensors measured."""
        self._has_sensors = True
        self._check_clock(measured.t_ns)
        self._odometry.sensors(measured)
        if measured.steering_rad is not None:
            self.steering_rad = measured.steering_rad

    def state(self, reported: VehicleState) -> None:
        """Take the motion of a car that has but a scanner, as the Eye saw it."""
        if reported.source != "eye" or self._has_sensors:
            return
        self._check_clock(reported.t_ns)
        self._odometry.sensors(Seen(reported.t_ns, reported.speed_mps, reported.yaw_rate_radps))
        self.steering_rad = reported.steering_rad

    def scan(self, message: LidarScan) -> Localised | None:
        """Take a sweep; return where the car was at its end, None where it is not used.

        Raises:
            MessageError: when the message is damaged.
        """
        self._check_clock(message.t_ns)
        self._odometry.scan(message)
        moved = self._odometry.at_sweep
        if moved is None or moved.t_ns != message.t_ns:
            return None
        last, self._last = self._last or moved.pose, moved.pose
        sweep = sweep_of(message)
        self._measure_noise(sweep)
        echoes = deskewed(sweep, self._mount, moved.twist)
        if self._start is not None and len(echoes):
            self.is_turned = self._looks_backward(self._start, echoes)
            self._start = None
        found = self._filter.update(last.inverse() @ moved.pose, echoes)
        self.localised = found
        if _is_known(found):
            self.obstacles.update(found.pose @ self._mount, _on_map(found.pose, echoes))
        return found

    def _looks_backward(self, start: Pose2, echoes: Floats) -> bool:
        """Return whether the echoes fit a start only with the scanner turned by half a circle."""
        backward = self._mount @ Pose2(0.0, 0.0, math.pi) @ self._mount.inverse()
        turned = self._filter.fits(start @ backward, echoes)
        return turned >= FOUND_SHARE > self._filter.fits(start, echoes)

    def now(self) -> Whereabouts | None:
        """Return where the car is by the newest measurement; None before a sweep."""
        found, odometry = self.localised, self._odometry.now()
        if found is None or odometry is None or self._last is None:
            return None
        pose = found.pose @ (self._last.inverse() @ odometry.pose)
        twist = odometry.twist
        return Whereabouts(
            odometry.t_ns, pose, twist.along_mps, twist.yaw_rate_radps, _is_known(found)
        )

    def _measure_noise(self, sweep: Sweep) -> None:
        noise_m = noise_of(sweep)
        if noise_m is not None:
            self.noise_m += NEWER * (noise_m - self.noise_m)
            self._filter.set_noise(self.noise_m)
            self.obstacles.set_noise(self.noise_m)

    def _check_clock(self, t_ns: int) -> None:
        """Begin odometry anew where the car's clock jumped."""
        newest, self._newest_ns = self._newest_ns, t_ns
        if newest is not None and abs(t_ns - newest) > JUMP_NS:
            self.clock_jump_s = (t_ns - newest) / NS_PER_S
            self._odometry, self._last = OdometryFilter(self._car), None


def _is_known(found: Localised) -> bool:
    x, y, yaw = np.sqrt(np.diag(found.covariance))
    is_sure = math.hypot(x, y) < KNOWN_STD_M and yaw < KNOWN_STD_RAD
    return is_sure and not found.is_lost and found.alternative is None


def _on_map(pose: Pose2, points: Floats) -> Floats:
    """Return points (m, 2) of the car's frame on the map."""
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    x, y = points.T
    return np.column_stack((pose.x + c * x - s * y, pose.y + s * x + c * y))
