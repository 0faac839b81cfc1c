"""Plays a written drive with a car of a city, open loop, and records it for the mismatch search.

The recording is the same as from a run's `.mcap`: the commands that the car reports as obeyed, and
its poses except around collisions.

A drive is a `.yaml` file with a car, a map, a place to start and a table of commands. `scm
mismatch` writes one to find out which of several candidate effects is the cause.
"""

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import dropwhile, pairwise
from pathlib import Path
from typing import Any

import msgspec
import yaml

from scm.clock import NS_PER_S
from scm.errors import RecordingError, RunError, ScmError, reading
from scm.geometry import Pose2
from scm.recorder.driven import RUN_IN_NS, CarMessages, recording_of
from scm.recorder.play_monitor import PlayMonitor
from scm.recording.read import Recording
from scm.recording.table import read_table
from scm.runtime.city_link import Link
from scm.runtime.part import Subscription
from scm.v2x.message import Message, Refused, Request
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState

OWNER = "script"
LEASE_MS = 5000  # survives a short break of the link
RENEW_S = 1.0
REPEAT_S = 0.05  # between two commands
MAX_STOPPING_NS = 5 * NS_PER_S
Row = tuple[float, float, float]
_FILES = {
    "commands.csv": {"throttle": "command.throttle", "steering": "command.steering"},
    "pose.csv": {"x_m": "pose.x", "y_m": "pose.y", "yaw_rad": "pose.yaw"},
    "sensors.csv": {
        "left": "encoder.left", "right": "encoder.right", "gyro_rad_s": "imu.gyro_z",
    },
}  # fmt: skip
_UNITS = {
    "throttle": "1", "steering": "1", "x_m": "m", "y_m": "m", "yaw_rad": "rad",
    "left": "count", "right": "count", "gyro_rad_s": "rad/s",
}  # fmt: skip


class Drive(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The file of a drive; paths are relative to it.

    Attributes:
        drive: Version of the format, 1.
        say: Description for a person.
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


@dataclass(frozen=True, slots=True)
class Played:
    """The result of a played drive.

    Attributes:
        vehicle: The car.
        messages: The commands sent and the city's messages about the car.
        lost: Number of the car's messages that did not arrive or were dropped for newer ones.
        ended: Why it ended early; empty: it did not.
    """

    vehicle: str
    messages: CarMessages
    lost: int
    ended: str = ""


class _Listener:
    """Empties the mailboxes of one car during a drive, so that no queue fills up."""

    def __init__(self, link: Link, vehicle: str) -> None:
        self._link, self._vehicle, self._messages = link, vehicle, CarMessages()
        of_car = {"vehicle": vehicle}
        self._reports = link.subscribe(Subscription(VehicleState, of_car))
        self._others = [
            link.subscribe(Subscription(kind, of_car)) for kind in (VehicleSensors, EyePose)
        ]
        self._others.append(link.subscribe(Subscription(CityEvent)))

    def sent(self, command: DriveCommand) -> None:
        self._messages.add(command)

    def listen_until(self, due_ns: int) -> None:
        def is_due() -> bool:
            for box in (self._reports, *self._others):
                for item in box.drain():
                    if getattr(item.message, "vehicle", None) == self._vehicle:
                        self._messages.add(item.message)
            return self._link.now_ns >= due_ns

        self._link.run_until(is_due, 60.0)

    @property
    def messages(self) -> CarMessages:
        return self._messages

    def played(self, ended: str) -> Played:
        lost = self._messages.lost + sum(box.dropped for box in self._others)
        return Played(self._vehicle, self._messages, lost, ended)


def read_drive(path: Path) -> tuple[Drive, list[Row]]:
    """Return a drive and its rows of time, throttle and steering, in order of time.

    Raises:
        ScmError: naming the file and what is wrong with it.
    """
    with reading(path, "a drive", RecordingError, "expected one as `scm mismatch` writes it"):
        drive = msgspec.convert(yaml.safe_load(path.read_text(encoding="utf-8")), Drive)
    table = read_table(path.parent / drive.commands)
    columns = [table[name] for name in ("t_s", "throttle", "steering")]
    rows = [(float(t), float(u), float(s)) for t, u, s in zip(*columns, strict=True)]
    times = [t for t, _, _ in rows]
    if not rows or times != sorted(times) or not all(map(math.isfinite, sum(rows, ()))):
        msg = f"{path.parent / drive.commands}: expected rows of numbers, t_s going up"
        raise ScmError(msg)
    return drive, rows


def play(link: Link, vehicle: str, rows: list[Row], monitor: PlayMonitor | None = None) -> Played:
    """Command a car row by row and return its reports; release the lease at the end.

    Its reports are recorded from a second before, to know the servo's angle at the start.

    Args:
        link: To the city.
        vehicle: The car.
        rows: Time, throttle and steering.
        monitor: Stops the car first and may end the drive early; None: no monitor.

    Raises:
        RunError: when the car cannot be leased, or the monitor refuses the drive.
    """
    listener = _Listener(link, vehicle)
    listener.listen_until(link.now_ns + RUN_IN_NS)
    leased = _LeasedCar(link, vehicle, listener)
    try:
        if monitor is not None:
            leased.rest(monitor)
        ended = leased.drive(rows, monitor)
    finally:
        leased.release()
    listener.listen_until(link.now_ns)
    return listener.played(ended)


class _LeasedCar:
    """Holds a car's lease and commands it."""

    def __init__(self, link: Link, vehicle: str, listener: _Listener) -> None:
        self._link, self._vehicle, self._listener = link, vehicle, listener
        self._epoch = _lease(link, vehicle, "acquire", 0)
        self._renewed_ns, self._seq = link.now_ns, 0

    def command(self, throttle: float, steering: float) -> None:
        if self._link.now_ns - self._renewed_ns > RENEW_S * 1e9:
            _lease(self._link, self._vehicle, "renew", self._epoch)
            self._renewed_ns = self._link.now_ns
        self._seq += 1
        command = DriveCommand(vehicle=self._vehicle, t_ns=self._link.now_ns, epoch=self._epoch,
                               seq=self._seq, throttle=throttle, steering=steering)  # fmt: skip
        self._link.publish(command)
        self._listener.sent(command)

    def rest(self, monitor: PlayMonitor) -> None:
        """Stop the car and wait until it is at rest."""
        until_ns = self._link.now_ns + MAX_STOPPING_NS
        while (
            not monitor.is_at_rest(self._listener.messages.reports) and self._link.now_ns < until_ns
        ):
            self.command(0.0, 0.0)
            self._listener.listen_until(self._link.now_ns + round(REPEAT_S * 1e9))
        why = monitor.refuses(self._listener.messages.reports)
        if why:
            msg = f"{self._vehicle}: {why}"
            raise RunError(msg)

    def drive(self, rows: list[Row], monitor: PlayMonitor | None) -> str:
        """Command row by row; return why it ended early."""
        began_ns = self._link.now_ns
        for t, throttle, steering in _repeated(rows):
            self._listener.listen_until(began_ns + round(t * 1e9))
            ended = monitor.ends(self._listener.messages, began_ns) if monitor is not None else ""
            if ended:
                self.command(0.0, 0.0)
                return ended
            self.command(throttle, steering)
        return ""

    def release(self) -> None:
        _lease(self._link, self._vehicle, "release", self._epoch)


def read_way(drive: Path) -> list[Pose2]:
    """Return the predicted path of a drive from the table beside it; empty: there is none.

    Raises:
        ScmError: when the table cannot be read.
    """
    path = drive.with_name(f"{drive.stem}_way.csv")
    if not path.is_file():
        return []
    table = read_table(path)
    columns = [table[name].tolist() for name in ("x_m", "y_m", "yaw_rad")]
    return [Pose2(*row) for row in zip(*columns, strict=True)]


def _repeated(rows: list[Row]) -> Iterator[Row]:
    """Yield each row repeatedly until the next, since commands expire; the last row once."""
    for (t, throttle, steering), (end, _, _) in pairwise(rows):
        times = max(1, math.ceil((end - t) / REPEAT_S - 1e-6))
        for k in range(times):
            yield t + k * (end - t) / times, throttle, steering
    yield rows[-1]


def write_recording(played: Played, car: str, folder: Path) -> Recording:
    """Write a played drive as a recording that `scm mismatch` reads, and return it.

    Raises:
        RecordingError: when nothing of it can be simulated again.
    """
    recording = recording_of(played.messages, folder, played.vehicle, sent_only=True)
    folder.mkdir(parents=True, exist_ok=True)
    there = recording.channels.keys()
    written = {file: of for file, of in _FILES.items() if there >= set(of.values())}
    for file, of in written.items():
        channels = [recording.channel(name) for name in of.values()]
        columns = [channels[0].t.tolist(), *(channel.values.tolist() for channel in channels)]
        with (folder / file).open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow(("t_s", *of))
            writer.writerows(zip(*columns, strict=True))
    of_car = {"vehicle": car, "frame": "world"}
    tables = [_described(file, of, recording) for file, of in written.items()]
    text = yaml.safe_dump({"recording": 1, **of_car, "tables": tables}, sort_keys=False)
    (folder / "recording.yaml").write_text(text, encoding="utf-8")
    return recording


def _described(file: str, of: dict[str, str], recording: Recording) -> dict[str, Any]:
    """Return the description of one table."""
    channels: dict[str, dict[str, Any]] = {}
    for column, name in of.items():
        std = recording.channel(name).std
        channels[name] = {"column": column, "unit": _UNITS[column]}
        channels[name] |= {} if std is None else {"std": std}
    return {"file": file, "time": {"column": "t_s", "unit": "s"}, "channels": channels}


def left_out(played: Played, recording: Recording) -> list[str]:
    """Return sentences on what the recording lacks or has changed of a played drive."""
    messages, sentences = played.messages, [played.ended] if played.ended else []
    first_ns, last_ns = messages.commands[0].t_ns, messages.commands[-1].t_ns
    reports = [report for report in messages.reports if first_ns <= report.t_ns <= last_ns]
    hits = sum(first_ns <= t_ns <= last_ns for t_ns in messages.hit_ns)
    missing = len(reports) - len(recording.channel("pose.x").t)
    if hits and missing > 0:
        sentences.append(f"{missing} poses are left out: the car hit something {hits} times")
    begun = dropwhile(lambda report: report.mode != "drive", reports)
    late = [report for report in begun if report.mode != "drive"]
    if late:
        sentences.append(
            f"{len(late)} of {len(reports)} reports say that it did not obey, for commands came "
            "late or the city was stopped; recorded is what it did obey"
        )
    if played.lost:
        sentences.append(
            f"{played.lost} messages of the car were lost on the way: it is not all here"
        )
    return sentences


def _lease(link: Link, vehicle: str, verb: str, epoch: int) -> int:
    request: Request = msgspec.convert(
        {"vehicle": vehicle, "owner": OWNER, "verb": verb, "epoch": epoch, "ttl_ms": LEASE_MS},
        LeaseRequest,
    )
    reply: Message = link.request(request)
    if isinstance(reply, LeaseReply):
        return reply.epoch
    why = reply.detail if isinstance(reply, Refused) else type(reply).__name__
    msg = f"{vehicle}: its lease was not granted: {why}"
    raise RunError(msg)
