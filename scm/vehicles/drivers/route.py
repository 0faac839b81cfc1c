"""Follow a path through the city: stop at red, keep a distance, never block a junction.

For scripts and experiments that lay a path themselves; who takes errands uses `trips`.
"""

from scm.maps.route import Path
from scm.vehicles.driver import CarLimits, RouteView
from scm.vehicles.drivers.alone import OWN, Alone
from scm.vehicles.drivers.law import ARRIVED_WITHIN


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
        self._driver = Alone(path.roads, limits)
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
        self._driver.crowd.send(OWN, path.lanes, s, after, self._speed, first)
