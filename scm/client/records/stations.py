"""Records of stations.

Written by docs/make/client.py: do not change it here.
"""

import msgspec

from scm.client.records.shared import StationRow


class Stations(msgspec.Struct, kw_only=True, frozen=True):
    """Some stations.

    Attributes:
        stations: A row for each run of a station: one that was restarted may be listed twice.
    """

    stations: tuple[StationRow, ...]


class LoggedEvent(msgspec.Struct, kw_only=True, frozen=True):
    """An event and its number; numbers start at 1 and have no gaps.

    Attributes:
        seq: Number of the event since the server started.
        id: The same for this event for ever: of its time, source, name and text.
        severity: `info`, `warning` or `error`.
        source: Who told it.
        t_ns: When it was true, by the clock of who tells it [ns].
        name: What it is called.
        text: One sentence for a person.
        vehicle: The car it is about; null: none.
    """

    seq: int
    id: str
    severity: str
    source: str
    t_ns: int
    name: str
    text: str
    vehicle: str | None = None


class StationEvents(msgspec.Struct, kw_only=True, frozen=True):
    """What the log still holds of one station.

    Attributes:
        events: Those it told, and those about it, newest first.
    """

    events: tuple[LoggedEvent, ...]
