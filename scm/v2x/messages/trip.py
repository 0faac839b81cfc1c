"""How far a car is on the route it was given."""

from typing import ClassVar

from scm.v2x.message import Delivery, Message


class Trip(Message, kw_only=True, frozen=True):
    """Progress of one trip; sent twice a second and when it ends.

    Attributes:
        trip_id: The id the route request gave it.
        route: Lane names in order.
        done_m: Distance driven along the route.
        length_m: Of the whole route; None for a route without end.
        arrived_ns: When it ended; None while under way.
        waiting_for: What holds the car now: `signal`, `vehicle`, `stop`, or None.
    """

    KEY: ClassVar[str] = "v/{vehicle}/trip"
    RATE_HZ: ClassVar[float | None] = 2.0
    DELIVERY: ClassVar[Delivery] = Delivery.EVENT

    vehicle: str
    trip_id: str
    t_ns: int
    route: tuple[str, ...]
    done_m: float
    length_m: float | None
    started_ns: int
    arrived_ns: int | None = None
    waiting_for: str | None = None


MESSAGE = Trip
