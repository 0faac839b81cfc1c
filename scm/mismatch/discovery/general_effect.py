"""The general effect: one shape of one mix of variables, as a force, wheel angle or throttle.

    q = time, x, y, yaw, speed, wheel angle, throttle, yaw rate, acceleration across, throttle of
        late, distance from a place, each times its weight, + phase
    g = sine * sin(q) + cosine * cos(q) + one + line * q + size * |q| + square * q^2 + cube * q^3
        + heavy * |q|^3 + ramp * max(q, 0)
        + step * (0 below q = -0.5, 1 above 0.5, straight between) + comb

One compiled car so serves every effect of the dictionary: each is a set of numbers. The comb is a
hat of time that returns: it shows what a push at each moment would explain. Torque over a wheel's
turn acts on each driven wheel by its own angle, not through the mix.
"""

import math

from scm.vehicles.car import Car
from scm.vehicles.jit import kernel_function
from scm.vehicles.lane_math import sin_cos, soft_sign
from scm.vehicles.param import Param
from scm.vehicles.term import Function, Per, Term

PREFIX = "learned."
TRIM, GAIN = "steering.trim_rad", "steering.gain"
SLOW = 0.02  # speed over which a drag turns round with the car [m/s]
_FAR = (-1e4, 1e4)


def _number(name: str, about: str, default: float = 0.0) -> Param:
    return Param(name, default, "1", PREFIX + name, _FAR, about)


WEIGHTS = ("time", "x", "y", "yaw", "speed", "steer", "throttle", "rate", "side", "memory", "away")
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
_PLACE = tuple(_number(f"away_{axis}", f"{axis} of the place") for axis in "xy")
_MEMORY = _number("memory_s", "how long the throttle is remembered [s]", 1.0)
_MIX = (*_WEIGHTS, *_PLACE, _number("phase", "added to the mix"), *_SHAPES, *_COMB)


@kernel_function
def throttle_memory(
    throttle_memory: float, throttle_command: float, memory_s: float, dt: float
) -> float:
    """Mean throttle command over the last `memory_s`, which fades, + forward."""
    return throttle_memory + (throttle_command - throttle_memory) * (dt / (memory_s + dt))


@kernel_function
def mixed(
    time: float, x_cog: float, y_cog: float, yaw: float, vx: float, linkage_angle: float,
    throttle_command: float, yaw_rate: float, accel_y: float, throttle_memory: float,
    by_time: float, by_x: float, by_y: float, by_yaw: float, by_speed: float, by_steer: float,
    by_throttle: float, by_rate: float, by_side: float, by_memory: float, by_away: float,
    away_x: float, away_y: float, phase: float,
) -> float:  # fmt: skip
    """The mix of variables."""
    dx, dy = x_cog - away_x, y_cog - away_y
    place = by_x * x_cog + by_y * y_cog + by_yaw * yaw + by_away * math.sqrt(dx * dx + dy * dy)
    motion = by_speed * vx + by_rate * yaw_rate + by_side * accel_y
    drive = by_steer * linkage_angle + by_throttle * throttle_command + by_memory * throttle_memory
    return by_time * time + place + motion + drive + phase


@kernel_function
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


@kernel_function
def learned_shape(
    time: float, x_cog: float, y_cog: float, yaw: float, vx: float, linkage_angle: float,
    throttle_command: float, yaw_rate: float, accel_y: float, throttle_memory: float,
    by_time: float, by_x: float, by_y: float, by_yaw: float, by_speed: float, by_steer: float,
    by_throttle: float, by_rate: float, by_side: float, by_memory: float, by_away: float,
    away_x: float, away_y: float, phase: float, sine: float, cosine: float, one: float,
    line: float, size: float, square: float, cube: float, heavy: float, ramp: float, step: float,
    comb: float, comb_at: float, comb_every: float, comb_wide: float,
) -> float:  # fmt: skip
    """The shape over the mix of variables here and now."""
    q = mixed(
        time, x_cog, y_cog, yaw, vx, linkage_angle, throttle_command, yaw_rate, accel_y,
        throttle_memory, by_time, by_x, by_y, by_yaw, by_speed, by_steer, by_throttle, by_rate,
        by_side, by_memory, by_away, away_x, away_y, phase,
    )  # fmt: skip
    return shaped(
        q, time, sine, cosine, one, line, size, square, cube, heavy, ramp, step, comb, comb_at,
        comb_every, comb_wide,
    )  # fmt: skip


@kernel_function
def learned_push(
    learned_shape: float, vx: float, cos_yaw: float, sin_yaw: float, x_cog: float, y_cog: float,
    along_n: float, drag_n: float, world_x_n: float, world_y_n: float, pull_n_m: float,
) -> float:  # fmt: skip
    """Force along the body, + forward [N]."""
    floor = (world_x_n - pull_n_m * x_cog) * cos_yaw + (world_y_n - pull_n_m * y_cog) * sin_yaw
    return learned_shape * (along_n - drag_n * soft_sign(vx / SLOW) + floor)


@kernel_function
def learned_push_across(
    learned_shape: float, cos_yaw: float, sin_yaw: float, x_cog: float, y_cog: float,
    world_x_n: float, world_y_n: float, pull_n_m: float,
) -> float:  # fmt: skip
    """Force across the body, + to its left [N]."""
    east, north = world_x_n - pull_n_m * x_cog, world_y_n - pull_n_m * y_cog
    return learned_shape * (north * cos_yaw - east * sin_yaw)


@kernel_function
def learned_twist(learned_shape: float, moment_nm: float) -> float:
    """Moment about z [N*m]."""
    return learned_shape * moment_nm


@kernel_function
def learned_turn(
    learned_shape: float, linkage_angle: float, turn_rad: float, turn_gain: float, offset: float
) -> float:
    """Road-wheel angle with the linkage's misalignment, + left [rad]."""
    return linkage_angle + offset + learned_shape * (turn_rad + turn_gain * linkage_angle)


@kernel_function
def learned_demand(
    steer_demand: float, gain: float, by_steer: float, size: float, ramp: float, cube: float,
    demand_rad: float,
) -> float:  # fmt: skip
    """Mean road-wheel angle meant, + left [rad]: the shape over the angle commanded."""
    q = by_steer * steer_demand
    g = abs(q) * size + ramp * max(q, 0.0) + cube * q * q * q
    return gain * steer_demand + demand_rad * g


@kernel_function
def learned_throttle(
    learned_shape: float, throttle_command: float, throttle_add: float, throttle_gain: float
) -> float:
    """Throttle as it reaches the car, + forward."""
    return throttle_command + learned_shape * (throttle_add + throttle_gain * throttle_command)


@kernel_function
def learned_ripple(
    driven: float, wheel_angle: float, ripple_nm: float, per_turn: float, turn_phase: float
) -> float:
    """Torque on a driven wheel as it turns, + forward [N*m]."""
    s, _ = sin_cos(per_turn * wheel_angle + turn_phase)
    return driven * ripple_nm * s


def _term(function: Function, *, channels: tuple[str, ...], more: tuple[Param, ...] = (),
          adds: str | None = None, sets: str | None = None) -> Term:  # fmt: skip
    amounts = tuple(_number(name, "how much of the shape acts here") for name in channels)
    return Term(function, per=Per.BODY, adds=adds, sets=sets, params=(*amounts, *more),
                neutral=dict.fromkeys(channels, 0.0))  # fmt: skip


_OFFSET = Param("offset", 0.0, "rad", TRIM, (-0.3, 0.3), "added to the wheels' angle, + left",
                report="offset_rad")  # fmt: skip
MEMORY = Term(throttle_memory, per=Per.BODY, sets="throttle_memory", keeps=0.0, params=(_MEMORY,))
SHAPE = Term(
    learned_shape, per=Per.BODY, sets="learned_shape", params=_MIX,
    neutral={p.name: 0.0 for p in _SHAPES},
)  # fmt: skip
_WORLD = ("world_x_n", "world_y_n", "pull_n_m")
PUSH = _term(learned_push, channels=("along_n", "drag_n", *_WORLD), adds="force_x")
ACROSS = _term(learned_push_across, channels=_WORLD, adds="force_y")
TWIST = _term(learned_twist, channels=("moment_nm",), adds="moment_z")
TURN = _term(
    learned_turn, channels=("turn_rad", "turn_gain"), more=(_OFFSET,), sets="steer_trimmed"
)
_MEANT = Param("gain", 1.0, "1", GAIN, (0.2, 2.0), "angle over the angle meant", report="gain")
_BY_STEER = [p for p in _MIX if p.key.removeprefix(PREFIX) in ("by_steer", "size", "ramp", "cube")]
DEMAND = Term(
    learned_demand, per=Per.BODY, sets="steer_scaled", neutral={"demand_rad": 0.0},
    params=(*_BY_STEER, _number("demand_rad", "how much of the shape is commanded"), _MEANT),
)  # fmt: skip
THROTTLE = _term(
    learned_throttle, channels=("throttle_add", "throttle_gain"), sets="throttle_received"
)
RIPPLE = Term(
    learned_ripple, per=Per.WHEEL, adds="wheel_torque", neutral={"ripple_nm": 0.0},
    params=(
        _number("ripple_nm", "largest torque on a wheel as it turns"),
        _number("per_turn", "waves in a turn of the wheel", 1.0),
        _number("turn_phase", "of those waves where a wheel has not turned"),
    ),
)  # fmt: skip


TERMS = (MEMORY, SHAPE, PUSH, ACROSS, TWIST, TURN, DEMAND, THROTTLE, RIPPLE)


def learned_terms(car: Car) -> list[Term]:
    """Return the general effect's parts that a car can carry; steering keeps its trim and gain."""
    set_by_car = {term.sets for term in car.terms if term.sets}
    return [term for term in TERMS if term is not THROTTLE or term.sets not in set_by_car]
