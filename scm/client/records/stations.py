"""Records of stations.

Written by docs/make/client.py: do not change it here.
"""

import msgspec

from scm.client.records.shared import LoggedEvent, StationRow


class Stations(msgspec.Struct, kw_only=True, frozen=True):
    """Some stations.

    Attributes:
        stations: A row for each run of a station: one that was restarted may be listed twice.
    """

    stations: tuple[StationRow, ...]


class StationEvents(msgspec.Struct, kw_only=True, frozen=True):
    """What the log still holds of one station.

    Attributes:
        events: Those it told, and those about it, newest first.
    """

    events: tuple[LoggedEvent, ...]
