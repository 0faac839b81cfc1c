"""The dictionary of effects: every channel with every shape that makes sense there."""

import math
from functools import cache

from scm.mismatch.discovery.dictionary_effect import (
    Channel,
    DictionaryEffect,
    Shape,
    ToNumbers,
    Values,
    Written,
    dictionary_effect,
)
from scm.mismatch.effect_catalogue import Parameter
from scm.mismatch.findings import Equation
from scm.vehicles.physics_variables import Per

_FORCE = (-200.0, 200.0)


def _amount(name: str, unit: str, step: float, bounds: tuple[float, float]) -> Parameter:
    return Parameter(name, "", unit, bounds, 0.0, step)


def _only(number: str) -> ToNumbers:
    return lambda values: {number: values[0]}


def _over_floor(values: Values) -> dict[str, float]:
    force, toward = values
    return {"world_x_n": force * math.cos(toward), "world_y_n": force * math.sin(toward)}


def _towards(values: Values) -> dict[str, float]:
    stiffness, x, y = values
    return {"pull_n_m": stiffness, "world_x_n": stiffness * x, "world_y_n": stiffness * y}


DRAG = Channel(
    "drive force", "along_n", Equation.BODY, (_amount("force_n", "N", 0.05, _FORCE),),
    _only("drag_n"), "Something brakes the car by {force_n},", "-{force_n} * {g}",
    (Written("adds force_x", ("vx",), "-force_n * g * soft_sign(vx / 0.02)",
             "Force along the body, + forward [N]."),),
)  # fmt: skip
ALONG = Channel(
    "drive force", "along_n", Equation.DRIVE, (_amount("force_n", "N", 0.05, _FORCE),),
    _only("along_n"), "Something pushes the car forward by {force_n},", "{force_n} * {g}",
    (Written("adds force_x", (), "force_n * g", "Force along the body, + forward [N]."),),
)  # fmt: skip
FLOOR = Channel(
    "floor force", "along_n", Equation.BODY,
    (_amount("force_n", "N", 0.05, _FORCE),
     Parameter("toward_rad", "", "rad", (-30.0, 30.0), 0.0, 0.1)),
    _over_floor, "Something pushes the car over the floor by {force_n} towards {toward_rad},",
    "{force_n} towards {toward_rad} * {g}",
    (Written("adds force_x", ("yaw",), "force_n * g * cosine_of(yaw - toward_rad)",
             "Force along the body, + forward [N]."),
     Written("adds force_y", ("yaw",), "force_n * g * sine_of(toward_rad - yaw)",
             "Force across the body, + to its left [N].", "_across")),
)  # fmt: skip
PULL = Channel(
    "spring", "along_n", Equation.BODY,
    (_amount("stiffness_n_m", "N/m", 0.05, (-200.0, 200.0)),
     Parameter("x_m", "", "m", (-100.0, 100.0), 0.0, 0.05),
     Parameter("y_m", "", "m", (-100.0, 100.0), 0.0, 0.05)),
    _towards, "Something pulls the car towards ({x_m}, {y_m}) with {stiffness_n_m},",
    "-{stiffness_n_m} * ((x, y) - ({x_m}, {y_m})) * {g}",
    (Written("adds force_x", ("x_cog", "y_cog", "yaw"),
             "-stiffness_n_m * g * ((x_cog - x_m) * cosine_of(yaw) + (y_cog - y_m) * sine_of(yaw))",
             "Force along the body, + forward [N]."),
     Written("adds force_y", ("x_cog", "y_cog", "yaw"),
             "-stiffness_n_m * g * ((y_cog - y_m) * cosine_of(yaw) - (x_cog - x_m) * sine_of(yaw))",
             "Force across the body, + to its left [N].", "_across")),
)  # fmt: skip
ANGLE = Channel(
    "wheel angle", "turn_rad", Equation.STEERING,
    (_amount("angle_rad", "rad", 0.005, (-1.0, 1.0)),), _only("turn_rad"),
    "The front wheels turn by {angle_rad} that nobody asked for,", "{angle_rad} * {g}",
    (Written("sets steer_trimmed", ("linkage_angle",), "linkage_angle + offset + angle_rad * g",
             "Mean road-wheel angle, + left [rad]."),),
)  # fmt: skip
DEMAND = Channel(
    "wheel angle", "turn_rad", Equation.STEERING,
    (_amount("angle_rad", "rad", 0.005, (-1.0, 1.0)),), _only("demand_rad"),
    "The servo is asked for {angle_rad} that nobody meant,", "{angle_rad} * {g}",
    (Written("sets steer_scaled", ("steer_demand",), "gain * steer_demand + angle_rad * g",
             "Mean road-wheel angle meant, + left [rad]."),),
)  # fmt: skip
STEER_GAIN = Channel(
    "steering gain", "turn_rad", Equation.STEERING, (_amount("gain", "1", 0.02, (-3.0, 3.0)),),
    _only("turn_gain"), "The steering's gain changes by {gain},", "{gain} * wheel angle * {g}",
    (Written("sets steer_trimmed", ("linkage_angle",),
             "linkage_angle * (1.0 + gain * g) + offset", "Mean road-wheel angle, + left [rad]."),),
)  # fmt: skip
THROTTLE = Channel(
    "throttle", "throttle_add", Equation.DRIVE, (_amount("gain", "1", 0.02, (-1.0, 1.0)),),
    _only("throttle_gain"), "The drive changes by a share of {gain},", "{gain} * throttle * {g}",
    (Written("sets throttle_received", ("throttle_command",), "throttle_command * (1.0 + gain * g)",
             "Throttle as it reaches the car, + forward."),),
)  # fmt: skip
TWIST = Channel(
    "yaw moment", "moment_nm", Equation.BODY, (_amount("moment_nm", "N*m", 0.02, (-50.0, 50.0)),),
    _only("moment_nm"), "Something turns the car with {moment_nm},", "{moment_nm} * {g}",
    (Written("adds moment_z", (), "moment_nm * g", "Moment about z [N*m]."),),
)  # fmt: skip
RIPPLE = Channel(
    "drive torque", "ripple_nm", Equation.DRIVE,
    (_amount("torque_nm", "N*m", 0.002, (-10.0, 10.0)),), _only("ripple_nm"),
    "The torque on each driven wheel swings by {torque_nm} as it turns,",
    "{torque_nm} * {g}",
    (Written("adds wheel_torque", ("driven",), "driven * torque_nm * g",
             "Torque on a driven wheel as it turns, + forward [N*m].", per=Per.WHEEL),),
)  # fmt: skip


EDGE_S, EDGE_M = 0.2, 0.05  # over which steps in time and on the floor rise
_TURN = 2.0 * math.pi


def _parameter(name: str, unit: str, bounds: tuple[float, float], step: float) -> Parameter:
    return Parameter(name, "", unit, bounds, 0.0, step)


def _angle(name: str) -> Parameter:
    return _parameter(name, "rad", (-30.0, 30.0), 0.1)


_PERIOD = _parameter("period_s", "s", (0.5, 200.0), 0.05)
_PHASE = _angle("phase_rad")
_LENGTH = _parameter("length_m", "m", (0.05, 100.0), 0.01)
_AT = _parameter("beyond_m", "m", (-100.0, 100.0), 0.03)
_ABOVE = _parameter("above_mps", "m/s", (0.0, 30.0), 0.02)


def _fixed(**numbers: float) -> ToNumbers:
    return lambda _: numbers


def _in_time(values: Values) -> dict[str, float]:
    period, phase = values
    return {"by_time": _TURN / period, "phase": phase, "sine": 1.0}


def _one_way(values: Values) -> dict[str, float]:
    return {"by_yaw": 1.0, "phase": -values[0], "cosine": 0.5, "one": 0.5}


def _round(values: Values) -> dict[str, float]:
    return {"by_yaw": 1.0, "phase": -values[0], "cosine": 1.0}


def _both_ways(values: Values) -> dict[str, float]:
    return {"by_yaw": 2.0, "phase": -2.0 * values[0], "cosine": 1.0}


def _wave(values: Values) -> dict[str, float]:
    length, way, phase = values
    size = _TURN / length
    by = {"by_x": size * math.cos(way), "by_y": size * math.sin(way)}
    return {**by, "phase": phase, "sine": 1.0}


def _tiles(values: Values) -> dict[str, float]:
    return {**_wave(values), "sine": 0.5, "one": 0.5}


def _beyond(values: Values) -> dict[str, float]:
    at, way = values
    by = {"by_x": math.cos(way) / EDGE_M, "by_y": math.sin(way) / EDGE_M}
    return {**by, "phase": -at / EDGE_M, "step": 1.0}


def _slope(values: Values) -> dict[str, float]:
    return {"by_x": math.cos(values[0]), "by_y": math.sin(values[0]), "line": 1.0}


def _near(values: Values) -> dict[str, float]:
    x, y, radius = values
    place = {"away_x": x, "away_y": y, "phase": radius / EDGE_M}
    return {**place, "by_away": -1.0 / EDGE_M, "step": 1.0}


def _faster(values: Values) -> dict[str, float]:
    return {"by_speed": 1.0, "phase": -values[0], "ramp": 1.0}


def _worked(values: Values) -> dict[str, float]:
    return {"memory_s": values[0], "by_memory": 1.0, "size": 1.0}


def _around(values: Values) -> dict[str, float]:
    return {"per_turn": values[0], "turn_phase": values[1]}


_PLACE = "x_cog * cosine_of(way_rad) + y_cog * sine_of(way_rad)"
_AWAY = "math.sqrt((x_cog - x_m) * (x_cog - x_m) + (y_cog - y_m) * (y_cog - y_m))"
_WAY = _angle("way_rad")
_XY = ("x_cog", "y_cog")
_SPOT = "x cos({way_rad}) + y sin({way_rad})"
SWING = Shape(
    "swing", "time", (_PERIOD, _PHASE), _in_time, "swinging in time with a period of {period_s}",
    "sin(2 pi t / {period_s} + {phase_rad})", ("time",),
    "g = sine_of(2.0 * math.pi * time / period_s + phase_rad)",
)  # fmt: skip
ONE_WAY = Shape(
    "one way", "heading", (_angle("against_rad"),), _one_way,
    "most when it drives towards {against_rad} and not at all the other way",
    "(1 + cos(heading - {against_rad})) / 2", ("yaw",),
    "g = 0.5 + 0.5 * cosine_of(yaw - against_rad)",
)  # fmt: skip
ROUND = Shape(
    "round", "heading", (_angle("against_rad"),), _round,
    "depending on the way it drives, most towards {against_rad}", "cos(heading - {against_rad})",
    ("yaw",), "g = cosine_of(yaw - against_rad)",
)  # fmt: skip
BOTH_WAYS = Shape(
    "both ways", "heading", (_angle("against_rad"),), _both_ways,
    "most when it drives along {against_rad}, either way", "cos(2 (heading - {against_rad}))",
    ("yaw",), "g = cosine_of(2.0 * (yaw - against_rad))",
)  # fmt: skip
_WAVES = (_LENGTH, _WAY, _PHASE)
WAVE = Shape(
    "wave", "position", _WAVES, _wave,
    "in waves over the floor, {length_m} long towards {way_rad}",
    f"sin(2 pi ({_SPOT}) / {{length_m}} + {{phase_rad}})", _XY,
    f"g = sine_of(2.0 * math.pi * ({_PLACE}) / length_m + phase_rad)", Equation.SURFACE,
)  # fmt: skip
TILES = Shape(
    "tiles", "position", _WAVES, _tiles,
    "on stripes of the floor, {length_m} apart towards {way_rad}",
    f"(1 + sin(2 pi ({_SPOT}) / {{length_m}} + {{phase_rad}})) / 2", _XY,
    f"g = 0.5 + 0.5 * sine_of(2.0 * math.pi * ({_PLACE}) / length_m + phase_rad)",
    Equation.SURFACE,
)  # fmt: skip
BEYOND = Shape(
    "beyond", "position", (_AT, _WAY), _beyond,
    "on the part of the floor beyond {beyond_m} towards {way_rad}", f"({_SPOT} > {{beyond_m}})",
    _XY, f"g = min(max(({_PLACE} - beyond_m) / {EDGE_M} + 0.5, 0.0), 1.0)", Equation.SURFACE,
)  # fmt: skip
SLOPE = Shape(
    "slope", "position", (_WAY,), _slope, "for each metre that it is further towards {way_rad}",
    f"({_SPOT}) / 1 m", _XY, f"g = {_PLACE}", Equation.SURFACE,
)  # fmt: skip
NEAR = Shape(
    "near", "position",
    (_parameter("x_m", "m", (-100.0, 100.0), 0.03), _parameter("y_m", "m", (-100.0, 100.0), 0.03),
     _parameter("radius_m", "m", (0.05, 50.0), 0.03)),
    _near, "within {radius_m} of ({x_m}, {y_m})", "(within {radius_m} of ({x_m}, {y_m}))", _XY,
    f"g = min(max((radius_m - {_AWAY}) / {EDGE_M} + 0.5, 0.0), 1.0)", Equation.SURFACE,
)  # fmt: skip
EVERYWHERE = Shape(
    "everywhere", "position", (), _fixed(one=1.0), "in proportion to its distance", "1", (),
    "g = 1.0",
)  # fmt: skip
SPEED = Shape(
    "in proportion", "speed", (), _fixed(by_speed=1.0, line=1.0),
    "for each metre a second that it drives", "speed / (1 m/s)", ("vx",), "g = vx",
)  # fmt: skip
SPEED_SQUARED = Shape(
    "squared", "speed", (), _fixed(by_speed=1.0, square=1.0), "growing with its speed squared",
    "speed^2 / (1 m/s)^2", ("vx",), "g = vx * vx",
)  # fmt: skip
SPEED_CUBED = Shape(
    "cubed", "speed", (), _fixed(by_speed=1.0, heavy=1.0), "growing with its speed cubed",
    "|speed|^3 / (1 m/s)^3", ("vx",), "g = vx * vx * abs(vx)",
)  # fmt: skip
FASTER = Shape(
    "above", "speed", (_ABOVE,), _faster, "for each metre a second above {above_mps}",
    "max(speed - {above_mps}, 0) / (1 m/s)", ("vx",), "g = max(vx - above_mps, 0.0)",
)  # fmt: skip
TURNED = Shape(
    "turned", "steering angle", (), _fixed(by_steer=1.0, size=1.0),
    "for each radian that the wheels are turned", "|wheel angle| / 1 rad", ("linkage_angle",),
    "g = abs(linkage_angle)",
)  # fmt: skip
TURNED_SQUARED = Shape(
    "turned, squared", "steering angle", (), _fixed(by_steer=1.0, square=1.0),
    "growing with the wheels' angle squared", "wheel angle^2 / (1 rad)^2", ("linkage_angle",),
    "g = linkage_angle * linkage_angle",
)  # fmt: skip
TURNED_CUBED = Shape(
    "turned, cubed", "steering angle", (), _fixed(by_steer=1.0, heavy=1.0),
    "growing with the wheels' angle cubed", "|wheel angle|^3 / (1 rad)^3", ("linkage_angle",),
    "g = linkage_angle * linkage_angle * abs(linkage_angle)",
)  # fmt: skip
SIDE = Shape(
    "side", "steering sign", (), _fixed(by_steer=1.0, size=1.0),
    "for each radian to the left, and as much less to the right", "|angle asked for| / 1 rad",
    ("steer_demand",), "g = abs(steer_demand)",
)  # fmt: skip
LEFT = Shape(
    "left", "steering sign", (), _fixed(by_steer=1.0, ramp=1.0),
    "for each radian to the left", "max(wheel angle, 0) / 1 rad", ("linkage_angle",),
    "g = max(linkage_angle, 0.0)", rare=2.0,
)  # fmt: skip
RIGHT = Shape(
    "right", "steering sign", (), _fixed(by_steer=-1.0, ramp=1.0),
    "for each radian to the right", "max(-wheel angle, 0) / 1 rad", ("linkage_angle",),
    "g = max(-linkage_angle, 0.0)", rare=2.0,
)  # fmt: skip
BENT = Shape(
    "bent", "steering angle", (), _fixed(by_steer=1.0, cube=1.0),
    "growing with the angle asked for cubed", "angle asked for^3 / (1 rad)^3", ("steer_demand",),
    "g = steer_demand * steer_demand * steer_demand",
)  # fmt: skip
DRIVEN = Shape(
    "driven", "throttle", (), _fixed(by_throttle=1.0, line=1.0), "in proportion to the throttle",
    "throttle", ("throttle_command",), "g = throttle_command",
)  # fmt: skip
REVERSED = Shape(
    "reversed", "throttle", (), _fixed(by_throttle=-20.0, phase=-0.5, step=1.0),
    "while the throttle is reversed", "(throttle < 0)", ("throttle_command",),
    "g = min(max(-20.0 * throttle_command, 0.0), 1.0)",
)  # fmt: skip
LOAD = Shape(
    "load", "load", (), _fixed(by_side=1.0, size=1.0),
    "for each m/s^2 across, which loads the outer wheels", "|acceleration across| / (1 m/s^2)",
    ("accel_y",), "g = abs(accel_y)",
)  # fmt: skip
TURNING = Shape(
    "turning", "yaw rate", (), _fixed(by_rate=1.0, size=1.0),
    "for each radian a second that it turns", "|yaw rate| / (1 rad/s)", ("yaw_rate",),
    "g = abs(yaw_rate)",
)  # fmt: skip
WORKED = Shape(
    "worked", "throttle's past", (_parameter("memory_s", "s", (0.2, 120.0), 0.1),), _worked,
    "for full throttle over the last {memory_s}", "|mean throttle of the last {memory_s}|",
    ("throttle_memory",), "g = abs(throttle_memory)",
    also=Written(
        "sets throttle_memory", ("throttle_memory", "throttle_command", "dt"),
        "throttle_memory + (throttle_command - throttle_memory) * (dt / (memory_s + dt))",
        "Mean throttle of late, which fades.", "_memory", keeps=0.0,
    ),
)  # fmt: skip
PHASE = Shape(
    "phase", "phase", (_parameter("per_turn", "1", (0.2, 40.0), 0.002), _PHASE), _around,
    "in so many waves a turn: {per_turn}", "sin({per_turn} * wheel turn + {phase_rad})",
    ("wheel_angle",),
    "g = sine_of(per_turn * wheel_angle + phase_rad)",
)  # fmt: skip


_FLOOR = (TILES, WAVE, BEYOND, SLOPE)
_HEADING = (ONE_WAY, ROUND, BOTH_WAYS)
_TIME = (SWING,)
_SPEED = (SPEED, SPEED_SQUARED, SPEED_CUBED, FASTER)
_TURNED = (TURNED, TURNED_SQUARED, TURNED_CUBED, LEFT, RIGHT)
_ROWS = (
    (FLOOR, (SWING, BEYOND)),
    (PULL, (EVERYWHERE,)),
    (ALONG, (SWING,)),
    (DRAG, (*_HEADING, *_FLOOR, SPEED_CUBED, FASTER, *_TURNED,
               TURNING)),
    (ANGLE, (*_TIME, ROUND, WAVE, BEYOND, SLOPE, SPEED, SPEED_SQUARED,
                DRIVEN)),
    (DEMAND, (SIDE, BENT)),
    (STEER_GAIN, (*_TIME, ROUND, BEYOND, SPEED, LOAD)),
    (THROTTLE, (*_TIME, ROUND, BEYOND, SPEED, TURNED, LEFT, RIGHT,
                   REVERSED, LOAD, WORKED)),
    (TWIST, (SWING, *_SPEED[:2], DRIVEN, BEYOND, NEAR)),
    (RIPPLE, (PHASE,)),
)  # fmt: skip


@cache
def dictionary() -> tuple[DictionaryEffect, ...]:
    """Return every effect that may be tried."""
    return tuple(dictionary_effect(channel, shape) for channel, shapes in _ROWS for shape in shapes)
