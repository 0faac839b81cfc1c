"""Speed advice for a car that has no map but the air: junctions by MAPEM, their lights by SPATEM.

For drivers of your own, in an agent or a script; the city's driver follows `green_light.py`.
"""

import math
from typing import NamedTuple

from scm.geometry import Pose2, wrap_angle
from scm.v2x.etsi.cam_spatem import SCALE, SpatemBody
from scm.v2x.etsi.codes import number_of, scaled
from scm.v2x.etsi.convert import Told, colours_of, place_of
from scm.v2x.etsi.mapem import IntersectionGeometry, MapemBody, MapLane
from scm.vehicles.driver import CarLimits
from scm.vehicles.drivers.green_light import FLOOR, HORIZON, advised_speed
from scm.vehicles.drivers.stop_lines import SHORT_OF_LINE
from scm.vehicles.jit import plain

FRESH_S = 1.0
_AWRY_RAD = math.radians(30.0)
_CM, _SPEED_STEP = SCALE * 100.0, 0.02 / SCALE
_speed = plain(advised_speed)


class Advice(NamedTuple):
    """How to come to the next lights.

    Attributes:
        junction: Its number, as in MAPEM; `lane` the number of the lane that leads to it, None:
            MAPEM does not tell it.
        distance_m: From the front bumper to the stop line.
        speed_mps: To drive now, at most the lane's limit; None: MAPEM tells no limit.
        earliest_s, latest_s, likely_s: When the lights change; None: not told.
        confidence: The share of such likely ends that come true; None: not told.
        is_green: What they are now.
    """

    junction: int
    lane: int | None
    distance_m: float
    speed_mps: float | None
    earliest_s: float | None
    latest_s: float | None
    likely_s: float | None
    confidence: float | None
    is_green: bool


class GreenAdvisor:
    """What one car makes of MAPEMs and SPATEMs.

    Args:
        limits: Of the car.
        floor: Least speed that is advised, a share of the limit.
    """

    def __init__(self, limits: CarLimits, floor: float = FLOOR) -> None:
        self._limits, self._floor = limits, floor
        self._maps: dict[int, IntersectionGeometry] = {}
        self._lights: dict[int, tuple[int, int, dict[int, Told]]] = {}

    def hear_mapem(self, body: MapemBody) -> None:
        """Take the lanes of junctions."""
        for geometry in body.intersections or ():
            self._maps[geometry.id.id] = geometry

    def hear_spatem(self, body: SpatemBody, arrived_ns: int) -> None:
        """Take a SPATEM that arrived at `arrived_ns`, on the receiver's clock."""
        self._lights[body.intersection] = (
            arrived_ns,
            body.revision,
            {} if "failureFlash" in body.status else colours_of(body),
        )

    def advise(self, pose: Pose2, now_ns: int) -> Advice | None:
        """Return how to go on from a pose of the rear axle; None: no lights told of ahead."""
        yaw, front = pose.yaw, self._limits.front
        x, y = pose.x + front * math.cos(yaw), pose.y + front * math.sin(yaw)
        found = [
            (distance, number, lane)
            for number, geometry in self._maps.items()
            for lane in geometry.lane_set
            if (distance := _distance(geometry, lane, x, y, yaw)) is not None
            and distance <= HORIZON
        ]
        if not found:
            return None
        distance, number, lane = min(found, key=lambda one: one[0])
        told = self._told(number, lane, now_ns)
        return None if told is None else self._advice(distance, number, lane, told)

    def _told(self, number: int, lane: MapLane, now_ns: int) -> Told | None:
        """Return what is told now of the group that is the first to release a lane."""
        arrived_ns, revision, groups = self._lights.get(number, (0, -1, {}))
        age_s = 1e-9 * (now_ns - arrived_ns)
        if revision != self._maps[number].revision or not -FRESH_S <= age_s <= FRESH_S:
            return None
        numbers = {number_of(way, "signal_group") for way in lane.connects_to or ()}
        told = [groups[n] for n in numbers if n is not None and n in groups]
        if not told:
            return None
        first = min(told, key=lambda one: (one.colour != "green", one.min_end_s or 0.0))
        return first._replace(
            min_end_s=_later(first.min_end_s, age_s),
            max_end_s=_later(first.max_end_s, age_s),
            likely_end_s=_later(first.likely_end_s, age_s),
        )

    def _advice(self, distance: float, number: int, lane: MapLane, told: Told) -> Advice:
        allowed = _limit_mps(self._maps[number])
        wait = (told.min_end_s or 0.0) if told.colour == "red" else 0.0
        room = distance - SHORT_OF_LINE
        speed = None
        if allowed is not None:
            speed = _speed(room, wait, self._limits.decel, allowed, self._floor * allowed)
        ends = told.min_end_s, told.max_end_s, told.likely_end_s, told.likely_confidence
        is_green = told.colour == "green"
        return Advice(number, number_of(lane, "lane_id"), distance, speed, *ends, is_green)


def _limit_mps(geometry: IntersectionGeometry) -> float | None:
    """Return the speed limit of all vehicles at a junction [m/s]; None: it is not told."""
    limits = geometry.speed_limits or ()
    told = next((one for one in limits if one.type == "vehicleMaxSpeed"), None)
    return None if told is None else scaled(told, "speed", _SPEED_STEP)


def _later(end_s: float | None, age_s: float) -> float | None:
    return None if end_s is None else max(0.0, end_s - age_s)


def _distance(
    geometry: IntersectionGeometry, lane: MapLane, x: float, y: float, yaw: float
) -> float | None:
    """Return how far a place on a lane that leads in is from the stop line [m]; None: beside it."""
    attributes = lane.lane_attributes
    if "ingressPath" not in attributes.directional_use or attributes.lane_type.vehicle is None:
        return None
    reference = place_of(geometry.ref_point.latitude, geometry.ref_point.longitude)
    if reference is None or geometry.lane_width is None:
        return None
    (near_x, near_y), half, begin = reference, 0.5 * geometry.lane_width / _CM, 0.0
    for place, node in enumerate(lane.node_list.nodes):
        delta = node.delta.node_xy
        dx, dy = delta.x / _CM, delta.y / _CM
        length = math.hypot(dx, dy)
        if place and length > 0.0:
            along = ((x - near_x) * dx + (y - near_y) * dy) / length
            beside = ((y - near_y) * dx - (x - near_x) * dy) / length
            awry = abs(wrap_angle(yaw - math.atan2(-dy, -dx)))
            if 0.0 <= along <= length and abs(beside) <= half and awry <= _AWRY_RAD:
                return begin + along
            begin += length
        near_x, near_y = near_x + dx, near_y + dy
    return None
