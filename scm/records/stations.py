"""Stations on the bus."""

from typing import Annotated

import msgspec
from msgspec import Meta

from scm.records.events import LoggedEvent
from scm.records.fields import AgeS, Detail, IsAlive, Name


class StationRow(msgspec.Struct, kw_only=True, frozen=True):
    """One run of one station.

    Attributes:
        since_ns: When it was first seen here.
        lost_ns: When it left or died; None while it is there.
        age_s: Since its last status; None: it never sent one.
        step_ms: Its slowest step of the last second [ms].
        late_steps: Steps that were due and left out, since its start.
        late_share: The same as a share of the steps due in the last minute; None: not known.
        dropped: Messages that its mailboxes had to drop, since its start.
        dropped_lately: The same within the last minute.
    """

    role: Annotated[
        str,
        Meta(
            description="What it is in the city, or what its holder may do.", examples=["operator"]
        ),
    ]
    name: Name
    session: Annotated[
        str,
        Meta(description="Of this run of it: another after each start.", examples=["8f31a0c2d4"]),
    ]
    alive: IsAlive
    since_ns: int
    lost_ns: int | None = None
    age_s: AgeS | None = None
    detail: Detail = ""
    step_ms: float = 0.0
    late_steps: int = 0
    late_share: float | None = None
    dropped: int = 0
    dropped_lately: int = 0


class Stations(msgspec.Struct, kw_only=True, frozen=True):
    """Some stations.

    Attributes:
        stations: A row for each run of a station: one that was restarted may be listed twice.
    """

    stations: tuple[StationRow, ...]


class StationEvents(msgspec.Struct, kw_only=True, frozen=True):
    """What the log still holds of one station.

    Attributes:
        events: Those it reported, and those about it, newest first.
    """

    events: tuple[LoggedEvent, ...]
