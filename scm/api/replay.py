"""Moments of a recording, small enough to be drawn: where cars were, what signals showed, events.

Times are seconds since the recording's first message, on the recorder's clock.
"""

import csv
import io
import math
import re
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import TypeVar

import msgspec

from scm.clock import NS_PER_MS, NS_PER_S
from scm.recorder.mcap_file import Recorded
from scm.recorder.run_index import RunIndex
from scm.records.boxes import SnapshotBox
from scm.records.city_map import CityMap
from scm.records.recordings import (
    CarAt,
    CarCamera,
    CarFacts,
    Frame,
    Frames,
    PictureAt,
    RecordedEvent,
    SignalChange,
)
from scm.v2x.message import Message
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

MOST_ROWS = 60_000  # of one answer: a hundred cars for a minute at 10 Hz
MOST_EVENTS = 20_000
BLOCK = 64 * 1024
_PREFIX = r"scm/@v\d+/[^/]+/"
M = TypeVar("M", bound=Message)
Wanted = Callable[[str], bool]
Row = tuple[object, ...]


def _key(form: str) -> Wanted:
    expression = re.compile(_PREFIX + form)
    return lambda key: expression.fullmatch(key) is not None


SNAPSHOT, SPAT, EVENT = _key("world/snapshot"), _key("tl/[^/]+/spat"), _key("event/[^/]+/[^/]+")
DEFINITION = _key("world/def")
EYE, CAR_CAMERA = _key("eye/[^/]+/frame"), _key("v/[^/]+/@camera/[^/]+")
_PICTURE = _key("(?:eye/[^/]+/frame|v/[^/]+/@camera/[^/]+)")
_DRAWN = _key("(?:world/snapshot|tl/[^/]+/spat|eye/[^/]+/frame|v/[^/]+/@camera/[^/]+)")


def frames_of(index: RunIndex, from_s: float, to_s: float, hz: float) -> Frames:
    """Return where everything was from a time to another, at most so often a second.

    Raises:
        RecordingError: when the file cannot be opened any more.
    """
    gathering = _Frames(index, hz)
    begin_ns, end_ns = (index.begin_ns + round(at * NS_PER_S) for at in (from_s, to_s))
    gathering.lights_before(begin_ns)
    gathering.pictures_before(begin_ns)
    damage: list[str] = []
    for one in index.read(begin_ns, end_ns, _DRAWN, damage):
        if not gathering.add(one):
            end_ns = one.t_ns
            break
    return Frames(
        from_s=from_s,
        to_s=min(to_s, gathering.seconds(end_ns)),
        hz=hz,
        cars=tuple(gathering.cars),
        frames=tuple(gathering.frames),
        signals=tuple(gathering.signals),
        pictures=tuple(gathering.pictures),
        damaged=tuple(damage),
        next_s=None if gathering.frames else _next_frame_s(index, end_ns),
    )


def _next_frame_s(index: RunIndex, after_ns: int) -> float | None:
    """Return when the world next published poses, since the recording's begin."""
    found = next(index.read(after_ns + 1, index.end_ns, SNAPSHOT), None)
    return None if found is None else round((found.t_ns - index.begin_ns) / NS_PER_S, 3)


class _Frames:
    """Frames on their way to an answer."""

    def __init__(self, index: RunIndex, hz: float) -> None:
        self._index, self._period_ns = index, NS_PER_S / hz
        self._due_ns = 0.0
        self._rows = 0
        self._numbers: dict[CarFacts, int] = {}
        self._colours: dict[str, str] = {}
        self._boxes: tuple[SnapshotBox, ...] = ()
        self.cars: list[CarFacts] = []
        self.frames: list[Frame] = []
        self.signals: list[SignalChange] = []
        self.pictures: list[PictureAt] = []

    def seconds(self, t_ns: float) -> float:
        """Return a time since the recording's begin [s]."""
        return round((t_ns - self._index.begin_ns) / NS_PER_S, 3)

    def lights_before(self, begin_ns: int) -> None:
        """Note what each junction showed when the stretch begins."""
        for key in [key for key in self._index.topics.values() if SPAT(key)]:
            found = self._index.newest(begin_ns, key.__eq__)
            spat = read(found, Spat) if found is not None else None
            if spat is not None:
                self._lights(begin_ns, spat)

    def pictures_before(self, begin_ns: int) -> None:
        """Note what each camera had pictured last when the stretch begins."""
        for key in [key for key in self._index.topics.values() if _PICTURE(key)]:
            found = self._index.newest(begin_ns - 1, key.__eq__)
            if found is not None:
                self._picture(found)

    def add(self, one: Recorded) -> bool:
        """Take a message; return False when the answer is full."""
        if _PICTURE(one.key):
            is_full = self._is_full(1)
            if not is_full:
                self._picture(one)
            return not is_full
        if SPAT(one.key):
            spat = read(one, Spat)
            if spat is not None:
                self._lights(one.t_ns, spat)
            return True
        if one.t_ns < self._due_ns:
            return True
        snapshot = read(one, WorldSnapshot)
        if snapshot is None:
            return True
        if self._is_full(len(snapshot.vehicles)):
            return False
        # Counted from when it was due, so that 20 Hz that jitter make 10 Hz and not 7.
        late = one.t_ns - self._due_ns >= self._period_ns
        self._due_ns = (one.t_ns if late else self._due_ns) + 0.999 * self._period_ns
        boxes = snapshot.boxes if snapshot.boxes != self._boxes or not self.frames else None
        self._boxes = snapshot.boxes
        cars = tuple(self._car(car) for car in snapshot.vehicles)
        self.frames.append(Frame(t_s=self.seconds(one.t_ns), cars=cars, boxes=boxes))
        return True

    def _is_full(self, rows: int) -> bool:
        self._rows += rows
        return self._rows > MOST_ROWS and bool(self.frames)

    def _car(self, car: SnapshotVehicle) -> CarAt:
        facts = _facts(car)
        number = self._numbers.setdefault(facts, len(self.cars))
        if number == len(self.cars):
            self.cars.append(facts)
        return CarAt(
            car=number,
            x_m=round(car.x_m, 4),
            y_m=round(car.y_m, 4),
            yaw_rad=round(car.yaw_rad, 4),
            speed_mps=round(car.speed_mps, 3),
            steering_rad=round(car.steering_rad, 3),
            mode=car.mode,
            alive=car.alive,
            lights=car.lights,
            stuck=car.stuck,
        )

    def _picture(self, one: Recorded) -> None:
        # Rounded up: a request for this time gets this picture, not the one before.
        t_s = math.ceil((one.t_ns - self._index.begin_ns) / NS_PER_MS) / 1000
        vehicle, camera = _camera_of(one.key)
        self.pictures.append(PictureAt(t_s=t_s, vehicle=vehicle, camera=camera))

    def _lights(self, t_ns: int, spat: Spat) -> None:
        for group in spat.groups:
            name = f"{spat.junction}/{group.group}"
            if self._colours.get(name) != group.colour:
                self._colours[name] = group.colour
                change = SignalChange(t_s=self.seconds(t_ns), group=name, colour=group.colour)
                self.signals.append(change)


def events_of(index: RunIndex) -> tuple[RecordedEvent, ...]:
    """Return the events of a recording in their order, the first 20 000 of them.

    Raises:
        RecordingError: when the file cannot be opened any more.
    """
    found: list[RecordedEvent] = []
    for one in index.read(0, index.end_ns, EVENT):
        event = read(one, CityEvent)
        if event is None:
            continue
        t_s = round((one.t_ns - index.begin_ns) / NS_PER_S, 3)
        found.append(
            RecordedEvent(
                number=len(found) + 1,
                t_s=t_s,
                severity=event.severity,
                source=event.source,
                name=event.name,
                text=event.text,
                vehicle=event.vehicle,
            )
        )
        if len(found) == MOST_EVENTS:
            break
    return tuple(found)


def eye_cameras(index: RunIndex) -> tuple[str, ...]:
    """Return the overhead cameras of which a recording has pictures."""
    return tuple(sorted(_camera_of(key)[1] for key in index.topics.values() if EYE(key)))


def car_cameras(index: RunIndex) -> tuple[CarCamera, ...]:
    """Return the cars' own cameras of which a recording has pictures."""
    found = (_camera_of(key) for key in index.topics.values() if CAR_CAMERA(key))
    return tuple(CarCamera(vehicle=vehicle, camera=camera) for vehicle, camera in found)


def picture_at(
    index: RunIndex, camera: str, t_s: float, vehicle: str = ""
) -> tuple[int, bytes] | None:
    """Return the newest picture of a camera at a time: its exposure [ns] and the JPEG file.

    No more of the file is unpacked than the piece that holds it.

    Args:
        index: Of the recording.
        camera: An overhead one, or one of the car's.
        t_s: Since the recording's begin.
        vehicle: Whose camera it is; empty: an overhead one.

    Raises:
        RecordingError: when the file cannot be opened any more.
    """
    before_ns = index.begin_ns + round(t_s * NS_PER_S)
    own = f"v/{re.escape(vehicle)}/@camera/{re.escape(camera)}"
    found = index.newest(before_ns, _key(own if vehicle else f"eye/{re.escape(camera)}/frame"))
    kind: type[CameraFrame | EyeFrame] = CameraFrame if vehicle else EyeFrame
    frame = read(found, kind) if found is not None else None
    return (frame.t_ns, frame.payload) if frame is not None else None


def _camera_of(key: str) -> tuple[str, str]:
    """Return vehicle and camera of a picture's key; the vehicle of an overhead one is empty."""
    *_, vehicle, camera, last = key.split("/")
    return (vehicle, last) if camera == "@camera" else ("", camera)


def map_of(index: RunIndex) -> CityMap | None:
    """Return the map that was driven on; None: the recording does not contain it.

    Raises:
        RecordingError: when the file cannot be opened any more.
    """
    found = index.newest(index.end_ns, DEFINITION)
    message = read(found, WorldDefinition) if found is not None else None
    return message.map if message is not None else None


def cars_in(index: RunIndex) -> tuple[CarFacts, ...]:
    """Return all cars of the first and the last snapshot: those of a sparse recording."""
    first = next(index.read(0, index.end_ns, SNAPSHOT), None)
    last = index.newest(index.end_ns, SNAPSHOT)
    message = [read(one, WorldSnapshot) for one in (first, last) if one is not None]
    cars = {car.vehicle: _facts(car) for one in message if one is not None for car in one.vehicles}
    return tuple(cars.values())


def first_frame_s(index: RunIndex) -> float:
    """Return when the world first published poses; 0: never."""
    first = next(index.read(0, index.end_ns, SNAPSHOT), None)
    return (first.t_ns - index.begin_ns) / NS_PER_S if first is not None else 0.0


def _facts(car: SnapshotVehicle) -> CarFacts:
    return CarFacts(vehicle=car.vehicle, kind=car.kind, car=car.car, owner=car.owner)


def csv_of(
    index: RunIndex, vehicle: str = "", from_s: float = 0.0, to_s: float | None = None
) -> Iterator[bytes] | None:
    """Return a recording as CSV, in blocks: a car's own reports, or all cars as the world saw them.

    None where it has no row then: a header alone would look like a table. `no_rows` says so.

    Args:
        index: Of the recording.
        vehicle: The car; empty: all of them, a row a car and snapshot.
        from_s: Of the first row, since the recording's begin.
        to_s: Of the last one; None: to the end.

    Raises:
        RecordingError: when the file cannot be opened any more.
    """
    end_ns = index.end_ns if to_s is None else index.begin_ns + round(to_s * NS_PER_S)
    span = index.begin_ns + round(from_s * NS_PER_S), end_ns
    damage: list[str] = []
    of_each = _car_rows(index, vehicle, span, damage) if vehicle else _all_rows(index, span, damage)
    first = next(of_each, None)
    if first is None and not damage:
        return None
    head = ("t_s", "vehicle", *(_OF_CAR if vehicle else _OF_ALL))
    return _blocks(chain((head,) if first is None else (head, first), of_each), damage)


def no_rows(index: RunIndex, vehicle: str, from_s: float, to_s: float | None) -> str:
    """Raise that a recording has nothing of a car, or of any, in a span, with its length."""
    whose = vehicle or "any car"
    span = f"from {from_s:g} s on" if to_s is None else f"from {from_s:g} s to {to_s:g} s"
    length_s = (index.end_ns - index.begin_ns) / NS_PER_S
    return f"no row of {whose} {span}; the recording is {length_s:.1f} s long"


def _blocks(of_each: Iterable[Row], damage: list[str]) -> Iterator[bytes]:
    """Yield rows as text, and at its end what was left out."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    for row in of_each:
        rows.writerow(row)
        if text.tell() > BLOCK:
            yield text.getvalue().encode()
            text.seek(0)
            text.truncate()
    for message in damage:
        text.write(f"# left out: {message}\n")
    yield text.getvalue().encode()


_OF_ALL = (
    *("kind", "owner", "mode", "alive", "x_m", "y_m", "yaw_rad"),
    *("speed_mps", "steering_rad", "throttle"),
)
_OF_CAR = (
    *("source", "mode", "epoch", "x_m", "y_m", "yaw_rad", "speed_mps", "lateral_speed_mps"),
    *("yaw_rate_radps", "accel_mps2", "steering_rad", "throttle", "steering"),
)


def _car_rows(
    index: RunIndex, vehicle: str, span: tuple[int, int], damage: list[str]
) -> Iterator[Row]:
    key = _key(f"v/{re.escape(vehicle)}/state")
    for one in index.read(*span, key, damage):
        state = read(one, VehicleState)
        if state is not None:
            t_s = round((one.t_ns - index.begin_ns) / NS_PER_S, 6)
            yield (t_s, vehicle, *(getattr(state, name) for name in _OF_CAR))


def _all_rows(index: RunIndex, span: tuple[int, int], damage: list[str]) -> Iterator[Row]:
    for one in index.read(*span, SNAPSHOT, damage):
        snapshot = read(one, WorldSnapshot)
        for car in snapshot.vehicles if snapshot is not None else ():
            t_s = round((one.t_ns - index.begin_ns) / NS_PER_S, 6)
            yield (t_s, car.vehicle, *(getattr(car, name) for name in _OF_ALL))


def read(one: Recorded, kind: type[M]) -> M | None:
    """Return a recorded message; None where it is not of today's form."""
    try:
        return msgspec.json.decode(one.body, type=kind)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return None
