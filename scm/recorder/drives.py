"""Runs of the city as recordings of its cars: what each was told, where it was, what it sensed.

Only who is commanded over the bus can be driven again. A car that drives itself, hosted by the
world or by its agent, tells nobody which steering it asked for: its wheels' angle is what came of
it. What counts is a commanded stretch: from a command on until its guard would stop the car, but
for what follows each hit that the city tells of, a second at least and until the car is away.
"""

import math
import re
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scm.arrays import Bools, Floats
from scm.clock import NS_PER_S
from scm.errors import MessageError, RecordingError, nearest
from scm.recorder.mcap_file import read_keys, read_run
from scm.recording.read import Channel, Recording, read_recordings
from scm.v2x.message import Message, decode
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.vehicles.guard import HOLD_NS, STOP_NS, Guard

SUFFIX = ".mcap"
REPORTED_M, REPORTED_RAD, GYRO_RAD_S = 0.002, 0.005, 0.002
IN_FORCE_NS = NS_PER_S // 4
HIT, BEFORE_HIT_NS, AFTER_HIT_NS, AWAY_M = "contact", NS_PER_S // 10, NS_PER_S, 0.3
SIMULATED, EYE, REAL = "simulated", "eye", "real"
OBEYED = ("drive", "hold")
_OURS = re.compile(r"scm/@v\d+/")
_KEY = re.compile(r"scm/@v\d+/[^/]+/(?:v/([^/]+)/(cmd/drive|state|sensors)|eye/[^/]+/pose/([^/]+))")
_OF_ALL: dict[type[Message], re.Pattern[str]] = {
    WorldSnapshot: re.compile(r"scm/@v\d+/[^/]+/world/snapshot"),
    CityEvent: re.compile(r"scm/@v\d+/[^/]+/event/[^/]+/[^/]+"),
}
_KINDS: dict[str | None, type[Message]] = {
    "cmd/drive": DriveCommand, "state": VehicleState, "sensors": VehicleSensors, None: EyePose,
}  # fmt: skip


class Report(NamedTuple):
    """Where a car was by its own account, or by the world's, and whom it obeyed."""

    t_ns: int
    x_m: float
    y_m: float
    yaw_rad: float
    source: str
    mode: str
    epoch: int
    car: str


@dataclass(slots=True)
class Heard:
    """All that a run tells of one car; `hit_ns` is when it hit something hard enough to tell."""

    commands: list[DriveCommand] = field(default_factory=list)
    reports: list[Report] = field(default_factory=list)
    sensors: list[VehicleSensors] = field(default_factory=list)
    seen: dict[str, list[EyePose]] = field(default_factory=dict)
    hit_ns: list[int] = field(default_factory=list)


class Stretch(NamedTuple):
    """From the first command to where the guard stops the car for want of the next [ns]."""

    start_ns: int
    end_ns: int
    epoch: int


def recordings_of(
    path: Path | str, data: Path | str | None = None, vehicle: str | None = None
) -> list[Recording]:
    """Read what was recorded of cars: a run of the city (`.mcap`), or a described recording.

    Args:
        path: A run, a description, or the folder of one.
        data: Folder of a description's tables; None: its own.
        vehicle: The one of several cars; None: all of them.

    Raises:
        RecordingError: when there is nothing to read, or no such car.
    """
    if Path(path).suffix == SUFFIX:
        return read_drives(Path(path), vehicle)
    found = read_recordings(path, data)
    chosen = [recording for recording in found if vehicle in (None, recording.name)]
    if not chosen:
        names = [recording.name for recording in found]
        msg = f"{path}: no car {vehicle!r}{nearest(str(vehicle), names) or _listed(names)}"
        raise RecordingError(msg)
    return chosen


def recordings_of_one(
    path: Path | str, data: Path | str | None = None, vehicle: str | None = None
) -> list[Recording]:
    """Read what was recorded, as `recordings_of` does; a run must then be of one car.

    Raises:
        RecordingError: when several cars were commanded in a run and none is chosen.
    """
    found = recordings_of(path, data, vehicle)
    if Path(path).suffix == SUFFIX and len(found) > 1:
        names = ", ".join(recording.name for recording in found)
        msg = f"{path}: several cars were commanded: {names}; say which with --vehicle"
        raise RecordingError(msg)
    return found


def read_drives(path: Path, vehicle: str | None = None) -> list[Recording]:
    """Read the commanded cars of a run, times since its first message.

    Args:
        path: The `.mcap` that the recorder wrote.
        vehicle: One of its cars; None: all that were commanded.

    Returns:
        One recording a car, by name. Poses are those of the car's own reports where it is
        simulated, else those of the overhead camera that saw it most.

    Raises:
        RecordingError: when the file is no complete run, or holds no car that can be driven again.
    """
    keys = read_keys(path)
    if keys and not any(_OURS.match(key) for key in keys):
        msg = f"{path}: no run of a city: it holds {', '.join(keys[:5])}; a ROS 2 bag is read as a "
        msg += "table of a recording.yaml"
        raise RecordingError(msg)
    commanded = sorted({name for name, kind in map(_of, keys) if kind is DriveCommand})
    known = sorted({name for name, kind in map(_of, keys) if kind in (VehicleState, EyePose)})
    if vehicle is not None and vehicle not in {*commanded, *known}:
        names = sorted({*commanded, *known})
        msg = f"{path}: no car {vehicle!r}{nearest(vehicle, names) or _listed(names)}"
        raise RecordingError(msg)
    chosen = [name for name in commanded if vehicle in (None, name)]
    if not chosen:
        who = (
            f"{vehicle} was" if vehicle else f"none of its cars ({', '.join(known) or 'none'}) was"
        )
        msg = (
            f"{path}: {who} commanded over the bus: a car that drives itself tells nobody its "
            "steering command, so it cannot be driven again; drive it by `scm play` or a script"
        )
        raise RecordingError(msg)
    heard, start_ns = _heard(path, keys, chosen)
    drives = [_Drive(path, name, heard[name], start_ns) for name in chosen]
    return [drive.recording() for drive in drives]


def _of(key: str) -> tuple[str, type[Message] | None]:
    """Return which car a key is of, if of one, and what travels on it; None for all other keys."""
    match = _KEY.fullmatch(key)
    if match is not None:
        return match[1] or match[3], _KINDS[match[2]]
    return "", next((kind for kind, keys in _OF_ALL.items() if keys.fullmatch(key)), None)


def _listed(names: Sequence[str]) -> str:
    return f"; it has {', '.join(names)}" if names else "; it has none"


def _heard(path: Path, keys: Iterable[str], chosen: Sequence[str]) -> tuple[dict[str, Heard], int]:
    """Return what a run tells of some cars, and when it began [ns].

    Snapshots of the world stand in for the reports of a car that a sparse run has not.
    """
    of = {key: _of(key) for key in keys}
    reporting = {name for name, kind in of.values() if kind is VehicleState}
    silent = {name for name in chosen if name not in reporting}
    of_all = {CityEvent, WorldSnapshot} if silent else {CityEvent}
    wanted = {key for key, (name, kind) in of.items() if name in chosen or kind in of_all}
    heard = {name: Heard() for name in chosen}
    start_ns = None
    for message in read_run(path, wanted):
        name, kind = of[message.key]
        start_ns = message.t_ns if start_ns is None else start_ns
        if kind is None:
            continue
        try:
            told = decode(kind, message.body)
        except MessageError:
            continue  # a stranger's, as everybody on the bus ignores it
        match told:
            case WorldSnapshot():
                for one, report in _reports(told):
                    if one in silent:
                        heard[one].reports.append(report)
            case CityEvent(name=event, vehicle=str() as one) if event == HIT and one in heard:
                heard[one].hit_ns.append(told.t_ns)
            case _ if name in heard:
                _take(heard[name], told)
    return heard, start_ns or 0


def _reports(snapshot: WorldSnapshot) -> Iterator[tuple[str, Report]]:
    """Yield where the cars of a snapshot were; a real one's place is the Eye's to say."""
    for car in snapshot.vehicles:
        t_ns = snapshot.t_ns - round(car.age_ms * 1e6)
        source = EYE if car.kind == REAL else SIMULATED
        at = (car.x_m, car.y_m, car.yaw_rad)
        yield car.vehicle, Report(t_ns, *at, source, car.mode, car.epoch, car.car)


def _take(heard: Heard, told: Message) -> None:
    match told:
        case DriveCommand():
            heard.commands.append(told)
        case VehicleSensors():
            heard.sensors.append(told)
        case EyePose():
            heard.seen.setdefault(told.camera, []).append(told)
        case VehicleState(t_ns=t_ns, x_m=x, y_m=y, yaw_rad=yaw, source=source):
            report = Report(t_ns, x, y, yaw, source, told.mode, told.epoch, told.car)
            heard.reports.append(report)


class _Drive:
    """One car's part of a run on its way to being a recording."""

    def __init__(self, path: Path, name: str, heard: Heard, start_ns: int) -> None:
        self._at, self._path, self._name = f"{path}: {name}", path, name
        self._heard, self._start_ns = heard, start_ns
        heard.reports.sort()
        self._report_ns = [report.t_ns for report in heard.reports]
        self._rows, self._stretches = _obeyed(heard.commands)
        hits = heard.hit_ns if heard.reports else []
        self._leans = [_lean(hit_ns, heard.reports, self._report_ns) for hit_ns in hits]

    def recording(self) -> Recording:
        """Return what stands of this car in the run.

        Raises:
            RecordingError: when it lacks poses, or the car obeyed no command.
        """
        if not self._heard.reports:
            msg = f"{self._at}: neither it nor the world reports which car it is"
            raise RecordingError(msg)
        channels = self._poses()
        t = np.array([row[0] for row in self._rows], np.int64)
        for i, name in enumerate(("command.throttle", "command.steering"), 1):
            values = np.array([row[i] for row in self._rows], np.float64)
            channels[name] = self._channel(t, values, None, "ratio")
        channels |= self._sensors()
        return Recording(self._path, self._heard.reports[-1].car, channels, self._name)

    def _poses(self) -> dict[str, Channel]:
        """Return the poses while the car was commanded."""
        rows: list[tuple[float, ...]] = [
            report[:4] for report in self._heard.reports if report.source == SIMULATED
        ]
        std = REPORTED_M, REPORTED_M, REPORTED_RAD
        if not rows:
            seen = max(self._heard.seen.values(), key=len, default=[])
            rows = sorted((pose.t_ns, pose.x_m, pose.y_m, pose.yaw_rad) for pose in seen)
            variances = [pose.covariance[::4] for pose in seen] or [(np.nan,) * 3]
            std = tuple(np.sqrt(np.maximum(np.median(variances, axis=0), 1e-12)))
        rows = [row for row in rows if self._is_commanded(int(row[0]))]
        if not rows:
            msg = f"{self._at}: no pose while it obeyed commands: nothing can be driven again"
            raise RecordingError(msg)
        t, columns = np.array([row[0] for row in rows], np.int64), np.array(rows, np.float64).T[1:]
        kinds = zip(("pose.x", "pose.y", "pose.yaw"), ("length", "length", "angle"), strict=True)
        return {
            name: self._channel(t, column, float(noise), kind)
            for (name, kind), column, noise in zip(kinds, columns, std, strict=True)
        }

    def _sensors(self) -> dict[str, Channel]:
        """Return encoders and yaw gyro, where the car has them."""
        read = [one for one in self._heard.sensors if self._is_commanded(one.t_ns)]
        if not read:
            return {}
        t = np.array([one.t_ns for one in read], np.int64)
        of: dict[str, tuple[Callable[[VehicleSensors], float], float | None, str]] = {
            "encoder.left": (lambda one: one.encoder_left, None, "count"),
            "encoder.right": (lambda one: one.encoder_right, None, "count"),
            "imu.gyro_z": (lambda one: one.gyro_radps[2], GYRO_RAD_S, "angular speed"),
        }
        return {
            name: self._channel(t, np.array([value(one) for one in read], np.float64), std, kind)
            for name, (value, std, kind) in of.items()
        }

    def _channel(self, t_ns: np.ndarray, values: Floats, std: float | None, kind: str) -> Channel:
        fit: Bools = np.isfinite(values)
        t: Floats = (t_ns - self._start_ns) / NS_PER_S
        return Channel(t[fit], values[fit], std, (0.0, 0.0), kind)

    def _is_commanded(self, t_ns: int) -> bool:
        """Say whether the car obeyed the commands of the run at a time, as far as it tells."""
        i = bisect_right(self._stretches, t_ns, key=lambda stretch: stretch.start_ns) - 1
        if i < 0 or t_ns > self._stretches[i].end_ns:
            return False
        if any(start_ns <= t_ns <= end_ns for start_ns, end_ns in self._leans):
            return False
        k = bisect_right(self._report_ns, t_ns) - 1
        if k < 0 or t_ns - self._report_ns[k] > IN_FORCE_NS:
            return False
        report = self._heard.reports[k]
        return report.mode in OBEYED and report.epoch == self._stretches[i].epoch


def _lean(hit_ns: int, reports: Sequence[Report], report_ns: Sequence[int]) -> tuple[int, int]:
    """Return from when to when what a car hit may move it: until it is away from there [ns]."""
    k = min(bisect_right(report_ns, hit_ns), len(reports) - 1)
    at = reports[k]
    away = (r for r in reports[k:] if math.hypot(r.x_m - at.x_m, r.y_m - at.y_m) > AWAY_M)
    left = next(away, reports[-1])
    return hit_ns - BEFORE_HIT_NS, max(hit_ns + AFTER_HIT_NS, left.t_ns)


def _obeyed(
    commands: Iterable[DriveCommand],
) -> tuple[list[tuple[int, float, float]], list[Stretch]]:
    """Return what the guard let through: time [ns], throttle, steering; and the stretches.

    Where the next command is late the throttle is let go, as the guard does.
    """
    guard = Guard()
    rows: list[tuple[int, float, float]] = []
    stretches: list[Stretch] = []

    def let_go(until_ns: int | None) -> None:
        if not stretches:
            return
        last = stretches[-1].end_ns - STOP_NS
        for late in (HOLD_NS, STOP_NS):
            if until_ns is None or until_ns > last + late:
                rows.append((last + late, 0.0, rows[-1][2]))

    for command in commands:
        t_ns = command.t_ns
        if not guard.take(command, t_ns):
            continue
        let_go(t_ns)
        allowed = guard.output(t_ns)
        rows.append((t_ns, allowed.throttle, allowed.steering))
        goes_on = stretches and t_ns <= stretches[-1].end_ns
        if goes_on and stretches[-1].epoch == command.epoch:
            stretches[-1] = stretches[-1]._replace(end_ns=t_ns + STOP_NS)
        else:
            stretches.append(Stretch(t_ns, t_ns + STOP_NS, command.epoch))
    let_go(None)
    return rows, stretches
