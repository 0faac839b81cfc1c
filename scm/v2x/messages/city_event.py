"""Something a person would want to read in the log of the city."""

from typing import ClassVar, Literal

from scm.v2x.message import Delivery, Message


class CityEvent(Message, kw_only=True, frozen=True):
    """One event.

    Attributes:
        source: The station that reports it.
        name: A fixed short name: `vehicle_joined`, `vehicle_lost`, `plan_changed` ...
        text: One sentence for a person.
    """

    KEY: ClassVar[str] = "event/{severity}/{source}"
    DELIVERY: ClassVar[Delivery] = Delivery.EVENT
    HISTORY_DEPTH: ClassVar[int] = 50

    severity: Literal["info", "warning", "error"]
    source: str
    t_ns: int
    name: str
    text: str
    vehicle: str | None = None


MESSAGE = CityEvent
