"""The drive that shows how a car steers and moves: short legs, small throttles first.

Pure: poses and seconds in, commands out. A leg is a throttle and two steering commands, one for
each half, so that the wheels turn while it moves; between legs the car rests. Of the legs that are
left at one throttle the next is the one that ends farthest inside the fence, and a leg ends early
where the car could not stop inside.
"""

import math
from dataclasses import dataclass

from scm.geometry import Pose2
from vehicle_agent.guard import GuardLimits, along

SHARES = (0.3, 0.45, 0.6, 0.8)
"""Of the throttle that the car may have."""
STEERINGS = ((0.0, 0.0), (0.5, 0.5), (-0.5, -0.5), (1.0, -1.0), (-1.0, 1.0))
LEG_S = 1.8
REST_S = 0.5
AHEAD_S = 0.2
"""How far ahead of the guard the pattern gives way."""
NEARER_M = 1e-3


@dataclass(frozen=True, slots=True)
class Leg:
    """One way: throttle, and steering of its first and its second half."""

    throttle: float
    steering: tuple[float, float]


class Pattern:
    """Where a calibration has got to."""

    def __init__(self, limits: GuardLimits) -> None:
        self._limits = limits
        self._levels = [
            [Leg(way * share * limits.throttle, both) for both in STEERINGS for way in (1.0, -1.0)]
            for share in SHARES
        ]
        self._all = sum(map(len, self._levels))
        self._leg: Leg | None = None
        self._begun_s = -math.inf
        self._ended_s: float | None = None

    @property
    def progress(self) -> float:
        """Share of the legs that are driven or under way, 0 to 1."""
        return 1.0 - sum(map(len, self._levels)) / self._all

    def step(self, pose: Pose2, t_s: float) -> tuple[float, float] | None:
        """Return throttle and steering at a pose and a time [s]; None: the drive is over."""
        if self._ended_s is None:
            self._ended_s = t_s
        if self._leg is None:
            if t_s - self._ended_s < REST_S:
                return 0.0, 0.0
            if not self._begin(pose, t_s):
                return None
        leg = self._leg
        since_s = t_s - self._begun_s
        if leg is None:
            return 0.0, 0.0
        steering = leg.steering[since_s >= LEG_S / 2.0]
        if since_s >= LEG_S or not self._has_room(pose, leg.throttle, steering):
            self._leg, self._ended_s = None, t_s
            return 0.0, steering
        return leg.throttle, steering

    def give_up(self, t_s: float) -> None:
        """End the leg: the car is not where it drove to [s]."""
        self._leg, self._ended_s = None, t_s

    def _begin(self, pose: Pose2, t_s: float) -> bool:
        self._levels = [legs for legs in self._levels if legs]
        if not self._levels:
            return False
        legs = self._levels[0]
        best = min(legs, key=lambda leg: self._limits.outside_m(self._end(pose, leg)))
        legs.remove(best)
        self._leg, self._begun_s = best, t_s
        return True

    def _end(self, pose: Pose2, leg: Leg) -> Pose2:
        half_m = leg.throttle * self._limits.top_speed_mps * LEG_S / 2.0
        for steering in leg.steering:
            pose = along(pose, self._limits.curvature_per_m * steering, half_m)
        return pose

    def _has_room(self, pose: Pose2, throttle: float, steering: float) -> bool:
        limits = self._limits
        speed = throttle * limits.top_speed_mps
        ahead_m = speed * (limits.reaction_s + AHEAD_S)
        ahead_m += math.copysign(speed * speed / (2.0 * limits.decel_mps2), speed)
        there = limits.outside_m(along(pose, limits.curvature_per_m * steering, ahead_m))
        return there <= 0.0 or there < limits.outside_m(pose) - NEARER_M
