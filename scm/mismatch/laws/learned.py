"""The general effect: one shape of one mix of variables, as a force, wheel angle or throttle.

    q = time, x, y, yaw, speed, wheel angle, throttle, yaw rate, each times its weight, + phase
    g = sine * sin(q) + cosine * cos(q) + one + line * q + size * |q| + square * q^2 + cube * q^3
        + heavy * |q|^3 + ramp * max(q, 0)
        + step * (0 below q = -0.5, 1 above 0.5, straight between) + comb

One compiled car so serves every law that may be tried: a law is a set of numbers. The comb is a
hat of time that returns: it asks what a push at each moment would explain.
"""

import math

from scm.vehicles.car import Car
from scm.vehicles.jit import law
from scm.vehicles.lane_math import sin_cos, soft_sign
from scm.vehicles.param import Param
from scm.vehicles.term import Law, Per, Term

PREFIX = "learned."
TRIM, GAIN = "steering.trim_rad", "steering.gain"
SLOW = 0.02  # speed over which a drag turns round with the car [m/s]
_FAR = (-1e4, 1e4)


def _number(name: str, about: str, default: float = 0.0) -> Param:
    return Param(name, default, "1", PREFIX + name, _FAR, about)


WEIGHTS = ("time", "x", "y", "yaw", "speed", "steer", "throttle", "rate")
_WEIGHTS = tuple(_number(f"by_{name}", f"weight of {name} in the mix") for name in WEIGHTS)
_SHAPES = tuple(
    _number(name, f"share of the shape: {name}")
    for name in (
        "sine",
        "cosine",
        "one",
        "line",
        "size",
        "square",
        "cube",
        "heavy",
        "ramp",
        "step",
        "comb",
    )
)
_COMB = (
    _number("comb_at", "time of the first hat", 0.0),
    _number("comb_every", "time between hats", 1000.0),
    _number("comb_wide", "half of a hat's foot", 1.0),
)
_MIX = (*_WEIGHTS, _number("phase", "added to the mix"), *_SHAPES, *_COMB)


@law
def mixed(
    time: float, x_cog: float, y_cog: float, yaw: float, vx: float, linkage_angle: float,
    throttle_command: float, yaw_rate: float, by_time: float, by_x: float, by_y: float,
    by_yaw: float, by_speed: float, by_steer: float, by_throttle: float, by_rate: float,
    phase: float,
) -> float:  # fmt: skip
    """The mix of variables."""
    place = by_x * x_cog + by_y * y_cog + by_yaw * yaw
    motion = by_speed * vx + by_rate * yaw_rate
    return (
        by_time * time
        + place
        + motion
        + by_steer * linkage_angle
        + by_throttle * throttle_command
        + phase
    )


@law
def shaped(
    q: float, time: float, sine: float, cosine: float, one: float, line: float, size: float,
    square: float, cube: float, heavy: float, ramp: float, step: float, comb: float,
    comb_at: float, comb_every: float, comb_wide: float,
) -> float:  # fmt: skip
    """The shape over the mix."""
    s, c = sin_cos(q)
    smooth = sine * s + cosine * c + one + q * (line + q * (square + q * cube))
    bent = abs(q) * (size + heavy * q * q) + ramp * max(q, 0.0) + step * min(max(q + 0.5, 0.0), 1.0)
    since = (time - comb_at) / comb_every
    away = abs(since - math.floor(since + 0.5)) * comb_every
    return smooth + bent + comb * max(0.0, 1.0 - away / comb_wide)


@law
def learned_push(
    time: float, x_cog: float, y_cog: float, yaw: float, vx: float, linkage_angle: float,
    throttle_command: float, yaw_rate: float, cos_yaw: float, sin_yaw: float, by_time: float,
    by_x: float, by_y: float, by_yaw: float, by_speed: float, by_steer: float, by_throttle: float,
    by_rate: float, phase: float, sine: float, cosine: float, one: float, line: float,
    size: float, square: float, cube: float, heavy: float, ramp: float, step: float, comb: float,
    comb_at: float, comb_every: float, comb_wide: float, along_n: float, drag_n: float,
    world_x_n: float, world_y_n: float,
) -> float:  # fmt: skip
    """Force along the body, + forward [N]."""
    q = mixed(
        time, x_cog, y_cog, yaw, vx, linkage_angle, throttle_command, yaw_rate, by_time,
        by_x, by_y, by_yaw, by_speed, by_steer, by_throttle, by_rate, phase,
    )  # fmt: skip
    g = shaped(
        q, time, sine, cosine, one, line, size, square, cube, heavy, ramp, step, comb, comb_at,
        comb_every, comb_wide,
    )  # fmt: skip
    floor = world_x_n * cos_yaw + world_y_n * sin_yaw
    return g * (along_n - drag_n * soft_sign(vx / SLOW) + floor)


@law
def learned_push_across(
    time: float, x_cog: float, y_cog: float, yaw: float, vx: float, linkage_angle: float,
    throttle_command: float, yaw_rate: float, cos_yaw: float, sin_yaw: float, by_time: float,
    by_x: float, by_y: float, by_yaw: float, by_speed: float, by_steer: float, by_throttle: float,
    by_rate: float, phase: float, sine: float, cosine: float, one: float, line: float,
    size: float, square: float, cube: float, heavy: float, ramp: float, step: float, comb: float,
    comb_at: float, comb_every: float, comb_wide: float, world_x_n: float, world_y_n: float,
) -> float:  # fmt: skip
    """Force across the body, + to its left [N]."""
    q = mixed(
        time, x_cog, y_cog, yaw, vx, linkage_angle, throttle_command, yaw_rate, by_time,
        by_x, by_y, by_yaw, by_speed, by_steer, by_throttle, by_rate, phase,
    )  # fmt: skip
    g = shaped(
        q, time, sine, cosine, one, line, size, square, cube, heavy, ramp, step, comb, comb_at,
        comb_every, comb_wide,
    )  # fmt: skip
    return g * (world_y_n * cos_yaw - world_x_n * sin_yaw)


@law
def learned_twist(
    time: float, x_cog: float, y_cog: float, yaw: float, vx: float, linkage_angle: float,
    throttle_command: float, yaw_rate: float, by_time: float, by_x: float, by_y: float,
    by_yaw: float, by_speed: float, by_steer: float, by_throttle: float, by_rate: float,
    phase: float, sine: float, cosine: float, one: float, line: float, size: float, square: float,
    cube: float, heavy: float, ramp: float, step: float, comb: float, comb_at: float,
    comb_every: float, comb_wide: float, moment_nm: float,
) -> float:  # fmt: skip
    """Moment about z [N*m]."""
    q = mixed(
        time, x_cog, y_cog, yaw, vx, linkage_angle, throttle_command, yaw_rate, by_time,
        by_x, by_y, by_yaw, by_speed, by_steer, by_throttle, by_rate, phase,
    )  # fmt: skip
    g = shaped(
        q, time, sine, cosine, one, line, size, square, cube, heavy, ramp, step, comb, comb_at,
        comb_every, comb_wide,
    )  # fmt: skip
    return g * moment_nm


@law
def learned_turn(
    time: float, x_cog: float, y_cog: float, yaw: float, vx: float, linkage_angle: float,
    throttle_command: float, yaw_rate: float, by_time: float, by_x: float, by_y: float,
    by_yaw: float, by_speed: float, by_steer: float, by_throttle: float, by_rate: float,
    phase: float, sine: float, cosine: float, one: float, line: float, size: float, square: float,
    cube: float, heavy: float, ramp: float, step: float, comb: float, comb_at: float,
    comb_every: float, comb_wide: float, turn_rad: float, turn_gain: float, offset: float,
) -> float:  # fmt: skip
    """Road-wheel angle with the linkage's misalignment, + left [rad]."""
    q = mixed(
        time, x_cog, y_cog, yaw, vx, linkage_angle, throttle_command, yaw_rate, by_time,
        by_x, by_y, by_yaw, by_speed, by_steer, by_throttle, by_rate, phase,
    )  # fmt: skip
    g = shaped(
        q, time, sine, cosine, one, line, size, square, cube, heavy, ramp, step, comb, comb_at,
        comb_every, comb_wide,
    )  # fmt: skip
    return linkage_angle + offset + g * (turn_rad + turn_gain * linkage_angle)


@law
def learned_demand(
    steer_demand: float, gain: float, by_steer: float, size: float, ramp: float, cube: float,
    asked_rad: float,
) -> float:  # fmt: skip
    """Mean road-wheel angle meant, + left [rad]: the shape over the angle asked of the servo."""
    q = by_steer * steer_demand
    g = abs(q) * size + ramp * max(q, 0.0) + cube * q * q * q
    return gain * steer_demand + asked_rad * g


@law
def learned_throttle(
    time: float, x_cog: float, y_cog: float, yaw: float, vx: float, linkage_angle: float,
    throttle_command: float, yaw_rate: float, by_time: float, by_x: float, by_y: float,
    by_yaw: float, by_speed: float, by_steer: float, by_throttle: float, by_rate: float,
    phase: float, sine: float, cosine: float, one: float, line: float, size: float, square: float,
    cube: float, heavy: float, ramp: float, step: float, comb: float, comb_at: float,
    comb_every: float, comb_wide: float, throttle_add: float, throttle_gain: float,
) -> float:  # fmt: skip
    """Throttle as it reaches the car, + forward."""
    q = mixed(
        time, x_cog, y_cog, yaw, vx, linkage_angle, throttle_command, yaw_rate, by_time,
        by_x, by_y, by_yaw, by_speed, by_steer, by_throttle, by_rate, phase,
    )  # fmt: skip
    g = shaped(
        q, time, sine, cosine, one, line, size, square, cube, heavy, ramp, step, comb, comb_at,
        comb_every, comb_wide,
    )  # fmt: skip
    return throttle_command + g * (throttle_add + throttle_gain * throttle_command)


_NEUTRAL = dict.fromkeys(
    ("along_n", "drag_n", "world_x_n", "world_y_n", "moment_nm", "turn_rad", "turn_gain",
     "asked_rad", "throttle_add", "throttle_gain"),
    0.0,
)  # fmt: skip


def _term(function: Law, *, channels: tuple[str, ...], more: tuple[Param, ...] = (),
          adds: str | None = None, sets: str | None = None) -> Term:  # fmt: skip
    amounts = tuple(_number(name, "how much of the shape acts here") for name in channels)
    neutral = {name: _NEUTRAL[name] for name in channels}
    return Term(function, per=Per.BODY, adds=adds, sets=sets, neutral=neutral,
                params=(*_MIX, *amounts, *more))  # fmt: skip


_OFFSET = Param("offset", 0.0, "rad", TRIM, (-0.3, 0.3), "added to the wheels' angle, + left",
                report="offset_rad")  # fmt: skip
_WORLD = ("world_x_n", "world_y_n")
PUSH = _term(learned_push, channels=("along_n", "drag_n", *_WORLD), adds="force_x")
ACROSS = _term(learned_push_across, channels=_WORLD, adds="force_y")
TWIST = _term(learned_twist, channels=("moment_nm",), adds="moment_z")
TURN = _term(
    learned_turn, channels=("turn_rad", "turn_gain"), more=(_OFFSET,), sets="steer_trimmed"
)
_MEANT = Param("gain", 1.0, "1", GAIN, (0.2, 2.0), "angle over the angle meant", report="gain")
_BY_STEER = [p for p in _MIX if p.key.removeprefix(PREFIX) in ("by_steer", "size", "ramp", "cube")]
DEMAND = Term(
    learned_demand, per=Per.BODY, sets="steer_scaled", neutral={"asked_rad": 0.0},
    params=(*_BY_STEER, _number("asked_rad", "how much of the shape is asked for"), _MEANT),
)  # fmt: skip
THROTTLE = _term(
    learned_throttle, channels=("throttle_add", "throttle_gain"), sets="throttle_received"
)


TERMS = (PUSH, ACROSS, TWIST, TURN, DEMAND, THROTTLE)


def learned_terms(car: Car) -> list[Term]:
    """Return the general effect's parts that a car can carry; steering keeps its trim and gain."""
    taken = {term.sets for term in car.terms if term.sets}
    return [term for term in TERMS if term is not THROTTLE or term.sets not in taken]
