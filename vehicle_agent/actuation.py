"""The last word before a body: what its own state and a real car's guard leave of a command."""

import math
from dataclasses import replace

from scm.records.city_map import CityMap
from scm.v2x.messages.eye_track import EyeTrack
from scm.vehicles.driver import CarLimits
from scm.vehicles.guard import Guarded, Mode
from vehicle_agent.body import Body, Wiring
from vehicle_agent.guard import GuardLimits, RealGuard, rectangle

FASTER = 1.1
"""Than its table says a car may be: a full battery."""


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
        given = replace(given, top_speed_mps=FASTER * limits.speeds[-1])
    return RealGuard(given)


class LastWord:
    """Passes on to a body what may reach it.

    Attributes:
        why: What keeps the car from moving as it should, in words; empty: nothing.
    """

    def __init__(self, body: Body, guard: RealGuard | None = None) -> None:
        self._body, self._guard = body, guard
        self.why = ""

    @property
    def told(self) -> str:
        """How often each limit of a real car's guard began to bite."""
        return "" if self._guard is None else self._guard.told

    def see(self, track: EyeTrack, now_ns: int) -> None:
        """Let body and guard know where the Eye sees the car."""
        self._body.see(track, now_ns)
        if self._guard is not None:
            self._guard.see(track, now_ns)

    def pass_on(self, guarded: Guarded, astray: str, now_ns: int) -> Guarded:
        """Command the body; return what it was commanded.

        Args:
            guarded: What the first guard let pass.
            astray: Why the car must not drive from where it stands; empty: it may.
            now_ns: The present time [ns].
        """
        self.why = self._body.unfit(now_ns) or astray
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
