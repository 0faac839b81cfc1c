"""Reads LIDAR scans of a ROS bag (`sensor_msgs/LaserScan`) as arrays."""

import importlib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from scm.arrays import Bools, Floats
from scm.errors import RecordingError
from scm.recording.shortcuts import RANGES

SCALARS = (
    "angle_min", "angle_increment", "time_increment", "range_min", "range_max",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Scans:
    """The scans of one LIDAR. Beam `i` of a scan looks at `angle_min + i * angle_increment`.

    Its ray left `i * time_increment` after the scan's stamp. Angles are about the LIDAR's own axes,
    + = counter-clockwise; where it stands on the car is not in a scan.

    Attributes:
        t: Stamp of the first ray, on the recording's clock, shape `(scans,)` [s].
        ranges: As recorded, shape `(scans, beams)` [m]; what lies outside `range_min` and
            `range_max` is no measurement. A scan of fewer beams is filled up with NaN.
        angle_min, angle_increment: Shape `(scans,)` [rad].
        time_increment: Shape `(scans,)` [s].
        range_min, range_max: Shape `(scans,)` [m].
    """

    t: Floats
    ranges: Floats
    angle_min: Floats
    angle_increment: Floats
    time_increment: Floats
    range_min: Floats
    range_max: Floats

    def between(self, first: float, last: float) -> "Scans":
        """Return the scans whose stamps lie between two moments."""
        rows = (self.t >= first) & (self.t <= last)
        return Scans(**{one.name: getattr(self, one.name)[rows] for one in fields(self)})


def read_scans(path: Path, topic: str | None, t: Floats, keep: Bools) -> Scans:
    """Return the scans of a topic.

    Args:
        path: A ROS bag.
        topic: Of `sensor_msgs/LaserScan`.
        t: Time of each message of the topic [s].
        keep: Which of the messages count.

    Raises:
        RecordingError: when the file is no bag, or the topic holds other messages.
    """
    if topic is None:
        msg = f"{path}: scans are read from a ROS bag: expected the topic of one"
        raise RecordingError(msg)
    ranges: list[Floats] = []
    scalars: list[tuple[float, ...]] = []
    bag = importlib.import_module("scm.recording.bag")  # its library is there, or `t` were not
    for kind, _, message in bag.messages(path, topic):
        if not hasattr(message, RANGES):
            msg = f"{path}: topic {topic!r} holds {kind}, expected sensor_msgs/msg/LaserScan"
            raise RecordingError(msg)
        ranges.append(np.asarray(message.ranges, np.float64))
        scalars.append(tuple(float(getattr(message, name)) for name in SCALARS))
    fields = np.array(scalars).T[:, keep]
    return Scans(t=t[keep], ranges=_padded(ranges)[keep], **dict(zip(SCALARS, fields, strict=True)))


def _padded(rows: Sequence[Floats]) -> Floats:
    """Return rows of different lengths as one array, filled up with NaN."""
    out = np.full((len(rows), max(map(len, rows))), np.nan)
    for row, values in zip(out, rows, strict=True):
        row[: len(values)] = values
    return out
