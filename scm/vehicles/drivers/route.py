"""Follow a path through the city: stop at red, keep a distance, never block a junction.

Of all that limits the speed, the slowest wins: the lane and its curves, the end of the route, the
next stop line, the car ahead (time gap in flow, a fixed gap at rest), the order to stop.
"""

from typing import NamedTuple

from scm.maps.route import Path
from scm.vehicles.driver import CarLimits, RouteView
from scm.vehicles.drivers.ahead import Ahead, cars_ahead
from scm.vehicles.drivers.pace import STANDSTILL, Pace, free_speeds, stopping_speed
from scm.vehicles.drivers.steering import Steering
from scm.vehicles.drivers.stop_lines import STANDSTILL_GAP, StopLines
from scm.vehicles.drivers.track import Track

TIME_GAP = 0.8
ARRIVED_WITHIN = 0.02


class _Limit(NamedTuple):
    speed: float
    reason: str | None


class RouteDriver:
    """Drives one car along a path.

    Attributes:
        path: The way.
        s: Where the rear axle is along it, laps included [m]; None before the first look.
        cross_track: Rear axle beside it [m], + = left.
        waiting_for: What holds the car at rest: `signal`, `vehicle`, `stop`, or None.
        trip_m: Length of the trip; None: without end.
    """

    def __init__(
        self,
        path: Path,
        limits: CarLimits,
        *,
        speed: float | None = None,
        trip_m: float | None = None,
        near: float | None = None,
    ) -> None:
        self.limits = limits
        self.cross_track = 0.0
        self.waiting_for: str | None = None
        self._pace = Pace(limits)
        self._steering = Steering(limits)
        self.follow(path, speed=speed, trip_m=trip_m, near=near)

    def follow(
        self,
        path: Path,
        *,
        speed: float | None = None,
        trip_m: float | None = None,
        near: float | None = None,
    ) -> None:
        """Take another path from now on, without a jerk.

        Args:
            path: An open path ends the drive with the rear axle at its end, a closed one never.
            speed: Wished on free road [m/s]; None: what lanes and curves allow.
            trip_m: How far the trip goes, from where the car begins; None: to the end of the path.
            near: Where along the path the car is, roughly [m]; None: at the place closest to it.
        """
        self.path = path
        self.trip_m = trip_m
        self.s: float | None = None
        self._started = 0.0
        self._near = near
        self._speed = speed
        self._track = Track(path)
        self._free = free_speeds(self._track, self.limits)
        self._lines = StopLines(self._track, self.limits)
        self._steering.follow(self._track)

    @property
    def done_m(self) -> float:
        """Distance driven along the path since the first look [m]."""
        return 0.0 if self.s is None else self.s - self._started

    @property
    def arrived(self) -> bool:
        """Whether the trip is done."""
        return self.trip_m is not None and self.done_m >= self.trip_m - ARRIVED_WITHIN

    def decide(self, view: RouteView) -> tuple[float, float]:
        """Return (throttle, steering), both -1 to 1: + forward, + left."""
        near = self._near if self.s is None else self.s
        s, lateral = self.path.project(view.pose.x, view.pose.y, near)
        if self.s is None:
            self._begin(s)
        self.s, self.cross_track = s, lateral
        limit = min(self._limits_at(s, view), key=lambda one: one.speed)
        throttle = self._pace.throttle(limit.speed, view.speed, view.now_ns)
        standing = view.speed < STANDSTILL and throttle == 0.0
        self.waiting_for = limit.reason if standing else None
        rolling = max(0.0, view.speed)
        return throttle, self._steering.command(s, lateral, view.pose, rolling, view.now_ns)

    def _begin(self, s: float) -> None:
        self._started = s
        if self.trip_m is None and not self.path.closed:
            self.trip_m = self.path.length_m - s

    def _limits_at(self, s: float, view: RouteView) -> list[_Limit]:
        front = s + self.limits.front
        ahead = cars_ahead(self._track, front, self.limits.width, view.pose, view.others)
        found = [_Limit(self._free_speed(s), None)]
        if view.stop:
            found.append(_Limit(0.0, "stop"))
        if not self.path.closed:
            found.append(_Limit(self._stopping(self.path.length_m - s), None))
        line = self._lines.target(front, view, ahead)
        if line is not None:
            found.append(_Limit(self._stopping(line[0] - front), line[1]))
        found.extend(self._behind(front, car) for car in ahead[:1])
        return found

    def _free_speed(self, s: float) -> float:
        allowed = self._free[self._track.cell(s)]
        return allowed if self._speed is None else min(allowed, self._speed)

    def _behind(self, front: float, car: Ahead) -> _Limit:
        """Return the speed that keeps the gap to a car ahead, and still stops if it brakes."""
        room = max(0.0, car.rear - front - STANDSTILL_GAP)
        decel = self.limits.decel
        stopping = stopping_speed(room + car.speed**2 / (2.0 * decel), decel)
        return _Limit(min(stopping, room / TIME_GAP), "vehicle")

    def _stopping(self, distance: float) -> float:
        return stopping_speed(distance, self.limits.decel)
