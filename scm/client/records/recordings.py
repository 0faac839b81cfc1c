"""Records of recordings.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

import msgspec

from scm.client.records.shared import Box, Light, SnapshotBox


class RecordingRow(msgspec.Struct, kw_only=True, frozen=True):
    """One recording.

    Attributes:
        name: What it is called.
        title: What people call it.
        notes: What people wrote about it.
        state: `being written`; `complete`; `cut off`: its writer was killed, and it is read as far
            as it goes; `unreadable`: `trouble` says why.
        trouble: Why it cannot be read; empty: it can.
        begin_ns: When the first message was heard, since 1970; None: it holds none.
        length_s: How long it is [s].
        size_bytes: How large it is [byte].
        cars: Those that told of themselves, in the order people count.
    """

    name: str
    title: str
    notes: str
    state: Literal["being written", "complete", "cut off", "unreadable"]
    trouble: str
    begin_ns: int | None
    length_s: float
    size_bytes: int
    cars: tuple[str, ...]


class CarFacts(msgspec.Struct, kw_only=True, frozen=True):
    """What of a car is the same in all frames.

    Attributes:
        vehicle: Name of a car.
        kind: Of which sort it is.
        car: Name of its car file.
        owner: Who holds it.
    """

    vehicle: str
    kind: str
    car: str
    owner: str


class CarCamera(msgspec.Struct, kw_only=True, frozen=True):
    """A car's own camera: `front` or `rear`.

    Attributes:
        vehicle: Name of a car.
        camera: Name of a camera.
    """

    vehicle: str
    camera: str


class Summary(msgspec.Struct, kw_only=True, frozen=True):
    """What is known of a recording before any of it is shown.

    Attributes:
        recording: One recording.
        cars: All cars that it tells of.
        map_title: Of the map that was driven on; empty: it does not tell.
        lights: Lamps that burn.
        boxes: Boxes that cars can push.
        first_frame_s: When the world first told where cars are: it may have begun later.
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


class Frame(msgspec.Struct, kw_only=True, frozen=True):
    """The city at one moment.

    Attributes:
        t_s: Since the begin of the recording [s].
        cars: A row each: its number in `cars` of the stretch, x [m], y [m], yaw [rad], speed
            [m/s], steering angle [rad], mode, whether it is alive, lights that are on, what it is
            stuck against (null: it is not stuck).
        boxes: None: as in the frame before.
    """

    t_s: float
    cars: tuple[
        tuple[
            int,
            float,
            float,
            float,
            float,
            float,
            str,
            bool,
            tuple[str, ...],
            tuple[str, ...] | None,
        ],
        ...,
    ]
    boxes: tuple[SnapshotBox, ...] | None


class SignalChange(msgspec.Struct, kw_only=True, frozen=True):
    """From when on a signal group shows a colour.

    Attributes:
        t_s: Since the begin of the recording [s].
        group: Name of a signal group: heads that always show the same.
        colour: Colour.
    """

    t_s: float
    group: str
    colour: str


class PictureAt(msgspec.Struct, kw_only=True, frozen=True):
    """From when on a picture of a camera is the newest one; `vehicle` empty: an overhead one.

    Attributes:
        t_s: Since the begin of the recording [s].
        vehicle: Name of a car.
        camera: Name of a camera.
    """

    t_s: float
    vehicle: str
    camera: str


class Frames(msgspec.Struct, kw_only=True, frozen=True):
    """A stretch of a recording.

    Attributes:
        from_s: Where it begins [s].
        to_s: How far it goes: less than was asked where that would be too much for one answer.
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
    damaged: tuple[str, ...]
    next_s: float | None


class RecordedEvent(msgspec.Struct, kw_only=True, frozen=True):
    """An event of a recording; `number` counts from its begin.

    Attributes:
        number: Its number.
        t_s: Since the begin of the recording [s].
        severity: `info`, `warning` or `error`.
        source: Who told it.
        name: What it is called.
        text: One sentence for a person.
        vehicle: Name of a car.
    """

    number: int
    t_s: float
    severity: str
    source: str
    name: str
    text: str
    vehicle: str | None


class PageRecordedEvent(msgspec.Struct, kw_only=True, frozen=True):
    """Some rows of a list.

    Attributes:
        items: The rows of this page.
        next_: Cursor of those after them; null at the end.
    """

    items: tuple[RecordedEvent, ...]
    next_: str | None = msgspec.field(name="next")


class RecordedDisturbance(msgspec.Struct, kw_only=True, frozen=True):
    """One of them, from when to when since the recording began; see `/disturbances`.

    Attributes:
        kind: Of which sort it is.
        source: Who told it.
        text: One sentence for a person.
        start_s: When it begins [s].
        end_s: When it ends [s].
    """

    kind: str
    source: str
    text: str
    start_s: float
    end_s: float


class RecordedDisturbances(msgspec.Struct, kw_only=True, frozen=True):
    """What of a recording is void.

    Attributes:
        disturbances: The oldest first.
        void: What that means for the recording as a whole, in words; none: all of it counts.
    """

    disturbances: tuple[RecordedDisturbance, ...]
    void: tuple[str, ...]


class Notes(msgspec.Struct, kw_only=True, frozen=True):
    """What people wrote about a recording; the file keeps its name.

    Attributes:
        title: What people call it.
        notes: What people wrote about it.
    """

    title: str = ""
    notes: str = ""


class PageRecordingRow(msgspec.Struct, kw_only=True, frozen=True):
    """Some rows of a list.

    Attributes:
        items: The rows of this page.
        next_: Cursor of those after them; null at the end.
    """

    items: tuple[RecordingRow, ...]
    next_: str | None = msgspec.field(name="next")
