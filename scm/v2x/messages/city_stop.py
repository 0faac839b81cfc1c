"""Whether the city-wide stop is engaged: every car obeys it, whoever drives it."""

from typing import ClassVar

from scm.v2x.message import Delivery, Message


class CityStop(Message, kw_only=True, frozen=True):
    """State of the red button; repeated once a second while engaged."""

    KEY: ClassVar[str] = "world/stop"
    DELIVERY: ClassVar[Delivery] = Delivery.EVENT

    t_ns: int
    engaged: bool
    by: str = ""
    reason: str = ""


MESSAGE = CityStop
