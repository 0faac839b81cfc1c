"""Stop or go at the next line: what the signal says, and whether there is room behind it.

A yellow light, or a green one whose promised end has passed, stops a car that can stop with
comfortable deceleration before the line, and lets the others clear the junction. Whoever went on
for that reason goes on. Red, flashing red and silence stop everybody.
"""

from scm.maps.model import StopLine
from scm.vehicles.driver import CarLimits, RouteView
from scm.vehicles.drivers.ahead import Ahead
from scm.vehicles.drivers.track import Track

SHORT_OF_LINE = 0.04
NEAREST = 0.02
REACTION = 0.1
LOOK_AHEAD = 0.5
STANDSTILL_GAP = 0.08
FLOW = 0.7


class StopLines:
    """The stop lines of a way, and what the car has decided at the next of them."""

    def __init__(self, track: Track, limits: CarLimits) -> None:
        self._path = track.path
        self._limits = limits
        self._going: float | None = None

    def target(self, front: float, view: RouteView, ahead: list[Ahead]) -> tuple[float, str] | None:
        """Return where to stop along the way [m] and for what: `signal` or `vehicle`; or None.

        Args:
            front: Where the front bumper is along the way [m].
            view: What the driver is shown.
            ahead: Cars on the way, nearest first.
        """
        found = self._path.next_stop_line(front)
        if found is None:
            return None
        at, line = found
        brake = self._stopping(view.speed)
        if at - front > LOOK_AHEAD + 2.0 * brake:
            return None
        can_stop = at - front >= brake + NEAREST
        reason = self._reason(at, line, can_stop, view, ahead)
        return None if reason is None else (at - SHORT_OF_LINE, reason)

    def _reason(
        self, at: float, line: StopLine, can_stop: bool, view: RouteView, ahead: list[Ahead]
    ) -> str | None:
        colour = view.signals.colour(line.junction, line.group, view.now_ns)
        if colour == "yellow" and (self._is_going(at) or not can_stop):
            self._going = at
            return None
        if colour != "green":
            return "signal"
        if self._is_going(at):
            return None
        if can_stop:
            return None if self._has_room(at, line, view.speed, ahead) else "vehicle"
        self._going = at
        return None

    def _is_going(self, at: float) -> bool:
        return self._going is not None and abs(self._going - at) < NEAREST

    def _stopping(self, speed: float) -> float:
        return speed * REACTION + speed**2 / (2.0 * self._limits.decel)

    def _has_room(self, at: float, line: StopLine, speed: float, ahead: list[Ahead]) -> bool:
        """Return whether the car, once past the line, will find a place behind the junction.

        Counts from the farthest car backwards: one that rolls is taken to move on at part of its
        speed for as long as the crossing takes, but not into the car before it.
        """
        leave = self._leave(at, line)
        if leave is None:
            return True
        crossing = (leave - at) / max(speed, 0.5 * self._cruise())
        room = float("inf")
        for car in reversed(ahead):
            rear = min(car.rear + FLOW * car.speed * crossing, room - car.length)
            room = rear - STANDSTILL_GAP
        return room - self._limits.front >= leave

    def _leave(self, at: float, line: StopLine) -> float | None:
        """Return where the rear axle is when the car has left the junction behind a line [m]."""
        inside = at % self._path.length_m if self._path.closed else at
        for start, end, junction in self._path.conflicts:
            if junction == line.junction and start >= inside - SHORT_OF_LINE:
                return at + end - inside
        return None

    def _cruise(self) -> float:
        return self._limits.speeds[-1] if self._limits.speeds else self._path.speed_limit_mps(0.0)
