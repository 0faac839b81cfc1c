"""How far a car is on the route it was given."""

from typing import ClassVar, Literal

from scm.v2x.message import Delivery, Message


class Trip(Message, kw_only=True, frozen=True):
    """Progress of one trip; sent twice a second, when it ends, and when somebody takes the car.

    A request along `via`, with the same speed and the same end, continues it.

    Attributes:
        trip_id: The id the route request gave it.
        route: Lane names in order.
        done_m: Distance driven along the route.
        length_m: Of the whole route; None for a route without end.
        arrived_ns: When it ended; None while under way.
        waiting_for: What holds the car now: `signal`, `vehicle`, `stop`, or None.
        via: Lanes that it still has to pass, in order, the laps written out; a lane counts as
            passed at its end. Empty: it circulates.
        speed_mps: Desired speed on free road; None: the lanes' limits.
        then: What it does on arrival, as in `RouteRequest`.
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
    via: tuple[str, ...] = ()
    speed_mps: float | None = None
    then: Literal["stop", "circulate"] = "stop"


MESSAGE = Trip
