"""The status of an overhead camera: whether its poses can be trusted, and why not."""

from typing import ClassVar

import msgspec

from scm.records.eye import InForce
from scm.v2x.message import Message


class Complaint(msgspec.Struct, kw_only=True, frozen=True):
    """One thing that is wrong.

    Attributes:
        code: A short machine word: `bumped`, `focus`, `stalled`.
        said: One sentence with numbers, for a person.
    """

    code: str
    said: str


class EyeStatus(Message, kw_only=True, frozen=True):
    """The self check of one camera.

    Attributes:
        good: No fault affects its poses.
        in_force: By what it sees; None: not reported.
    """

    KEY: ClassVar[str] = "eye/{camera}/status"
    RATE_HZ: ClassVar[float | None] = 2.0

    camera: str
    t_ns: int
    good: bool
    complaints: tuple[Complaint, ...] = ()
    in_force: InForce | None = None


MESSAGE = EyeStatus
