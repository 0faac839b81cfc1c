"""What a policy observes beside the car's own motion: what its sensors and radio receive, its goal.

Each class returns columns by the names that they have in training, or says what it waits for.
"""

import math
from collections import deque
from typing import NamedTuple, Protocol

import numpy as np

from scm.arrays import Floats
from scm.clock import NS_PER_MS, NS_PER_S, seconds
from scm.geometry import Pose2
from scm.maps.route import Roads
from scm.records.city_map import CityMap
from scm.v2x.etsi.convert import CamView, read_cam
from scm.v2x.exchange import Incoming
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spatem import SpatemRx
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.car import Car
from scm.vehicles.drivers.cam_tracker import MAX_CAM_AGE_NS, other_of
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.drivers.signal_table import SignalTable

COUNTED_OVER = 3  # readings: 40 ms, in which a slow car's encoders count enough
MAX_READING_AGE_NS, MAX_SCAN_AGE_NS = 200 * NS_PER_MS, NS_PER_S
NEVER_S = 1e3  # the age of a CAM that never came
UNKNOWN_S = 1e3  # until a signal changes of which nothing is known


class Now(NamedTuple):
    """The moment and the place for which columns are requested.

    Attributes:
        lanes: On which the car drives on, the one it is on first.
        along_m: How far along that its rear axle is.
        speed_mps: Of the rear axle along the body.
    """

    t_ns: int
    pose: Pose2
    lanes: tuple[str, ...]
    along_m: float
    speed_mps: float


Columns = dict[str, float] | str


class Received(Protocol):
    """Some columns of an observation."""

    def receive(self, item: Incoming) -> None:
        """Receive a message, whatever it is."""

    def columns(self, now: Now) -> Columns:
        """Return the columns by name, or in words what they wait for."""


def seen_from(pose: Pose2, there: Pose2) -> tuple[float, float, float, float]:
    """Return a pose as seen from another: ahead and left [m], cosine and sine of its direction."""
    x, y, turn = pose.inverse() @ there
    return x, y, math.cos(turn), math.sin(turn)


class Inertial:
    """The IMU, and the speeds of the rear wheels by their encoders."""

    def __init__(self, car: Car) -> None:
        counts = car.value("encoder.counts_per_revolution")
        self._m_per_count = math.tau * car.value("wheel.radius_m") / counts
        self._readings = deque[VehicleSensors](maxlen=COUNTED_OVER)
        self._arrived_ns = -NS_PER_S

    def receive(self, item: Incoming) -> None:
        """Receive a reading."""
        if isinstance(item.message, VehicleSensors):
            if self._readings and item.message.t_ns <= self._readings[-1].t_ns:
                self._readings.clear()  # the car was placed anew
            self._readings.append(item.message)
            self._arrived_ns = item.t_ns

    def columns(self, now: Now) -> Columns:
        """Return the newest readings."""
        if len(self._readings) < 2 or now.t_ns - self._arrived_ns > MAX_READING_AGE_NS:
            return "its IMU and encoders"
        first, last = self._readings[0], self._readings[-1]
        per_count = self._m_per_count / seconds(last.t_ns - first.t_ns)
        read = {f"accel_{axis}_mps2": last.accel_mps2[k] for k, axis in enumerate("xyz")}
        read |= {f"gyro_{axis}_radps": last.gyro_radps[k] for k, axis in enumerate("xyz")}
        read["wheel_left_mps"] = per_count * (last.encoder_left - first.encoder_left)
        read["wheel_right_mps"] = per_count * (last.encoder_right - first.encoder_right)
        return read


class Ranges:
    """The car's LIDAR, by the beams that the policy was trained with.

    Args:
        beams: Evenly round the car, the first ahead.
    """

    def __init__(self, beams: int) -> None:
        self._bearings: Floats = math.tau * np.arange(beams) / beams
        self._ranges: Floats | None = None
        self._arrived_ns = 0

    def receive(self, item: Incoming) -> None:
        """Receive a scan; each beam is that which looked nearest to its bearing."""
        scan = item.message
        if isinstance(scan, LidarScan) and scan.beams > 0:
            step = scan.bearing_step_rad or math.tau / scan.beams
            beams = np.round((self._bearings - scan.bearing_first_rad) % math.tau / step)
            ranges = np.frombuffer(scan.payload, "<f4").astype(np.float64)
            if len(ranges) != scan.beams:
                return
            is_seen = beams < scan.beams + (0 if step * scan.beams < math.tau - 1e-3 else 1)
            found = ranges[beams.astype(np.int64) % scan.beams]
            missed = ~is_seen | ~np.isfinite(found)
            self._ranges, self._arrived_ns = np.where(missed, scan.range_max_m, found), item.t_ns

    def columns(self, now: Now) -> Columns:
        """Return the newest ranges."""
        if self._ranges is None or now.t_ns - self._arrived_ns > MAX_SCAN_AGE_NS:
            return "its LIDAR"
        return {f"range_{k}_m": float(value) for k, value in enumerate(self._ranges)}


class Others:
    """The nearest other cars, by their newest CAMs, in the order of their stations.

    Args:
        count: How many the policy was trained with.
        car: Its car file: others are taken for cars of that kind.
        vehicle: Itself.
    """

    def __init__(self, count: int, car: Car, vehicle: str) -> None:
        self._count, self._vehicle = count, vehicle
        self._front_m = limits_of(car).front
        self._newest = dict[int, tuple[CamView, int]]()

    def receive(self, item: Incoming) -> None:
        """Receive a CAM."""
        message = item.message
        if isinstance(message, CamRx) and message.station != self._vehicle:
            view = read_cam(message.body)
            if view.place is not None and view.yaw_rad is not None:
                self._newest[view.station_id] = view, item.t_ns

    def columns(self, now: Now) -> Columns:
        """Return where they were, seen from the car; zeros and a great age where there are none."""
        known = sorted(self._newest.items(), key=lambda one: self._away(one[1][0], now.pose))
        nearest = [one for _, one in sorted(known[: self._count], key=lambda one: one[0])]
        found = dict[str, float]()
        for k in range(self._count):
            one = self._seen(*nearest[k], now) if k < len(nearest) else (0.0,) * 5 + (NEVER_S,)
            names = ("ahead_m", "left_m", "cos_turn", "sin_turn", "speed_mps", "age_s")
            found |= {f"other_{k}_{name}": v for name, v in zip(names, one, strict=True)}
        return found

    def _away(self, view: CamView, pose: Pose2) -> float:
        x, y = view.place or (math.inf, math.inf)
        return math.hypot(x - pose.x, y - pose.y)

    def _seen(self, view: CamView, arrived_ns: int, now: Now) -> tuple[float, ...]:
        (x, y), yaw = view.place or (0.0, 0.0), view.yaw_rad or 0.0
        there = Pose2(x, y, yaw) @ Pose2(-self._front_m, 0.0, 0.0)
        age_s = seconds(now.t_ns - arrived_ns)
        return (*seen_from(now.pose, there), view.speed_mps or 0.0, age_s)


class Pursued:
    """The car that is pursued, extrapolated from its newest CAM.

    Args:
        name: Of that car.
        car: The own car file: the other is taken for a car of that kind.
    """

    def __init__(self, name: str, car: Car) -> None:
        self._name, limits = name, limits_of(car)
        self._middle_m = 0.5 * (limits.front - limits.rear)
        self._newest: tuple[CamView, int] | None = None

    def receive(self, item: Incoming) -> None:
        """Receive a CAM."""
        message = item.message
        if isinstance(message, CamRx) and message.station == self._name:
            view = read_cam(message.body)
            if view.place is not None and view.yaw_rad is not None:
                self._newest = view, item.t_ns

    def columns(self, now: Now) -> Columns:
        """Return where it is now, seen from the car, and how fast."""
        if self._newest is None or now.t_ns - self._newest[1] > MAX_CAM_AGE_NS:
            return f"a CAM of {self._name}"
        view, arrived_ns = self._newest
        other = other_of(view, seconds(now.t_ns - arrived_ns))
        there = Pose2(other.x, other.y, other.yaw) @ Pose2(-self._middle_m, 0.0, 0.0)
        names = ("ahead_m", "left_m", "cos_turn", "sin_turn", "speed_mps")
        values = (*seen_from(now.pose, there), other.speed)
        return {f"pursued_{name}": value for name, value in zip(names, values, strict=True)}


class Goal:
    """The place that the car is to drive to.

    Args:
        pose: Of its rear axle there.
    """

    def __init__(self, pose: Pose2) -> None:
        self.pose = pose

    def receive(self, item: Incoming) -> None:
        """Receive nothing: it stays where it is."""

    def columns(self, now: Now) -> Columns:
        """Return where it is, seen from the car."""
        names = ("ahead_m", "left_m", "cos_turn", "sin_turn")
        values = seen_from(now.pose, self.pose)
        return {f"goal_{name}": value for name, value in zip(names, values, strict=True)}


class Lights:
    """The stop line ahead, by the map, and what its signals show, by SPATEMs.

    Args:
        city_map: With its junctions.
        roads: Of the map.
        car: Its car file.
        reach_m: Lines farther ahead are not seen.
    """

    def __init__(self, city_map: CityMap, roads: Roads, car: Car, reach_m: float) -> None:
        self._roads, self._reach_m = roads, reach_m
        self._front_m = limits_of(car).front
        self._table = SignalTable(city_map)

    def receive(self, item: Incoming) -> None:
        """Receive what signals and their monitors report."""
        if isinstance(item.message, SpatemRx):
            self._table.receive_spatem(item.message.body, item.t_ns)
        elif isinstance(item.message, MonitorStatus):
            self._table.receive_monitor_status(item.message)

    def columns(self, now: Now) -> Columns:
        """Return the way to the line, whether it shows green, and the least time until it changes.

        A line of which nothing is known is not green.
        """
        front_m = now.along_m + self._front_m
        found = self._roads.line_ahead(now.lanes, front_m)
        way_m, is_green, change_s = self._reach_m, True, 0.0
        if found is not None and found[1] <= self._reach_m:
            line, way_m = found
            signal = line.junction, line.group, now.t_ns
            is_green, left_s = self._table.may_go(*signal), self._table.time_to_change(*signal)
            change_s = UNKNOWN_S if left_s is None else left_s
        return {
            "stop_line_m": way_m, "signal_is_green": float(is_green), "signal_change_s": change_s
        }  # fmt: skip
