"""Converts a folder of AutoDRIVE's logs to a recording: tables as CSV, and their description.

Cells are copied unchanged. Only logs with Unity's axes are converted: x = z, y = -x, z = y, and
angles accordingly.
"""

import csv
import ntpath
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from scm.arrays import Floats
from scm.errors import RecordingError
from scm.recording.autodrive import (
    ACCELERATION,
    EULER,
    PICTURES,
    POSITION,
    RATES,
    STAMP,
    cell_of,
)
from scm.recording.autodrive_read import TICKS, Log, read_logs
from scm.recording.autodrive_remarks import (
    counted_on,
    of_axes,
    of_clock,
    of_scans,
    of_steering,
    of_wheels,
)
from scm.recording.columns import LeftOut
from scm.recording.description import FILE_NAME
from scm.recording.units import G

LEFT_OUT = "left_out.csv"
TIME = "t_s"
OURS = {
    STAMP: "stamp",
    "steering": "steering_rad",
    "leftTicks": "left_ticks",
    "rightTicks": "right_ticks",
    **dict(zip(POSITION, ("x_m", "y_m", "z_m"), strict=True)),
    **dict(zip(EULER, ("roll_rad", "pitch_rad", "yaw_rad"), strict=True)),
    "speed": "speed_mps",
    **dict(zip(RATES, ("gyro_x_radps", "gyro_y_radps", "gyro_z_radps"), strict=True)),
    **dict(zip(ACCELERATION, ("accel_x_mps2", "accel_y_mps2", "accel_z_mps2"), strict=True)),
    "cam0": "front_camera",
    "cam1": "rear_camera",
}
CHANNELS: dict[str, tuple[str, dict[str, Any]]] = {  # the recorder's column -> ours, and its unit
    "throttle": ("command.throttle", {}),
    "steering": ("command.steering", {"unit": "rad"}),
    "leftTicks": ("encoder.left", {"unit": "count"}),
    "rightTicks": ("encoder.right", {"unit": "count"}),
    **{name: (f"pose.{axis}", {"unit": "m"}) for name, axis in zip(POSITION, "xyz", strict=True)},
    **{name: (f"pose.{name}", {"unit": "rad"}) for name in EULER},
    "speed": ("speed", {"unit": "m/s"}),
    **{n: (f"imu.gyro_{axis}", {"unit": "rad/s"}) for n, axis in zip(RATES, "xyz", strict=True)},
    "accX": ("imu.accel_x", {"unit": "m/s^2"}),
    "accY": ("imu.accel_y", {"unit": "m/s^2"}),
    "accZ": ("imu.accel_z", {"unit": "m/s^2", "offset": G}),  # theirs is without gravity
}
SMALL = ("roll", "pitch")  # angles about zero, which the recorder writes as 0 to 2 pi
# ours from Unity's, of each three columns: which one, and its sign
_FROM_UNITY = {
    POSITION: ((2, 1), (0, -1), (1, 1)),
    EULER: ((2, -1), (0, 1), (1, -1)),
    RATES: ((2, -1), (0, 1), (1, -1)),
    ACCELERATION: ((2, 1), (0, -1), (1, 1)),
}


@dataclass(frozen=True, slots=True)
class Imported:
    """What came of a folder of logs.

    Attributes:
        remarks: What is to be known of the logs, in lines.
        left_out: Lines of the logs that are no rows, or placeholders; they stand in `left_out.csv`.
    """

    remarks: list[str]
    left_out: list[LeftOut]


def import_logs(
    folder: Path,
    out: Path,
    *,
    car: str,
    car_file: Path,
    steering_sign: int = 1,
    unity_axes: bool = False,
    m_per_count: float | None = None,
    axle_m: float = 0.0,
) -> Imported:
    """Write a folder of logs as a recording.

    Args:
        folder: With `V1 Log.csv` and others; it is not changed.
        out: Folder to write; it must be new, or empty.
        car: Name or path of the cars' file, as a description names it.
        car_file: That file: of several cars each gets a copy, since a file is a car.
        steering_sign: 1: + = left in the logs; -1: + = right.
        unity_axes: The logs have Unity's axes, y up, and turn clockwise.
        m_per_count: What the car rolls for one count of an encoder [m]; None: not known.
        axle_m: How high the rear axle is above the ground, where our poses are [m].

    Raises:
        RecordingError: when there is nothing to read, or `out` is in use.
    """
    logs = read_logs(folder)
    for log in logs:
        if log.kind == "V" and not _channels(log, steering_sign, axle_m):
            msg = f"{log.path}: {len(log.lines)} rows without a number"
            raise RecordingError(msg)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        msg = f"{out}: is there already: a recording is never written over"
        raise RecordingError(msg)
    out.mkdir(parents=True, exist_ok=True)
    start_ms = min(int(log.stamps_ms[0]) for log in logs)
    remarks: list[str] = []
    names = [log.name for log in logs if log.kind == "V"]
    vehicles = {name: car if len(names) == 1 else f"{name}.toml" for name in names}
    for log in logs:
        remarks += of_clock(log)
        if log.kind == "V":
            if unity_axes:
                _turn(log)
            copy = f"put its car file in place of {vehicles[log.name]} in {out}"
            instead = "give its car file with --car" if len(names) == 1 else copy
            axes = [] if unity_axes else of_axes(log)
            remarks += axes or _of_motion(log, steering_sign, m_per_count, car, instead)
            remarks += of_scans(log) + _find_pictures(log, folder)
        _write_table(log, out, start_ms)
    left_out = [one for log in logs for one in log.left_out]
    if left_out:
        _write_left_out(out / LEFT_OUT, left_out)
    if len(names) > 1:
        for vehicle in vehicles.values():
            shutil.copyfile(car_file, out / vehicle)
    _describe(logs, out, vehicles, steering_sign, axle_m)
    return Imported(remarks, left_out)


def _of_motion(
    log: Log, steering_sign: int, m_per_count: float | None, car: str, instead: str
) -> list[str]:
    steering = steering_sign * log.numbers("steering")
    remarks = of_steering(steering, log.numbers("speed"), log.numbers("angZ"))
    return remarks + of_wheels(log, m_per_count, car, instead)


def _turn(log: Log) -> None:
    """Turn the columns of a log from Unity's axes to ours."""
    for names, sources in _FROM_UNITY.items():
        columns: Sequence[Floats] = [log.numbers(name) for name in names]
        for name, (k, sign) in zip(names, sources, strict=True):
            if name in log.cells:
                values = sign * columns[k]
                log.cells[name] = [
                    cell_of(v % (2.0 * np.pi) if names == EULER else v) for v in values
                ]


def _find_pictures(log: Log, folder: Path) -> list[str]:
    """Name the pictures by where they are now, if they came with the logs."""
    frames = folder / f"{log.name} Camera Frames"
    there = {path.name for path in frames.iterdir()} if frames.is_dir() else set()
    remarks = []
    for column in PICTURES:
        cells = log.cells.get(column, [])
        names = [ntpath.basename(cell) for cell in cells]
        found = sum(name in there for name in names)
        if any(names):
            remarks.append(
                f"  {OURS[column]}: {found} of {sum(map(bool, names))} pictures are there"
            )
        for k, name in enumerate(names):
            if name in there:
                cells[k] = str((frames / name).resolve())
    return remarks


def _write_table(log: Log, out: Path, start_ms: int) -> None:
    """Write the rows of a log, and beside them the scans of its LIDAR."""
    t_s = (counted_on(log.stamps_ms) - start_ms) / 1000.0
    names = [_our_name(name) for name in log.cells]
    with (out / f"{log.name}.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow([TIME, *names])
        cells = zip(*log.cells.values(), strict=True)
        writer.writerows([f"{t:.3f}", *row] for t, row in zip(t_s, cells, strict=True))
    if log.scans is not None:
        np.savez_compressed(out / f"{log.name}_lidar.npz", t=t_s, ranges=log.scans)


def _our_name(name: str) -> str:
    """Return what we call a column; one that is not the recorder's must not be taken for ours."""
    is_strange = name not in OURS and name in {TIME, *OURS.values()}
    return f"{name} (theirs)" if is_strange else OURS.get(name, name)


def _write_left_out(path: Path, left_out: Sequence[LeftOut]) -> None:
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(LeftOut._fields)
        writer.writerows(left_out)


def _describe(
    logs: Sequence[Log], out: Path, vehicles: Mapping[str, str], steering_sign: int, axle_m: float
) -> None:
    """Write the description: of each car its table, and the lights as it met them."""
    tables = []
    for log in logs:
        if log.kind != "V":
            continue
        of_car = {"vehicle": vehicles[log.name]}
        tables.append(_table(log, _channels(log, steering_sign, axle_m)) | of_car)
        tables += [
            _table(light, {f"light.{light.name}": {"column": "state"}}) | of_car
            for light in logs
            if light.kind == "TL"
        ]
    described: dict[str, Any] = {
        "recording": 1,
        "frame": "world",
        "source": "AutoDRIVE's data recorder",
        "tables": tables,
    }
    text = yaml.safe_dump(described, sort_keys=False)
    (out / FILE_NAME).write_text(text, encoding="utf-8")


def _channels(log: Log, steering_sign: int, axle_m: float) -> dict[str, dict[str, Any]]:
    """Return where the channels of a car stand, of those columns that have a number in them."""
    channels = {}
    for name, (channel, unit) in CHANNELS.items():
        is_no_counter = name in TICKS and not log.is_counter(name)
        if is_no_counter or not np.isfinite(log.numbers(name)).any():
            continue
        column = OURS.get(name, name)
        value = f"atan2(sin({column}), cos({column}))"
        source = {"expression": value} if name in SMALL else {"column": column}
        more: dict[str, Any] = {}
        if name == "steering" and steering_sign < 0:
            more = {"sign": -1}
        elif name == "posZ" and axle_m:
            more = {"offset": -axle_m}
        channels[channel] = source | unit | more
    return channels


def _table(log: Log, channels: Mapping[str, Any]) -> dict[str, Any]:
    time = {"column": TIME, "unit": "s"}
    return {"file": f"{log.name}.csv", "time": time, "channels": dict(channels)}
