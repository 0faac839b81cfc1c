"""Virtual detectors: which cars stand and drive before a stop line, by their reported positions.

    call       a car within the reach of the approach, whose front is before the line
    extend     one that comes to the line within EXTEND_S, or stands close to it: keeps a green
    presence   one whose front is within PRESENCE_M of the line
    count      cars that have passed the line
    queue      cars that stand, from the line on; queue_m to the tail of the last of them
    gap_s      since a car last kept the green
    arrivals_s when cars that drive will be at the line

A car is where its last CAM received at the roadside, or the overhead cameras, put it, predicted at
its speed for at most `MAX_PREDICTION_NS` and forgotten after `MAX_AGE_NS`. World truth is not an
input.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from scm.clock import NS_PER_S
from scm.geometry import Pose2
from scm.maps.route import Roads
from scm.records.city_map import Group, Junction, StopLine
from scm.traffic.signals.kernel import Program
from scm.v2x.etsi.convert import ASSUMED_LENGTH_M, generated_ns, read_cam, station_id
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.eye_track import EyeTrack

MIN_REACH_M = 2.4  # from how far before a line cars are known, at the least
MESSAGE_AND_NOTICE_S = (
    2.5  # a message may be a second old, the green of others is guaranteed for one
)
EXIT_QUEUE_M = 0.9  # behind a junction, in which standing cars count
PRESENCE_M = 0.25  # one car's length
EXTEND_S = 3.0  # before a line a car that comes keeps the green
KEEP_GREEN_M = 0.5  # before a line a car keeps the green whatever its speed
STANDS_MPS = 0.04  # at most; noise of a standing car is below it
MAX_QUEUE_GAP_M = 0.6  # between two cars of a queue
MAX_LATERAL_M = 0.2  # beside a lane's middle a car is on it
MAX_PREDICTION_NS = 1_200_000_000  # a standing car sends once a second
MAX_AGE_NS = 2_500_000_000  # of a message: two may be lost
MAX_SILENCE_NS = 5 * NS_PER_S  # without any car the detectors may be blind
NIGEL_FRONT_M = 0.23  # front bumper before the rear axle
SAME_CAR_M = 0.2  # less than the distance of two cars side by side
CAM_MEMORY_NS = 2 * NS_PER_S
UNKNOWN_TAG = "tag-"  # the Eye's name of a tag that no car has


class Seen(NamedTuple):
    """A car at `t_ns`: middle of its front bumper, map frame; speed + = forward."""

    who: int
    t_ns: int
    x_m: float
    y_m: float
    yaw_rad: float
    speed_mps: float
    length_m: float


@dataclass(frozen=True, slots=True)
class Detector:
    """What is detected on one lane, or on all lanes of a group; see the module.

    Attributes:
        near: Cars within reach, standing or not.
        ahead: Cars that stand just behind the junction, where this group's cars go.
        gap_s: None: never yet.
        arrivals_s: Of the cars that drive, from now; the first first.
    """

    call: bool = False
    extend: bool = False
    presence: bool = False
    count: int = 0
    near: int = 0
    queue: int = 0
    queue_m: float = 0.0
    ahead: int = 0
    gap_s: float | None = None
    arrivals_s: tuple[float, ...] = ()


class Stretch(NamedTuple):
    """A piece of a lane: a place s on it is `to_line_m - s` before the line."""

    lane: str
    from_m: float
    to_m: float
    to_line_m: float


class Approach(NamedTuple):
    """A stop line, the ways that lead to it, where cars are once they have passed, and go then."""

    line: StopLine
    before: tuple[Stretch, ...]
    beyond: tuple[Stretch, ...]
    ahead: tuple[Stretch, ...]


def reach_of(program: Program, roads: Roads) -> float:
    """Return from how far before a line cars are to be known [m].

    From there a car at the fastest limit comes to the line when the green of others is over.
    """
    change_s = max(times.yellow + times.clearance for times in program.times) / NS_PER_S
    fastest_mps = max(lane.speed_limit_mps for lane in roads.city_map.lanes)
    return max(MIN_REACH_M, fastest_mps * (change_s + MESSAGE_AND_NOTICE_S))


def approaches_of(
    junction: Junction, roads: Roads, reach_m: float = MIN_REACH_M
) -> tuple[Approach, ...]:
    """Return the approaches of a junction, one for each stop line."""
    lanes = roads.city_map.lanes
    feeders: dict[str, list[str]] = {}
    for lane in lanes:
        for following in lane.next:
            feeders.setdefault(following, []).append(lane.name)
    groups = {group.name: group for group in junction.groups}
    return tuple(
        _approach(line, group, feeders, roads, reach_m)
        for group in groups.values()
        for line in roads.stop_lines_of(junction.name, group.name)
    )


def _approach(
    line: StopLine, group: Group, feeders: dict[str, list[str]], roads: Roads, reach_m: float
) -> Approach:
    before = [Stretch(line.lane, max(0.0, line.at_m - reach_m), line.at_m, line.at_m)]
    todo = [(line.lane, line.at_m)]
    while todo:
        lane, gone_m = todo.pop()
        for feeder in feeders.get(lane, []) if gone_m < reach_m else []:
            length_m = roads.length_of(feeder)
            start_m = max(0.0, length_m - (reach_m - gone_m))
            before.append(Stretch(feeder, start_m, length_m, length_m + gone_m))
            todo.append((feeder, gone_m + length_m))
    beyond, ahead = [], []
    for move in group.movements:
        start_m = line.at_m if move.lane == line.lane else 0.0
        beyond.append(Stretch(move.lane, start_m, roads.length_of(move.lane), start_m))
        rest_m = roads.length_of(move.lane) - move.to_m
        if rest_m > 0.0:
            ahead.append(Stretch(move.lane, move.to_m, move.to_m + min(rest_m, EXIT_QUEUE_M), 0.0))
        ahead += [
            Stretch(exit_lane, 0.0, EXIT_QUEUE_M - rest_m, 0.0)
            for exit_lane in roads.successors(move.lane)
            if rest_m < EXIT_QUEUE_M
        ]
    if all(stretch.lane != line.lane for stretch in beyond):
        beyond.append(Stretch(line.lane, line.at_m, roads.length_of(line.lane), line.at_m))
    return Approach(line, tuple(before), tuple(beyond), tuple(ahead))


class _Car(NamedTuple):
    """A car and the lane it was last put on; None: on none."""

    seen: Seen
    lane: str | None
    at_m: float


class JunctionDetectors:
    """The detectors of one junction: add cars, then read them.

    Attributes:
        received_ns: When a car was last received or seen here; None: never.
    """

    def __init__(self, junction: Junction, roads: Roads, reach_m: float = MIN_REACH_M) -> None:
        self.approaches = approaches_of(junction, roads, reach_m)
        self.received_ns: int | None = None
        self._junction, self._roads = junction, roads
        self._cars: dict[int, _Car] = {}
        self._coming: dict[str, dict[int, float]] = {a.line.name: {} for a in self.approaches}
        self._counts = dict.fromkeys(self._coming, 0)
        self._extended_ns: dict[str, int | None] = dict.fromkeys(self._coming)

    def extend_to(self, program: Program) -> None:
        """Know cars from as far before the line as other least times require."""
        reach_m = reach_of(program, self._roads)
        self.approaches = approaches_of(self._junction, self._roads, reach_m)

    def add(self, seen: Seen, arrived_ns: int) -> None:
        """Add a car as received or seen; data older than the known one is ignored."""
        self.received_ns = arrived_ns
        known = self._cars.get(seen.who)
        if known is not None and seen.t_ns <= known.seen.t_ns:
            return
        on = self._roads.nearest(Pose2(seen.x_m, seen.y_m, seen.yaw_rad))
        is_on = on is not None and abs(on.lateral) <= MAX_LATERAL_M
        self._cars[seen.who] = (
            _Car(seen, on.lane, on.s) if on is not None and is_on else _Car(seen, None, 0.0)
        )

    def sees(self, now_ns: int) -> bool:
        """Return whether any car was received lately."""
        return self.received_ns is not None and now_ns - self.received_ns <= MAX_SILENCE_NS

    def read(self, now_ns: int) -> dict[str, Detector]:
        """Return the detectors now, by the stop lines' names; call it once a step."""
        self._cars = {
            who: car for who, car in self._cars.items() if now_ns - car.seen.t_ns <= MAX_AGE_NS
        }
        by_lane: dict[str, list[_Car]] = {}
        for car in self._cars.values():
            if car.lane is not None:
                by_lane.setdefault(car.lane, []).append(car)
        return {a.line.name: self._read(a, by_lane, now_ns) for a in self.approaches}

    def by_group(self, lines: dict[str, Detector]) -> dict[str, Detector]:
        """Return the detectors of all lanes of each group together."""
        found: dict[str, list[Detector]] = {}
        for approach in self.approaches:
            found.setdefault(approach.line.group, []).append(lines[approach.line.name])
        return {group: _together(detectors) for group, detectors in found.items()}

    def _read(self, approach: Approach, by_lane: dict[str, list[_Car]], now_ns: int) -> Detector:
        name = approach.line.name
        places: dict[int, tuple[float, _Car]] = {}
        for stretch in approach.before:
            for car in by_lane.get(stretch.lane, []):
                if stretch.from_m <= car.at_m <= stretch.to_m:
                    left_m = stretch.to_line_m - car.at_m - _driven_m(car.seen, now_ns)
                    places[car.seen.who] = (left_m, car)
        self._count(approach, places, by_lane)
        # A car that should be over the line by now may have braked: it stays until it reports so.
        near = sorted((max(0.0, left), car.seen.who, car.seen) for left, car in places.values())
        queue, queue_m = _queue(near)
        extend = any(_keeps_green(left, seen) for left, _, seen in near)
        if extend:
            self._extended_ns[name] = now_ns
        extended_ns = self._extended_ns[name]
        return Detector(
            call=bool(near),
            extend=extend,
            presence=any(left <= PRESENCE_M for left, _, _ in near),
            count=self._counts[name],
            near=len(near),
            queue=queue,
            queue_m=queue_m,
            ahead=_standing(approach.ahead, by_lane),
            gap_s=None if extended_ns is None else (now_ns - extended_ns) / NS_PER_S,
            arrivals_s=tuple(
                left / seen.speed_mps for left, _, seen in near if seen.speed_mps > STANDS_MPS
            ),
        )

    def _count(
        self,
        approach: Approach,
        places: dict[int, tuple[float, _Car]],
        by_lane: dict[str, list[_Car]],
    ) -> None:
        """Count who was coming and is now beyond the line."""
        name = approach.line.name
        beyond = {
            car.seen.who
            for stretch in approach.beyond
            for car in by_lane.get(stretch.lane, [])
            if stretch.from_m < car.at_m <= stretch.to_m
        }
        coming = self._coming[name]
        self._counts[name] += len(beyond & coming.keys())
        for who in list(coming):
            if who in beyond or who not in self._cars:
                del coming[who]
        coming.update({who: left for who, (left, _) in places.items()})


def _driven_m(seen: Seen, now_ns: int) -> float:
    return max(0.0, seen.speed_mps) * min(max(0, now_ns - seen.t_ns), MAX_PREDICTION_NS) / NS_PER_S


def _keeps_green(left_m: float, seen: Seen) -> bool:
    moving = seen.speed_mps > STANDS_MPS and left_m <= seen.speed_mps * EXTEND_S
    return moving or left_m <= KEEP_GREEN_M


def _queue(near: list[tuple[float, int, Seen]]) -> tuple[int, float]:
    """Return how many cars stand one behind the other from the line on, and how far back [m]."""
    count, tail_m = 0, 0.0
    for left_m, _, seen in near:
        if abs(seen.speed_mps) > STANDS_MPS or left_m > tail_m + MAX_QUEUE_GAP_M:
            break
        count, tail_m = count + 1, left_m + seen.length_m
    return count, tail_m


def _standing(stretches: Iterable[Stretch], by_lane: dict[str, list[_Car]]) -> int:
    return sum(
        stretch.from_m <= car.at_m <= stretch.to_m and abs(car.seen.speed_mps) <= STANDS_MPS
        for stretch in stretches
        for car in by_lane.get(stretch.lane, [])
    )


def _together(detectors: list[Detector]) -> Detector:
    gaps = [d.gap_s for d in detectors if d.gap_s is not None]
    return Detector(
        call=any(d.call for d in detectors),
        extend=any(d.extend for d in detectors),
        presence=any(d.presence for d in detectors),
        count=sum(d.count for d in detectors),
        near=sum(d.near for d in detectors),
        queue=sum(d.queue for d in detectors),
        queue_m=max(d.queue_m for d in detectors),
        ahead=sum(d.ahead for d in detectors),
        gap_s=min(gaps) if gaps else None,
        arrivals_s=tuple(sorted(arrival for d in detectors for arrival in d.arrivals_s)),
    )


class Sightings:
    """Turns CAMs and tracks into `Seen`.

    A track and the CAMs of the same car count as one car, by its name. An unknown tag is a car of
    its own, unless a car that sent a CAM lately is there.
    """

    def __init__(self) -> None:
        self._senders: dict[int, Seen] = {}

    def of_cam(self, message: CamRx) -> Seen | None:
        """Return the car of a CAM, or None if it lacks a position, heading or speed."""
        cam = read_cam(message.body)
        if cam.place is None or cam.yaw_rad is None or cam.speed_mps is None:
            return None
        t_ns, length_m = generated_ns(message.body, message.t_ns), cam.length_m or ASSUMED_LENGTH_M
        seen = Seen(cam.station_id, t_ns, *cam.place, cam.yaw_rad, cam.speed_mps, length_m)
        self._senders[seen.who] = seen
        return seen

    def of_track(self, track: EyeTrack) -> Seen | None:
        """Return the car of a track, or None if it is stale or a sender of CAMs."""
        if track.stale:
            return None
        who, yaw = station_id(track.vehicle), track.yaw_rad
        sender = self._senders.get(who)
        x = track.x_m + NIGEL_FRONT_M * math.cos(yaw)
        y = track.y_m + NIGEL_FRONT_M * math.sin(yaw)
        length_m = ASSUMED_LENGTH_M if sender is None else sender.length_m
        seen = Seen(who, track.t_ns, x, y, yaw, track.speed_mps, length_m)
        is_sender = track.vehicle.startswith(UNKNOWN_TAG) and self._is_sender(seen)
        return None if is_sender else seen

    def _is_sender(self, seen: Seen) -> bool:
        """Return whether a car that sent a CAM lately is there; forget those that did not."""
        self._senders = {
            who: one for who, one in self._senders.items() if seen.t_ns - one.t_ns <= CAM_MEMORY_NS
        }
        return any(
            math.dist((seen.x_m, seen.y_m), (one.x_m, one.y_m))
            < SAME_CAR_M + abs(one.speed_mps) * max(0, seen.t_ns - one.t_ns) / NS_PER_S
            for one in self._senders.values()
        )
