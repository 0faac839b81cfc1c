"""What a run tells of one car, as a recording: what it was told, where it was, what it sensed.

Commands are those that the car itself reports: they passed its guard, and are dated by the motion
that they led to. Where reports do not tell the steering, as those of other programs and of older
runs, they are what was sent over the bus, as far as the guard lets it through.

Of a car that was commanded over the bus only commanded stretches count: from a command on until its
guard would stop the car. What follows each hit that the city tells of does not count for any car: a
second at least, and until the car is away.
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scm.arrays import Bools, Floats
from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import RecordingError
from scm.recording.read import Channel, Recording
from scm.v2x.message import Message
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.guard import HOLD_NS, STOP_NS, Guard

REPORTED_M, REPORTED_RAD, GYRO_RAD_S = 0.002, 0.005, 0.002
IN_FORCE_NS = NS_PER_S // 4
TICK_NS, RUN_IN_NS = 20 * NS_PER_MS, NS_PER_S
HIT, BEFORE_HIT_NS, AFTER_HIT_NS, AWAY_M = "contact", NS_PER_S // 10, NS_PER_S, 0.3
SIMULATED = "simulated"
OBEYED, MOVED = ("drive", "hold"), ("drive", "hold", "idle")
Row = tuple[int, float, float]
Span = tuple[int, int]


class Report(NamedTuple):
    """Where a car was by its own account, or by the world's, whom it obeyed, and what it was told.

    `throttle` and `steering` were in force until `t_ns`; steering None: not told.
    """

    t_ns: int
    x_m: float
    y_m: float
    yaw_rad: float
    source: str
    mode: str
    epoch: int
    car: str
    seq: int = 0
    throttle: float = 0.0
    steering: float | None = None


@dataclass(slots=True)
class Heard:
    """All that a run tells of one car; `hit_ns` is when it hit something hard enough to tell."""

    commands: list[DriveCommand] = field(default_factory=list)
    reports: list[Report] = field(default_factory=list)
    sensors: list[VehicleSensors] = field(default_factory=list)
    seen: dict[str, list[EyePose]] = field(default_factory=dict)
    hit_ns: list[int] = field(default_factory=list)

    def take(self, told: Message) -> None:
        """Note a message that is about this car."""
        match told:
            case DriveCommand():
                self.commands.append(told)
            case VehicleSensors():
                self.sensors.append(told)
            case EyePose():
                self.seen.setdefault(told.camera, []).append(told)
            case CityEvent(name=event, t_ns=t_ns) if event == HIT:
                self.hit_ns.append(t_ns)
            case VehicleState():
                at = (told.t_ns, told.x_m, told.y_m, told.yaw_rad, told.source)
                whom = (told.mode, told.epoch, told.car, told.seq)
                self.reports.append(Report(*at, *whom, told.throttle, told.steering))

    @property
    def lost(self) -> int:
        """How many of the car's reports are missing between the first and the last."""
        steps = (now.seq - before.seq for before, now in pairwise(self.reports))
        return sum(step - 1 for step in steps if step > 1)


class Stretch(NamedTuple):
    """From the first command to where the guard stops the car for want of the next [ns].

    `epoch` None: the car drove itself.
    """

    start_ns: int
    end_ns: int
    epoch: int | None


def tells_commands(heard: Heard) -> bool:
    """Return whether a car's reports say how it was steered."""
    return any(report.steering is not None for report in heard.reports)


def recording_of(heard: Heard, path: Path, name: str, start_ns: int = 0) -> Recording:
    """Return what was heard of a car as a recording, times since `start_ns`.

    Poses are those of the car's own reports where it is simulated, else those of the overhead
    camera that saw it most.

    Raises:
        RecordingError: naming `path` and the car, when it lacks poses, or obeyed no command.
    """
    return _Drive(path, name, heard, start_ns).recording()


class _Drive:
    """One car's part of a run on its way to being a recording."""

    def __init__(self, path: Path, name: str, heard: Heard, start_ns: int) -> None:
        self._at, self._path, self._name = f"{path}: {name}", path, name
        self._heard, self._start_ns = heard, start_ns
        heard.reports.sort(key=lambda report: report.t_ns)
        self._report_ns = [report.t_ns for report in heard.reports]
        self._rows, self._stretches = _obeyed(heard.commands)
        if tells_commands(heard):
            self._rows, self._stretches = _told(heard.reports, self._stretches)
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
        if not self._rows:
            msg = f"{self._at}: no command that it obeyed is known: nothing can be driven again"
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
        epoch = self._stretches[i].epoch
        return (
            report.mode in MOVED
            if epoch is None
            else (report.mode in OBEYED and report.epoch == epoch)
        )


def _lean(hit_ns: int, reports: Sequence[Report], report_ns: Sequence[int]) -> Span:
    """Return from when to when what a car hit may move it: until it is away from there [ns]."""
    k = min(bisect_right(report_ns, hit_ns), len(reports) - 1)
    at = reports[k]
    away = (r for r in reports[k:] if math.hypot(r.x_m - at.x_m, r.y_m - at.y_m) > AWAY_M)
    left = next(away, reports[-1])
    return hit_ns - BEFORE_HIT_NS, max(hit_ns + AFTER_HIT_NS, left.t_ns)


def _told(reports: Sequence[Report], commanded: list[Stretch]) -> tuple[list[Row], list[Stretch]]:
    """Return what a car reports that it was told, and when; as commanded, or all it drove itself.

    Commands begin with the report before. A car that reports more seldom than it decides keeps
    what was in force between to itself: then the new ones begin, on average, half way through it.
    Rows begin a little before poses count, so that the servo stands right by then.
    """
    stretches = commanded or _lives(reports)
    first_ns, last_ns = stretches[0].start_ns - RUN_IN_NS, stretches[-1].end_ns
    spans = [now.t_ns - before.t_ns for before, now in pairwise(reports)] or [TICK_NS]
    unknown_ns = max(0, int(np.median(spans)) - TICK_NS) // 2
    rows = []
    for before, now in pairwise(reports):
        if now.steering is not None and first_ns < now.t_ns <= last_ns:
            follows = now.seq == before.seq + 1
            since_ns = before.t_ns + unknown_ns if follows else now.t_ns - TICK_NS
            rows.append((since_ns, now.throttle, now.steering))
    return rows, stretches


def _lives(reports: Sequence[Report]) -> list[Stretch]:
    """Return from when to when a car was there without having been placed anew."""
    anew = [i for i in range(1, len(reports)) if reports[i].seq <= reports[i - 1].seq]
    parts = pairwise([0, *anew, len(reports)])
    return [Stretch(reports[i].t_ns + RUN_IN_NS, reports[j - 1].t_ns, None) for i, j in parts]


def _obeyed(commands: Iterable[DriveCommand]) -> tuple[list[Row], list[Stretch]]:
    """Return what the guard let through: time [ns], throttle, steering; and the stretches.

    Where the next command is late the throttle is let go, as the guard does.
    """
    guard = Guard()
    rows: list[Row] = []
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
