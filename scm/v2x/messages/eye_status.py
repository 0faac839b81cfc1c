"""What an overhead camera says of itself: whether its poses can be trusted, and why not."""

from typing import ClassVar

import msgspec

from scm.v2x.message import Message


class Complaint(msgspec.Struct, kw_only=True, frozen=True):
    """One thing that is wrong.

    Attributes:
        code: A short machine word: `bumped`, `focus`, `stalled`.
        said: One sentence with numbers, for a person.
    """

    code: str
    said: str


class Calibrated(msgspec.Struct, kw_only=True, frozen=True):
    """Names of calibrations.

    Attributes:
        lens: Of the lens alone; empty: the one that the place was found with.
        place: Of the place and its lens; empty: as the camera was started, by the map file.
    """

    lens: str = ""
    place: str = ""


class InForce(msgspec.Struct, kw_only=True, frozen=True):
    """By which calibration a camera sees.

    Attributes:
        now: What it sees by.
        since_ns: When that was put in force, on the Eye's clock; None: it was started so.
        by: Who did, and `reason` why.
        before: What can be put back; None: nothing.
    """

    now: Calibrated
    since_ns: int | None = None
    by: str = ""
    reason: str = ""
    before: Calibrated | None = None


class EyeStatus(Message, kw_only=True, frozen=True):
    """The self check of one camera.

    Attributes:
        good: Nothing spoils its poses.
        in_force: By what it sees; None: not told.
    """

    KEY: ClassVar[str] = "eye/{camera}/status"
    RATE_HZ: ClassVar[float | None] = 2.0

    camera: str
    t_ns: int
    good: bool
    complaints: tuple[Complaint, ...] = ()
    in_force: InForce | None = None


MESSAGE = EyeStatus
