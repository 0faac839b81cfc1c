"""The emulated car on the city's bus: it learns the floor, and tells the emulated camera the truth.

Its board hears the serial line only. Nothing that goes over the bus can move it.
"""

from collections.abc import Sequence

from scm.clock import NS_PER_MS
from scm.errors import MapError, nearest
from scm.geometry import Pose2
from scm.maps.model import CityMap
from scm.maps.route import Roads
from scm.part import Hears
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.emulated_pose import EmulatedPose
from scm.v2x.messages.world_definition import WorldDefinition
from vehicle_agent.emulate.device import Device
from vehicle_agent.emulate.wheels import Wheels

STEP_NS = 5 * NS_PER_MS
TELL_NS = 20 * NS_PER_MS


def station_of(vehicle: str) -> str:
    """Return the name of a vehicle's emulator on the bus."""
    return f"emulated-{vehicle}"


def place_of(city_map: CityMap, spawn: str) -> Pose2:
    """Return where the car is put down: at a spawn place, the map's first if none is named.

    Raises:
        MapError: when the map has none of that name.
    """
    for place in city_map.spawns:
        if spawn in ("", place.name):
            if place.pose is not None:
                return Pose2(*place.pose)
            line = Roads(city_map).lanes[place.lane or ""]
            return Pose2(*line.at(place.at_m or 0.0))
    known = [place.name for place in city_map.spawns]
    msg = f"map {city_map.name}: no spawn place {spawn!r}{nearest(spawn, known)}"
    raise MapError(msg)


class EmulatorPart:
    """One emulated car."""

    role = "client"
    period_ns = STEP_NS
    serves = ()
    hears = (Hears(WorldDefinition),)

    def __init__(
        self, vehicle: str, device: Device, wheels: Wheels, spawn: str = "", car: str = "nigel",
        tag_id: int | None = None,
    ) -> None:  # fmt: skip
        """Prepare the car; it is put down when the city's map is known.

        Args:
            vehicle: Whose car this is.
            device: Its board and cable.
            wheels: What the board moves.
            spawn: Spawn place; empty: the map's first.
            car: Car file's name.
            tag_id: Printed on its roof; None: the one that the city gives to the vehicle.
        """
        self.name = station_of(vehicle)
        self._vehicle, self._device, self._wheels = vehicle, device, wheels
        self._spawn, self._car, self._tag_id = spawn, car, tag_id
        self._defined_ns: int | None = None
        self._is_placed = False
        self._told_ns = 0

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Let the board run, the car roll; tell where it is, 50 times a second."""
        for item in inbox:
            if isinstance(item.message, WorldDefinition):
                self._learn(item.message, now_ns)
        self._device.step(now_ns)
        if not self._is_placed:
            return []
        self._wheels.follow(self._device.firmware, now_ns)
        if now_ns - self._told_ns < TELL_NS - STEP_NS // 2:
            return []
        self._told_ns = now_ns
        return [self._pose(now_ns)]

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Take the cable away."""
        del now_ns
        self._device.close()
        return []

    def _learn(self, world: WorldDefinition, now_ns: int) -> None:
        """Know the floor; a city that begins anew does not carry the car away."""
        if world.t_ns == self._defined_ns:
            return
        self._defined_ns = world.t_ns
        self._wheels.learn(world.map, world.seed)
        if not self._is_placed:
            self._wheels.place(place_of(world.map, self._spawn), now_ns)
            self._is_placed = True

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
