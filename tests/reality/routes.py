"""Floors, and closed lines on them that a car can follow."""

import math
from dataclasses import dataclass, replace

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

    def on_floor(self, size):
        """Return the same driving on a floor of another size, relative to the usual one."""
        return self if size == 1.0 else replace(self, floor=tuple(size * f for f in self.floor))


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


SHAPES = {
    "basic": ("oval", "eight", "box", "wavy", "peanut"),
    "spline": ("spline",),
    "further": ("stadium", "triangle", "clover", "loop", "bean"),
}


def _shape(kind, rng, width):
    """Return a closed line about the origin within -1..1, as a function of 0..2 pi."""
    if kind not in SHAPES["basic"]:
        x, y = _spline(rng) if kind == "spline" else _further(kind, rng)
        x, y = _smoothed(x, width), _smoothed(y, width)
        x, y = x - 0.5 * (x.max() + x.min()), y - 0.5 * (y.max() + y.min())
        return x / np.abs(x).max(), y / np.abs(y).max()
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


def _further(kind, rng):
    """Return a closed line of a shape that is not among the basic ones."""
    a = np.linspace(0.0, 2.0 * math.pi, 4000, endpoint=False)
    if kind == "stadium":
        straight = rng.uniform(0.5, 1.5)
        return np.cos(a) + straight * np.clip(3.0 * np.cos(a), -1.0, 1.0), np.sin(a)
    if kind == "triangle":
        bulge = rng.uniform(0.1, 0.2) * np.cos(3.0 * a + rng.uniform(0.0, 6.28))
        return (1.0 + bulge) * np.cos(a), (1.0 + bulge) * np.sin(a)
    if kind == "clover":
        leaves = 1.0 + rng.uniform(0.15, 0.3) * np.cos(4.0 * a)
        return leaves * np.cos(a), leaves * np.sin(a)
    if kind == "loop":
        inner = 0.5 + rng.uniform(0.8, 1.0) * np.cos(a)
        return inner * np.cos(a), inner * np.sin(a)
    bend = rng.uniform(0.2, 0.5)
    return np.cos(a), np.sin(a) + bend * np.cos(a) ** 2


def _spline(rng):
    """Return a closed Catmull-Rom spline through random points; some cross their own line."""
    count = int(rng.integers(5, 10))
    around = 2.0 * math.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    away = rng.uniform(0.4, 1.0, count)
    points = np.column_stack((away * np.cos(around), away * np.sin(around)))
    if rng.random() < 0.3:
        points[:2] = points[1::-1].copy()
    u = np.linspace(0.0, 1.0, 4000 // count, endpoint=False)[:, None]
    parts = []
    for k in range(count):
        p, q, r, s = (points[(k + j) % count] for j in (-1, 0, 1, 2))
        parts.append(
            q + 0.5 * u * (r - p + u * (2 * p - 5 * q + 4 * r - s + u * (3 * q - p - 3 * r + s)))
        )
    return tuple(np.vstack(parts).T)


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


def draw_route(temper, sharpest, rng, of="basic"):
    """Draw a route whose bends the car can take with some steering left.

    Shapes that are not basic are drawn smoother and smoother, until the car can.
    """
    width = 0.04
    while True:
        kind = str(rng.choice(SHAPES[of]))
        x, y = _shape(kind, rng, width)
        x = x * temper.floor[0] * rng.uniform(0.65, 1.0)
        y = y * temper.floor[1] * rng.uniform(0.65, 1.0)
        if rng.random() < 0.5:
            x, y = x[::-1], y[::-1]
        x, y, spacing = _resampled(_smoothed(x, 0.04), _smoothed(y, 0.04))
        bends = _curvature(x, y, spacing)
        if np.abs(bends).max() < 0.8 * sharpest:
            return Route(np.column_stack((x, y)), bends, spacing, kind)
        width *= 1.1


def draw_speeds(temper, duration, rng):
    """Draw the target speed at every command: stretches of some seconds, now and then a stop."""
    fastest = rng.uniform(*temper.fastest)
    target_speeds, stops = [], rng.uniform(0.08, 0.22)
    count = round(duration * 20)
    while len(target_speeds) < count:
        stop = bool(target_speeds) and rng.random() < stops
        seconds = rng.uniform(1.5, 3.5) if stop else rng.uniform(2.5, 8.0)
        speed = 0.0 if stop else fastest * rng.uniform(0.3, 1.0)
        target_speeds += [speed] * round(seconds * 20)
    return np.array(target_speeds[:count]), fastest
