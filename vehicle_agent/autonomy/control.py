"""Follow a trajectory: from where a car is, to a throttle and a steering command.

The place to be is the nearest on the way, not that of the clock, so a car that lags is not pulled
across a corner. What was commanded is not yet done: the car's pose and speed are first predicted
over the drive's delay, by the commands on their way. The speed's integral term compares what is
measured with what was wanted a delay ago (Smith predictor, 1957). With e the distance to the left
of the way, psi the heading's error, d = +1 forward and -1 backward, kappa the way's curvature:

    LQR            kappa - e / w^2 - sqrt(2) d psi / w     w: weights of e over that of curvature
    pure pursuit   curvature of the arc to the point `AHEAD_M` further on
    Stanley        heading's error + atan(gain e / v), at the front axle

The LQR is that of e'' = kappa over distance, in closed form. A piece of the way between two cusps
is driven to its end, then the wheels turn at rest to where the next piece begins.
Source: Coulter, CMU-RI-TR-92-01 (pure pursuit); Hoffmann et al., ACC 2007 (Stanley); the paper's
own law, throttle = v / 0.26 and steering = delta / 0.5236 at 5 Hz, without feedback, is "paper".
"""

import math
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats, Ints
from scm.clock import NS_PER_MS, NS_PER_S
from scm.geometry import Pose2, wrap_angle
from scm.vehicles.lights import Headlights, Indicators
from vehicle_agent.autonomy.plan import CarLimits, Trajectory
from vehicle_agent.autonomy.response import Response

FADE_M = 0.15  # w: errors fade over some such distances
AHEAD_M = 0.12
STANLEY_GAIN, STANLEY_SOFT_MPS = 1.0, 0.05
PAPER_SPEED_MPS, PAPER_STEERING_RAD, PAPER_PERIOD_NS = 0.26, 0.5236, 200 * NS_PER_MS
END_M = 0.004  # from the end of a piece, where it is done
CREEP_MPS = 0.03
STOPPING_MPS2 = 0.1  # towards the end of a piece
SPEED_GAIN, SPEED_INTEGRAL, MOST_INTEGRAL = 1.0, 2.0, 0.3
WHEELS_READY_RAD = 0.06
TRIM_MPS, TRIM_S, MOST_TRIM_RAD = 0.05, 0.7, 0.15  # learned while it drives, so fast, at most
STEADY_RAD = 0.03  # of wheels that are where they are to be
READY_TIMEOUT_S = 2.0
WINDOW_M = 0.25  # of the way, in which the nearest point is looked for
STANDS_MPS = 0.015


class Command(NamedTuple):
    """What a car is to do: throttle and steering -1 to 1, + forward, + left; its lights."""

    throttle: float
    steering: float
    headlights: Headlights | None = None
    indicators: Indicators | None = None


class Place(NamedTuple):
    """A car beside its way.

    Attributes:
        left_m: Of the way, seen along the way's heading.
        heading_rad: Of the car over the way's.
        gear: +1 forward, -1 backward.
        curvature: Of the way, + = left [1/m].
    """

    left_m: float
    heading_rad: float
    gear: float
    curvature: float


Steer = Callable[[Trajectory, int, Place, Pose2, float, CarLimits], float]
"""From the way, the nearest point's index, the place, pose and speed: the path's curvature."""


def lqr(
    way: Trajectory, at: int, place: Place, pose: Pose2, speed_mps: float, limits: CarLimits
) -> float:
    """Return the curvature that brings the car back with the least weighted effort."""
    del way, at, pose, speed_mps, limits
    back = place.left_m / FADE_M**2
    return place.curvature - back - math.sqrt(2.0) * place.gear * place.heading_rad / FADE_M


def pure_pursuit(
    way: Trajectory, at: int, place: Place, pose: Pose2, speed_mps: float, limits: CarLimits
) -> float:
    """Return the curvature of the arc to a point ahead."""
    del speed_mps, limits
    ahead = at
    while ahead + 1 < len(way.poses) and _along(way, at, ahead) < AHEAD_M:
        if way.speeds_mps[ahead + 1] * place.gear < 0.0:
            break
        ahead += 1
    x, y = pose.inverse().apply(float(way.poses[ahead, 0]), float(way.poses[ahead, 1]))
    away = x * x + y * y
    return 2.0 * y / away if away > END_M**2 else place.curvature


def stanley(
    way: Trajectory, at: int, place: Place, pose: Pose2, speed_mps: float, limits: CarLimits
) -> float:
    """Return the curvature by the heading's error and the front axle's distance from the way."""
    del way, at, pose
    front = place.left_m + place.gear * limits.wheelbase_m * math.sin(place.heading_rad)
    cross = math.atan(STANLEY_GAIN * front / (abs(speed_mps) + STANLEY_SOFT_MPS))
    angle = math.atan(limits.wheelbase_m * place.curvature) - place.gear * place.heading_rad - cross
    return math.tan(max(-1.2, min(1.2, angle))) / limits.wheelbase_m


def open_loop(
    way: Trajectory, at: int, place: Place, pose: Pose2, speed_mps: float, limits: CarLimits
) -> float:
    """Return the way's own curvature, as the paper's controller does."""
    del way, at, pose, speed_mps, limits
    return place.curvature


CONTROLLERS: dict[str, Steer] = {
    "lqr": lqr,
    "pure_pursuit": pure_pursuit,
    "stanley": stanley,
    "paper": open_loop,
}


class Tracker:
    """Drives one car along trajectories.

    Args:
        limits: Of the car; `response`: how it answers to commands.
        controller: Of steering: a key of `CONTROLLERS`.

    Attributes:
        sent: The commands of the last second: when [ns], what, and for which speed [m/s].
    """

    def __init__(self, limits: CarLimits, response: Response, controller: str = "lqr") -> None:
        self._limits, self._response, self._steer = limits, response, CONTROLLERS[controller]
        self._has_constant_gains = controller == "paper"
        self._way: Trajectory | None = None
        self._pieces: list[tuple[int, int]] = []
        self._piece = self._at = 0
        self._ready_ns: int | None = None
        self._integral = self._trim_rad = self._wheel_rad = 0.0
        self._before_ns: int | None = None
        self.sent = deque[tuple[int, Command, float]]()
        self._target = 0.0

    @property
    def is_done(self) -> bool:
        """Whether the end of the trajectory was reached."""
        return self._way is None or self._piece >= len(self._pieces)

    def ahead(self, lasts_s: float) -> tuple[Floats, Floats]:
        """Return poses (n, 3) of the rest of the way and times from here (n,), up to a time."""
        if self._way is None or self.is_done:
            return np.empty((0, 3)), np.empty(0)
        times = self._way.times_s
        end = int(np.searchsorted(times, times[self._at] + lasts_s)) + 1
        return self._way.poses[self._at : end], times[self._at : end] - times[self._at]

    def follow(self, way: Trajectory) -> None:
        """Follow this trajectory from now on; it begins about where the car is."""
        self._way, self._pieces = way, _pieces(way)
        self._piece, self._at = 0, self._pieces[0][0] if self._pieces else 0

    def stop(self) -> None:
        """Follow none."""
        self._way, self._pieces = None, []
        self._ready_ns, self._integral = None, 0.0

    def command(
        self,
        now_ns: int,
        pose: Pose2,
        speed_mps: float,
        steering_rad: float,
        yaw_rate_radps: float | None = None,
    ) -> Command:
        """Return the command for now.

        Args:
            now_ns: Now.
            pose: Of the rear axle, in the trajectory's frame, now.
            speed_mps: Now, + forward.
            steering_rad: Of the front wheels, now, + = left.
            yaw_rate_radps: Now; with it the controller learns how far the wheels are off.
        """
        if self._has_constant_gains and self.sent and not self.is_done:
            sent_ns, last, _ = self.sent[-1]
            if 0 <= now_ns - sent_ns < PAPER_PERIOD_NS:
                return last
        dt = 0.0 if self._before_ns is None else (now_ns - self._before_ns) / NS_PER_S
        self._before_ns = now_ns
        if yaw_rate_radps is not None:
            self._learn_trim(now_ns, dt, speed_mps, yaw_rate_radps)
        self._target = 0.0
        wanted = self._wanted(now_ns, pose, speed_mps, steering_rad, min(max(dt, 0.0), 0.1))
        self.sent.append((now_ns, wanted, self._target))
        oldest_ns = now_ns - round(1.0 * NS_PER_S)
        while self.sent and self.sent[0][0] < oldest_ns:
            self.sent.popleft()
        return wanted

    def _wanted(
        self, now_ns: int, pose: Pose2, speed: float, steering: float, dt: float
    ) -> Command:
        way = self._way
        if way is None or self.is_done:
            return Command(0.0, self._steering_for(steering))
        first, last = self._pieces[self._piece]
        predicted, then, wheel = self._predicted(now_ns, pose, speed, steering)
        self._at = self._nearest(way, predicted, last)
        gear = math.copysign(1.0, float(way.speeds_mps[first : last + 1].sum()))
        place = _place(way, first, self._at, predicted, gear, self._limits.wheelbase_m)
        left = self._left(way, predicted, last, gear)
        if left < END_M:
            self._integral = 0.0
            if max(abs(speed), abs(then)) > STANDS_MPS:
                return Command(0.0, self._steering_for(steering))
            self._piece, self._ready_ns = self._piece + 1, None
            if self._piece >= len(self._pieces):
                return Command(0.0, self._steering_for(steering))
            self._at = self._pieces[self._piece][0]
            return self._wanted(now_ns, pose, speed, steering, 0.0)
        curvature = self._steer(way, self._at, place, predicted, speed, self._limits)
        angle = math.atan(self._limits.wheelbase_m * curvature)
        angle = max(-self._limits.steering_rad, min(self._limits.steering_rad, angle))
        turn = 0.0 if self._has_constant_gains else angle - wheel
        if self._turns_at_rest(now_ns, turn, speed):
            return Command(0.0, self._steering_for(angle))
        target = self._speed(way, left, turn)
        self._target = gear * target
        throttle = self._throttle(now_ns, speed, then, dt)
        return Command(throttle, self._steering_for(angle))

    def _predicted(
        self, now_ns: int, pose: Pose2, speed: float, steering: float
    ) -> tuple[Pose2, float, float]:
        """Return pose, speed and wheel angle when a command of now begins to act."""
        delay_s = max(self._response.drive_delay_s, self._response.steer_delay_s)
        if delay_s < 1e-3 or self._has_constant_gains:
            return pose, speed, steering
        steps = max(1, round(delay_s / 0.01))
        dt, rate = delay_s / steps, self._limits.steering_rate_radps
        lag = max(self._response.drive_lag_s, 0.01)
        for step in range(steps):
            drive_ns = now_ns + round(((step + 1) * dt - self._response.drive_delay_s) * NS_PER_S)
            steer_ns = now_ns + round(((step + 1) * dt - self._response.steer_delay_s) * NS_PER_S)
            throttle = self._sent_at(drive_ns, Command(0.0, 0.0))[0].throttle
            steer, _ = self._sent_at(steer_ns, Command(0.0, self._steering_for(steering)))
            aim = self._response.speed_of(throttle)
            angle = self._response.angle_of(steer.steering) + self._trim_rad
            speed += (aim - speed) * (1.0 - math.exp(-dt / lag))
            steering += max(-rate * dt, min(rate * dt, angle - steering))
            turn = speed * math.tan(steering) / self._limits.wheelbase_m * dt
            pose = pose @ Pose2(speed * dt, 0.5 * speed * dt * turn, turn)
        return pose, speed, steering

    def _steering_for(self, angle_rad: float) -> float:
        """Return the command that brings the front wheels to an angle."""
        if self._has_constant_gains:
            return max(-1.0, min(1.0, angle_rad / PAPER_STEERING_RAD))
        return self._response.steering_for(angle_rad - self._trim_rad)

    def _learn_trim(self, now_ns: int, dt: float, speed: float, yaw_rate: float) -> None:
        """Compare the curvature driven with that of the commands which act now.

        A trim that the car file has not would else bend every new stretch of the way alike.
        """
        acting_ns = now_ns - round(self._response.steer_delay_s * NS_PER_S)
        before = Command(0.0, self._response.steering_for(self._wheel_rad))
        acting, _ = self._sent_at(acting_ns, before)
        aim = self._response.angle_of(acting.steering)
        most = self._limits.steering_rate_radps * min(max(dt, 0.0), 0.1)
        self._wheel_rad += max(-most, min(most, aim - self._wheel_rad))
        if abs(speed) < TRIM_MPS or abs(aim - self._wheel_rad) > STEADY_RAD:
            return
        driven = math.atan(self._limits.wheelbase_m * yaw_rate / speed)
        left = driven - self._wheel_rad - self._trim_rad
        trim = self._trim_rad + left * min(dt / TRIM_S, 1.0)
        self._trim_rad = max(-MOST_TRIM_RAD, min(MOST_TRIM_RAD, trim))

    def _sent_at(self, t_ns: int, before: Command) -> tuple[Command, float]:
        """Return the command at a time, and the speed that it was for."""
        for sent_ns, command, target in reversed(self.sent):
            if sent_ns <= t_ns:
                return command, target
        return before, 0.0

    def _nearest(self, way: Trajectory, pose: Pose2, last: int) -> int:
        """Return the nearest point of the piece, not before the last one found."""
        end, along = self._at, 0.0
        while end < last and along < WINDOW_M:
            along += _step(way, end)
            end += 1
        some = way.poses[self._at : end + 1]
        return self._at + int(np.argmin(np.hypot(some[:, 0] - pose.x, some[:, 1] - pose.y)))

    def _left(self, way: Trajectory, pose: Pose2, last: int, gear: float) -> float:
        """Return how far it is to the end of the piece, along it [m]; < 0 past it."""
        x, _ = Pose2(*map(float, way.poses[self._at])).inverse().apply(pose.x, pose.y)
        return _along(way, self._at, last) - gear * x

    def _turns_at_rest(self, now_ns: int, turn: float, speed: float) -> bool:
        """Return whether the car waits, before a piece, until its wheels are turned."""
        if self._ready_ns is None:
            self._ready_ns = now_ns + round(READY_TIMEOUT_S * NS_PER_S)
        if abs(turn) < WHEELS_READY_RAD or now_ns >= self._ready_ns:
            self._ready_ns = 0
        return self._ready_ns > 0 and abs(speed) < STANDS_MPS

    def _speed(self, way: Trajectory, left: float, turn: float) -> float:
        """Return the speed to drive at, without sign."""
        ahead = way.speeds_mps[self._at : self._at + 3]
        planned = float(np.abs(ahead).max())
        stopping = math.sqrt(2.0 * STOPPING_MPS2 * max(0.0, left))
        servo = max(CREEP_MPS, planned * (1.0 - abs(turn) / 0.3))
        return max(CREEP_MPS, min(planned, stopping, servo))

    def _throttle(self, now_ns: int, speed: float, then: float, dt: float) -> float:
        """Return the throttle for the target, from the speeds measured now and predicted."""
        if self._has_constant_gains:
            return max(-1.0, min(1.0, self._target / PAPER_SPEED_MPS))
        known = self._response.throttle_for(self._target)
        slope = known / self._target if self._target else 0.0
        value = known + slope * (SPEED_GAIN * (self._target - then) + self._integral)
        if abs(value) < 1.0:
            acting_ns = now_ns - round(self._response.drive_delay_s * NS_PER_S)
            _, wanted = self._sent_at(acting_ns, Command(0.0, 0.0))
            self._integral += SPEED_INTEGRAL * (wanted - speed) * dt
            self._integral = max(-MOST_INTEGRAL, min(MOST_INTEGRAL, self._integral))
        return max(-1.0, min(1.0, value))


def _pieces(way: Trajectory) -> list[tuple[int, int]]:
    """Return the first and last index of each piece between two changes of gear."""
    moved = np.hypot(*np.diff(way.poses[:, :2], axis=0).T)
    forward = np.cos(way.poses[:-1, 2]) * np.diff(way.poses[:, 0])
    forward += np.sin(way.poses[:-1, 2]) * np.diff(way.poses[:, 1])
    gears: Ints = np.where(moved < 1e-6, 0, np.sign(forward)).astype(np.int64)
    pieces: list[tuple[int, int]] = []
    begin, gear = 0, 0
    for i, sign in enumerate(gears.tolist()):
        if sign and gear and sign != gear:
            pieces.append((begin, i))
            begin = i
        gear = sign or gear
    if gear:
        pieces.append((begin, len(way.poses) - 1))
    return pieces


def _step(way: Trajectory, i: int) -> float:
    (x0, y0), (x1, y1) = way.poses[i, :2], way.poses[i + 1, :2]
    return math.hypot(x1 - x0, y1 - y0)


def _along(way: Trajectory, first: int, last: int) -> float:
    """Return the length of a stretch [m]."""
    return float(np.hypot(*np.diff(way.poses[first : last + 1, :2], axis=0).T).sum())


def _place(
    way: Trajectory, first: int, at: int, pose: Pose2, gear: float, wheelbase_m: float
) -> Place:
    """Return where a pose is beside the way, between two of its points.

    At a cusp, the `first` point of a piece, the way has the angle of the piece before.
    """
    off = Pose2(*map(float, way.poses[at])).inverse() @ pose
    on = at + 1 if off.x * gear > 0.0 else at - 1
    angles = way.steering_rad[first + 1 :]
    angle = float(angles[max(at - first - 1, 0)])
    if first < on < len(way.poses):
        length = math.hypot(*(way.poses[on, :2] - way.poses[at, :2]))
        part = min(abs(off.x) / length, 1.0) if length > 1e-6 else 0.0
        angle += part * (float(angles[on - first - 1]) - angle)
    curvature = math.tan(angle) / wheelbase_m
    left = off.y - 0.5 * curvature * off.x**2
    return Place(left, wrap_angle(off.yaw - curvature * off.x), gear, curvature)
