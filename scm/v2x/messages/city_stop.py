"""Whether the city-wide stop is engaged: every car obeys it, whatever drives it."""

from typing import ClassVar

from scm.records.fields import ReasonText, RequestedBy, TNs
from scm.v2x.message import Delivery, Message


class CityStop(Message, kw_only=True, frozen=True):
    """State of the city stop; repeated once a second while engaged.

    Attributes:
        engaged: Whether the city-wide stop is engaged: no car may drive.
    """

    KEY: ClassVar[str] = "world/stop"
    DELIVERY: ClassVar[Delivery] = Delivery.EVENT

    t_ns: TNs
    engaged: bool
    by: RequestedBy = ""
    reason: ReasonText = ""


MESSAGE = CityStop
