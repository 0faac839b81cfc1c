"""Traffic violations, found in estimated poses: red light, stop line, speed, wrong way, collision.

    red light   the front passed the line when its group had been red for 0.3 s, and went on 0.20 m
    stop line   it passed the line at red by 0.05 m and stands there; or it passed a stop sign's
                line and was never slower than 0.05 m/s on the last 0.30 m
    speed       a tenth and 0.02 m/s over the limit, for a second
    wrong way   0.30 m along a lane of the other direction alone, or 0.50 m backwards
    collision   a contact that the world reports

A limit counts as passed by three standard deviations of the estimate, so noise around it causes no
report. Each violation is reported once: for a line once a visit, for speed and direction until it
has been absent for three seconds, for a pair of cars until three seconds without contact.
"""

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from scm.clock import NS_PER_S, seconds
from scm.geometry import Pose2
from scm.maps.route import Roads
from scm.records.signals import SignalGroup
from scm.records.traffic import Kind, TrackPoint
from scm.traffic.observation.car_estimates import CarEstimate
from scm.traffic.observation.lane_tracking import Followed, Lines
from scm.traffic.signals.detectors import NIGEL_FRONT_M
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.violation import Violation

SIGMAS = 3.0  # by which every limit must be passed
RED_GRACE_S = 0.3  # after a red began; a car cannot react faster
DRIVEN_ON_M, BEYOND_LINE_M = 0.20, 0.05  # past a line: drove on, and stands beyond it
STANDS_MPS, STOPPED_MPS = 0.02, 0.05  # stands beyond a line; has stopped at a sign
STANDS_NS = NS_PER_S // 2
STOP_ZONE_M = 0.30  # before a stop sign's line, in which a car must stop
SPEED_TOLERANCE_RATIO, SPEED_TOLERANCE_MPS = 1.1, 0.02  # above the limit
MIN_DURATION_NS = NS_PER_S  # of speeding and of wrong way
CLEARS_NS = 3 * NS_PER_S  # without it, before the same may be reported again
MIN_WRONG_WAY_M, MIN_REVERSE_M = 0.30, 0.50
MIN_MOVING_MPS = 0.03  # slower, a direction of travel is noise
TRACK_POINTS = 50  # of a report: five seconds
HISTORY_SAMPLES = 40  # of each group: four seconds
MAX_SIGNAL_AGE_NS = NS_PER_S // 2  # what was shown longer ago proves nothing


class Shown(NamedTuple):
    """What a group showed, and since when that was red."""

    junction: str
    group: SignalGroup
    since_ns: int


class SignalHistory:
    """The last seconds of every group."""

    def __init__(self) -> None:
        self._rows: dict[tuple[str, str], deque[tuple[int, SignalGroup]]] = {}

    def receive(self, spat: Spat) -> None:
        """Add what a junction shows."""
        for group in spat.groups:
            row = self._rows.setdefault((spat.junction, group.group), deque(maxlen=HISTORY_SAMPLES))
            if row and spat.t_ns < row[-1][0]:
                row.clear()  # its clock went back: what came before is another run's
            row.append((spat.t_ns, group))

    def red_at(self, junction: str, group: str, t_ns: int, grace_s: float) -> Shown | None:
        """Return what a group showed at a time if it had been red for longer than the grace.

        None also if no SPaT came within half a second before.
        """
        row = self._rows.get((junction, group), ())
        shown = next(((at, what) for at, what in reversed(row) if at <= t_ns), None)
        if shown is None or t_ns - shown[0] > MAX_SIGNAL_AGE_NS or shown[1].colour != "red":
            return None
        if t_ns - shown[1].since_ns < grace_s * NS_PER_S:
            return None
        return Shown(junction, shown[1], shown[1].since_ns)

    def is_not_red(self, junction: str, group: str) -> bool:
        """Return whether the newest sample of a group is another colour."""
        row = self._rows.get((junction, group))
        return bool(row) and row is not None and row[-1][1].colour != "red"


class _Past(NamedTuple):
    """A car that has passed its line at red and has neither driven on nor stopped yet."""

    t_ns: int
    shown: Shown


@dataclass(slots=True)
class _Lasting:
    """A condition that counts once it has lasted, and again once it has been absent for a while."""

    since_ns: int | None = None
    way_m: float = 0.0
    reported: bool = False
    good_ns: int | None = None

    def bad(self, now_ns: int, way_m: float) -> None:
        self.good_ns = None
        if self.since_ns is None:
            self.since_ns, self.way_m = now_ns, 0.0
        self.way_m += way_m

    def lasts_ns(self, now_ns: int) -> int:
        return 0 if self.since_ns is None else now_ns - self.since_ns

    def good(self, now_ns: int) -> None:
        self.since_ns = None
        if self.good_ns is None:
            self.good_ns = now_ns
        if now_ns - self.good_ns >= CLEARS_NS:
            self.reported = False


@dataclass(slots=True)
class _Car:
    """The state of one car."""

    track: deque[TrackPoint] = field(default_factory=lambda: deque(maxlen=TRACK_POINTS))
    lane: str = ""
    front_m: float = 0.0
    t_ns: int = 0
    past: _Past | None = None
    line_reported: bool = False
    stands_ns: int | None = None
    came_m: float = 0.0
    slowest_mps: float = math.inf
    speed: _Lasting = field(default_factory=_Lasting)
    way: _Lasting = field(default_factory=_Lasting)


class Judge:
    """Finds violations; every one that `see` and `hit` return is to be reported."""

    def __init__(self, roads: Roads, lines: Mapping[str, Lines]) -> None:
        self._roads, self._lines = roads, lines
        self._cars: dict[str, _Car] = {}
        self._limits: dict[str, list[tuple[float, float]]] = {}
        self._contacts: dict[frozenset[str], int] = {}
        self._number = 0
        self.signals = SignalHistory()

    def forget(self, vehicle: str) -> None:
        """Forget a car that is gone."""
        self._cars.pop(vehicle, None)

    def _car(self, vehicle: str) -> _Car:
        car = self._cars.get(vehicle)
        if car is None:
            car = self._cars[vehicle] = _Car()
        return car

    def see(self, estimate: CarEstimate, followed: Followed | None) -> list[Violation]:
        """Check where a car is now."""
        car = self._car(estimate.vehicle)
        if car.track and estimate.t_ns <= car.track[-1].t_ns:
            return []
        span_s = seconds(estimate.t_ns - car.track[-1].t_ns) if car.track else 0.0
        car.track.append(_point(estimate))
        found = [
            self._line(car, estimate, followed),
            self._speed(car, estimate, followed),
            self._direction(car, estimate, followed, abs(estimate.speed) * span_s),
        ]
        return [violation for violation in found if violation is not None]

    def hit(self, contact: Contact) -> list[Violation]:
        """Check a contact that the world reports."""
        found = []
        for other in contact.against:
            pair = frozenset((contact.vehicle, other))
            last_ns = self._contacts.get(pair)
            self._contacts[pair] = contact.t_ns
            if last_ns is None or contact.t_ns - last_ns >= CLEARS_NS:
                found.append(self._collision(contact, other))
        return found

    def _collision(self, contact: Contact, other: str) -> Violation:
        car = self._car(contact.vehicle)
        dv_mps = math.hypot(contact.dvx_mps, contact.dvy_mps)
        last = car.track[-1] if car.track else None
        self._number += 1
        return Violation(
            vehicle=contact.vehicle,
            number=self._number,
            kind="collision",
            t_ns=contact.t_ns,
            x_m=last.x_m if last is not None else 0.0,
            y_m=last.y_m if last is not None else 0.0,
            lane=car.lane,
            text=f"{contact.vehicle} hit {other}: {dv_mps:.2f} m/s in one blow",
            certainty=1.0,
            sources=("contact", *_sources(car)),
            against=(other,),
            track=tuple(car.track),
        )

    def _line(
        self, car: _Car, estimate: CarEstimate, followed: Followed | None
    ) -> Violation | None:
        """Check the line of the lane that a car is on, or has just left over the junction."""
        if followed is None:
            car.lane, car.past = "", None
            return None
        lane, s = followed.place.lane, followed.place.s
        line = self._lines.get(lane)
        if line is None:
            line, s = self._behind(car, lane, s)
            if line is None:
                car.lane, car.past = "", None
                return None
            lane = car.lane
        front = s + NIGEL_FRONT_M - line.at_m
        if lane != car.lane:
            car.lane, car.front_m, car.t_ns = lane, front, estimate.t_ns
            car.past, car.line_reported, car.stands_ns = None, False, None
            car.came_m, car.slowest_mps = front, math.inf
        if front > -STOP_ZONE_M - NIGEL_FRONT_M:
            car.slowest_mps = min(car.slowest_mps, abs(estimate.speed))
        if line.group:
            return self._at_signal(car, estimate, line, front)
        return self._at_sign(car, estimate, line, front)

    def _behind(self, car: _Car, lane: str, s: float) -> tuple[Lines | None, float]:
        """Return the line that lies behind a car on the way over a junction, and its place."""
        if not car.lane or lane not in self._roads.successors(car.lane):
            return None, s
        return self._lines[car.lane], s + self._roads.length_of(car.lane)

    def _at_signal(
        self, car: _Car, estimate: CarEstimate, line: Lines, front: float
    ) -> Violation | None:
        before_m, before_ns = car.front_m, car.t_ns
        car.front_m, car.t_ns = front, estimate.t_ns
        if before_m <= 0.0 < front:
            share = -before_m / (front - before_m)
            at_ns = before_ns + round(share * (estimate.t_ns - before_ns))
            grace_s = RED_GRACE_S + SIGMAS * estimate.std_m / max(abs(estimate.speed), STANDS_MPS)
            shown = self.signals.red_at(line.junction, line.group, at_ns, grace_s)
            car.past = None if shown is None else _Past(at_ns, shown)
        if front <= 0.0 or car.line_reported:
            car.past = None if front <= 0.0 else car.past
            return None
        return self._past_red(car, estimate, line, front) if car.past is not None else None

    def _past_red(
        self, car: _Car, estimate: CarEstimate, line: Lines, front: float
    ) -> Violation | None:
        """Check a car whose front has passed its line at red."""
        assert car.past is not None  # noqa: S101 checked by the caller
        sure = SIGMAS * estimate.std_m
        if front >= DRIVEN_ON_M + sure:
            car.line_reported = True
            age_s = seconds(car.past.t_ns - car.past.shown.since_ns)
            text = (
                f"{estimate.vehicle} passed the line of {line.junction} at {_where(line)} at red, "
                f"{age_s:.1f} s after it began, and drove on"
            )
            return self._violation(
                "red_light", car, estimate, text, front / _std_m(estimate), car.past
            )
        if self.signals.is_not_red(line.junction, line.group):
            car.past = None
            return None
        if abs(estimate.speed) > STANDS_MPS + SIGMAS * estimate.std_mps:
            car.stands_ns = None
            return None
        if car.stands_ns is None:
            car.stands_ns = estimate.t_ns
        if front < BEYOND_LINE_M + sure or estimate.t_ns - car.stands_ns < STANDS_NS:
            return None
        car.line_reported = True
        text = (
            f"{estimate.vehicle} stands {front:.2f} m beyond the line of {line.junction} at "
            f"{_where(line)}, which it passed at red"
        )
        return self._violation("stop_line", car, estimate, text, front / _std_m(estimate), car.past)

    def _at_sign(
        self, car: _Car, estimate: CarEstimate, line: Lines, front: float
    ) -> Violation | None:
        car.front_m, car.t_ns = front, estimate.t_ns
        if (
            line.sign != "stop"
            or car.line_reported
            or front < DRIVEN_ON_M + SIGMAS * estimate.std_m
        ):
            return None
        car.line_reported = True
        beyond = car.slowest_mps - STOPPED_MPS
        came_from_afar = car.came_m < -STOP_ZONE_M
        if not came_from_afar or beyond <= SIGMAS * estimate.std_mps:
            return None
        text = (
            f"{estimate.vehicle} passed the stop sign of {line.junction} without a stop: never "
            f"slower than {car.slowest_mps:.2f} m/s before the line"
        )
        return self._violation(
            "stop_line", car, estimate, text, beyond / max(estimate.std_mps, 1e-6)
        )

    def _speed(
        self, car: _Car, estimate: CarEstimate, followed: Followed | None
    ) -> Violation | None:
        if followed is None:
            car.speed.good(estimate.t_ns)
            return None
        limit = self._limit(followed)
        over = abs(estimate.speed) - limit * SPEED_TOLERANCE_RATIO - SPEED_TOLERANCE_MPS
        if over <= SIGMAS * estimate.std_mps:
            car.speed.good(estimate.t_ns)
            return None
        car.speed.bad(estimate.t_ns, 0.0)
        if car.speed.reported or car.speed.lasts_ns(estimate.t_ns) < MIN_DURATION_NS:
            return None
        car.speed.reported = True
        text = (
            f"{estimate.vehicle} drives {abs(estimate.speed):.2f} m/s on {followed.place.lane}, "
            f"where {limit:.2f} m/s are allowed"
        )
        return self._violation("speed", car, estimate, text, over / max(estimate.std_mps, 1e-6))

    def _limit(self, followed: Followed) -> float:
        lane = followed.place.lane
        limits = self._limits.get(lane)
        if limits is None:
            limits = self._limits[lane] = self._roads.limits_on(lane)
        return next(limit for at, limit in reversed(limits) if at <= max(followed.place.s, 0.0))

    def _direction(
        self, car: _Car, estimate: CarEstimate, followed: Followed | None, way_m: float
    ) -> Violation | None:
        lane, needed, how = "", MIN_REVERSE_M, "drives backwards on"
        if followed is not None and estimate.speed < -MIN_MOVING_MPS - SIGMAS * estimate.std_mps:
            lane = followed.place.lane
        elif followed is None and estimate.speed > MIN_MOVING_MPS + SIGMAS * estimate.std_mps:
            lane, needed, how = (
                self._against(estimate),
                MIN_WRONG_WAY_M,
                "drives against the direction of",
            )
        if not lane:
            car.way.good(estimate.t_ns)
            return None
        car.way.bad(estimate.t_ns, way_m)
        is_sure = car.way.way_m - needed >= SIGMAS * estimate.std_m
        if car.way.reported or not is_sure or car.way.lasts_ns(estimate.t_ns) < MIN_DURATION_NS:
            return None
        car.way.reported = True
        text = f"{estimate.vehicle} {how} {lane}, for {car.way.way_m:.2f} m so far"
        return self._violation("wrong_way", car, estimate, text, car.way.way_m / _std_m(estimate))

    def _against(self, estimate: CarEstimate) -> str:
        """Return the lane of the other direction on which a car is; empty: on none."""
        turned = Pose2(estimate.x, estimate.y, estimate.yaw + math.pi)
        place = self._roads.nearest(turned)
        if place is None:
            return ""
        room = self._roads.definition(place.lane).width_m / 2.0 - SIGMAS * estimate.std_m
        return place.lane if abs(place.lateral) < room else ""

    def _violation(
        self,
        kind: Kind,
        car: _Car,
        estimate: CarEstimate,
        text: str,
        sigmas: float,
        past: _Past | None = None,
    ) -> Violation:
        self._number += 1
        place = car.lane if kind in ("red_light", "stop_line") else ""
        signal: SignalGroup | None = past.shown.group if past is not None else None
        at_m = car.front_m + self._lines[place].at_m - NIGEL_FRONT_M if place else 0.0
        return Violation(
            vehicle=estimate.vehicle,
            number=self._number,
            kind=kind,
            t_ns=past.t_ns if past is not None else estimate.t_ns,
            x_m=estimate.x,
            y_m=estimate.y,
            lane=place,
            at_m=at_m,
            text=text,
            certainty=0.5 * (1.0 + math.erf(sigmas / math.sqrt(2.0))),
            sources=(*_sources(car), *(("spat",) if past is not None else ())),
            junction=past.shown.junction if past is not None else "",
            signal=signal,
            track=tuple(car.track),
        )


def _point(estimate: CarEstimate) -> TrackPoint:
    return TrackPoint(
        t_ns=estimate.t_ns,
        x_m=estimate.x,
        y_m=estimate.y,
        yaw_rad=estimate.yaw,
        speed_mps=estimate.speed,
        source=estimate.source,
    )


def _sources(car: _Car) -> tuple[str, ...]:
    return tuple(sorted({point.source for point in car.track}))


def _std_m(estimate: CarEstimate) -> float:
    return max(estimate.std_m, 1e-6)


def _where(line: Lines) -> str:
    return f"group {line.group!r}"
