"""A driver along a path that a test lays itself, with the place of its car along it."""

from scm.maps.route import Path
from scm.vehicles.driver import CarLimits, RouteView
from scm.vehicles.drivers.controller import ARRIVED_WITHIN
from scm.vehicles.drivers.single_car import OWN, SingleDriver


class RouteDriver:
    """Drives one car along a path that a script lays itself.

    Attributes:
        path: The path.
        s: Where the rear axle is along it, laps included [m]; None before the first decision.
        cross_track: Lateral offset of the rear axle [m], + = left.
        waiting_for: What the car is waiting for at rest: `signal`, `vehicle`, `stop`, `sign`.
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
        self._driver = SingleDriver(path.roads, limits)
        self.follow(path, speed=speed, trip_m=trip_m, near=near)

    def follow(
        self,
        path: Path,
        *,
        speed: float | None = None,
        trip_m: float | None = None,
        near: float | None = None,
    ) -> None:
        """Follow another path from now on, without a jerk.

        Args:
            path: An open path ends the drive with the rear axle at its end, a closed one never.
            speed: On free road [m/s]; None: what lanes and curves allow.
            trip_m: Length of the trip from where the car begins; None: to the end of the path.
            near: Approximate place of the car along the path [m]; None: the closest point.
        """
        self.path = path
        self.trip_m = trip_m
        self.s: float | None = None
        self._started = 0.0
        self._near = near
        self._speed = speed

    @property
    def done_m(self) -> float:
        """Distance driven along the path since the first decision [m]."""
        return 0.0 if self.s is None else self.s - self._started

    @property
    def arrived(self) -> bool:
        """Whether the trip is done."""
        return self.trip_m is not None and self.done_m >= self.trip_m - ARRIVED_WITHIN

    def decide(self, view: RouteView) -> tuple[float, float]:
        """Return (throttle, steering), both -1 to 1: + forward, + left."""
        if self.s is None:
            self._begin(view)
        commands = self._driver.decide(view)
        self.s = self._started + self._driver.done_m
        self.cross_track = self._driver.cross_track
        self.waiting_for = self._driver.waiting_for
        return commands

    def _begin(self, view: RouteView) -> None:
        path = self.path
        self._started, _ = path.project(view.pose.x, view.pose.y, self._near)
        if self.trip_m is None and not path.closed:
            self.trip_m = path.length_m - self._started
        first, s = path.index_at(self._started)
        after = "loop" if path.closed else "stop"
        self._driver.batch.send(OWN, path.lanes, s, after, self._speed, first)
