"""Telemetry of our own firmware, a std_msgs/Float32MultiArray; the published one sends none."""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace

from scm.errors import MessageError

FLOATS = "std_msgs/Float32MultiArray"
FLOATS_MD5 = "6a40e0ffa6a17a503ac3f8616991b1f6"

VALUES = 8
_LARGEST_TICKS = 2**31
_WRAP = 2**24  # of the counts: as many whole numbers as a float32 tells apart


@dataclass(frozen=True, slots=True)
class Telemetry:
    """One reading of everything.

    Attributes:
        left: Encoder counts since the start, + = forward; likewise `right`.
        gyro_radps: About z, + = left. NaN: there is no IMU; likewise `accel_mps2`.
        accel_mps2: Along x forward and y left.
        battery_v: NaN: not measured.
        version: Of the firmware.
        command_age_ms: Time since its last command.
    """

    left: int
    right: int
    gyro_radps: float
    accel_mps2: tuple[float, float]
    battery_v: float
    version: float
    command_age_ms: float

    @property
    def has_imu(self) -> bool:
        """Whether gyro and accelerometer have values."""
        return all(math.isfinite(value) for value in (self.gyro_radps, *self.accel_mps2))


def unpack_floats(payload: bytes) -> tuple[float, ...]:
    """Decode a std_msgs/Float32MultiArray; its layout is ignored.

    Raises:
        MessageError: when it is truncated or too long.
    """
    try:
        (dimensions,), at = struct.unpack_from("<I", payload), 4
        for _ in range(min(dimensions, len(payload))):
            at += 4 + struct.unpack_from("<I", payload, at)[0] + 8
        _, count = struct.unpack_from("<II", payload, at)
        if at + 8 + 4 * count != len(payload):
            msg = f"{FLOATS}: got {len(payload)} bytes, expected {at + 8 + 4 * count}"
            raise MessageError(msg)
        return struct.unpack_from(f"<{count}f", payload, at + 8)
    except struct.error as cause:
        msg = f"{FLOATS} of {len(payload)} bytes: {cause}"
        raise MessageError(msg) from cause


def telemetry_of(values: Sequence[float]) -> Telemetry:
    """Return eight values as a reading.

    Raises:
        MessageError: when there are fewer, or ticks that are no counts.
    """
    if len(values) < VALUES or not all(abs(ticks) <= _LARGEST_TICKS for ticks in values[:2]):
        msg = f"telemetry: got {list(values)[:VALUES]}, expected {VALUES} values, two counts first"
        raise MessageError(msg)
    left, right, gyro, ax, ay, volts, version, age_ms = values[:VALUES]
    return Telemetry(int(left), int(right), gyro, (ax, ay), volts, version, age_ms)


def unwrapped(reading: Telemetry, before: Telemetry | None) -> Telemetry:
    """Return a reading with counts unwrapped from the one before: the firmware's wrap around."""
    if before is None:
        return reading
    left, right = (
        old + (new - old + _WRAP // 2) % _WRAP - _WRAP // 2
        for new, old in ((reading.left, before.left), (reading.right, before.right))
    )
    return replace(reading, left=left, right=right)
