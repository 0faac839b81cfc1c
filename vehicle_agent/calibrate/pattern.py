"""The drive pattern that identifies steering and drive: short legs, small throttles first.

Pure: poses and seconds in, commands out. A leg is a throttle and two steering commands, one for
each half, so that the wheels turn while it moves; between legs the car rests. Of the remaining legs
at one throttle the next is the one that ends farthest inside the fence, and a leg ends early where
the car could not stop inside.

Commands vary within a leg: in every piece slightly less throttle and slightly different steering,
spread evenly over several steps of any firmware that rounds. A firmware that truncates a servo's
angle to whole degrees steers half a degree to one side on average: that is a trim, and only
commands between its steps show it. Also at rest, since a swing of the wheels begins there.
"""

import math
from dataclasses import dataclass

from scm.geometry import Pose2
from vehicle_agent.guard import GuardLimits, along

STEERINGS = ((0.0, 0.0), (0.5, 0.5), (-0.5, -0.5), (1.0, -1.0), (-1.0, 1.0))
PIECE_S = 0.12
THROTTLE_SPREAD = 0.02
"""Largest reduction of the throttle: five steps of an 8-bit timer."""
STEERING_SPREAD = 0.1
"""Range of the steering variation: three degrees of a servo."""
EVEN_SEQUENCE = (0.7548776662, 0.1458980338)
"""Irrational steps, of throttle and of steering: fractions of their multiples are evenly spread."""
LOOKAHEAD_S = 0.2
"""How much earlier than the guard the pattern ends a leg."""
MIN_RETURN_M = 1e-3


@dataclass(frozen=True, slots=True)
class Plan:
    """Extent of the drive.

    Attributes:
        shares: Of the maximum throttle, one a level.
        leg_s: Maximum duration of a leg; likewise `rest_s` between two.
    """

    shares: tuple[float, ...]
    leg_s: float
    rest_s: float


FULL = Plan((0.3, 0.45, 0.6, 0.8), 1.8, 0.5)
SHORT = Plan((0.4, 0.8), 1.0, 0.3)


@dataclass(frozen=True, slots=True)
class Leg:
    """One leg: throttle, and steering of its first and its second half."""

    throttle: float
    steering: tuple[float, float]


class Pattern:
    """Progress of a calibration drive."""

    def __init__(self, limits: GuardLimits, plan: Plan = FULL) -> None:
        self._limits, self._plan = limits, plan
        self._levels = [
            [Leg(way * share * limits.throttle, both) for both in STEERINGS for way in (1.0, -1.0)]
            for share in plan.shares
        ]
        self._all = sum(map(len, self._levels))
        self._leg: Leg | None = None
        self._begun_s = -math.inf
        self._ended_s: float | None = None
        self._pieces = 0

    @property
    def progress(self) -> float:
        """Share of the legs that are driven or in progress, 0 to 1."""
        return 1.0 - sum(map(len, self._levels)) / self._all

    def step(self, pose: Pose2, t_s: float) -> tuple[float, float] | None:
        """Return throttle and steering at a pose and a time [s]; None: the drive is complete."""
        if self._ended_s is None:
            self._ended_s = t_s
        if self._leg is None:
            if t_s - self._ended_s < self._plan.rest_s:
                return 0.0, self._spread(self._pieces)
            if not self._begin(pose, t_s):
                return None
        leg = self._leg
        since_s = t_s - self._begun_s
        if leg is None:
            return 0.0, 0.0
        throttle, steering = self._between(leg, since_s)
        if since_s >= self._plan.leg_s or not self._has_room(pose, leg.throttle, steering):
            self._end_leg(t_s)
            return 0.0, steering
        return throttle, steering

    def give_up(self, t_s: float) -> None:
        """End the leg: the car is not where it drove to; `t_s` is the time [s]."""
        self._end_leg(t_s)

    def _between(self, leg: Leg, since_s: float) -> tuple[float, float]:
        """Return the commands of this piece of a leg."""
        piece = self._pieces + 1 + int(since_s / PIECE_S)
        steering = leg.steering[since_s >= self._plan.leg_s / 2.0]
        middle = math.copysign(min(abs(steering), 1.0 - STEERING_SPREAD / 2.0), steering)
        less = EVEN_SEQUENCE[0] * piece % 1.0 * THROTTLE_SPREAD
        throttle = math.copysign(max(0.0, abs(leg.throttle) - less), leg.throttle)
        return throttle, middle + self._spread(piece)

    def _spread(self, piece: int) -> float:
        to_and_fro = abs(
            2.0 * (EVEN_SEQUENCE[1] * piece % 1.0) - 1.0
        )  # no jumps: they would delay the servo
        return (to_and_fro - 0.5) * STEERING_SPREAD

    def _end_leg(self, t_s: float) -> None:
        if self._leg is not None:
            self._pieces += 2 + int((t_s - self._begun_s) / PIECE_S)
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
        half_m = leg.throttle * self._limits.top_speed_mps * self._plan.leg_s / 2.0
        for steering in leg.steering:
            pose = along(pose, self._limits.curvature_per_m * steering, half_m)
        return pose

    def _has_room(self, pose: Pose2, throttle: float, steering: float) -> bool:
        limits = self._limits
        speed = throttle * limits.top_speed_mps
        ahead_m = speed * (limits.reaction_s + LOOKAHEAD_S)
        ahead_m += math.copysign(speed * speed / (2.0 * limits.decel_mps2), speed)
        there = limits.outside_m(along(pose, limits.curvature_per_m * steering, ahead_m))
        return there <= 0.0 or there < limits.outside_m(pose) - MIN_RETURN_M
