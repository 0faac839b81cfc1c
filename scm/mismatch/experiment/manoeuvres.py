"""Drives that a person can command: pieces of constant throttle and steering, scaled to a pace.

A pace is what car and floor allow: how fast it went when recorded, how far there is to go. To add a
drive: a function of a `Pace`, and its line in `MANOEUVRES`. The sentence is for a student with a
remote control; where to start and how much room it needs is added later.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.geometry import Pose2
from scm.replay.drive import Drive
from scm.vehicles.car import Car
from scm.vehicles.fleet import Fleet

LEVELS = np.linspace(0.05, 1.0, 20)
SETTLING_S = 6.0
STEP_S = 0.01
WALL_M = 0.1
SIDEWAYS_M_S2 = 3.0  # what ordinary tyres hold on an ordinary floor
ROW_S = 0.05
ABOUT_S = 30.0
REST_S = 1.0
EIGHT = 0.17  # radius over length of an eight, with some room to drift
Piece = tuple[float, float, float]
"""Seconds, throttle, steering."""


@dataclass(frozen=True, slots=True)
class Floor:
    """The rectangle that is free to drive on [m]."""

    x_m: tuple[float, float]
    y_m: tuple[float, float]

    @property
    def size(self) -> tuple[float, float]:
        """Its width along x and along y [m]."""
        return self.x_m[1] - self.x_m[0], self.y_m[1] - self.y_m[0]


@dataclass(frozen=True, slots=True)
class Pace:
    """How manoeuvres are scaled.

    Attributes:
        throttle: The highest that is used.
        speeds: Steady speed of the nominal car at `LEVELS` of throttle [m/s].
        rise_s: Until it is two thirds as fast as it gets.
        run_m: Length of the longest straight run that fits, the car's own length taken off.
        turn_m: Radius of the largest circle that fits.
        tightest_m: Radius at full lock.
        margin_m: What the car needs around its rear axle.
    """

    floor: Floor
    throttle: float
    speeds: tuple[float, ...]
    rise_s: float
    run_m: float
    turn_m: float
    wheelbase_m: float
    limit_rad: float
    margin_m: float

    @property
    def tightest_m(self) -> float:
        """Radius at full lock [m]."""
        return self.wheelbase_m / math.tan(self.limit_rad)

    def speed(self, throttle: float) -> float:
        """Return the steady speed on the level [m/s]."""
        return float(np.interp(throttle, (0.0, *LEVELS), (0.0, *self.speeds)))

    def lasts(self, throttle: float, longest_s: float = 12.0) -> float:
        """Return how long a straight run from standstill may take, in half seconds."""
        reach = self.run_m / max(self.speed(throttle), 1e-3) + 0.7 * self.rise_s
        return max(math.floor(2.0 * min(reach, longest_s)) / 2.0, 0.5)

    def steering(self, radius_m: float) -> float:
        """Return the command for a circle, at most 0.95."""
        return min(math.atan(self.wheelbase_m / radius_m) / self.limit_rad, 0.95)

    def radius(self, steering: float) -> float:
        """Return the radius that a steering command gives [m]."""
        return self.wheelbase_m / math.tan(abs(steering) * self.limit_rad)


def pace_of(car: Car, drives: Sequence[Drive], floor: Floor | None = None) -> Pace:
    """Return what a car may do, from what it did; without a floor, where it was recorded."""
    floor = floor or _driven_on(drives)
    commands = np.concatenate([np.abs(d.throttle.values) for d in drives])
    top = min(round(float(np.percentile(commands, 98)), 2), 1.0)
    top = max(top, 0.1)
    speeds, rise = _answers(car)
    base = car.value("body.wheelbase_m")
    known = car.has("body.footprint_x_m")
    ends = car.vector("body.footprint_x_m") if known else (-0.5 * base, 1.5 * base)
    margin = max(abs(end) for end in ends) + WALL_M
    wide, narrow = max(floor.size), min(floor.size)
    limit = car.value("steering.limit_rad") if car.has("steering.limit_rad") else 0.5
    return Pace(
        floor, top, speeds, rise, max(wide - 2.0 * margin, 0.2),
        max(0.5 * narrow - margin, 0.1), base, limit, margin,
    )  # fmt: skip


def _driven_on(drives: Sequence[Drive]) -> Floor:
    spans = [
        (
            min(float(d.stream(name).values.min()) for d in drives),
            max(float(d.stream(name).values.max()) for d in drives),
        )
        for name in ("pose.x", "pose.y")
    ]
    return Floor(*((low - 0.3, high + 0.3) for low, high in spans))


def _answers(car: Car) -> tuple[tuple[float, ...], float]:
    """Return the speeds that throttles give after a while, and how fast they are reached [s]."""
    fleet, n = Fleet(car, len(LEVELS)), len(LEVELS)
    for _ in range(n):
        fleet.add(Pose2(0.0, 0.0, 0.0))
    steps = round(SETTLING_S / STEP_S)
    throttle = np.tile(LEVELS, (steps, 1))
    speed = fleet.rollout(throttle, np.zeros_like(throttle), STEP_S, ("speed",))["speed"]
    middle = speed[:, n // 2]
    rise = STEP_S * float(np.argmax(middle >= 0.63 * middle[-1]))
    return tuple(float(v) for v in np.maximum.accumulate(speed[-1])), rise


@dataclass(frozen=True, slots=True)
class Manoeuvre:
    """One drive.

    Attributes:
        text: What to do, a sentence with numbers.
    """

    name: str
    pieces: tuple[Piece, ...]
    text: str

    @property
    def lasts_s(self) -> float:
        """How long it takes [s]."""
        return sum(piece[0] for piece in self.pieces)

    def rows(self) -> Floats:
        """Return (n, 3): time, throttle and steering of rows `ROW_S` apart, the last at rest."""
        counts = [max(round(seconds / ROW_S), 1) for seconds, _, _ in self.pieces]
        values = np.repeat([piece[1:] for piece in self.pieces], counts, axis=0)
        values = np.concatenate((values, np.zeros((1, 2))))
        return np.column_stack((ROW_S * np.arange(len(values)), values))


def _again(pieces: list[Piece], about_s: float = ABOUT_S) -> tuple[Piece, ...]:
    """Repeat a round until it lasts about so long; it begins and ends at rest."""
    once = sum(piece[0] for piece in pieces)
    times = max(round(about_s / once), 1)
    return ((REST_S, 0.0, 0.0), *(pieces * times), (REST_S, 0.0, 0.0))


def _there_and_back(run: list[Piece]) -> list[Piece]:
    """Drive a run, stop, and drive it backwards."""
    back = [(seconds, -throttle, steering) for seconds, throttle, steering in run]
    return [*run, (REST_S, 0.0, 0.0), *back, (REST_S, 0.0, 0.0)]


def shuttle(pace: Pace) -> Manoeuvre:
    """Forwards and backwards, wheels straight."""
    u, t = pace.throttle, pace.lasts(pace.throttle)
    text = (
        f"wheels straight, drive forwards for {t:g} s at throttle {u:.2f}, stop for {REST_S:g} s, "
        f"drive backwards for {t:g} s at throttle -{u:.2f}, stop, and so on for half a minute"
    )
    return Manoeuvre("shuttle", _again(_there_and_back([(t, u, 0.0)])), text)


def straight_steps(pace: Pace) -> Manoeuvre:
    """Throttle up and down in steps, straight."""
    u, t = pace.throttle, pace.lasts(0.7 * pace.throttle) / 4.0
    levels = [round(f * u, 2) for f in (0.4, 0.7, 1.0, 0.7)]
    text = (
        f"wheels straight, step the throttle {', '.join(f'{x:.2f}' for x in levels)}, "
        f"{t:.2g} s each, stop, the same backwards, and so on for half a minute"
    )
    run = [(t, level, 0.0) for level in levels]
    return Manoeuvre("throttle steps", _again(_there_and_back(run)), text)


def throttle_noise(pace: Pace) -> Manoeuvre:
    """Throttle that jumps at random, straight."""
    u, rng = pace.throttle, np.random.default_rng(7)
    low, run, left = round(0.25 * u, 2), list[Piece](), pace.lasts(0.6 * pace.throttle)
    while left > 0.3:
        seconds = float(min(rng.integers(6, 20) * ROW_S, left))
        run.append((seconds, u if len(run) % 2 == 0 else low, 0.0))
        left -= seconds
    text = (
        f"wheels straight, let the throttle jump between {low:.2f} and {u:.2f} every 0.3 to 1 s "
        f"until the floor ends, stop, the same backwards, and so on for half a minute"
    )
    return Manoeuvre("throttle jumps", _again(_there_and_back(run)), text)


def pulse_and_coast(pace: Pace) -> Manoeuvre:
    """Full throttle for a moment, then none until the car stands."""
    u = pace.throttle
    on = max(round(min(1.5, 0.5 * pace.lasts(u)) / ROW_S) * ROW_S, 0.2)
    text = (
        f"wheels straight, give throttle {u:.2f} for {on:.2g} s, then none until the car has "
        f"stood for a second, the same backwards, and so on for half a minute"
    )
    off = on + 1.0
    run = [(on, u, 0.0), (off, 0.0, 0.0), (on, -u, 0.0), (off, 0.0, 0.0)]
    return Manoeuvre("pulse and coast", _again(run), text)


def launches(pace: Pace) -> Manoeuvre:
    """Creep at low throttle, then launch; straight."""
    u, t = pace.throttle, min(pace.lasts(pace.throttle), 2.0)
    creep = [(0.5, round(f * u, 3), 0.0) for f in (0.05, 0.1, 0.15, 0.2, 0.3)]
    text = (
        f"wheels straight, raise the throttle slowly from {0.05 * u:.2f} to {0.3 * u:.2f} in "
        f"2.5 s, then launch at {u:.2f} for {0.5 * t:.2g} s, stop, the same backwards, and so on"
    )
    return Manoeuvre("creep and launch", _again(_there_and_back([*creep, (0.5 * t, u, 0.0)])), text)


def _circle(pace: Pace, share: float = 0.7) -> float:
    """Return the steering of a circle that two halves of an eight leave room for."""
    radius = max(min(share * pace.turn_m, EIGHT * pace.run_m), pace.tightest_m)
    return round(max(pace.steering(radius), 0.1), 2)


def _laps(pace: Pace, throttle: float, steering: float, about_s: float = 8.0) -> float:
    """Return how long whole laps take, as many as fill about so long [s]."""
    lap = 2.0 * math.pi * pace.radius(steering) / max(pace.speed(throttle), 1e-3)
    return round(max(round(about_s / lap), 1) * lap / ROW_S) * ROW_S


def circles(pace: Pace) -> Manoeuvre:
    """Circles left and right, slow and fast."""
    u, s = pace.throttle, _circle(pace)
    slow = round(0.5 * u, 2)
    slowly, fast = _laps(pace, slow, s), _laps(pace, u, s)
    text = (
        f"circles of {pace.radius(s):.2g} m radius (steering {s:.2f}): {slowly:.2g} s left at "
        f"throttle {slow:.2f}, {fast:.2g} s left at {u:.2f}, then the same to the right"
    )
    pieces = [(slowly, slow, s), (fast, u, s), (slowly, slow, -s), (fast, u, -s)]
    return Manoeuvre("circles at two speeds", _again(pieces), text)


def steering_steps(pace: Pace) -> Manoeuvre:
    """Steering that steps from side to side at speed."""
    u, s = round(0.8 * pace.throttle, 2), _circle(pace, 0.5)
    t = min(0.5 * pace.lasts(u), 4.0)
    text = (
        f"at throttle {u:.2f} steer {s:.2f} left for {0.5 * t:.2g} s, right for {t:.2g} s, left "
        f"for {0.5 * t:.2g} s, stop, the same backwards, and so on for half a minute"
    )
    run = [(0.5 * t, u, s), (t, u, -s), (0.5 * t, u, s)]
    return Manoeuvre("steering from side to side", _again(_there_and_back(run)), text)


def slalom(pace: Pace) -> Manoeuvre:
    """A slalom out and back."""
    u, s = round(0.7 * pace.throttle, 2), 0.4
    runs = max(int(pace.lasts(u) / 2.0), 1)
    text = (
        f"a slalom at throttle {u:.2f}: steer {s:g} left and right in turn, 1 s each, for "
        f"{2 * runs} s, stop, the same backwards, and so on for half a minute"
    )
    run = [(0.5, u, s), *([(1.0, u, -s), (1.0, u, s)] * runs)][: 2 * runs]
    return Manoeuvre("slalom", _again(_there_and_back([*run, (0.5, u, -s)])), text)


def small_reversals(pace: Pace) -> Manoeuvre:
    """Small steering to and fro about straight ahead."""
    u, s = round(0.7 * pace.throttle, 2), 0.1
    runs = max(int(pace.lasts(u) / 2.0), 1)
    text = (
        f"at throttle {u:.2f} steer only {s:g} left and right in turn, 1 s each, for {2 * runs} s, "
        f"stop, the same backwards, and so on for half a minute"
    )
    run = [(1.0, u, s), (1.0, u, -s)] * runs
    return Manoeuvre("small steering reversals", _again(_there_and_back(run)), text)


def steer_then_go(pace: Pace) -> Manoeuvre:
    """Steering at rest, then driving off."""
    u, s = pace.throttle, 0.7
    on = min(2.0, 2.0 * pace.turn_m / max(pace.speed(pace.throttle), 1e-3))
    pieces = list[Piece]()
    for side in (s, -s):
        for way in (u, -u):
            gently = [(0.2, round(share * way, 3), side) for share in (0.2, 0.4, 0.6, 0.8)]
            pieces += [(1.5, 0.0, side), *gently, (on, way, side), *reversed(gently)]
    text = (
        f"standing, steer {s:g} to the left, wait 1.5 s, raise the throttle to {u:.2f} in a "
        f"second, drive for {on:.2g} s, stop as gently, drive back, then the same to the right"
    )
    return Manoeuvre("steer at rest, then go", _again(pieces), text)


def out_and_back(pace: Pace) -> Manoeuvre:
    """Straight along the floor, turn round, and straight back, at one throttle."""
    u, s = round(0.8 * pace.throttle, 2), min(pace.steering(0.4 * pace.turn_m), 0.95)
    v, radius = pace.speed(u), pace.radius(s)
    straight = max(0.6 * (pace.run_m - 2.0 * radius) / max(v, 1e-3), 0.5)
    turn = math.pi * radius / max(v, 1e-3)
    text = (
        f"at throttle {u:.2f} drive {straight:.2g} s straight, turn round to the left, steering "
        f"{s:.2f} for {turn:.2g} s, drive straight back as long, and turn round again"
    )
    loop = [(straight, u, 0.0), (turn, u, s)] * 2
    return Manoeuvre("two headings", _again(loop, 1.0), text)


def long_laps(pace: Pace) -> Manoeuvre:
    """Long laps at one throttle, and again after a rest in between."""
    u, s = round(0.8 * pace.throttle, 2), _circle(pace, 0.9)
    text = (
        f"laps of {pace.radius(s):.2g} m radius (steering {s:.2f}) at throttle {u:.2f} for 45 s, "
        f"rest for 30 s, and the same laps for 45 s more"
    )
    pieces = ((REST_S, 0.0, 0.0), (45.0, u, s), (30.0, 0.0, 0.0), (45.0, u, s), (REST_S, 0.0, 0.0))
    return Manoeuvre("long laps with a rest", pieces, text)


MANOEUVRES: Mapping[str, Callable[[Pace], Manoeuvre]] = {
    build.__name__: build
    for build in (
        shuttle, straight_steps, throttle_noise, pulse_and_coast, launches, circles, steering_steps,
        slalom, small_reversals, steer_then_go, out_and_back, long_laps,
    )
}  # fmt: skip
