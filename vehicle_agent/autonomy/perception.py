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
from vehicle_agent.autonomy.eye_pose import EyePoses
from vehicle_agent.autonomy.grid_map import GridMap
from vehicle_agent.autonomy.obstacles import ObstacleLayer
from vehicle_agent.autonomy.odometry import (
    CHECK_MOUNT,
    CONTRARY_WORDS,
    OdometryFilter,
    Seen,
    mount_of,
)
from vehicle_agent.autonomy.particle_filter import (
    FOUND_SHARE,
    Localised,
    ParticleFilter,
    PoseMeasurement,
    is_near,
)
from vehicle_agent.autonomy.sweep import Sweep, deskewed, noise_of, sweep_of

KNOWN_STD_M, KNOWN_STD_RAD = 0.05, 0.1
"""Of a pose that is good enough to plan from."""
JUMP_NS = NS_PER_S  # of a clock, in either direction
NOISE_M = 0.025  # of a range, at first, where the car file has none
NEWER = 0.2  # part of the noise measured in one sweep
AS_WELL = 0.05  # of the echoes: scans that fit two places to within this fit both


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
        mounting_problem: Why the scanner does not look ahead, in words; empty: nothing is known.
        eye: Where the Eye sees the car, if somebody hands that over.
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
        self._has_checked_mount = False
        self.mounting_problem = ""
        self.eye = EyePoses()

    def begin(self, pose: Pose2 | None) -> None:
        """Start at a pose that is roughly known; None: look for the car everywhere."""
        self._start, self._has_checked_mount, self.mounting_problem = pose, False, ""
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
        if self._check_clock(message.t_ns):
            return None
        self._odometry.scan(message)
        if self._odometry.is_contrary:
            self.mounting_problem = f"{CONTRARY_WORDS}: {CHECK_MOUNT}"
        moved = self._odometry.at_sweep
        if moved is None or moved.t_ns != message.t_ns:
            return None
        last, self._last = self._last or moved.pose, moved.pose
        sweep = sweep_of(message)
        self._measure_noise(sweep)
        echoes = deskewed(sweep, self._mount, moved.twist)
        seen = self.eye.at_sweep(moved)
        self._check_mount(seen, echoes)
        if self._was_lifted(echoes):
            self._filter.begin_anywhere()
        if seen is not None:
            self._consult(seen, echoes)
        found = self._filter.update(last.inverse() @ moved.pose, echoes, seen)
        self.localised = found
        if _is_known(found):
            self.obstacles.update(found.pose @ self._mount, _on_map(found.pose, echoes))
            if seen is not None:
                self.eye.compare(moved.t_ns, seen, found)
        return found

    def _was_lifted(self, echoes: Floats) -> bool:
        """Return whether the car was put elsewhere, so that the echoes do not fit its last pose.

        Which way it was carried, scans alone do not say: in a room that looks alike from two places
        they fit both.
        """
        if not self._odometry.was_lifted or self.localised is None:
            return False
        return self._filter.fits(self.localised.pose, echoes) < FOUND_SHARE

    def _check_mount(self, seen: PoseMeasurement | None, echoes: Floats) -> None:
        """Check once, where a pose is known otherwise, whether the scanner looks backward."""
        pose, name = self._start, "the start"
        if pose is None and seen is not None:
            pose, name = seen.pose, "the pose by the Eye"
        if pose is None or self._has_checked_mount or not len(echoes):
            return
        self._has_checked_mount = True
        backward = self._mount @ Pose2(0.0, 0.0, math.pi) @ self._mount.inverse()
        turned = self._filter.fits(pose @ backward, echoes)
        if turned >= FOUND_SHARE > self._filter.fits(pose, echoes):
            problem = f"the scans fit {name} only where the scanner looks backward"
            self.mounting_problem = f"{problem}: {CHECK_MOUNT}, and {name}"

    def _consult(self, seen: PoseMeasurement, echoes: Floats) -> None:
        """Begin where the Eye sees the car, if its place is not known and the scans fit there.

        Likewise where the two disagree for long: scans that fit both places cannot decide.
        """
        found, least = self.localised, FOUND_SHARE
        if not self._filter.is_global:
            if found is None or is_near(found.pose, seen.pose):
                return
            if not found.is_lost:
                least = max(least, float(found.explained.mean()) - AS_WELL)
                if not self.eye.problem:
                    return
        if self._filter.fits(seen.pose, echoes) >= least:
            self._filter.begin(seen.pose)

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

    def _check_clock(self, t_ns: int) -> bool:
        """Begin odometry anew where the car's clock jumped; return whether it did."""
        newest, self._newest_ns = self._newest_ns, t_ns
        if newest is None or abs(t_ns - newest) <= JUMP_NS:
            return False
        self.clock_jump_s = (t_ns - newest) / NS_PER_S
        self._odometry, self._last = OdometryFilter(self._car), None
        self.eye.begin_anew()
        return True


def _is_known(found: Localised) -> bool:
    x, y, yaw = np.sqrt(np.diag(found.covariance))
    is_sure = math.hypot(x, y) < KNOWN_STD_M and yaw < KNOWN_STD_RAD
    return is_sure and not found.is_lost and found.alternative is None


def _on_map(pose: Pose2, points: Floats) -> Floats:
    """Return points (m, 2) of the car's frame on the map."""
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    x, y = points.T
    return np.column_stack((pose.x + c * x - s * y, pose.y + s * x + c * y))
