"""What an agent sees of its car: parts, each some columns with unit and range, joined in one array.

To add one, write a function that returns a `Part` and name it in `PARTS`.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from gymnasium.error import Error
from numpy.typing import NDArray

from scm.arrays import Floats
from scm.errors import nearest
from scm.gym.camera import FrontCameras
from scm.gym.junctions import AHEAD, NEAR, QUEUE
from scm.gym.pursuit import LOST_M, look, pursued_rows
from scm.gym.radio import COLUMNS
from scm.gym.signals import REACH_M
from scm.gym.worlds import READINGS, Worlds
from scm.maps.segments import wall_segments
from scm.vehicles.drivers.cars_ahead import REACH
from scm.vehicles.drivers.course import AHEAD_M, BENDS, BESIDE_M, LIMIT_MPS, TURNED_RAD
from scm.vehicles.noise import bases_of
from scm.vehicles.rays.cast import cast
from scm.vehicles.rays.grid import WallGrid
from scm.vehicles.rays.scene import Scene
from scm.vehicles.sensor_noise import add_device_errors
from scm.vehicles.sensors import imu, lidar

Observation = NDArray[np.float32]
MOST_CARS = 50.0
FAR_M = 5.0  # more than any way across a school


@dataclass(frozen=True, slots=True)
class Part:
    """Some columns of an observation.

    Attributes:
        names: Of the columns, each with its unit at the end.
        low, high: Their range; what lies beyond is clipped.
        read: Returns them for all cars, (rows, columns).
    """

    names: tuple[str, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    read: Callable[[], Floats | Observation]


def motion(worlds: Worlds) -> Part:
    """Return the true motion of the rear axle, and the steering angle."""
    fleet = worlds.fleet
    columns = tuple(
        signal[: worlds.rows]
        for signal in (fleet.speed, fleet.lateral_speed, fleet.yaw_rate, fleet.steer_angle)
    )
    most = (5.0, 2.0, 10.0, 1.0)
    return Part(
        ("speed_mps", "lateral_speed_mps", "yaw_rate_radps", "steer_angle_rad"),
        tuple(-one for one in most), most, lambda: np.column_stack(columns),
    )  # fmt: skip


def action(worlds: Worlds) -> Part:
    """Return the action in force."""
    return Part(("throttle", "steering"), (-1.0,) * 2, (1.0,) * 2, lambda: worlds.actions)


def lane(worlds: Worlds) -> Part:
    """Return where the car is in its lane, the speed limit, and how the lane turns ahead."""
    bends = tuple(f"lane_turn_{ahead:g}m_rad" for ahead in AHEAD_M)
    most = (0.5, np.pi, 5.0, *(2.0 * np.pi,) * len(bends))
    known = worlds.lanes.known
    columns = [BESIDE_M, TURNED_RAD, LIMIT_MPS, *range(BENDS, BENDS + len(AHEAD_M))]
    return Part(
        ("beside_m", "turned_rad", "speed_limit_mps", *bends), tuple(-one for one in most), most,
        lambda: known[:, columns],
    )  # fmt: skip


def inertial(worlds: Worlds) -> Part:
    """Return what IMU and encoders of the car file read now: noise and bias of each episode."""
    device, fleet = imu.device(worlds.car), worlds.fleet
    rows, bias = np.arange(worlds.rows), np.array(device.bias)
    radius = fleet.parameters[: worlds.rows, [fleet.parameter_names.index("wheel_radius")]]

    def read() -> Floats:
        exact = imu.measure(worlds.car, fleet, rows, None)
        bases = bases_of(worlds.keys[: worlds.rows] ^ READINGS, worlds.row_steps)
        readings = add_device_errors(device, exact, bias, bases)
        return np.column_stack((readings[:, :6], radius * fleet.wheel_speed[: worlds.rows, 2:]))

    names = [f"accel_{axis}_mps2" for axis in "xyz"] + [f"gyro_{axis}_radps" for axis in "xyz"]
    most = (50.0,) * 3 + (20.0,) * 3 + (5.0,) * 2
    return Part(
        (*names, "wheel_left_mps", "wheel_right_mps"), tuple(-one for one in most), most, read
    )


def ranges(worlds: Worlds, beams: int = 108) -> Part:
    """Return what a level scanner sees of walls and boxes, evenly round the car, first ahead."""
    car, fleet = worlds.car, worlds.fleet
    nearest, farthest = car.vector("lidar.range_m")
    ahead, left, _ = car.vector("lidar.position_m")
    nobody = np.empty((0, 4)), np.empty(0, np.int64)
    scene = Scene(WallGrid(wall_segments(worlds.city_map)), *nobody)
    bearings = lidar.Bearings(0.0, 2.0 * np.pi / beams, beams)
    own = np.arange(worlds.rows)

    def read() -> Floats:
        x, y, yaw = fleet.x[own], fleet.y[own], fleet.yaw[own]
        c, s = np.cos(yaw), np.sin(yaw)
        x, y = x + c * ahead - s * left, y + s * ahead + c * left
        return cast(scene, np.column_stack((x, y, yaw)), own, bearings, farthest)

    names = tuple(f"range_{beam}_m" for beam in range(beams))
    return Part(names, (nearest,) * beams, (farthest,) * beams, read)


def camera(worlds: Worlds) -> Part:
    """Return the newest picture of the front camera."""
    cameras = FrontCameras(worlds)
    count = len(cameras.names)
    return Part(cameras.names, (0.0,) * count, (1.0,) * count, cameras.read)


def goal(worlds: Worlds) -> Part:
    """Return the goal's place and direction, seen from the car."""
    names = ("goal_ahead_m", "goal_left_m", "goal_cos_turn", "goal_sin_turn")
    most = (10.0, 10.0, 1.0, 1.0)
    known = worlds.to_goal.known[:, : len(names)]
    return Part(names, tuple(-one for one in most), most, lambda: known)


def ahead(worlds: Worlds) -> Part:
    """Return the gaps to the cars ahead and behind on the lanes, and how fast those are."""
    traffic = worlds.traffic
    if traffic is None:
        raise TypeError(f"task {worlds.task.name}: `ahead` needs cars that rules drive")
    names = ("leader_gap_m", "leader_speed_mps", "follower_gap_m", "follower_speed_mps")
    most, known = (REACH, 5.0) * 2, traffic.known
    return Part(names, (0.0, -5.0) * 2, most, lambda: known)


def pursued(worlds: Worlds) -> Part:
    """Return the pursued car's place and direction, seen from the own, and its speed."""
    if worlds.traffic is None:
        raise TypeError(f"task {worlds.task.name}: `pursued` needs cars that rules drive")
    names = ("ahead_m", "left_m", "cos_turn", "sin_turn", "speed_mps")
    most, rows = (2.0 * LOST_M, 2.0 * LOST_M, 1.0, 1.0, 5.0), pursued_rows(worlds)

    def read() -> Floats:
        return np.column_stack((look(worlds)[:, :4], worlds.fleet.speed[rows]))

    return Part(tuple(f"pursued_{name}" for name in names), tuple(-one for one in most), most, read)


def goal_offset(worlds: Worlds) -> Part:
    """Return the goal's place less the own, in the map's frame."""
    fleet, goals = worlds.fleet, worlds.to_goal.goals
    return Part(
        ("goal_x_m", "goal_y_m"), (-FAR_M,) * 2, (FAR_M,) * 2,
        lambda: goals[:, :2] - np.column_stack((fleet.x, fleet.y)),
    )  # fmt: skip


def peers(worlds: Worlds) -> Part:
    """Return each other car less the own, exactly, in the map's frame; who is out is far away.

    The next after the own comes first, the one before it last.
    """
    fleet, count = worlds.fleet, worlds.agents - 1
    own = np.arange(worlds.rows)[:, None]
    behind = (own + 1 + np.arange(count)) % worlds.agents
    rows = own - own % worlds.agents + behind
    names = ("x_m", "y_m", "turn_rad", "speed_mps")
    most = (FAR_M, FAR_M, np.pi, 5.0)

    def read() -> Floats:
        turn = fleet.yaw[rows] - fleet.yaw[own]
        seen = np.stack(
            (fleet.x[rows] - fleet.x[own], fleet.y[rows] - fleet.y[own],
             np.arctan2(np.sin(turn), np.cos(turn)), fleet.speed[rows]), axis=2,
        )  # fmt: skip
        seen[~worlds.present[rows]] = FAR_M, FAR_M, 0.0, 0.0
        return seen.reshape(worlds.rows, -1)

    return Part(
        tuple(f"peer_{k}_{name}" for k in range(count) for name in names),
        tuple(-one for one in most) * count, most * count, read,
    )  # fmt: skip


def others(worlds: Worlds) -> Part:
    """Return what the radio knows of each other car: place and direction seen from the own, age."""
    radio = worlds.radio
    count = worlds.agents - 1
    names = ("ahead_m", "left_m", "cos_turn", "sin_turn", "speed_mps", "age_s")
    most = (20.0, 20.0, 1.0, 1.0, 5.0, 10.0)

    def read() -> Floats:
        known = np.empty((0, 0)) if radio is None else radio.known
        return known.reshape(len(worlds.present), COLUMNS * count)

    return Part(
        tuple(f"other_{k}_{name}" for k in range(count) for name in names),
        tuple(-one for one in most) * count, most * count, read,
    )  # fmt: skip


def junction(worlds: Worlds) -> Part:
    """Return a junction's traffic, group by group, and what is green; what it lacks is 0.

    Pressure is the cars before a group's line less those where its ways lead to.
    """
    junctions = worlds.junctions
    if junctions is None:
        raise TypeError(f"task {worlds.task.name}: `junction` needs agents that are junctions")
    per_group = ("near_cars", "queue_cars", "pressure_cars", "is_green")
    groups = [f"group_{k}_{name}" for k in range(junctions.places) for name in per_group]
    stages = [f"stage_{k}_is_chosen" for k in range(junctions.choices)]
    most = (MOST_CARS, MOST_CARS, MOST_CARS, 1.0) * junctions.places + (1.0,) * len(stages)
    low = (0.0, 0.0, -MOST_CARS, 0.0) * junctions.places + (0.0,) * (len(stages) + 1)

    def read() -> Floats:
        near, queue, behind = (junctions.known[:, :, one] for one in (NEAR, QUEUE, AHEAD))
        columns = (near, queue, near - behind, junctions.green)
        traffic = np.stack([junctions.of_places(one) for one in columns], axis=3)
        chosen = junctions.stage.ravel()[:, None] == np.arange(junctions.choices)
        since_s = worlds.task.period_s * junctions.since.reshape(-1, 1)
        return np.hstack((traffic.reshape(worlds.rows, -1), chosen, since_s))

    return Part((*groups, *stages, "since_change_s"), low, (*most, 600.0), read)


def signals(worlds: Worlds) -> Part:
    """Return how far the line with lights ahead is, whether it is green, and when that changes."""
    lights = worlds.signals

    def read() -> Floats:
        return np.empty((0, 3)) if lights is None else lights.known[:, :3]

    return Part(
        ("stop_line_m", "signal_is_green", "signal_change_s"), (0.0,) * 3, (REACH_M, 1.0, 60.0),
        read,
    )  # fmt: skip


PARTS: dict[str, Callable[[Worlds], Part]] = {
    "motion": motion, "action": action, "lane": lane, "inertial": inertial,
    "others": others, "peers": peers, "signals": signals, "ahead": ahead, "goal": goal,
    "goal_offset": goal_offset, "pursued": pursued, "junction": junction,
    "camera": camera, "ranges": ranges,
    "ranges_36": partial(ranges, beams=36), "ranges_360": partial(ranges, beams=360),
}  # fmt: skip


class Observations:
    """What all agents see, in one array.

    Args:
        worlds: Of the agents.
        parts: By name.

    Attributes:
        names: Of the columns.
        low, high: Their range, (columns,).
        values: What `update` saw, (rows, columns).

    Raises:
        gymnasium.error.Error: There is no such part, or the agents have none of its columns.
    """

    def __init__(self, worlds: Worlds, parts: Sequence[str]) -> None:
        for part in parts:
            _check(worlds, part)
        self._parts = [PARTS[name](worlds) for name in parts]
        self.names = tuple(name for part in self._parts for name in part.names)
        twice = [name for name, count in Counter(self.names).items() if count > 1]
        if twice or not self.names:
            found = f"{twice[0]} more than once" if twice else "none"
            raise Error(f"observations = {tuple(parts)}: expected columns once each, got {found}")
        self.low, self.high = (
            np.array([v for part in self._parts for v in getattr(part, side)], np.float32)
            for side in ("low", "high")
        )
        self.values: Observation = np.zeros((worlds.rows, len(self.names)), np.float32)

    def update(self) -> Observation:
        """Look at all cars; return the array, which the next call writes over."""
        at = 0
        for part in self._parts:
            self.values[:, at : at + len(part.names)] = part.read()
            at += len(part.names)
        np.clip(self.values, self.low, self.high, out=self.values)
        return self.values


def _check(worlds: Worlds, part: str) -> None:
    """Raise an error where agents cannot have a part."""
    if part not in PARTS:
        raise Error(f"observations: no {part!r}{nearest(part, sorted(PARTS))}")
    if worlds.junctions is not None and part != "junction":
        raise Error(f"observations: {part!r} is a car's, the agents of {worlds.task.name} are none")
