"""Counters: who passes a lane, how long a junction delays it, and how many stand before it.

    passage      the front passes the line of the lane; without a line, the rear axle its middle
    delay        from entering the lane before the line to leaving the junction, beyond the time
                 that this way takes at the limits
    stop         slower than 0.03 m/s, after having been faster than 0.10
    queue        cars that stopped and have not been faster than 0.10 since
    saturation   flow x saturation headway / share of green; the headway is that of cars that had
                 stopped and follow one another

A passage counts once: a car must have been before the place, or have come from the lane before, and
4 s must lie between two of its passages on a lane.
"""

import itertools
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import fmean

from scm.clock import NS_PER_S, seconds
from scm.maps.route import OnLane, Roads
from scm.records.traffic import ApproachCount, LaneCount
from scm.traffic.observation.car_estimates import CarEstimate
from scm.traffic.observation.lane_tracking import Followed, Lines
from scm.traffic.signals.detectors import NIGEL_FRONT_M
from scm.v2x.etsi.convert import ASSUMED_LENGTH_M
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.traffic_counts import TrafficCounts

WINDOW_NS = 900 * NS_PER_S  # of all counts; a quarter of an hour is usual
MIN_PASSAGE_GAP_NS = 4 * NS_PER_S  # of one car on one lane: noise at the line is no passage
ARMED_BEFORE_M = 0.02  # so far before the line a car must have been, beyond the noise
STANDS_MPS, MOVES_MPS = 0.03, 0.10
MAX_QUEUE_HEADWAY_S = 8.0  # a car that comes later did not leave the queue with the one before
MIN_HEADWAYS = 5  # fewer give no mean
SAMPLE_NS = NS_PER_S
SIGNAL_DELAY_S = (10.0, 20.0, 35.0, 55.0, 80.0)  # limits of A to E with signals, HCM
SIGN_DELAY_S = (10.0, 15.0, 25.0, 35.0, 50.0)  # and without
LEVELS = "ABCDEF"


@dataclass(slots=True)
class _Visit:
    """A car on one lane, and over the junction behind it."""

    lane: str
    from_ns: int
    from_m: float
    armed: bool
    front_m: float
    t_ns: int
    passed_ns: int | None = None
    stops: int = 0
    stands: bool = False
    moved: bool = True


@dataclass(slots=True)
class _Log:
    """What was counted on a lane; times [ns] with what belongs to them, oldest first."""

    passages: deque[tuple[int, float, bool]] = field(default_factory=deque)
    delays: deque[tuple[int, float, int]] = field(default_factory=deque)
    queues: deque[tuple[int, int]] = field(default_factory=deque)
    greens: deque[tuple[int, bool]] = field(default_factory=deque)

    def forget(self, before_ns: int) -> None:
        rows: tuple[deque[tuple[int, float, bool]] | deque[tuple[int, float, int]]
                    | deque[tuple[int, int]] | deque[tuple[int, bool]], ...]  # fmt: skip
        rows = (self.passages, self.delays, self.queues, self.greens)
        for row in rows:
            while row and row[0][0] < before_ns:
                row.popleft()


class Counters:
    """Counts on all lanes of a map."""

    def __init__(self, roads: Roads, lines: Mapping[str, Lines]) -> None:
        self._roads, self._lines = roads, lines
        self._logs: dict[str, _Log] = {}
        self._visits: dict[str, _Visit] = {}
        self._before: dict[str, _Visit] = {}
        self._last: dict[tuple[str, str], int] = {}
        self._began_ns: int | None = None
        self._next_sample_ns = 0

    def see(self, estimate: CarEstimate, followed: Followed | None) -> None:
        """Add where a car is now."""
        if followed is None:
            self.forget(estimate.vehicle)
            return
        place, vehicle = followed.place, estimate.vehicle
        visit = self._visits.get(vehicle)
        if visit is None or visit.lane != place.lane:
            visit = self._change(estimate, place, visit)
        self._stops(visit, estimate.speed)
        self._pass(visit, estimate, place)

    def forget(self, vehicle: str) -> None:
        """Forget a car that is gone, or beside all lanes."""
        self._visits.pop(vehicle, None)
        self._before.pop(vehicle, None)

    def sample(self, now_ns: int, spats: Mapping[str, Spat]) -> None:
        """Note queues and greens, once a second."""
        if self._began_ns is None:
            self._began_ns = now_ns
        if now_ns < self._next_sample_ns:
            return
        self._next_sample_ns = now_ns + SAMPLE_NS
        for lane, line in self._lines.items():
            log = self._log(lane)
            log.queues.append((now_ns, len(self._queue(lane))))
            spat = spats.get(line.junction)
            for group in spat.groups if spat is not None else ():
                if group.group == line.group:
                    log.greens.append((now_ns, group.colour == "green"))
        for log in self._logs.values():
            log.forget(now_ns - WINDOW_NS)
        old = now_ns - MIN_PASSAGE_GAP_NS
        self._last = {key: at for key, at in self._last.items() if at > old}

    def counts(self, now_ns: int) -> TrafficCounts:
        """Return all counts of the window that ends now."""
        began_ns = now_ns if self._began_ns is None else self._began_ns
        span_s = seconds(min(WINDOW_NS, now_ns - began_ns))
        lanes = [
            LaneCount(lane=name, **self._flow(log, span_s))  # type: ignore[arg-type]
            for name, log in self._logs.items()
            if log.passages
        ]
        approaches = [self._approach(lane, line, span_s) for lane, line in self._lines.items()]
        return TrafficCounts(
            t_ns=now_ns, window_s=span_s, lanes=tuple(lanes), approaches=tuple(approaches)
        )

    def _log(self, lane: str) -> _Log:
        return self._logs.setdefault(lane, _Log())

    def _change(self, estimate: CarEstimate, place: OnLane, old: _Visit | None) -> _Visit:
        """Begin a visit; the one before goes on until the junction is behind the car."""
        vehicle, earlier = estimate.vehicle, self._before.get(estimate.vehicle)
        if earlier is not None and old is not None and place.lane == earlier.lane:
            self._visits[vehicle] = earlier  # it was not gone: noise at the joint
            del self._before[vehicle]
            return earlier
        if earlier is not None and old is not None:
            successors = self._roads.successors(old.lane)
            if place.lane in successors:
                self._leave(earlier, old.lane, estimate.t_ns)
                del self._before[vehicle]
            elif place.lane not in self._roads.successors(earlier.lane):
                del self._before[vehicle]
        follows = old is not None and place.lane in self._roads.successors(old.lane)
        if old is not None and follows and old.lane in self._lines:
            self._before[vehicle] = old
        front = self._front(place)
        visit = _Visit(place.lane, estimate.t_ns, place.s, follows, front, estimate.t_ns)
        if old is None:  # a car that stands where it is first seen has not stopped there
            visit.moved = abs(estimate.speed) > MOVES_MPS
        else:
            visit.stands, visit.moved = old.stands, old.moved
        self._visits[vehicle] = visit
        return visit

    def _front(self, place: OnLane) -> float:
        """Return how far a car is beyond the place where it is counted [m]."""
        line = self._lines.get(place.lane)
        if line is None:
            return place.s - self._roads.length_of(place.lane) / 2.0
        return place.s + NIGEL_FRONT_M - line.at_m

    def _stops(self, visit: _Visit, speed: float) -> None:
        if abs(speed) < STANDS_MPS and visit.moved:
            visit.stands, visit.moved = True, False
            visit.stops += 1
        elif abs(speed) > MOVES_MPS:
            visit.stands, visit.moved = False, True

    def _pass(self, visit: _Visit, estimate: CarEstimate, place: OnLane) -> None:
        front = self._front(place)
        before_m, before_ns = visit.front_m, visit.t_ns
        visit.front_m, visit.t_ns = front, estimate.t_ns
        if front < -ARMED_BEFORE_M:
            visit.armed = True
        if front < 0.0 or not visit.armed or visit.passed_ns is not None:
            return
        key = (estimate.vehicle, visit.lane)
        if estimate.t_ns - self._last.get(key, -MIN_PASSAGE_GAP_NS) < MIN_PASSAGE_GAP_NS:
            return
        share = -before_m / (front - before_m) if before_m < 0.0 <= front else 1.0
        visit.passed_ns = before_ns + round(share * (estimate.t_ns - before_ns))
        self._last[key] = estimate.t_ns
        self._log(visit.lane).passages.append(
            (visit.passed_ns, abs(estimate.speed), visit.stops > 0)
        )

    def _leave(self, visit: _Visit, way: str, now_ns: int) -> None:
        """Note the delay of a car that has left the junction."""
        if visit.passed_ns is None:
            return
        roads = self._roads
        lane, over = roads.definition(visit.lane), roads.definition(way)
        free_s = (roads.length_of(visit.lane) - visit.from_m) / lane.speed_limit_mps
        free_s += roads.length_of(way) / over.speed_limit_mps
        delay_s = max(0.0, seconds(now_ns - visit.from_ns) - free_s)
        self._log(visit.lane).delays.append((now_ns, delay_s, visit.stops))

    def _queue(self, lane: str) -> list[float]:
        """Return how far the fronts of the cars that stand on a lane are before its line [m]."""
        return [
            -visit.front_m
            for visit in self._visits.values()
            if visit.lane == lane and visit.stands and visit.passed_ns is None
        ]

    def _flow(self, log: _Log, span_s: float) -> dict[str, float | int | None]:
        times = [at_ns for at_ns, _, _ in log.passages]
        headway = seconds(times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else None
        return {
            "passed": len(times),
            "flow_hz": len(times) / span_s if span_s > 0.0 else 0.0,
            "headway_s": headway,
            "speed_mps": fmean(speed for _, speed, _ in log.passages) if times else None,
        }

    def _approach(self, lane: str, line: Lines, span_s: float) -> ApproachCount:
        log = self._log(lane)
        flow = self._flow(log, span_s)
        queue = self._queue(lane)
        delay = fmean(delay for _, delay, _ in log.delays) if log.delays else None
        headway = _saturation_headway_s(log)
        green = fmean(is_green for _, is_green in log.greens) if log.greens else None
        saturation = None
        if headway is not None and green:
            saturation = (flow["flow_hz"] or 0.0) * headway / green
        level = ""
        if delay is not None:
            level = level_of(delay, signal=bool(line.group), saturation=saturation)
        return ApproachCount(
            junction=line.junction,
            lane=lane,
            delay_s=delay,
            level=level,
            stops=fmean(stops for _, _, stops in log.delays) if log.delays else 0.0,
            queue=len(queue),
            queue_m=max(queue) + ASSUMED_LENGTH_M if queue else 0.0,
            queue_most=share_below([count for _, count in log.queues], 0.95),
            saturation_headway_s=headway,
            saturation=saturation,
            **flow,  # type: ignore[arg-type]
        )


def _saturation_headway_s(log: _Log) -> float | None:
    """Return the mean headway of cars that leave a queue behind one another; None: too few."""
    rows = list(log.passages)
    gaps = [
        seconds(after[0] - before[0])
        for before, after in itertools.pairwise(rows)
        if before[2] and after[2] and seconds(after[0] - before[0]) < MAX_QUEUE_HEADWAY_S
    ]
    return fmean(gaps) if len(gaps) >= MIN_HEADWAYS else None


def level_of(delay_s: float, *, signal: bool, saturation: float | None = None) -> str:
    """Return the level of service of a mean control delay; over saturation it is `F`.

    The limits are those of the Highway Capacity Manual for full-size junctions, and time is not
    scaled: here they only compare approaches with each other.
    """
    if saturation is not None and saturation > 1.0:
        return LEVELS[-1]
    limits = SIGNAL_DELAY_S if signal else SIGN_DELAY_S
    return LEVELS[sum(1 for limit in limits if delay_s > limit)]


def share_below(samples: Sequence[int], share: float) -> int:
    """Return the least value that this share of the samples does not exceed; 0 without any."""
    if not samples:
        return 0
    ordered = sorted(samples)
    return ordered[min(len(ordered) - 1, max(0, -int(-share * len(ordered) // 1) - 1))]
