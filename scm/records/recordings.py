"""Recordings: the list, notes, and stretches that are replayed."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scm.records.body import Body
from scm.records.boxes import SnapshotBox
from scm.records.city_map import Box, Light
from scm.records.fields import (
    TS,
    CameraName,
    CarName,
    CarNames,
    ColourName,
    GroupName,
    KindName,
    Name,
    NotesText,
    Number,
    OwnerName,
    SeverityName,
    SourceName,
    Text,
    Title,
    VehicleName,
)

State = Literal["being written", "complete", "cut off", "unreadable"]


_CARS_AT = msgspec.Meta(
    examples=[[[0, 1.384, 0.655, -0.785, 0.21, 0.12, "drive", True, ["low"], None]]]
)


class Notes(msgspec.Struct, kw_only=True, frozen=True):
    """What people wrote about a recording; the file keeps its name."""

    title: Title = ""
    notes: NotesText = ""


class RecordingRow(msgspec.Struct, kw_only=True, frozen=True):
    """One recording.

    Attributes:
        state: `being written`; `complete`; `cut off`: its writer was killed, and it is read as far
            as it goes; `unreadable`: `trouble` gives the reason.
        trouble: Why it cannot be read; empty: it can.
        begin_ns: When the first message arrived, since 1970; None: it holds none.
        length_s: How long it is [s].
        size_bytes: How large it is [byte].
        cars: Those that reported their state, in natural order.
    """

    name: Name
    title: Title
    notes: NotesText
    state: State
    trouble: Annotated[str, Meta(examples=["it is no MCAP file"])]
    begin_ns: int | None
    length_s: float
    size_bytes: int
    cars: CarNames


class CarAt(msgspec.Struct, kw_only=True, frozen=True, array_like=True):
    """One car in one frame, without names: `[car, x_m, y_m, yaw_rad, ...]`.

    A record beside `SnapshotVehicle`: without names and with less, as a page loads many frames.

    Attributes:
        car: Number of its entry in `cars`.
        lights: Names of those that are on.
        stuck: It was commanded to drive and stayed: what it most likely pushed against, names of
            cars, `wall`, boxes; empty: nothing that is known. None: it was not stuck.
    """

    car: int
    x_m: float
    y_m: float
    yaw_rad: float
    speed_mps: float
    steering_rad: float
    mode: str
    alive: bool
    lights: tuple[str, ...]
    stuck: tuple[str, ...] | None


class CarFacts(msgspec.Struct, kw_only=True, frozen=True):
    """What of a car is the same in all frames."""

    vehicle: VehicleName
    kind: KindName
    car: CarName
    owner: OwnerName


class Frame(msgspec.Struct, kw_only=True, frozen=True):
    """The city at one moment.

    Attributes:
        cars: A row each: its number in `cars` of the stretch, x [m], y [m], yaw [rad], speed
            [m/s], steering angle [rad], mode, whether it is alive, lights that are on, what it
            is stuck against (null: it is not stuck).
        boxes: None: as in the frame before.
    """

    t_s: TS
    cars: Annotated[tuple[CarAt, ...], _CARS_AT]
    boxes: tuple[SnapshotBox, ...] | None


class SignalChange(msgspec.Struct, kw_only=True, frozen=True):
    """From when on a signal group shows a colour."""

    t_s: TS
    group: GroupName
    colour: ColourName


class PictureAt(msgspec.Struct, kw_only=True, frozen=True):
    """From when on a picture of a camera is the newest one; `vehicle` empty: an overhead one."""

    t_s: TS
    vehicle: VehicleName
    camera: CameraName


class CarCamera(msgspec.Struct, kw_only=True, frozen=True):
    """A car's own camera: `front` or `rear`."""

    vehicle: VehicleName
    camera: CameraName


class Frames(msgspec.Struct, kw_only=True, frozen=True):
    """A stretch of a recording.

    Attributes:
        from_s: Where it begins [s].
        to_s: How far it goes: less than requested where that would be too much for one answer.
        hz: How often a second.
        cars: Whom the frames' numbers mean.
        frames: Moments, in order of time.
        signals: Changes, the colours at `from_s` first; a group is `junction/group`.
        pictures: The Eye's and the cars' own, of each camera the one that is newest at `from_s`
            first.
        damaged: What of the stretch cannot be read, in words.
        next_s: When the first frame after a stretch without frames comes; None: there is none, or
            the stretch has frames.
    """

    from_s: float
    to_s: float
    hz: float
    cars: tuple[CarFacts, ...]
    frames: tuple[Frame, ...]
    signals: tuple[SignalChange, ...]
    pictures: tuple[PictureAt, ...]
    damaged: Annotated[tuple[str, ...], Meta(examples=[["from 12 s to 13 s: cut off"]])]
    next_s: float | None


class RecordedEvent(msgspec.Struct, kw_only=True, frozen=True):
    """An event of a recording; `number` counts from its begin."""

    number: Number
    t_s: TS
    severity: SeverityName
    source: SourceName
    name: Name
    text: Text
    vehicle: VehicleName | None


class Summary(msgspec.Struct, kw_only=True, frozen=True):
    """What is known of a recording before any of it is shown.

    Attributes:
        cars: All cars in it.
        map_title: Of the map that was driven on; empty: not known.
        lights: Lamps that burn.
        boxes: Boxes that cars can push.
        first_frame_s: When the world first reported where cars are: it may have begun later.
        eye_cameras: The overhead cameras of which it has pictures.
        car_cameras: The cars' own, likewise.
    """

    recording: RecordingRow
    cars: tuple[CarFacts, ...]
    map_title: Annotated[str, Meta(examples=["Driving School"])]
    lights: tuple[Light, ...]
    boxes: tuple[Box, ...]
    first_frame_s: float
    eye_cameras: Annotated[tuple[str, ...], Meta(examples=[["overhead"]])]
    car_cameras: tuple[CarCamera, ...]


class NotesBody(Body, kw_only=True, frozen=True):
    """What to call a recording, and what to know of it; its file keeps its name."""

    title: Annotated[
        str, Meta(max_length=120, description="shown first", examples=["Brisk plan"])
    ] = ""
    notes: Annotated[
        str,
        Meta(max_length=4000, description="in words, as long as need be", examples=["n3 slipped"]),
    ] = ""


class PartBody(Body, kw_only=True, frozen=True):
    """From when to when of a recording shall be one of its own."""

    from_s: Annotated[
        float,
        Meta(
            ge=0.0, le=10000000.0, description="seconds since the recording began", examples=[60.0]
        ),
    ] = 0.0
    to_s: (
        Annotated[
            float,
            Meta(
                ge=0.0, le=10000000.0, description="likewise; without: to the end", examples=[180.0]
            ),
        ]
        | None
    ) = None
