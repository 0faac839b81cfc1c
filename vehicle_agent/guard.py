"""The guard of a real car: the last check between a command and an actuator.

`scm.vehicles.guard` checks who commands and how old a command is, for every car. This guard follows
it where a wrong command would move a real car: it knows how fast an actuator may change, where the
floor ends, and whether the Eye still knows where the car is. It is pure: no bus and no clock.

    reason    what was wrong                                    what the car does
    value     not a number, or outside -1 to 1                  zero throttle, steering as it was
    limit     more throttle than this car may have              limited
    age       the newest command is 150 ms old                  zero throttle
    stop      300 ms old, or the city-wide stop                 zero throttle, brake
    lost      1 s old: the lease is gone                        zero throttle, brake
    slew      too fast a change                                 limited rate
    pose      no pose within the last 0.25 s                    zero throttle, brake
    doubt     the Eye's pose is too uncertain                   zero throttle, brake
    fence     outside, or could not stop inside                 zero throttle, brake
    crawl     near the fence, or outside and on the way in      throttle limited to a crawl

Throttle may always fall to zero at once. The fence checks three poses, each extrapolated to now:
the outline where it is, where it would stop from its present speed, and where it would stop from
the speed that the requested throttle can give, each along the arc of the requested steering. A
command that would leave is reduced to a crawl if the crawl stays inside; outside, a crawl passes if
it ends less far out, but never while the car still rolls the other way.
"""

import math
from collections import Counter
from dataclasses import asdict, dataclass, replace
from typing import NamedTuple

from scm.clock import seconds
from scm.errors import RunError
from scm.geometry import Pose2
from scm.v2x.messages.eye_track import EyeTrack
from scm.vehicles.guard import Guarded

MAX_SLEW_STEP_S = 0.1
"""An actuator moves by at most what it may in this time, however long ago the last call was."""
CLOCK_DRIFT_DIVISOR = 10_000
"""The Eye's clock may drift by one part in this many against ours; more counts as delay."""
STANDSTILL_MPS = 0.02
"""Below this the Eye's speed is noise and does not show which way a car rolls."""
BRAKING_REASONS = ("pose", "doubt", "fence")
MODE_REASONS = {"hold": "age", "stop": "stop", "lost": "lost"}

Point = tuple[float, float]


def rectangle(x0_m: float, y0_m: float, x1_m: float, y1_m: float) -> tuple[Point, ...]:
    """Return a rectangular fence from any two opposite corners."""
    (left, right), (low, high) = sorted((x0_m, x1_m)), sorted((y0_m, y1_m))
    return (left, low), (right, low), (right, high), (left, high)


@dataclass(frozen=True, slots=True)
class GuardLimits:
    """What a real car may do. The defaults are a Nigel's.

    Attributes:
        fence: Corners of a convex polygon, counter-clockwise, map frame [m].
        margin_m: How far from the fence the whole outline must stay.
        throttle: Maximum throttle in either direction, 0 to 1.
        throttle_slew_per_s: Maximum rate of growing throttle; `steering_slew_per_s`: both ways.
        top_speed_mps: At full throttle; less throttle gives at most its share.
        decel_mps2: Minimum deceleration at zero throttle.
        reaction_s: Maximum time from a command until the wheels obey.
        curvature_per_m: Of the path at full steering.
        front_m: From the rear axle to the front bumper; likewise `rear_m`, positive.
        crawl: Throttle near and outside the fence.
        pose_age_s: Maximum age of a pose.
        position_std_m: Maximum standard deviation in x and in y; likewise `yaw_std_rad`.
        harmless: Flags of the Eye that do not stop the car.
    """

    fence: tuple[Point, ...]
    margin_m: float = 0.05
    throttle: float = 1.0
    throttle_slew_per_s: float = 4.0
    steering_slew_per_s: float = 10.0
    top_speed_mps: float = 0.3
    decel_mps2: float = 1.0
    reaction_s: float = 0.15
    curvature_per_m: float = 4.1
    front_m: float = 0.23
    rear_m: float = 0.07
    width_m: float = 0.175
    crawl: float = 0.35
    pose_age_s: float = 0.25
    position_std_m: float = 0.05
    yaw_std_rad: float = 0.15
    harmless: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        """Check all numbers and the fence.

        Raises:
            RunError: for a value that is not a finite number of zero or more, or a fence that is
                not a convex polygon with counter-clockwise corners.
        """
        numbers = {
            name: value for name, value in asdict(self).items() if isinstance(value, int | float)
        }
        wrong = {name: v for name, v in numbers.items() if not 0.0 <= v < math.inf}
        if self.decel_mps2 == 0.0:
            wrong["decel_mps2"] = 0.0
        if wrong:
            msg = f"guard: limits: got {wrong}; expected finite numbers, not below zero"
            raise RunError(msg)
        sides = self._sides()
        turns = [
            math.atan2(x1 * y2 - y1 * x2, x1 * x2 + y1 * y2)
            for (x1, y1), (x2, y2) in zip(sides, sides[1:] + sides[:1], strict=True)
        ]
        is_convex = all(0.0 <= turn < math.pi for turn in turns) and all(map(any, sides))
        if not is_convex or not math.isclose(math.fsum(turns), math.tau):
            msg = f"guard: fence: got {self.fence}; expected a convex polygon, counter-clockwise"
            raise RunError(msg)

    def _sides(self) -> list[Point]:
        following = self.fence[1:] + self.fence[:1]
        return [
            (xb - xa, yb - ya) for (xa, ya), (xb, yb) in zip(self.fence, following, strict=True)
        ]

    def outside_m(self, pose: Pose2) -> float:
        """Return how far the outline at a pose reaches past the fence's margin [m].

        Zero or less: inside. Past a corner of the fence the larger distance of its sides counts.
        """
        half = self.width_m / 2.0
        outline = [pose.apply(x, y) for x in (self.front_m, -self.rear_m) for y in (half, -half)]
        farthest_m = -math.inf
        for (x0, y0), (dx, dy) in zip(self.fence, self._sides(), strict=True):
            inward = min(dx * (y - y0) - dy * (x - x0) for x, y in outline) / math.hypot(dx, dy)
            farthest_m = max(farthest_m, self.margin_m - inward)
        return farthest_m


@dataclass(frozen=True, slots=True)
class Passed:
    """What may reach the actuators.

    Attributes:
        throttle: -1 to 1, + forward.
        steering: -1 to 1, + = left.
        brake: Whether a car with a brake of its own must use it.
        reasons: One word for each limit that was active, as in the module's table.
    """

    throttle: float
    steering: float
    brake: bool
    reasons: tuple[str, ...]


class _Seen(NamedTuple):
    track: EyeTrack
    at_ns: int
    lead_ns: int


class RealGuard:
    """Limits the actuators of one real car; it stops the car until the first pose arrives."""

    def __init__(self, limits: GuardLimits) -> None:
        self._given = self._limits = limits
        self._seen: _Seen | None = None
        self._now_ns: int | None = None
        self._throttle = self._steering = 0.0
        self._reasons: tuple[str, ...] = ()
        self.counts: Counter[str] = Counter()

    @property
    def summary(self) -> str:
        """How often each limit became active, for a status line: `fence 2, slew 5`."""
        return ", ".join(f"{reason} {count}" for reason, count in sorted(self.counts.items()))

    def assume_decel(self, decel_mps2: float | None) -> None:
        """Assume from now on that the car brakes less; None: as given. Never more than given."""
        given = self._given
        least = given.decel_mps2 if decel_mps2 is None else min(decel_mps2, given.decel_mps2)
        self._limits = replace(given, decel_mps2=least)

    def see(self, track: EyeTrack, now_ns: int) -> None:
        """Receive a track of this car; `now_ns` is when it arrived, on our own clock.

        A track that is not newer than the last is ignored. The two clocks may differ by a constant,
        which the fastest track shows; any extra delay of a later one counts as age.
        """
        lead_ns = now_ns - track.t_ns
        if self._seen is not None:
            if track.t_ns <= self._seen.track.t_ns:
                return
            drift_ns = (now_ns - self._seen.at_ns) // CLOCK_DRIFT_DIVISOR
            lead_ns = min(lead_ns, self._seen.lead_ns + drift_ns)
        self._seen = _Seen(track, now_ns, lead_ns)

    def pass_on(self, guarded: Guarded, now_ns: int) -> Passed:
        """Return what may reach the actuators at `now_ns`, given the first guard's output."""
        dt_s = 0.0 if self._now_ns is None else seconds(max(0, now_ns - self._now_ns))
        self._now_ns = now_ns
        reasons: list[str] = []
        throttle, steering = self._limited(guarded, reasons)
        if guarded.mode != "drive":
            throttle = 0.0
            reasons.append(MODE_REASONS[guarded.mode])
        throttle, steering = self._slewed(throttle, steering, min(dt_s, MAX_SLEW_STEP_S), reasons)
        throttle, why = self._at_pose(throttle, steering, now_ns)
        if why is not None:
            reasons.append(why)
        self._throttle, self._steering = throttle, steering
        self._count(tuple(reasons))
        return Passed(throttle, steering, guarded.brake or why in BRAKING_REASONS, self._reasons)

    def _count(self, reasons: tuple[str, ...]) -> None:
        self.counts.update(set(reasons) - set(self._reasons))
        self._reasons = reasons

    def _limited(self, guarded: Guarded, reasons: list[str]) -> tuple[float, float]:
        throttle, steering = guarded.throttle, guarded.steering
        if not (abs(throttle) <= 1.0 and abs(steering) <= 1.0):
            reasons.append("value")
            return 0.0, self._steering
        most = self._limits.throttle
        if abs(throttle) > most:
            reasons.append("limit")
        return _clamped(throttle, -most, most), steering

    def _slewed(
        self, throttle: float, steering: float, dt_s: float, reasons: list[str]
    ) -> tuple[float, float]:
        gas, turn = self._limits.throttle_slew_per_s * dt_s, self._limits.steering_slew_per_s * dt_s
        slow = (
            _clamped(throttle, min(self._throttle, 0.0) - gas, max(self._throttle, 0.0) + gas),
            _clamped(steering, self._steering - turn, self._steering + turn),
        )
        if slow != (throttle, steering):
            reasons.append("slew")
        return slow

    def _at_pose(self, throttle: float, steering: float, now_ns: int) -> tuple[float, str | None]:
        """Return the throttle that the car's pose allows, and the reason if it is limited."""
        seen = self._seen
        if seen is None:
            return 0.0, "pose"
        track = seen.track
        since_s = seconds(max(now_ns, seen.at_ns) - track.t_ns - seen.lead_ns)
        age_s = since_s + track.age_s
        if track.stale or not (track.age_s >= 0.0 and age_s < self._limits.pose_age_s):
            return 0.0, "pose"
        if self._is_uncertain(track):
            return 0.0, "doubt"
        pose = Pose2(track.x_m, track.y_m, track.yaw_rad)
        bend = self._limits.curvature_per_m * steering
        here = along(pose, bend, track.speed_mps * since_s)
        return self._fenced(throttle, here, bend, track.speed_mps)

    def _is_uncertain(self, track: EyeTrack) -> bool:
        limits, c = self._limits, track.covariance
        is_sure = (
            _is_within_std(c[0][0], limits.position_std_m)
            and _is_within_std(c[1][1], limits.position_std_m)
            and _is_within_std(c[2][2], limits.yaw_std_rad)
        )
        numbers = track.x_m, track.y_m, track.yaw_rad, track.speed_mps
        is_finite = all(map(math.isfinite, numbers))
        return not (is_sure and is_finite and limits.harmless.issuperset(track.flags))

    def _fenced(
        self, throttle: float, pose: Pose2, bend: float, speed: float
    ) -> tuple[float, str | None]:
        limits = self._limits
        here = limits.outside_m(pose)
        inside = max(here, limits.outside_m(along(pose, bend, self._stop_m(speed)))) <= 0.0
        if inside and self._after(throttle, pose, bend, speed) <= 0.0:
            return throttle, None
        crawl = _clamped(throttle, -limits.crawl, limits.crawl)
        after = self._after(crawl, pose, bend, speed)
        stays = inside and after <= 0.0
        returns = after < here and speed * crawl >= -STANDSTILL_MPS * abs(crawl)
        return (crawl, "crawl") if crawl and (stays or returns) else (0.0, "fence")

    def _after(self, throttle: float, pose: Pose2, bend: float, speed: float) -> float:
        """Return how far outside the car would stop after applying a throttle [m]."""
        way = math.copysign(1.0, throttle)
        speed = max(way * speed, self._limits.top_speed_mps * abs(throttle))
        return self._limits.outside_m(along(pose, bend, way * self._stop_m(speed)))

    def _stop_m(self, speed: float) -> float:
        """Return the stopping distance from a speed, + = forward [m]."""
        limits = self._limits
        return speed * limits.reaction_s + speed * abs(speed) / (2.0 * limits.decel_mps2)


def along(pose: Pose2, bend: float, way: float) -> Pose2:
    """Return a pose moved along an arc by a signed length [m]."""
    half = 0.5 * bend * way
    chord = way * (math.sin(half) / half if half else 1.0)
    return pose @ Pose2(chord * math.cos(half), chord * math.sin(half), 2.0 * half)


def _clamped(value: float, low: float, high: float) -> float:
    return min(high, max(low, value))


def _is_within_std(variance: float, std: float) -> bool:
    return 0.0 <= variance <= std * std
