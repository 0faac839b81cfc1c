"""Recordings: the list, notes, and stretches that are replayed."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scm.records.body import Body
from scm.records.boxes import SnapshotBox
from scm.records.city_map import Box, Light

State = Literal["being written", "complete", "cut off", "unreadable"]


_CARS_AT = msgspec.Meta(
    examples=[[[0, 1.384, 0.655, -0.785, 0.21, 0.12, "drive", True, ["low"], None]]]
)


class Notes(msgspec.Struct, kw_only=True, frozen=True):
    """What people wrote about a recording; the file keeps its name."""

    title: str = ""
    notes: str = ""


class RecordingRow(msgspec.Struct, kw_only=True, frozen=True):
    """One recording.

    Attributes:
        state: `being written`; `complete`; `cut off`: its writer was killed, and it is read as far
            as it goes; `unreadable`: `trouble` gives the reason.
        begin_ns: When the first message arrived, since 1970; None: it holds none.
        cars: Those that reported their state, in natural order.
    """

    name: str
    title: str
    notes: str
    state: State
    trouble: str
    begin_ns: int | None
    length_s: float
    size_bytes: int
    cars: tuple[str, ...]


class CarAt(msgspec.Struct, kw_only=True, frozen=True, array_like=True):
    """One car in one frame, without names: `[car, x_m, y_m, yaw_rad, ...]`.

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

    vehicle: str
    kind: str
    car: str
    owner: str


class Frame(msgspec.Struct, kw_only=True, frozen=True):
    """The city at one moment.

    Attributes:
        cars: A row each: its number in `cars` of the stretch, x [m], y [m], yaw [rad], speed
            [m/s], steering angle [rad], mode, whether it is alive, lights that are on, what it
            is stuck against (null: it is not stuck).
        boxes: None: as in the frame before.
    """

    t_s: float
    cars: Annotated[tuple[CarAt, ...], _CARS_AT]
    boxes: tuple[SnapshotBox, ...] | None


class SignalChange(msgspec.Struct, kw_only=True, frozen=True):
    """From when on a signal group shows a colour."""

    t_s: float
    group: str
    colour: str


class PictureAt(msgspec.Struct, kw_only=True, frozen=True):
    """From when on a picture of a camera is the newest one; `vehicle` empty: an overhead one."""

    t_s: float
    vehicle: str
    camera: str


class CarCamera(msgspec.Struct, kw_only=True, frozen=True):
    """A car's own camera: `front` or `rear`."""

    vehicle: str
    camera: str


class Frames(msgspec.Struct, kw_only=True, frozen=True):
    """A stretch of a recording.

    Attributes:
        to_s: How far it goes: less than requested where that would be too much for one answer.
        cars: Whom the frames' numbers mean.
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
    damaged: tuple[str, ...]
    next_s: float | None


class RecordedEvent(msgspec.Struct, kw_only=True, frozen=True):
    """An event of a recording; `number` counts from its begin."""

    number: int
    t_s: float
    severity: str
    source: str
    name: str
    text: str
    vehicle: str | None


class Summary(msgspec.Struct, kw_only=True, frozen=True):
    """What is known of a recording before any of it is shown.

    Attributes:
        cars: All cars in it.
        map_title: Of the map that was driven on; empty: not known.
        first_frame_s: When the world first reported where cars are: it may have begun later.
        eye_cameras: The overhead cameras of which it has pictures.
        car_cameras: The cars' own, likewise.
    """

    recording: RecordingRow
    cars: tuple[CarFacts, ...]
    map_title: str
    lights: tuple[Light, ...]
    boxes: tuple[Box, ...]
    first_frame_s: float
    eye_cameras: tuple[str, ...]
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
