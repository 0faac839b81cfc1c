"""Whether the server is alive and the city ready."""

import msgspec

from scm.records.fields import Detail, Name, StatusText


class Alive(msgspec.Struct, kw_only=True, frozen=True):
    """The server answers.

    Attributes:
        status: `ok`.
    """

    status: StatusText


class Check(msgspec.Struct, kw_only=True, frozen=True):
    """One thing that the server needs.

    Attributes:
        name: `router`: its connection to the bus; `world`: snapshots come; `parts`: every part of
            the city that should be there is; `disk`: there is room on the disk for recordings,
            reports and the like.
        good: Whether it is there.
        detail: What was found, in words.
    """

    name: Name
    good: bool
    detail: Detail


class Ready(msgspec.Struct, kw_only=True, frozen=True):
    """The server can do its work.

    Attributes:
        status: `ready`.
        snapshot_age_s: Age of the world's newest snapshot.
        checks: What was looked at.
    """

    status: StatusText
    snapshot_age_s: float | None
    checks: tuple[Check, ...]
