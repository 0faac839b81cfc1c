"""Converts a described recording to the columns of AutoDRIVE's recorder."""

import re
from collections.abc import Sequence

import numpy as np

from scm.recording.autodrive import ACCELERATION, RATES
from scm.recording.autodrive_write import CarTrack, LightTrack, Series
from scm.recording.motion import Poses, forward
from scm.recording.read import Recording
from scm.recording.units import G
from scm.vehicles.car import Car, load_car

RADIUS, LIMIT = "wheel.radius_m", "steering.limit_rad"
LIGHT = "light."
SAME = {
    "command.throttle": "throttle",
    "encoder.left": "leftTicks",
    "encoder.right": "rightTicks",
    "pose.roll": "roll",
    "pose.pitch": "pitch",
    "speed": "speed",
    **dict(zip(("imu.gyro_x", "imu.gyro_y", "imu.gyro_z"), RATES, strict=True)),
    **dict(zip(("imu.accel_x", "imu.accel_y"), ACCELERATION, strict=False)),
}


def car_track(recording: Recording, car: Car | None = None) -> CarTrack:
    """Return a recording's car in the recorder's columns, its pose at the rear axle.

    A steering command is written as an angle if the car file has its limit.

    Raises:
        RecordingError: when it has no poses.
        CarError: when its file cannot be read.
    """
    car = car or load_car(recording.vehicle, trusted=False)
    poses = Poses(recording)
    columns = {
        "posX": Series(poses.t, poses.x),
        "posY": Series(poses.t, poses.y),
        "yaw": Series(poses.t, poses.yaw),
    }
    columns |= {theirs: _series(recording, ours) for ours, theirs in SAME.items()
                if ours in recording.channels}  # fmt: skip
    radius_m = car.value(RADIUS) if car.has(RADIUS) else 0.0
    if "pose.z" in recording.channels:
        z = _series(recording, "pose.z")
        columns["posZ"] = z._replace(values=z.values + radius_m)
    if "imu.accel_z" in recording.channels:
        up = _series(recording, "imu.accel_z")
        columns["accZ"] = up._replace(values=up.values - G)
    if "command.steering" in recording.channels:
        steering = _series(recording, "command.steering")
        is_angle = recording.channel("command.steering").dimension == "angle"
        if is_angle or car.has(LIMIT):
            scale = 1.0 if is_angle else car.value(LIMIT)
            columns["steering"] = steering._replace(values=steering.values * scale)
    return CarTrack(recording.name, columns)


def light_tracks(recordings: Sequence[Recording]) -> list[LightTrack]:
    """Return the lights of recordings; `light.TL3` is number 3; the others follow in order."""
    found = {
        name.removeprefix(LIGHT): _series(recording, name)
        for recording in recordings
        for name in recording.channels
        if name.startswith(LIGHT)
    }
    numbers = {name: int(m[1]) for name in found if (m := re.fullmatch(r"(?:TL)?(\d+)", name))}
    free = (n for n in range(1, len(found) + 1 + max(numbers.values(), default=0)))
    free = (n for n in free if n not in set(numbers.values()))
    return [
        LightTrack(numbers[name] if name in numbers else next(free), name, states)
        for name, states in found.items()
    ]


def _series(recording: Recording, name: str) -> Series:
    channel = forward(recording, name)
    values = channel.values
    if name in ("pose.roll", "pose.pitch"):
        values = np.unwrap(values)
    return Series(channel.t, values)
