"""Records of stop.

Written by docs/make/client.py: do not change it here.
"""

import msgspec


class CityStop(msgspec.Struct, kw_only=True, frozen=True):
    """State of the red button; repeated once a second while engaged.

    Attributes:
        t_ns: When it was true, by the clock of who tells it [ns].
        engaged: Whether the city-wide stop is engaged: no car may drive.
        by: Who wished it.
        reason: Why.
    """

    t_ns: int
    engaged: bool
    by: str = ""
    reason: str = ""
