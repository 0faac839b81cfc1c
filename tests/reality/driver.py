"""A driver who closes the loop on noisy poses, and so corrects away what is wrong with the car."""

import math
from dataclasses import dataclass

import numpy as np

POINTS = 1200


@dataclass(frozen=True)
class Temper:
    """How one type of car is driven: the floor's half sizes [m], speeds [m/s], gains."""

    floor: tuple[float, float]
    fastest: tuple[float, float]
    full_speed: float
    side_push: tuple[float, float]
    look: tuple[float, float]
    push: float
    creep: float


TEMPERS = {
    "nigel": Temper((1.2, 0.72), (0.20, 0.25), 0.267, (0.5, 0.6), (0.11, 0.45), 2.5, 2.0),
    "f1tenth": Temper((4.6, 2.8), (2.4, 3.0), 5.5, (3.0, 4.5), (0.40, 0.25), 0.25, 0.15),
}


@dataclass(frozen=True)
class Route:
    """A closed line: points (n, 2), curvature, spacing [m], and its name."""

    points: np.ndarray
    curvature: np.ndarray
    spacing: float
    shape: str


def _shape(kind, rng):
    """Return a closed line about the origin within -1..1, as a function of 0..2 pi."""
    a = np.linspace(0.0, 2.0 * math.pi, 4000, endpoint=False)
    if kind == "oval":
        x, y = np.cos(a), np.sin(a)
    elif kind == "eight":
        x, y = np.sin(a), np.sin(2.0 * a) * rng.uniform(0.8, 1.0)
    elif kind == "box":
        power = rng.uniform(0.45, 0.7)
        x = np.sign(np.cos(a)) * np.abs(np.cos(a)) ** power
        y = np.sign(np.sin(a)) * np.abs(np.sin(a)) ** power
    elif kind == "peanut":
        waist = 1.0 + rng.uniform(0.3, 0.45) * np.cos(2.0 * a)
        x, y = waist * np.cos(a), waist * np.sin(a)
    else:
        bulge = sum(
            rng.uniform(0.04, 0.22) / k * np.cos(k * a + rng.uniform(0.0, 6.28)) for k in (2, 3, 4)
        )
        x, y = (1.0 + bulge) * np.cos(a), (1.0 + bulge) * np.sin(a)
    return x / np.abs(x).max(), y / np.abs(y).max()


def _smoothed(values, width):
    spectrum = np.fft.fft(values)
    k = np.fft.fftfreq(len(values), 1.0 / len(values))
    return np.real(np.fft.ifft(spectrum * np.exp(-0.5 * (k * width) ** 2)))


def _resampled(x, y):
    ends = np.append(x, x[0]), np.append(y, y[0])
    way = np.append(0.0, np.cumsum(np.hypot(np.diff(ends[0]), np.diff(ends[1]))))
    at = np.linspace(0.0, way[-1], POINTS, endpoint=False)
    return np.interp(at, way, ends[0]), np.interp(at, way, ends[1]), way[-1] / POINTS


def _curvature(x, y, spacing):
    turn = np.unwrap(np.arctan2(np.roll(y, -1) - y, np.roll(x, -1) - x))
    bend = np.diff(np.append(turn, turn[0] + round((turn[-1] - turn[0]) / 6.2832) * 6.2831853))
    return _smoothed(np.roll(bend, 1) / spacing, 0.01)


def draw_route(temper, sharpest, rng):
    """Draw a route whose bends the car can take with some steering left."""
    while True:
        kind = str(rng.choice(["oval", "eight", "box", "wavy", "peanut"]))
        x, y = _shape(kind, rng)
        x = x * temper.floor[0] * rng.uniform(0.65, 1.0)
        y = y * temper.floor[1] * rng.uniform(0.65, 1.0)
        if rng.random() < 0.5:
            x, y = x[::-1], y[::-1]
        x, y, spacing = _resampled(_smoothed(x, 0.04), _smoothed(y, 0.04))
        bends = _curvature(x, y, spacing)
        if np.abs(bends).max() < 0.8 * sharpest:
            return Route(np.column_stack((x, y)), bends, spacing, kind)


def draw_speeds(temper, duration, rng):
    """Draw the speed wished at every command: stretches of some seconds, now and then a stop."""
    fastest = rng.uniform(*temper.fastest)
    wished, stops = [], rng.uniform(0.08, 0.22)
    count = round(duration * 20)
    while len(wished) < count:
        stop = bool(wished) and rng.random() < stops
        seconds = rng.uniform(1.5, 3.5) if stop else rng.uniform(2.5, 8.0)
        speed = 0.0 if stop else fastest * rng.uniform(0.3, 1.0)
        wished += [speed] * round(seconds * 20)
    return np.array(wished[:count]), fastest


class Driver:
    """Pure pursuit for the steering, a PI law on the speed seen for the throttle."""

    def __init__(self, temper, route, wished, base, limit, rng):
        self.temper, self.route, self.wished = temper, route, wished
        self.base, self.limit = base, limit
        self.side_push = rng.uniform(*temper.side_push)
        self.hand = rng.uniform(0.7, 1.3)
        self.seen, self.place, self.sum, self.speed = [], 0, 0.0, 0.0

    def look(self, t, pose):
        """See a pose (x, y, yaw) that came at time `t`."""
        self.seen = [*self.seen[-11:], (t, *pose)]
        then, now = self.seen[0], self.seen[-1]
        if now[0] - then[0] > 0.05:
            middle = now[3]
            way = (now[1] - then[1]) * math.cos(middle) + (now[2] - then[2]) * math.sin(middle)
            self.speed += 0.4 * (way / (now[0] - then[0]) - self.speed)

    def act(self, k):
        """Return throttle and steering, -1..1, of command `k`."""
        if not self.seen:
            return 0.0, 0.0
        _, x, y, yaw = self.seen[-1]
        ahead = self._ahead(x, y)
        goal_x, goal_y = ahead[0] - x, ahead[1] - y
        forward = goal_x * math.cos(yaw) + goal_y * math.sin(yaw)
        aside = goal_y * math.cos(yaw) - goal_x * math.sin(yaw)
        bend = 2.0 * aside / max(forward * forward + aside * aside, 1e-6)
        steering = math.atan(self.base * bend) / self.limit
        return self._throttle(k), min(max(steering, -1.0), 1.0)

    def _ahead(self, x, y):
        route = self.route
        near = (self.place + np.arange(-20, 60)) % POINTS
        away = np.hypot(*(route.points[near] - (x, y)).T)
        self.place = int(near[np.argmin(away)])
        reach = self.temper.look[0] + self.temper.look[1] * abs(self.speed)
        return route.points[(self.place + round(reach / route.spacing)) % POINTS]

    def _throttle(self, k):
        coming = (self.place + np.arange(0, 60, 4)) % POINTS
        sharpest = float(np.abs(self.route.curvature[coming]).max())
        wish = min(self.wished[k], math.sqrt(self.side_push / max(sharpest, 1e-3)))
        if wish == 0.0 and abs(self.speed) < 0.15 * self.temper.fastest[0]:
            self.sum = 0.0
            return 0.0
        off = wish - self.speed
        self.sum = min(max(self.sum + 0.05 * self.temper.creep * off * self.hand, -0.5), 0.5)
        throttle = wish / self.temper.full_speed + self.temper.push * self.hand * off + self.sum
        return min(max(throttle, -1.0), 1.0)
