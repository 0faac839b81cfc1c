"""Plays a written drive with a car of a city, open loop, and records it for the mismatch search.

A drive is a `.yaml` that names a car, a map, a place to start and a table of commands; `scm
mismatch` writes such files for the drive that would tell rivals apart.
"""

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import msgspec
import yaml

from scm.clock import seconds
from scm.errors import RunError, ScmError
from scm.fleet import Link
from scm.part import Hears
from scm.recording.table import read_table
from scm.v2x.message import Message, Refused, Request
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState

OWNER = "script"
LEASE_MS = 5000
RENEW_S = 1.0
REPEATED_S = 0.05
Row = tuple[float, float, float]
POSE_M, POSE_RAD, GYRO_RAD_S = 0.002, 0.005, 0.002
_DESCRIPTION = """recording: 1
vehicle: {car}
frame: world
tables:
  - file: commands.csv
    time: {{column: t_s, unit: s}}
    channels:
      command.throttle: {{column: throttle, unit: "1"}}
      command.steering: {{column: steering, unit: "1"}}
  - file: pose.csv
    time: {{column: t_s, unit: s}}
    channels:
      pose.x: {{column: x_m, unit: m, std: {metre}}}
      pose.y: {{column: y_m, unit: m, std: {metre}}}
      pose.yaw: {{column: yaw_rad, unit: rad, std: {radian}}}
"""
_SENSORS = """  - file: sensors.csv
    time: {{column: t_s, unit: s}}
    channels:
      encoder.left: {{column: left, unit: count}}
      encoder.right: {{column: right, unit: count}}
      imu.gyro_z: {{column: gyro_rad_s, unit: rad/s, std: {gyro}}}
"""


class Drive(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The file of a drive; paths are relative to it.

    Attributes:
        drive: Version of the format, 1.
        say: What is to be done, for a person.
        car: Name or file of the car.
        map: Name or file of the map; `spawn`: where on it the car starts.
        commands: CSV of `t_s, throttle, steering`, each row held until the next.
    """

    drive: int
    say: str = ""
    car: str = "nigel"
    map: str = "parking_school"
    spawn: str = ""
    commands: str


@dataclass(slots=True)
class Played:
    """What was commanded and reported, times on the city's clock [s]."""

    commands: list[tuple[float, ...]] = field(default_factory=list)
    poses: list[tuple[float, ...]] = field(default_factory=list)
    sensors: list[tuple[float, ...]] = field(default_factory=list)


def read_drive(path: Path) -> tuple[Drive, list[Row]]:
    """Return a drive and its rows of time, throttle and steering, in the order of time.

    Raises:
        ScmError: naming the file and what is wrong with it.
    """
    try:
        drive = msgspec.convert(yaml.safe_load(path.read_text(encoding="utf-8")), Drive)
    except (OSError, yaml.YAMLError, msgspec.ValidationError) as cause:
        msg = f"{path}: {cause}"
        raise ScmError(msg) from cause
    table = read_table(path.parent / drive.commands)
    columns = [table[name] for name in ("t_s", "throttle", "steering")]
    rows = [(float(t), float(u), float(s)) for t, u, s in zip(*columns, strict=True)]
    times = [t for t, _, _ in rows]
    if not rows or times != sorted(times) or not all(map(math.isfinite, sum(rows, ()))):
        msg = f"{path.parent / drive.commands}: expected rows of numbers, t_s going up"
        raise ScmError(msg)
    return drive, rows


def play(link: Link, vehicle: str, rows: list[Row]) -> Played:
    """Command a car row by row and return what it reported; the lease is given back at the end.

    Raises:
        RunError: when the car is not to be had.
    """
    states = link.hear(Hears(VehicleState, {"vehicle": vehicle}))
    sensors = link.hear(Hears(VehicleSensors, {"vehicle": vehicle}))
    epoch = _lease(link, vehicle, "acquire", 0)
    played, began_ns, renewed = Played(), link.now_ns, 0.0
    for seq, (t, throttle, steering) in enumerate(_repeated(rows), 1):
        due_ns = began_ns + round(t * 1e9)
        link.run_until(lambda due_ns=due_ns: link.now_ns >= due_ns, 60.0)  # type: ignore[misc]
        if t - renewed > RENEW_S:
            _lease(link, vehicle, "renew", epoch)
            renewed = t
        now_ns = link.now_ns
        link.publish(
            DriveCommand(vehicle=vehicle, t_ns=now_ns, epoch=epoch, seq=seq,
                         throttle=throttle, steering=steering)
        )  # fmt: skip
        played.commands.append((seconds(now_ns), throttle, steering))
    _lease(link, vehicle, "release", epoch)
    for item in states.drain():
        if isinstance(state := item.message, VehicleState):
            played.poses.append((seconds(state.t_ns), state.x_m, state.y_m, state.yaw_rad))
    for item in sensors.drain():
        if isinstance(read := item.message, VehicleSensors):
            played.sensors.append(
                (seconds(read.t_ns), read.encoder_left, read.encoder_right, read.gyro_radps[2])
            )
    return played


def _repeated(rows: list[Row]) -> Iterator[Row]:
    """Yield the rows, each again and again until the next: a command that is not repeated expires.

    The last row is sent once: after it the car is given back.
    """
    for (t, throttle, steering), (end, _, _) in pairwise(rows):
        times = max(1, math.ceil((end - t) / REPEATED_S - 1e-6))
        for k in range(times):
            yield t + k * (end - t) / times, throttle, steering
    yield rows[-1]


def write_recording(played: Played, car: str, folder: Path) -> None:
    """Write what was played as a recording that `scm mismatch` reads."""
    folder.mkdir(parents=True, exist_ok=True)
    _write(folder / "commands.csv", ("t_s", "throttle", "steering"), played.commands)
    _write(folder / "pose.csv", ("t_s", "x_m", "y_m", "yaw_rad"), played.poses)
    text = _DESCRIPTION.format(car=car, metre=POSE_M, radian=POSE_RAD)
    if played.sensors:
        _write(folder / "sensors.csv", ("t_s", "left", "right", "gyro_rad_s"), played.sensors)
        text += _SENSORS.format(gyro=GYRO_RAD_S)
    (folder / "recording.yaml").write_text(text, encoding="utf-8")


def _write(path: Path, names: tuple[str, ...], rows: list[tuple[float, ...]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(names)
        writer.writerows(rows)


def _lease(link: Link, vehicle: str, verb: str, epoch: int) -> int:
    request: Request = msgspec.convert(
        {"vehicle": vehicle, "owner": OWNER, "verb": verb, "epoch": epoch, "ttl_ms": LEASE_MS},
        LeaseRequest,
    )
    reply: Message = link.ask(request)
    if isinstance(reply, LeaseReply):
        return reply.epoch
    why = reply.detail if isinstance(reply, Refused) else type(reply).__name__
    msg = f"{vehicle}: its lease was not granted: {why}"
    raise RunError(msg)
