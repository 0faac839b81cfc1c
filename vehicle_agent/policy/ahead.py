"""The cars ahead of a car and behind it on the lanes, by their CAMs and the car's own map.

A gap is from the front of the car behind to where the outline of the car ahead first reaches into
the corridor that the former will sweep along its lanes, as the city's driver has it. A car behind
is taken to come along those lanes that lead here whose middle it is nearest to.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from scm.arrays import Floats, Ints
from scm.geometry import Pose2
from scm.maps.route import LanePath, Roads
from scm.v2x.exchange import Incoming
from scm.v2x.messages.cam import CamRx
from scm.vehicles.car import Car
from scm.vehicles.driver import Other
from scm.vehicles.drivers.cam_tracker import CamTracker
from scm.vehicles.drivers.cars_ahead import REACH, first_overlap
from scm.vehicles.drivers.driver_state import kind_row
from scm.vehicles.drivers.lane_graph import LENGTH, lane_graph_of
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.jit import array_kernel
from vehicle_agent.policy.received import Columns, Now

SAME_WAY = 0.5  # cosine of the angle to a lane, from which on a car drives along it
BEYOND_M = 0.01  # before the begin of a lane or behind its end, a car is still on it


class Ahead:
    """Gaps to the cars ahead and behind within 2 m, and how fast those are.

    Args:
        roads: Of the map.
        car: Its car file: the rear axles of others are taken for those of such a car.
        vehicle: Itself.
    """

    def __init__(self, roads: Roads, car: Car, vehicle: str) -> None:
        self._roads, self._graph, self._vehicle = roads, lane_graph_of(roads), vehicle
        self._limits = limits_of(car)
        self._kind = kind_row(self._limits, 0.0)
        self._middle_m = 0.5 * (self._limits.front - self._limits.rear)
        self._cars = CamTracker()
        self._before: dict[str, list[str]] = {name: [] for name in roads.lanes}
        for name in roads.lanes:
            for following in roads.successors(name):
                self._before[following].append(name)
        self._gap(self._graph.names[:1], 0.0, self._outline(Pose2(0.0, 0.0, 0.0)))  # compiles

    def receive(self, item: Incoming) -> None:
        """Receive a CAM."""
        message = item.message
        if isinstance(message, CamRx) and message.station != self._vehicle:
            self._cars.receive(message.body, item.t_ns)

    def columns(self, now: Now) -> Columns:
        """Return gaps and speeds; of none within reach: the reach, and the own speed."""
        others = self._cars.others(now.t_ns, now.pose)
        leader = follower = REACH, now.speed_mps
        for other in others:
            gap_m, same = self._gap(now.lanes, now.along_m, other)
            leader = min(leader, (gap_m, max(0.0, other.speed * same)), key=_gap_of)
            gap_m = self._gap_behind(now, other)
            follower = min(follower, (gap_m, other.speed), key=_gap_of)
        return {
            "leader_gap_m": leader[0], "leader_speed_mps": leader[1],
            "follower_gap_m": follower[0], "follower_speed_mps": follower[1],
        }  # fmt: skip

    def _gap_behind(self, now: Now, other: Other) -> float:
        """Return the gap to a car that comes along the lanes behind [m]; else infinity."""
        own, nearest = self._outline(now.pose), (math.inf, math.inf)
        for way in self._ways_here(now):
            place = self._place_on(self._roads.lanes[way[0]], other)
            if place is not None:
                gap_m, same = self._gap((*way, *now.lanes[1:]), place[0], own)
                nearest = min(nearest, (place[1], gap_m if same > SAME_WAY else math.inf))
        return nearest[1]

    def _gap(self, lanes: Sequence[str], along_m: float, ahead: Other) -> tuple[float, float]:
        """Return the gap from a car on some lanes to another [m], and the cosine between them.

        Infinity if the other is not ahead within reach.
        """
        arrays = self._graph.arrays
        first, numbers = arrays.segment_first, [self._graph.numbers[name] for name in lanes]
        ids = np.concatenate([np.arange(first[n], first[n + 1]) for n in numbers])
        begins = np.concatenate(([0.0], np.cumsum(arrays.segments[ids, LENGTH]))) - along_m
        shape = ahead.x, ahead.y, ahead.yaw, 0.5 * ahead.length, 0.5 * ahead.width
        is_ahead, rear_m, same = _overlap(arrays.segments, ids, begins, self._kind, np.array(shape))
        return (max(0.0, rear_m - self._limits.front), same) if is_ahead else (math.inf, 0.0)

    def _ways_here(self, now: Now) -> Iterator[tuple[str, ...]]:
        """Yield the lanes that lead to the car's place, from each that may hold a car behind it."""
        reach_m = REACH + self._limits.length
        open_ = [(now.lanes[:1], now.along_m)]
        while open_:
            way, length_m = open_.pop()
            yield way
            if length_m < reach_m:
                open_ += [
                    ((before, *way), length_m + self._roads.length_of(before))
                    for before in self._before[way[0]]
                ]

    def _place_on(self, lane: LanePath, other: Other) -> tuple[float, float] | None:
        """Return how far along a lane the rear axle of a car is, and how far beside it [m].

        None: it is not on that lane.
        """
        rear = Pose2(other.x, other.y, other.yaw) @ Pose2(-self._middle_m, 0.0, 0.0)
        along_m, _ = lane.project(rear.x, rear.y)
        beyond, beside, turned = lane.at(along_m).inverse() @ rear
        is_on = abs(beyond) < BEYOND_M and abs(beside) <= 0.5 * lane.width_m
        return (along_m, abs(beside)) if is_on and math.cos(turned) > SAME_WAY else None

    def _outline(self, pose: Pose2) -> Other:
        x, y, yaw = pose @ Pose2(self._middle_m, 0.0, 0.0)
        return Other(x, y, yaw, 0.0, self._limits.length, self._limits.width)


def _gap_of(found: tuple[float, float]) -> float:
    return found[0]


@array_kernel
def _overlap(
    segments: Floats, ids: Ints, begins: Floats, kind: Floats, shape: Floats
) -> tuple[bool, float, float]:
    x, y, yaw, half_length, half_width = shape
    return first_overlap(
        segments, ids, begins, kind, len(ids), REACH, x, y, math.cos(yaw), math.sin(yaw),
        half_length, half_width,
    )  # fmt: skip
