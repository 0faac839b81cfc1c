"""Reads runs of the city as recordings of its cars.

A car can be simulated again where its reports have the commands that it obeyed, or where it was
commanded over the bus.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from scm.errors import MessageError, RecordingError, nearest
from scm.recorder.driven import SIMULATED, CarMessages, Report, recording_of, reports_commands
from scm.recorder.mcap_file import has_end, read_begin_ns, read_keys, read_run
from scm.recording.columns import LeftOut
from scm.recording.read import Recording, read_recordings
from scm.v2x.message import Message, decode
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_snapshot import WorldSnapshot

SUFFIX = ".mcap"
EYE, REAL = "eye", "real"
_OURS = re.compile(r"scm/@v\d+/")
_KEY = re.compile(r"scm/@v\d+/[^/]+/(?:v/([^/]+)/(cmd/drive|state|sensors)|eye/[^/]+/pose/([^/]+))")
_OF_ALL: dict[type[Message], re.Pattern[str]] = {
    WorldSnapshot: re.compile(r"scm/@v\d+/[^/]+/world/snapshot"),
    CityEvent: re.compile(r"scm/@v\d+/[^/]+/event/[^/]+/[^/]+"),
}
_OF_A_CAR = (DriveCommand, VehicleState, EyePose)
Warn = Callable[[str], None]
_KINDS: dict[str | None, type[Message]] = {
    "cmd/drive": DriveCommand, "state": VehicleState, "sensors": VehicleSensors, None: EyePose,
}  # fmt: skip


def recordings_of(
    path: Path | str,
    data: Path | str | None = None,
    vehicle: str | None = None,
    warn: Warn = lambda _: None,
) -> list[Recording]:
    """Read the recordings of cars from a run of the city (`.mcap`) or a described recording.

    Args:
        path: A run, a description, or the folder of one.
        data: Folder of a description's tables; None: its own.
        vehicle: One of its cars; None: all.
        warn: Receives the reason when a car of a run is left out.

    Raises:
        RecordingError: when there is nothing to read or no such car.
    """
    if Path(path).suffix == SUFFIX:
        return read_drives(Path(path), vehicle, warn)
    found = read_recordings(path, data)
    chosen = [recording for recording in found if vehicle in (None, recording.name)]
    if not chosen:
        names = [recording.name for recording in found]
        msg = f"{path}: no car {vehicle!r}{nearest(str(vehicle), names) or _names_hint(names)}"
        raise RecordingError(msg)
    return chosen


def recordings_of_one(
    path: Path | str, data: Path | str | None = None, vehicle: str | None = None
) -> list[Recording]:
    """Read as `recordings_of` does, but only one car of a run.

    Raises:
        RecordingError: when several cars of a run can be driven again and none is chosen.
    """
    found = recordings_of(path, data, vehicle)
    if Path(path).suffix == SUFFIX and len(found) > 1:
        names = ", ".join(recording.name for recording in found)
        msg = f"{path}: several cars can be driven again: {names}; say which with --vehicle"
        raise RecordingError(msg)
    return found


def read_drives(
    path: Path, vehicle: str | None = None, warn: Warn = lambda _: None
) -> list[Recording]:
    """Read the cars of a run that can be driven again, times since its first message.

    Args:
        path: The `.mcap` that the recorder wrote.
        vehicle: One of its cars; None: all.
        warn: Receives the reason when a car is left out.

    Returns:
        One recording per car, by name.

    Raises:
        RecordingError: when the file is not a complete run, or no car can be simulated again.
    """
    keys = read_keys(path, whole=False)
    if keys and not any(_OURS.match(key) for key in keys):
        msg = f"{path}: no run of a city: it holds {', '.join(keys[:5])}; a ROS 2 bag is read as a "
        msg += "table of a recording.yaml"
        raise RecordingError(msg)
    cars = sorted({name for name, kind in map(_of, keys) if name and kind in _OF_A_CAR})
    if vehicle is not None and vehicle not in cars:
        msg = f"{path}: no car {vehicle!r}{nearest(vehicle, cars) or _names_hint(cars)}"
        raise RecordingError(msg)
    messages, start_ns = _read_messages(path, keys, [vehicle] if vehicle is not None else cars)
    able = {name: one for name, one in messages.items() if one.commands or reports_commands(one)}
    if not able:
        none = f"none of its cars ({', '.join(cars) or 'none'}) was"
        who = f"{vehicle} was not" if vehicle else none
        msg = (
            f"{path}: {who} commanded over the bus, and no report tells the steering command: "
            "nothing can be driven again; record anew, or drive a car by `scm play` or a script"
        )
        raise RecordingError(msg)
    found, failures, unfinished = [], list[str](), _unfinished(path)
    for name, one in able.items():
        try:
            recording = recording_of(one, path, name, start_ns)
            left_out = (*recording.left_out, *unfinished)
            found.append(replace(recording, begin_s=0.0, left_out=left_out))
        except RecordingError as error:
            failures.append(str(error))
    if not found:
        raise RecordingError("\n".join(failures))
    if unable := [name for name in messages if name not in able]:
        failures.append(
            f"{path}: {', '.join(unable)}: not commanded over the bus, and no report tells the "
            "steering command: left out"
        )
    for failure in failures:
        warn(failure)
    return found


def _unfinished(path: Path) -> list[LeftOut]:
    """Return the warning for a run whose file has no end."""
    if has_end(path):
        return []
    why = "has no end: it is still being written, or its recorder was killed; read as far as it is "
    return [LeftOut(path.name, None, f"{why}whole")]


def _of(key: str) -> tuple[str, type[Message] | None]:
    """Return a key's car, if it has one, and message class; None for all other keys."""
    match = _KEY.fullmatch(key)
    if match is not None:
        return match[1] or match[3], _KINDS[match[2]]
    return "", next((kind for kind, keys in _OF_ALL.items() if keys.fullmatch(key)), None)


def _names_hint(names: Sequence[str]) -> str:
    return f"; it has {', '.join(names)}" if names else "; it has none"


def _read_messages(
    path: Path, keys: Iterable[str], chosen: Sequence[str]
) -> tuple[dict[str, CarMessages], int]:
    """Return the messages of a run about some cars, and when it began [ns].

    Snapshots of the world replace the reports that a sparse run lacks.
    """
    of = {key: _of(key) for key in keys}
    reporting = {name for name, kind in of.values() if kind is VehicleState}
    silent = {name for name in chosen if name not in reporting}
    of_all = {CityEvent, WorldSnapshot} if silent else {CityEvent}
    wanted = {key for key, (name, kind) in of.items() if name in chosen or kind in of_all}
    messages = {name: CarMessages() for name in chosen}
    for message in read_run(path, wanted, whole=False):
        name, kind = of[message.key]
        if kind is None:
            continue
        try:
            decoded = decode(kind, message.body)
        except MessageError:
            continue  # of an unknown class: everybody on the bus ignores it
        match decoded:
            case WorldSnapshot():
                for one, report in _reports(decoded):
                    if one in silent:
                        messages[one].reports.append(report)
            case CityEvent(vehicle=str() as one) if one in messages:
                messages[one].add(decoded)
            case _ if name in messages:
                messages[name].add(decoded)
    return messages, read_begin_ns(path, whole=False) or 0


def _reports(snapshot: WorldSnapshot) -> Iterator[tuple[str, Report]]:
    """Yield the poses of a snapshot's simulated cars; those of real cars come from the Eye."""
    for car in snapshot.vehicles:
        t_ns = snapshot.t_ns - round(car.age_ms * 1e6)
        source = EYE if car.kind == REAL else SIMULATED
        at = (car.x_m, car.y_m, car.yaw_rad)
        yield car.vehicle, Report(t_ns, *at, source, car.mode, car.epoch, car.car)
