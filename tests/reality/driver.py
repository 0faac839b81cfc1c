"""Drivers: most close the loop on noisy poses, and so correct away what is wrong with the car."""

import math

import numpy as np

from tests.reality.motion import COMMAND_S
from tests.reality.routes import POINTS

SEEN_S = 11.0 / 30.0  # of poses, from which a driver sees the speed


class Driver:
    """Pure pursuit for the steering, a PI law on the speed seen for the throttle."""

    late_s = 0.0  # by which he looks farther ahead

    def __init__(self, temper, route, target_speeds, base, limit, rng, pose_hz=30):
        self.rng = rng
        self.frames = max(round(SEEN_S * pose_hz), 3)
        self.trust = 1.0 - 0.6 ** (30.0 / pose_hz)
        self.temper, self.route, self.target_speeds = temper, route, target_speeds
        self.base, self.limit = base, limit
        self.side_push = rng.uniform(*temper.side_push)
        self.hand = rng.uniform(0.7, 1.3)
        self.seen, self.place, self.sum, self.speed = [], 0, 0.0, 0.0

    def look(self, t, pose):
        """See a pose (x, y, yaw) that came at time `t`."""
        self.seen = [*self.seen[-self.frames :], (t, *pose)]
        then, now = self.seen[0], self.seen[-1]
        if now[0] - then[0] > 0.05:
            middle = now[3]
            way = (now[1] - then[1]) * math.cos(middle) + (now[2] - then[2]) * math.sin(middle)
            self.speed += self.trust * (way / (now[0] - then[0]) - self.speed)

    def act(self, k):
        """Return throttle and steering, -1..1, of command `k`."""
        if not self.seen:
            return 0.0, 0.0
        steering = self._steering(*self.seen[-1][1:])
        return self._throttle(k), min(max(steering, -1.0), 1.0)

    def _steering(self, x, y, yaw):
        self._find(x, y)
        reach = self.temper.look[0] + (self.temper.look[1] + self.late_s) * abs(self.speed)
        return self._toward(self._point(reach), x, y, yaw)

    def _toward(self, goal, x, y, yaw):
        """Return the steering of the arc from a pose to a point."""
        goal_x, goal_y = goal[0] - x, goal[1] - y
        forward = goal_x * math.cos(yaw) + goal_y * math.sin(yaw)
        aside = goal_y * math.cos(yaw) - goal_x * math.sin(yaw)
        bend = 2.0 * aside / max(forward * forward + aside * aside, 1e-6)
        return math.atan(self.base * bend) / self.limit

    def _find(self, x, y):
        """Find the place on the route that is nearest to a point."""
        near = (self.place + np.arange(-20, 60)) % POINTS
        away = np.hypot(*(self.route.points[near] - (x, y)).T)
        self.place = int(near[np.argmin(away)])

    def _point(self, ahead):
        """Return the route's point so many metres ahead."""
        return self.route.points[(self.place + round(ahead / self.route.spacing)) % POINTS]

    def _throttle(self, k):
        coming = (self.place + np.arange(0, 60, 4)) % POINTS
        sharpest = float(np.abs(self.route.curvature[coming]).max())
        target = min(self.target_speeds[k], math.sqrt(self.side_push / max(sharpest, 1e-3)))
        if target == 0.0 and abs(self.speed) < 0.15 * self.temper.fastest[0]:
            self.sum = 0.0
            return 0.0
        off = target - self.speed
        self.sum = min(max(self.sum + 0.05 * self.temper.creep * off * self.hand, -0.5), 0.5)
        throttle = target / self.temper.full_speed + self.temper.push * self.hand * off + self.sum
        return min(max(throttle, -1.0), 1.0)


class Stanley(Driver):
    """Steers by the front axle's distance from the route and its angle to it."""

    def _steering(self, x, y, yaw):
        front_x, front_y = x + self.base * math.cos(yaw), y + self.base * math.sin(yaw)
        self._find(front_x, front_y)
        there = self._point(0.2 * abs(self.speed))
        way = self._point(0.2 * abs(self.speed) + 4.0 * self.route.spacing) - there
        course = math.atan2(way[1], way[0])
        aside = (there[1] - front_y) * math.cos(course) - (there[0] - front_x) * math.sin(course)
        slow = 0.2 * self.temper.fastest[0]
        turn = math.remainder(course - yaw, 2.0 * math.pi)
        return (turn + math.atan2(1.5 * aside, abs(self.speed) + slow)) / self.limit


class Hand(Driver):
    """A person at a stick: sees late, trembles, and moves the stick now and then, in steps."""

    def __init__(self, *given):
        super().__init__(*given)
        self.late_s = self.rng.uniform(0.15, 0.3)
        self.side_push *= 0.7
        self.coming, self.stick, self.until = [], (0.0, 0.0), 0

    def look(self, t, pose):
        """See a pose, but only after a while."""
        self.coming.append((t, pose))

    def act(self, k):
        """Return the stick's place; it rests for one to five commands."""
        while self.coming and self.coming[0][0] <= k * COMMAND_S - self.late_s:
            super().look(*self.coming.pop(0))
        if self.seen and k >= self.until:
            tremor = self.rng.normal(0.0, (0.01, 0.025))
            throttle, steering = super().act(k)
            moved = np.round(np.array((throttle, steering)) / 0.02) * 0.02 + tremor
            rests = (abs(throttle) > 0.0, True)  # a stick that is let go does not tremble
            self.stick = tuple(float(v) for v in np.clip(moved, -1.0, 1.0) * rests)
            self.until = k + int(self.rng.integers(1, 6))
        return self.stick


class OpenLoop(Driver):
    """Pieces of steps, ramps and sines, whatever the car does; turned back where it leaves."""

    def __init__(self, *given):
        super().__init__(*given)
        self.stops = self.rng.uniform(0.08, 0.22)
        self.fastest = min(
            self.target_speeds.max(), math.sqrt(0.8 * self.side_push * min(self.temper.floor))
        )
        self.returns, self.piece, self.until = False, None, 0

    def act(self, k):
        """Return the piece's commands, or where the car is leaving, those that turn it back."""
        if not self.seen:
            return 0.0, 0.0
        _, x, y, yaw = self.seen[-1]
        room = max(abs(x) / self.temper.floor[0], abs(y) / self.temper.floor[1])
        turn = math.remainder(math.atan2(-y, -x) - yaw, 2.0 * math.pi)
        self.returns |= room > 0.75 and abs(turn) > 1.2
        if self.returns and abs(turn) > 0.8 and room > 0.5:
            steering = math.copysign(self._most(self.speed), turn)
            return 0.6 * self.fastest / self.temper.full_speed, steering
        if self.returns or k >= self.until:
            self.returns, self.piece = False, self._draw(k)
        return tuple(float(min(max(part(k), -1.0), 1.0)) for part in self.piece)

    def _most(self, speed):
        """Return the largest steering at which the car does not slide."""
        bend = self.side_push / max(speed * speed, 1e-6)
        return min(math.atan(self.base * bend) / self.limit, 1.0)

    def _draw(self, k):
        """Draw throttle and steering of the commands to come, functions of the command."""
        stop = k > 0 and self.rng.random() < self.stops
        self.until = k + round(self.rng.uniform(1.5, 5.0) / COMMAND_S)
        low, high = self.fastest * np.sort(self.rng.uniform(0.3, 1.0, 2))
        most = self._most(high)
        levels = np.array((low, high)) / self.temper.full_speed
        throttle = self._form(k, *self.rng.permutation(levels))
        steering = self._form(k, *self.rng.uniform(-most, most, 2))
        return (lambda _k: 0.0) if stop else throttle, steering

    def _form(self, k, first, last):
        """Return a step, a ramp or a sine between two values from command `k` on."""
        kind, length = self.rng.integers(3), self.until - k
        period = self.rng.uniform(0.8, 4.0) / COMMAND_S
        if kind == 0:
            return lambda _at: last
        if kind == 1:
            return lambda at: first + (last - first) * (at - k) / length
        middle, swing = 0.5 * (first + last), 0.5 * (last - first)
        return lambda at: middle + swing * math.sin(2.0 * math.pi * (at - k) / period)


DRIVERS = {"pure_pursuit": Driver, "stanley": Stanley, "hand": Hand, "open_loop": OpenLoop}
