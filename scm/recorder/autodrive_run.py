"""Converts a run of the city to the columns of AutoDRIVE's recorder.

Commands are those in force before a car's next report, after its guard, with steering as an angle.
Poses are the reported ones of a simulated car and those of the overhead cameras of a real one.
Accelerations are without gravity, as AutoDRIVE's.
"""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from scm.arrays import Floats
from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import CarError, RecordingError
from scm.recorder.mcap_file import Recorded, read_keys, read_run
from scm.recording.autodrive import ACCELERATION, GREEN, OFF, RATES, RED, YELLOW
from scm.recording.autodrive_write import CarTrack, LightTrack, Series
from scm.records.city_map import Light
from scm.v2x.message import Message
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.vehicles.autodrive_senses import BEAMS, ranges_of, without_gravity
from scm.vehicles.car import Car, load_car

SIMULATED, EYE, REAL = "simulated", "eye", "real"
RADIUS, LIMIT = "wheel.radius_m", "steering.limit_rad"
CAMERAS = ("front", "rear")
STATES = {"dark": OFF, "red": RED, "yellow": YELLOW, "green": GREEN}
FLASH_NS = 500 * NS_PER_MS
_PREFIX = r"scm/@v\d+/[^/]+/"
_KINDS: tuple[tuple[re.Pattern[str], type[Message]], ...] = tuple(
    (re.compile(_PREFIX + key), kind)
    for key, kind in (
        (r"v/[^/]+/state", VehicleState),
        (r"v/[^/]+/sensors", VehicleSensors),
        (r"v/[^/]+/scan", LidarScan),
        (r"v/[^/]+/@camera/[^/]+", CameraFrame),
        (r"eye/pose/[^/]+", EyeTrack),
        (r"tl/[^/]+/spat", Spat),
        (r"world/def", WorldDefinition),
        (r"world/snapshot", WorldSnapshot),
    )
)


@dataclass(slots=True)
class _CarMessages:
    """The messages of a run about one car; `placed`: from the world's snapshots."""

    states: list[VehicleState] = field(default_factory=list)
    placed: list[VehicleState] = field(default_factory=list)
    tracks: list[EyeTrack] = field(default_factory=list)
    sensors: list[VehicleSensors] = field(default_factory=list)
    scans: list[LidarScan] = field(default_factory=list)
    pictures: dict[str, list[int]] = field(default_factory=dict)


class Run(NamedTuple):
    """A run in the recorder's columns; times since `start_ms` [milliseconds since 1970].

    Attributes:
        remarks: What could not be converted exactly, one line each.
    """

    start_ms: int
    cars: list[CarTrack]
    lights: list[LightTrack]
    remarks: list[str]


def read_tracks(path: Path, vehicle: str | None = None) -> Run:
    """Read the cars and the lights of a run.

    Args:
        path: The `.mcap` that the recorder wrote.
        vehicle: One of its cars; None: all.

    Raises:
        RecordingError: when the file is not a complete run, or no car reports its pose.
    """
    cars: dict[str, _CarMessages] = {}
    spats: dict[str, list[Spat]] = {}
    lights: tuple[Light, ...] = ()
    is_level = False
    for message in _messages(path):
        match message:
            case WorldDefinition():
                lights, is_level = message.map.lights, message.map.floor.is_level
            case WorldSnapshot():
                for state in _states_of(message):
                    cars.setdefault(state.vehicle, _CarMessages()).placed.append(state)
            case Spat():
                spats.setdefault(message.junction, []).append(message)
            case _:
                _add(cars, message)
    for car in cars.values():
        car.states = car.states or car.placed
    reporting = sorted((name for name, car in cars.items() if car.states), key=_natural)
    chosen = [name for name in reporting if vehicle in (None, name)]
    if not chosen:
        which = "" if vehicle is None else f" {vehicle!r}"
        known = f"; it has {', '.join(reporting)}" if reporting else ""
        msg = f"{path}: no car{which} reports where it is{known}"
        raise RecordingError(msg)
    first_ns = min(cars[name].states[0].t_ns for name in chosen)
    start_ns = first_ns // NS_PER_S * NS_PER_S
    notes: list[str] = []
    tracks = [_Car(name, cars[name], start_ns, is_level, notes).track() for name in chosen]
    return Run(start_ns // NS_PER_MS, tracks, _light_tracks(spats, lights, start_ns), notes)


def pictures_of(path: Path, vehicle: str, camera: int) -> Iterator[bytes]:
    """Yield the JPEG files of a car's camera, 0 front and 1 rear, in order of time."""
    frames = [
        (message.t_ns, message.payload)
        for message in _messages(path)
        if isinstance(message, CameraFrame)
        and message.vehicle == vehicle
        and message.camera == CAMERAS[camera]
    ]
    yield from (payload for _, payload in sorted(frames))


def _messages(path: Path) -> Iterator[Message]:
    """Yield the relevant messages of a run; unreadable ones are skipped."""
    kinds = {key: kind for key in read_keys(path) for form, kind in _KINDS if form.fullmatch(key)}
    for recorded in read_run(path, set(kinds)):
        message = _decoded(recorded, kinds[recorded.key])
        if message is not None:
            yield message


def _decoded(recorded: Recorded, kind: type[Message]) -> Message | None:
    try:
        message: Message = msgspec.json.decode(recorded.body, type=kind)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return None
    return message


def _states_of(snapshot: WorldSnapshot) -> Iterator[VehicleState]:
    """Yield the cars of a snapshot as reports, for sparse runs, which have none."""
    for car in snapshot.vehicles:
        yield VehicleState(
            vehicle=car.vehicle,
            t_ns=snapshot.t_ns - round(car.age_ms * NS_PER_MS),
            seq=snapshot.tick,
            x_m=car.x_m,
            y_m=car.y_m,
            yaw_rad=car.yaw_rad,
            speed_mps=car.speed_mps,
            yaw_rate_radps=math.nan,
            steering_rad=car.steering_rad,
            throttle=math.nan if car.throttle is None else car.throttle,
            source=EYE if car.kind == REAL else SIMULATED,
            car=car.car,
        )


def _add(cars: dict[str, _CarMessages], message: Any) -> None:
    """Add a message about one car."""
    car = cars.setdefault(message.vehicle, _CarMessages())
    match message:
        case VehicleState():
            car.states.append(message)
        case EyeTrack():
            car.tracks.append(message)
        case VehicleSensors():
            car.sensors.append(message)
        case LidarScan():
            car.scans.append(message)
        case CameraFrame():
            car.pictures.setdefault(message.camera, []).append(message.t_ns)


def _natural(name: str) -> list[tuple[int, str]]:
    """Return a sort key that puts n2 before n10."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", name)]


class _Car:
    """Builds the recorder's columns of one car."""

    def __init__(
        self, name: str, car: _CarMessages, start_ns: int, is_level: bool, notes: list[str]
    ) -> None:
        self._name, self._messages, self._start_ns = name, car, start_ns
        self._is_level, self._notes = is_level, notes
        for known in (car.states, car.tracks, car.sensors, car.scans):
            known.sort(key=lambda one: one.t_ns)
        self._car = _car_of(car.states[-1].car, name, notes)

    def track(self) -> CarTrack:
        """Return the car in the recorder's columns."""
        columns = self._poses() | self._commands() | self._sensed()
        scans = [(one.t_ns, ranges_of(one)) for one in self._messages.scans]
        return CarTrack(
            self._name,
            columns,
            self._times([t_ns for t_ns, _ in scans]),
            np.array([ranges for _, ranges in scans]).reshape(-1, BEAMS),
            {
                CAMERAS.index(camera): self._times(sorted(frames))
                for camera, frames in self._messages.pictures.items()
                if camera in CAMERAS
            },
        )

    def _times(self, t_ns: Sequence[int]) -> Floats:
        return (np.array(t_ns, np.int64) - self._start_ns) / NS_PER_S

    def _series(self, rows: Sequence[tuple[int, float]]) -> Series:
        """Return rows of a time [ns] and a value whose times increase."""
        t, values = self._times([t for t, _ in rows]), np.array([v for _, v in rows], np.float64)
        keep = np.concatenate((np.full(min(len(t), 1), fill_value=True), np.diff(t) > 0.0))
        return Series(t[keep], values[keep])

    def _poses(self) -> dict[str, Series]:
        car = self._messages
        is_real = car.states[-1].source != SIMULATED and car.tracks
        at: Sequence[VehicleState | EyeTrack] = car.tracks if is_real else car.states
        if is_real:
            self._notes.append(f"{self._name}: where the overhead cameras saw it")
        yaw = self._series([(one.t_ns, one.yaw_rad) for one in at])
        return {
            "posX": self._series([(one.t_ns, one.x_m) for one in at]),
            "posY": self._series([(one.t_ns, one.y_m) for one in at]),
            "yaw": yaw._replace(values=np.unwrap(yaw.values)),
            "speed": self._series([(one.t_ns, one.speed_mps) for one in at]),
            **self._height(),
        }

    def _height(self) -> dict[str, Series]:
        """Return the height of the rear axle on level ground."""
        if not self._is_level or self._car is None or not self._car.has(RADIUS):
            return {}
        return {"posZ": Series(np.zeros(1), np.array([self._car.value(RADIUS)]))}

    def _commands(self) -> dict[str, Series]:
        """Return the commands in force, each from the previous report on."""
        states = self._messages.states
        since = [states[0].t_ns, *(one.t_ns for one in states[:-1])]
        limit = self._car.value(LIMIT) if self._car and self._car.has(LIMIT) else None
        angles = [
            one.steering_rad if one.steering is None or limit is None else one.steering * limit
            for one in states
        ]
        if limit is None or any(one.steering is None for one in states):
            self._notes.append(f"{self._name}: steering is the wheels' angle: no command was told")
        return {
            "throttle": self._held(since, [one.throttle for one in states]),
            "steering": self._held(since, angles),
        }

    def _held(self, since: Sequence[int], values: Sequence[float]) -> Series:
        """Return commands; of several at one time the last."""
        newest = dict(zip(since, values, strict=True))
        return self._series(list(newest.items()))

    def _sensed(self) -> dict[str, Series]:
        """Return encoders, roll, pitch, rates, and acceleration without gravity."""
        read = self._messages.sensors
        columns = {
            "leftTicks": self._series([(one.t_ns, one.encoder_left) for one in read]),
            "rightTicks": self._series([(one.t_ns, one.encoder_right) for one in read]),
        }
        for k, name in enumerate(RATES):
            columns[name] = self._series([(one.t_ns, one.gyro_radps[k]) for one in read])
        level = [(one, one.orientation_rad) for one in read if one.orientation_rad is not None]
        for k, name in enumerate(("roll", "pitch")):
            tilt = self._series([(one.t_ns, rpy[k]) for one, rpy in level])
            columns[name] = tilt._replace(values=np.unwrap(tilt.values))
        felt = [(one.t_ns, without_gravity(one.accel_mps2, rpy)) for one, rpy in level]
        for k, name in enumerate(ACCELERATION):
            columns[name] = self._series([(t_ns, accel[k]) for t_ns, accel in felt])
        return columns


def _car_of(car: str, name: str, notes: list[str]) -> Car | None:
    try:
        return load_car(car)
    except CarError as problem:
        notes.append(f"{name}: {problem}")
        return None


def _state(colour: str, t_ns: int) -> int:
    """Return the recorder's number of a colour; flashing red alternates with off."""
    if colour == "flashing_red":
        return RED if t_ns // FLASH_NS % 2 == 0 else OFF
    return STATES[colour]


def _light_tracks(
    spats: dict[str, list[Spat]], lights: Sequence[Light], start_ns: int
) -> list[LightTrack]:
    """Return the colours over time of each light of the map."""
    tracks = []
    for light in sorted(lights, key=lambda one: one.light_id):
        shown = [
            (spat.t_ns, _state(group.colour, spat.t_ns))
            for spat in sorted(spats.get(light.junction, []), key=lambda one: one.t_ns)
            for group in spat.groups
            if group.group == light.group
        ]
        if shown:
            t = (np.array([t_ns for t_ns, _ in shown], np.int64) - start_ns) / NS_PER_S
            states = np.array([state for _, state in shown], np.float64)
            name = f"{light.junction}/{light.group}"
            tracks.append(LightTrack(light.light_id, name, Series(t, states)))
    return tracks
