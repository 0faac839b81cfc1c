"""What can be concealed: each effect's name, parameters, sign and size, and how it acts here.

Sizes are multiples of the smallest effect that a drive of a minute or so can show at all.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

FLOOR = {"nigel": (1.2, 0.72), "f1tenth": (4.6, 2.8)}


@dataclass(frozen=True)
class Drawn:
    """One effect with its numbers.

    Attributes:
        parameters: By the names that the library gives them; of a law outside it, our own.
        adds, times: What to add to, or multiply with, the numbers of the motion and the sensors.
        law: Formula of a law outside the library.
    """

    parameters: dict[str, float]
    adds: dict[str, float] = field(default_factory=dict)
    times: dict[str, float] = field(default_factory=dict)
    law: str = ""


Draw = Callable[..., Drawn]
"""Of a size, a generator, the car, and the floor's size relative to the usual one."""


@dataclass(frozen=True)
class Effect:
    """One thing that can be concealed.

    Attributes:
        equation: Which part of a model holds it; `or_equation` are as good an answer.
        depends_on: Variables; `or_depends_on` may be said beside or instead.
        smallest: Size at strength 1 of each car that can show it.
    """

    name: str
    equation: str
    depends_on: tuple[str, ...]
    smallest: dict[str, float]
    draw: Draw
    listed: bool = True
    or_equation: tuple[str, ...] = ()
    or_depends_on: tuple[str, ...] = ()


def _sign(rng):
    return float(rng.choice([-1.0, 1.0]))


def _adds(parameter, number, *, signed=False, both=1.0, law=""):
    """Return a draw whose one parameter is added to one number."""

    def draw(size, rng, _car, _floor=1.0):
        value = size * (_sign(rng) if signed else 1.0)
        return Drawn({parameter: value}, {number: value * both}, law=law)

    return draw


def _times(parameter, *numbers, power=1.0, up=None):
    """Return a draw whose parameter multiplies numbers; `up` says which side of 1, None either."""

    def draw(size, rng, _car, _floor=1.0):
        sign = _sign(rng) if up is None else (1.0 if up else -1.0)
        factor = math.exp(sign * size)
        return Drawn({parameter: factor}, {}, dict.fromkeys(numbers, factor**power))

    return draw


def _grade(size, rng, _car, _floor=1.0):
    uphill = rng.uniform(-math.pi, math.pi)
    return Drawn({"slope": size, "uphill_rad": uphill}, {"slope": size, "uphill": uphill})


def _wind(size, rng, _car, _floor=1.0):
    way = rng.uniform(-math.pi, math.pi)
    x, y = size * math.cos(way), size * math.sin(way)
    return Drawn({"force_x_n": x, "force_y_n": y}, {"wind_x": x, "wind_y": y})


def _saturation(size, rng, _car, _floor=1.0):
    cut = 1.0 - 0.6 / math.sqrt(size)
    left, right = (1.0 - cut, 1.0) if rng.random() < 0.5 else (1.0, 1.0 - cut)
    values = {"left": left, "right": right}
    return Drawn(values, {"stop_left": left - 1.0, "stop_right": right - 1.0})


def _patch(size, rng, car, floor=1.0):
    grip = rng.uniform(0.35, 0.7) if car == "f1tenth" else 1.0
    radius = floor * FLOOR[car][1] * rng.uniform(0.3, 0.5)
    spot = {
        axis: rng.uniform(-0.8, 0.8) * floor * half
        for axis, half in zip("xy", FLOOR[car], strict=True)
    }
    adds = {"patch_x": spot["x"], "patch_y": spot["y"], "patch_rolling": size}
    adds |= {"patch_radius": radius - 0.01, "patch_grip": grip - 1.0}
    known = {"x_m": spot["x"], "y_m": spot["y"], "radius_m": radius}
    return Drawn({**known, "grip": grip, "rolling": size}, adds)


def _two(first, second, number_1, number_2):
    def draw(size, rng, _car, _floor=1.0):
        way = rng.uniform(-math.pi, math.pi)
        x, y = size * math.cos(way), size * math.sin(way)
        return Drawn({first: x, second: y}, {number_1: x, number_2: y})

    return draw


def _unit(_size, rng, _car, _floor=1.0):
    if rng.random() < 0.5:
        return Drawn({"factor": 180.0 / math.pi}, {}, {"gyro_unit": 180.0 / math.pi})
    return Drawn({"factor": 1.0 / 9.80665}, {}, {"accel_unit": 1.0 / 9.80665})


def _both(nigel, f1tenth):
    return {"nigel": nigel, "f1tenth": f1tenth}


def _listed(name, equation, depends_on, smallest, draw):
    return Effect(name, equation, tuple(depends_on.split("+")), smallest, draw)


LISTED = (
    _listed("drive_delay", "drive", "throttle history", _both(0.010, 0.012),
            _adds("delay_s", "drive_delay")),
    _listed("drive_lag", "drive", "throttle history", _both(0.015, 0.02),
            _adds("time_constant_s", "drive_lag")),
    _listed("drive_deadband", "drive", "throttle", _both(0.02, 0.015),
            _adds("threshold", "drive_deadband")),
    _listed("drive_gain", "drive", "throttle", _both(0.03, 0.08), _times("gain", "drive_gain")),
    _listed("drive_asymmetry", "drive", "side", _both(0.03, 0.03),
            _adds("difference", "asymmetry", signed=True)),
    _listed("battery_sag", "drive", "time", _both(0.06, 0.06), _adds("fraction_per_min", "sag")),
    _listed("motor_fade", "drive", "load+time", _both(0.08, 0.12), _adds("fraction", "fade")),
    _listed("rolling_resistance", "drive", "load", _both(0.02, 0.015),
            _adds("coefficient", "rolling")),
    _listed("viscous_drag", "body", "speed", _both(1.5, 0.3), _adds("coefficient", "drag_linear")),
    _listed("aero_drag", "body", "speed", {"f1tenth": 0.1}, _adds("coefficient", "drag_square")),
    _listed("stiction", "drive", "speed", _both(0.04, 0.04), _adds("torque_nm", "stiction")),
    _listed("payload", "body", "acceleration", _both(0.5, 0.8), _adds("mass_kg", "mass")),
    _listed("grade", "surface", "heading", _both(0.006, 0.008), _grade),
    _listed("surface_patch", "surface", "position", _both(0.03, 0.03), _patch),
    _listed("steer_trim", "steering", "constant", _both(0.0157, 0.008),
            _adds("offset_rad", "trim", signed=True)),
    _listed("steer_gain", "steering", "steering", _both(0.08, 0.06), _times("gain", "steer_gain")),
    _listed("steer_saturation", "steering", "steering", {"nigel": 1.0}, _saturation),
    _listed("steer_backlash", "steering", "steering history", _both(0.014, 0.015),
            _adds("width_rad", "backlash")),
    _listed("steer_delay", "steering", "steering history", _both(0.026, 0.02),
            _adds("delay_s", "steer_delay")),
    _listed("steer_lag", "steering", "steering history", _both(0.049, 0.03),
            _adds("time_constant_s", "steer_lag")),
    _listed("steer_rate", "steering", "steering rate", {"nigel": 0.3},
            _times("scale", "pace", up=False)),
    _listed("steer_compliance", "steering", "lateral force", {"f1tenth": 0.07},
            _adds("rad_per_weight", "give")),
    _listed("tyre_stiffness", "tyre", "slip", {"f1tenth": 0.4},
            _times("scale", "stiffness", up=False)),
    _listed("tyre_grip", "tyre", "slip", {"f1tenth": 0.3}, _times("scale", "grip", up=False)),
    _listed("tyre_relaxation", "tyre", "slip history", {"f1tenth": 0.08},
            _adds("length_m", "relaxation")),
    _listed("understeer", "steering", "lateral acceleration", {"f1tenth": 0.008},
            _adds("gradient", "understeer")),
    _listed("com_shift", "body", "lateral acceleration", {"f1tenth": 0.018},
            _adds("shift_m", "cog", signed=True)),
    _listed("corner_drag", "body", "yaw rate", _both(0.7, 0.06),
            _adds("coefficient", "corner_drag")),
    _listed("wind", "body", "heading", _both(0.15, 0.3), _wind),
    _listed("pose_latency", "sensor", "time", _both(0.02, 0.008), _adds("delay_s", "delay")),
    _listed("pose_scale", "sensor", "position", _both(0.025, 0.025), _times("scale", "scale")),
    _listed("camera_tilt", "sensor", "position", _both(0.008, 0.001),
            _two("tilt_x", "tilt_y", "tilt_x", "tilt_y")),
    _listed("pose_point", "sensor", "heading", _both(0.006, 0.012),
            _two("x_m", "y_m", "point_x", "point_y")),
    _listed("pose_heading", "sensor", "constant", _both(0.0131, 0.0131),
            _adds("offset_rad", "heading", signed=True)),
    _listed("wheel_radius", "sensor", "wheel", _both(0.04, 0.025), _times("scale", "radius")),
    _listed("encoder_loss", "sensor", "wheel", _both(0.025, 0.025),
            _adds("fraction", "lost_counts")),
    _listed("gyro_bias", "sensor", "constant", _both(0.01, 0.01),
            _adds("bias_rad_s", "gyro_bias", signed=True)),
    _listed("gyro_scale", "sensor", "yaw rate", _both(0.025, 0.025), _times("scale", "gyro_scale")),
    _listed("accel_bias", "sensor", "constant", _both(0.03, 0.08),
            _two("x_mps2", "y_mps2", "accel_x", "accel_y")),
    _listed("imu_misalignment", "sensor", "acceleration", {"f1tenth": 0.03},
            _adds("angle_rad", "imu_angle", signed=True)),
    _listed("clock_offset", "sensor", "time", _both(-0.02, -0.008),
            _adds("offset_s", "clock_offset")),
    _listed("clock_drift", "sensor", "time", _both(0.0006, 0.0004),
            _adds("rate", "clock_rate", signed=True)),
    _listed("unit_error", "sensor", "unit", _both(1.0, 1.0), _unit),
)  # fmt: skip


def _gust(size, rng, _car, _floor=1.0):
    period, way, phase = rng.uniform(3.0, 12.0), rng.uniform(-3.1, 3.1), rng.uniform(0.0, 6.28)
    found = {"force_n": size, "period_s": period, "toward_rad": way}
    adds = {"gust": size, "gust_period": period - 5.0, "gust_way": way, "gust_phase": phase}
    return Drawn(found, adds, law="force_n * sin(2 pi t / period_s + phase) along toward_rad")


def _tiles(size, rng, car, floor=1.0):
    length, way = rng.uniform(0.2, 0.5) * FLOOR[car][1] * floor, rng.uniform(-1.5, 1.5)
    adds = {"tiles": size, "tile_length": length - 0.5, "tile_way": way}
    adds["tile_phase"] = rng.uniform(0.0, 6.28)
    found = {"force_n": size, "length_m": length, "toward_rad": way}
    return Drawn(found, adds, law="-force_n / 2 * (1 + sin(2 pi s / length_m)), s = place")


def _cliff(size, rng, car, floor=1.0):
    way, at = rng.uniform(-3.1, 3.1), rng.uniform(-0.3, 0.3) * FLOOR[car][1] * floor
    adds = {"cliff_drag": size, "cliff_way": way, "cliff_at": at}
    found = {"force_n": size, "beyond_m": at, "toward_rad": way}
    return Drawn(found, adds, law="-force_n where x cos(toward) + y sin(toward) > beyond_m")


def _nap(size, rng, _car, _floor=1.0):
    way = rng.uniform(-3.1, 3.1)
    return Drawn(
        {"force_n": size, "against_rad": way}, {"nap": size, "nap_way": way},
        law="-force_n / 2 * (1 + cos(yaw - against_rad))",
    )  # fmt: skip


def _bend_drag(size, rng, _car, _floor=1.0):
    power = float(rng.choice([1.0, 2.0, 3.0]))
    return Drawn(
        {"force_n": size, "power": power}, {"bend_drag": size, "bend_power": power - 2.0},
        law="-force_n * (|wheel angle| / limit)^power",
    )  # fmt: skip


def _ripple(size, rng, _car, _floor=1.0):
    turns = float(rng.choice([1.0, 2.0, 3.0]))
    adds = {"ripple": size, "ripple_turns": turns - 2.0, "ripple_phase": rng.uniform(0.0, 6.28)}
    return Drawn(
        {"torque_nm": size, "per_turn": turns}, adds, law="torque_nm * sin(per_turn * wheel turn)"
    )


def _swinging(number, period_number, usual, low, high):
    def draw(size, rng, _car, _floor=1.0):
        period = rng.uniform(low, high)
        return Drawn(
            {"amplitude": size, "period_s": period},
            {number: size, period_number: period - usual},
            law="amplitude * sin(2 pi t / period_s)",
        )

    return draw


def _law(number, text):
    def draw(size, rng, _car, _floor=1.0):
        value = size * _sign(rng)
        return Drawn({"size": value}, {number: value}, law=text)

    return draw


def _unlisted(name, equation, depends_on, smallest, draw, or_equation="", or_depends_on=""):
    return Effect(
        name, equation, tuple(depends_on.split("+")), smallest, draw, False,
        tuple(or_equation.split()), tuple(filter(None, or_depends_on.split("+"))),
    )  # fmt: skip


_FORCE = "body drive surface"
UNLISTED = (
    _unlisted("gust", "body", "time", _both(0.3, 0.5), _gust, _FORCE, "heading"),
    _unlisted("steer_asymmetry", "steering", "side", _both(0.05, 0.05),
              _law("side_gain", "wheel angle * (1 + size) left, (1 - size) right"), "", "steering"),
    _unlisted("nap", "surface", "heading", _both(0.4, 0.6), _nap, _FORCE),
    _unlisted("tiles", "surface", "position", _both(0.5, 0.8), _tiles, _FORCE),
    _unlisted("cliff", "surface", "position", _both(0.4, 0.6), _cliff, _FORCE),
    _unlisted("bend_drag", "drive", "steering", _both(0.6, 1.5), _bend_drag, _FORCE),
    _unlisted("ripple", "drive", "phase", _both(0.02, 0.02), _ripple),
    _unlisted("steer_per_speed", "steering", "speed", _both(0.12, 0.006),
              _law("steer_per_speed", "wheel angle + size * speed")),
    _unlisted("weave", "steering", "time", _both(0.014, 0.008),
              _swinging("weave", "weave_period", 3.0, 2.0, 8.0)),
    _unlisted("surge", "drive", "time", _both(0.06, 0.06),
              _swinging("surge", "surge_period", 6.0, 3.0, 15.0), "", "throttle"),
    _unlisted("twist_per_speed", "body", "speed", {"f1tenth": 0.05},
              _law("twist_per_speed", "yaw moment = size * speed"), "tyre steering"),
    _unlisted("shake", "steering", "time", _both(0.04, 0.02),
              _law("shake", "wheel angle + noise, two seconds in ten")),
    _unlisted("gyro_feels_push", "sensor", "acceleration", {"f1tenth": 0.02},
              _law("gyro_per_accel", "yaw rate + size * acceleration along")),
    _unlisted("lens", "sensor", "position", _both(0.012, 0.002),
              _law("scale_per_x", "measured = true * (1 + size * |x|)")),
)  # fmt: skip


def _spring(size, rng, car, floor=1.0):
    x, y = (rng.uniform(-0.5, 0.5) * side * floor for side in FLOOR[car])
    found = {"stiffness_n_m": size, "x_m": x, "y_m": y}
    adds = {"pull": size, "pull_x": x, "pull_y": y}
    return Drawn(found, adds, law="-stiffness_n_m * (place - (x_m, y_m))")


def _half_slope(size, rng, car, floor=1.0):
    uphill, way = rng.uniform(-3.1, 3.1, 2)
    at = rng.uniform(-0.2, 0.2) * FLOOR[car][1] * floor
    found = {"slope": size, "uphill_rad": uphill, "beyond_m": at, "toward_rad": way}
    adds = {"half_slope": size, "half_uphill": uphill, "half_way": way, "half_at": at}
    return Drawn(found, adds, law="slope where x cos(toward) + y sin(toward) > beyond_m")


def _swirl(size, rng, car, floor=1.0):
    x, y = (rng.uniform(-0.7, 0.7) * side * floor for side in FLOOR[car])
    radius = FLOOR[car][1] * floor * rng.uniform(0.35, 0.6)
    found = {"moment_nm": size, "x_m": x, "y_m": y, "radius_m": radius}
    adds = {"swirl": size * _sign(rng), "swirl_x": x, "swirl_y": y, "swirl_radius": radius - 0.1}
    return Drawn(found, adds, law="yaw moment within radius_m of (x_m, y_m)")


PLACED = (
    _unlisted("spring", "body", "position", _both(0.4, 0.25), _spring, _FORCE),
    _unlisted("half_slope", "body", "position", _both(0.015, 0.02), _half_slope, _FORCE, "heading"),
    _unlisted("swirl", "surface", "position", _both(0.1, 0.3), _swirl, "body tyre"),
)
"""Forces and moments of a place."""

DEPENDENT = (
    _unlisted("servo_under_power", "steering", "throttle", {"nigel": 0.4},
              _adds("per_throttle", "pace_per_throttle",
                    law="servo rate * (1 - per_throttle * |throttle|)")),
    _listed("drive_soft_start", "drive", "throttle", _both(0.04, 0.05),
            _adds("time_constant_s", "rising_lag")),
    _unlisted("left_lag", "steering", "left turns", _both(0.07, 0.05),
              _adds("time_constant_s", "left_lag", law="lag while steered to the left")),
    _unlisted("warm_tyres", "tyre", "long use", {"f1tenth": 0.8},
              _adds("per_throttle", "warm_grip",
                    law="grip * (1 + per_throttle * mean |throttle| of 40 s)")),
)  # fmt: skip
"""A soft start, and numbers of known effects that depend on a variable."""

EFFECTS = {effect.name: effect for effect in (*LISTED, *UNLISTED, *DEPENDENT, *PLACED)}

# Pairs of which one makes good what the other does, with the cars that show both.
HIDING = (
    ("viscous_drag", "drive_gain"), ("battery_sag", "wheel_radius"),
    ("steer_trim", "drive_asymmetry"), ("rolling_resistance", "drive_gain"),
    ("steer_delay", "pose_latency"), ("pose_scale", "wheel_radius"), ("steer_gain", "understeer"),
    ("encoder_loss", "wheel_radius"), ("battery_sag", "motor_fade"), ("steer_trim", "pose_heading"),
    ("drive_deadband", "drive_gain"), ("steer_lag", "steer_backlash"), ("grade", "camera_tilt"),
    ("tyre_stiffness", "com_shift"), ("corner_drag", "steer_compliance"),
)  # fmt: skip

# Of which no drive on a level floor, or no stamps, could tell the shares: never concealed together.
ALIKE = ({"grade", "wind"}, {"pose_latency", "clock_offset"}, {"tyre_stiffness", "tyre_grip"})
