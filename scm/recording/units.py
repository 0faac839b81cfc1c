"""The units of recordings and their factors to SI."""

import math

from scm.errors import RecordingError, nearest

G = 9.80665
DEGREE = math.pi / 180.0

# unit -> (dimension, factor to SI)
UNITS: dict[str, tuple[str, float]] = {
    "1": ("ratio", 1.0),
    "%": ("ratio", 0.01),
    "s": ("time", 1.0),
    "ms": ("time", 1e-3),
    "us": ("time", 1e-6),
    "ns": ("time", 1e-9),
    "min": ("time", 60.0),
    "m": ("length", 1.0),
    "cm": ("length", 1e-2),
    "mm": ("length", 1e-3),
    "rad": ("angle", 1.0),
    "deg": ("angle", DEGREE),
    "m/s": ("speed", 1.0),
    "mm/s": ("speed", 1e-3),
    "cm/s": ("speed", 1e-2),
    "km/h": ("speed", 1.0 / 3.6),
    "rad/s": ("angular speed", 1.0),
    "deg/s": ("angular speed", DEGREE),
    "rpm": ("angular speed", math.tau / 60.0),
    "m/s^2": ("acceleration", 1.0),
    "g": ("acceleration", G),
    "V": ("voltage", 1.0),
    "mV": ("voltage", 1e-3),
    "A": ("current", 1.0),
    "mA": ("current", 1e-3),
    "count": ("count", 1.0),
    "counts": ("count", 1.0),
}

# channel (or its first part, when it ends in a dot) -> the dimensions it may be given in
DIMENSIONS: dict[str, tuple[str, ...]] = {
    "command.throttle": ("ratio",),
    "command.steering": ("ratio", "angle"),
    "command.speed": ("speed",),
    "command.acceleration": ("acceleration",),
    "pose.x": ("length",),
    "pose.y": ("length",),
    "pose.z": ("length",),
    "pose.roll": ("angle",),
    "pose.pitch": ("angle",),
    "pose.yaw": ("angle",),
    "velocity.x": ("speed",),
    "velocity.y": ("speed",),
    "speed": ("speed",),
    "yaw_rate": ("angular speed",),
    "wheel_speed.fl": ("angular speed",),
    "wheel_speed.fr": ("angular speed",),
    "wheel_speed.rl": ("angular speed",),
    "wheel_speed.rr": ("angular speed",),
    "encoder.left": ("count",),
    "encoder.right": ("count",),
    "imu.accel_x": ("acceleration",),
    "imu.accel_y": ("acceleration",),
    "imu.accel_z": ("acceleration",),
    "imu.gyro_x": ("angular speed",),
    "imu.gyro_y": ("angular speed",),
    "imu.gyro_z": ("angular speed",),
    "battery.voltage": ("voltage",),
    "motor.current": ("current",),
    "light.": ("ratio",),
}


def dimensions_of(channel: str, where: str) -> tuple[str, ...]:
    """Return what a channel may be measured in.

    Raises:
        RecordingError: when there is no such channel.
    """
    if channel.startswith("light."):
        return DIMENSIONS["light."]
    if channel not in DIMENSIONS:
        known = [name for name in DIMENSIONS if not name.endswith(".")]
        msg = f"{where}: no channel named {channel!r}{nearest(channel, known)}"
        raise RecordingError(msg)
    return DIMENSIONS[channel]


def factor(unit: str, dimensions: tuple[str, ...], where: str) -> float:
    """Return the factor that turns a value in `unit` into SI.

    Raises:
        RecordingError: when the unit is unknown or measures something else.
    """
    if unit not in UNITS:
        msg = f"{where}: unknown unit {unit!r}{nearest(unit, list(UNITS))}"
        raise RecordingError(msg)
    dimension, value = UNITS[unit]
    if dimension not in dimensions:
        fitting = [name for name, (measures, _) in UNITS.items() if measures in dimensions]
        msg = f"{where}: unit {unit!r} measures {dimension}, expected one of {fitting}"
        raise RecordingError(msg)
    return value
