"""The last stage before a body: its own state and a real car's guard limit each command."""

import math
from dataclasses import replace

from scm.records.city_map import CityMap
from scm.v2x.messages.eye_track import EyeTrack
from scm.vehicles.driver import CarLimits
from scm.vehicles.guard import Guarded, Mode
from vehicle_agent.body import Body, Wiring
from vehicle_agent.guard import GuardLimits, RealGuard, rectangle

TOP_SPEED_MARGIN = 1.1
"""Allowed factor over the car file's top speed: a full battery drives faster than its table."""


def real_guard(limits: CarLimits, city_map: CityMap, wiring: Wiring) -> RealGuard:
    """Return the guard of a real car: within its fence, or else the city's floor."""
    (x0, x1), (y0, y1) = city_map.floor.x_m, city_map.floor.y_m
    given = GuardLimits(
        fence=wiring.fence or rectangle(x0, y0, x1, y1),
        throttle=wiring.throttle,
        curvature_per_m=math.tan(limits.steer_limit) / limits.wheelbase,
        front_m=limits.front,
        rear_m=limits.rear,
        width_m=limits.width,
    )
    if limits.speeds:
        given = replace(given, top_speed_mps=TOP_SPEED_MARGIN * limits.speeds[-1])
    return RealGuard(given)


class ActuationGate:
    """Forwards the permitted part of a command to a body.

    Attributes:
        why: Why the car does not move as commanded; empty if it does.
    """

    def __init__(self, body: Body, guard: RealGuard | None = None) -> None:
        self._body, self._guard = body, guard
        self.why = ""

    @property
    def summary(self) -> str:
        """How often each limit of a real car's guard became active."""
        return "" if self._guard is None else self._guard.summary

    def assume_decel(self, decel_mps2: float | None) -> None:
        """Let a real car's guard assume that the car brakes less; None: as it came."""
        if self._guard is not None:
            self._guard.assume_decel(decel_mps2)

    def see(self, track: EyeTrack, now_ns: int) -> None:
        """Give body and guard a track of the car from the Eye."""
        self._body.see(track, now_ns)
        if self._guard is not None:
            self._guard.see(track, now_ns)

    def pass_on(self, guarded: Guarded, off_lane: str, now_ns: int) -> Guarded:
        """Send the command to the body and return what was sent.

        Args:
            guarded: Output of the first guard.
            off_lane: Why the car must not drive from where it stands; empty if it may.
            now_ns: The present time [ns].
        """
        self.why = self._body.inhibit_reason(now_ns) or off_lane
        if self.why:
            guarded = _stopped(guarded)
        if self._guard is not None:
            passed = self._guard.pass_on(guarded, now_ns)
            stopped = _stopped(guarded) if passed.brake else guarded
            guarded = replace(stopped, throttle=passed.throttle, steering=passed.steering)
            self.why = self.why or ", ".join(passed.reasons)
        self._body.command(guarded.throttle, guarded.steering)
        return guarded


def _stopped(guarded: Guarded) -> Guarded:
    mode: Mode = "lost" if guarded.mode == "lost" else "stop"
    return replace(guarded, throttle=0.0, mode=mode)
