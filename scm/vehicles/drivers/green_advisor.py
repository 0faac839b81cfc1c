"""Speed advice (GLOSA) for a car without a map: junctions from MAPEM, signals from SPATEM.

For drivers of your own, in an agent or a script. The city's driver uses `green_light.py`.
"""

import math
from typing import NamedTuple

from scm.geometry import Pose2, wrap_angle
from scm.v2x.etsi.cam_spatem import SCALE, SpatemBody
from scm.v2x.etsi.codes import number_of, scaled
from scm.v2x.etsi.convert import SignalState, colours_of, place_of
from scm.v2x.etsi.mapem import IntersectionGeometry, MapemBody, MapLane
from scm.vehicles.driver import CarLimits
from scm.vehicles.drivers.green_light import HORIZON, MIN_SPEED_SHARE, advised_speed
from scm.vehicles.drivers.stop_lines import SHORT_OF_LINE
from scm.vehicles.jit import plain

MAX_AGE_S = 1.0
_MAX_HEADING_ERROR_RAD = math.radians(30.0)
_CM, _SPEED_STEP = SCALE * 100.0, 0.02 / SCALE
_speed = plain(advised_speed)


class Advice(NamedTuple):
    """Advice for the approach to the next signals.

    Attributes:
        junction: Its number in MAPEM; `lane` is the number of the approach lane, None: unknown.
        distance_m: From the front bumper to the stop line.
        speed_mps: To drive now, at most the lane's limit; None: MAPEM has no limit.
        earliest_s, latest_s, likely_s: Time until the signals change; None: unknown.
        confidence: Probability that the likely time is right; None: unknown.
        is_green: Whether they are green now.
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
    """Advises one car by the MAPEMs and SPATEMs that it received.

    Args:
        limits: Of the car.
        floor: Lowest advised speed as a share of the limit.
    """

    def __init__(self, limits: CarLimits, floor: float = MIN_SPEED_SHARE) -> None:
        self._limits, self._floor = limits, floor
        self._maps: dict[int, IntersectionGeometry] = {}
        self._lights: dict[int, tuple[int, int, dict[int, SignalState]]] = {}

    def receive_mapem(self, body: MapemBody) -> None:
        """Store the lanes of junctions."""
        for geometry in body.intersections or ():
            self._maps[geometry.id.id] = geometry

    def receive_spatem(self, body: SpatemBody, arrived_ns: int) -> None:
        """Store a SPATEM that arrived at `arrived_ns`, on the receiver's clock."""
        self._lights[body.intersection] = (
            arrived_ns,
            body.revision,
            {} if "failureFlash" in body.status else colours_of(body),
        )

    def advise(self, pose: Pose2, now_ns: int) -> Advice | None:
        """Return the advice at a pose of the rear axle, or None without known signals ahead."""
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
        signal = self._signal_for(number, lane, now_ns)
        return None if signal is None else self._advice(distance, number, lane, signal)

    def _signal_for(self, number: int, lane: MapLane, now_ns: int) -> SignalState | None:
        """Return the present state of the group that releases a lane first."""
        arrived_ns, revision, groups = self._lights.get(number, (0, -1, {}))
        age_s = 1e-9 * (now_ns - arrived_ns)
        if revision != self._maps[number].revision or not -MAX_AGE_S <= age_s <= MAX_AGE_S:
            return None
        numbers = {number_of(way, "signal_group") for way in lane.connects_to or ()}
        signal = [groups[n] for n in numbers if n is not None and n in groups]
        if not signal:
            return None
        first = min(signal, key=lambda one: (one.colour != "green", one.min_end_s or 0.0))
        return first._replace(
            min_end_s=_later(first.min_end_s, age_s),
            max_end_s=_later(first.max_end_s, age_s),
            likely_end_s=_later(first.likely_end_s, age_s),
        )

    def _advice(self, distance: float, number: int, lane: MapLane, signal: SignalState) -> Advice:
        allowed = _limit_mps(self._maps[number])
        wait = (signal.min_end_s or 0.0) if signal.colour == "red" else 0.0
        distance_left = distance - SHORT_OF_LINE
        speed = None
        if allowed is not None:
            speed = _speed(distance_left, wait, self._limits.decel, allowed, self._floor * allowed)
        ends = signal.min_end_s, signal.max_end_s, signal.likely_end_s, signal.likely_confidence
        is_green = signal.colour == "green"
        return Advice(number, number_of(lane, "lane_id"), distance, speed, *ends, is_green)


def _limit_mps(geometry: IntersectionGeometry) -> float | None:
    """Return the speed limit of all vehicles at a junction [m/s], or None."""
    limits = geometry.speed_limits or ()
    signal = next((one for one in limits if one.type == "vehicleMaxSpeed"), None)
    return None if signal is None else scaled(signal, "speed", _SPEED_STEP)


def _later(end_s: float | None, age_s: float) -> float | None:
    return None if end_s is None else max(0.0, end_s - age_s)


def _distance(
    geometry: IntersectionGeometry, lane: MapLane, x: float, y: float, yaw: float
) -> float | None:
    """Return the distance from a place on an approach lane to the stop line [m], or None."""
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
            heading_error = abs(wrap_angle(yaw - math.atan2(-dy, -dx)))
            if (
                0.0 <= along <= length
                and abs(beside) <= half
                and heading_error <= _MAX_HEADING_ERROR_RAD
            ):
                return begin + along
            begin += length
        near_x, near_y = near_x + dx, near_y + dy
    return None
