"""Records of events.

Written by docs/make/client.py: do not change it here.
"""

import msgspec

from scm.client.records.shared import LoggedEvent


class Events(msgspec.Struct, kw_only=True, frozen=True):
    """Some events of the log.

    Attributes:
        events: Entries of the log.
        next_after: Number of the last of these: ask on with it as `after`.
        more: Whether there are others after them already.
    """

    events: tuple[LoggedEvent, ...]
    next_after: int
    more: bool
