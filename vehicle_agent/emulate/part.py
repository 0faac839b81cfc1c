"""The emulated car on the city's bus: it receives the floor and publishes its true pose.

Its board is connected to the serial line only. Nothing on the bus can move it.
"""

import logging
from collections.abc import Iterable, Sequence

import numpy as np

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.log import event
from scm.maps.room import CLEARANCE_M, distances_m
from scm.maps.route import Roads
from scm.records.city_map import CityMap
from scm.runtime.part import BasePart, Subscription
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.emulated_pose import EmulatedPose
from scm.v2x.messages.world_definition import WorldDefinition
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot
from vehicle_agent.emulate.device import Device
from vehicle_agent.emulate.scanner import Scanner
from vehicle_agent.emulate.wheels import Wheels

STEP_NS = 5 * NS_PER_MS
PUBLISH_NS = 20 * NS_PER_MS
SEARCH_NS = 300 * NS_PER_MS
"""How long it collects the poses of other cars: each is published several times meanwhile."""

_log = logging.getLogger(__name__)


def station_of(vehicle: str) -> str:
    """Return the name of a vehicle's emulator on the bus."""
    return f"emulated-{vehicle}"


def place_of(city_map: CityMap, spawn: str) -> Pose2:
    """Return where the car starts: at a spawn place or `X,Y,DEG`, else at the map's first.

    Raises:
        MapError: when the map has no such place, or the coordinates lie off its floor.
    """
    return Roads(city_map).spawn_pose(spawn or city_map.spawns[0].name)


def free_place(city_map: CityMap, others: Iterable[SnapshotVehicle | EmulatedPose]) -> Pose2 | None:
    """Return the first spawn place that is free and stays free; None if there is none."""
    cars = [(car.x_m, car.y_m, car.yaw_rad, car.speed_mps) for car in others]
    x, y, yaw, speed = np.array(cars, dtype=float).reshape(-1, 4).T
    roads = Roads(city_map)
    poses = (roads.spawn_pose(place.name) for place in city_map.spawns)
    free = (pose for pose in poses if np.all(distances_m(pose, x, y, yaw, speed) >= CLEARANCE_M))
    return next(free, None)


class EmulatorPart(BasePart):
    """One emulated car."""

    role = "client"
    period_ns = STEP_NS

    def __init__(
        self, vehicle: str, device: Device, wheels: Wheels, spawn: str = "", car: str = "nigel",
        tag_id: int | None = None, scanner: Scanner | None = None,
    ) -> None:  # fmt: skip
        """Prepare the car; it is placed when the city's map is known.

        Args:
            vehicle: Name of the car.
            device: Its board and cable.
            wheels: The car that the board moves.
            spawn: Spawn place or `X,Y,DEG`; empty: the first free one.
            car: Car file's name.
            tag_id: Of the tag on its roof; None: as the city assigns it.
            scanner: Its LIDAR, behind a cable of its own; None: it has none.
        """
        self.name = station_of(vehicle)
        self._vehicle, self._device, self._wheels = vehicle, device, wheels
        self._scanner = scanner
        self._spawn, self._car, self._tag_id = spawn, car, tag_id
        self.subscriptions: Sequence[Subscription] = (
            Subscription(WorldDefinition), Subscription(WorldSnapshot), Subscription(EmulatedPose),
        )  # fmt: skip
        self._map: CityMap | None = None
        self._defined_ns: int | None = None
        self._snapshot: WorldSnapshot | None = None
        self._emulated: dict[str, EmulatedPose] = {}
        self._search_since_ns: int | None = None
        self._is_full = self._is_placed = False
        self._published_ns = 0

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Run the board and move the car; publish its pose 50 times a second."""
        for item in inbox:
            if isinstance(item.message, WorldDefinition):
                self._learn(item.message)
            elif isinstance(item.message, WorldSnapshot):
                self._snapshot = item.message
            elif isinstance(item.message, EmulatedPose):
                self._emulated[item.message.vehicle] = item.message
        self._device.step(now_ns)
        if not self._is_placed:
            self._put_down(now_ns)
            return []
        self._wheels.follow(self._device.firmware, now_ns)
        if self._scanner is not None:
            self._scanner.step(now_ns, self._wheels.motion().pose)
        if now_ns - self._published_ns < PUBLISH_NS - STEP_NS // 2:
            return []
        self._published_ns = now_ns
        return [self._pose(now_ns)]

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Remove the cables."""
        del now_ns
        self._device.close()
        if self._scanner is not None:
            self._scanner.close()
        return []

    def _learn(self, world: WorldDefinition) -> None:
        """Receive the floor; a restarted city does not move the car."""
        if world.t_ns == self._defined_ns:
            return
        self._defined_ns, self._map = world.t_ns, world.map
        self._wheels.learn(world.map, world.seed)
        if self._scanner is not None:
            self._scanner.learn(world.map)

    def _put_down(self, now_ns: int) -> None:
        """Put the car at its place, or search for a free one."""
        if self._map is None:
            return
        pose = place_of(self._map, self._spawn) if self._spawn else self._found(self._map, now_ns)
        if pose is None:
            return
        self._wheels.place(pose, now_ns)
        self._is_placed, self.subscriptions = True, self.subscriptions[:1]
        self._snapshot, self._emulated = None, {}

    def _found(self, city_map: CityMap, now_ns: int) -> Pose2 | None:
        if self._snapshot is None:
            return None
        if self._search_since_ns is None:
            self._search_since_ns = now_ns
        if now_ns - self._search_since_ns < SEARCH_NS:
            return None
        seen = {car.vehicle: car for car in self._snapshot.vehicles} | self._emulated
        seen.pop(self._vehicle, None)
        pose = free_place(city_map, seen.values())
        if pose is None and not self._is_full:
            self._is_full = True
            event(_log, "no_free_place", level=logging.WARNING, map=city_map.name)
        return pose

    def _pose(self, now_ns: int) -> EmulatedPose:
        motion = self._wheels.motion()
        return EmulatedPose(
            vehicle=self._vehicle,
            t_ns=now_ns,
            x_m=motion.pose.x,
            y_m=motion.pose.y,
            yaw_rad=motion.pose.yaw,
            speed_mps=motion.speed,
            lateral_speed_mps=motion.lateral_speed,
            yaw_rate_radps=motion.yaw_rate,
            steering_rad=motion.steering,
            car=self._car,
            tag_id=self._tag_id,
        )
