"""Send a car along lanes: answered by its driver (the world, or its agent)."""

from typing import ClassVar, Literal

from scm.records.fields import LengthM, RouteLanes, TripId, VehicleName
from scm.v2x.message import Message, Request


class RouteReply(Message, kw_only=True, frozen=True):
    """The trip has begun.

    Attributes:
        route: The lanes the car will follow, those between the given ones filled in.
    """

    KEY: ClassVar[str] = "v/{vehicle}/cmd/route/reply"

    vehicle: VehicleName
    trip_id: TripId
    route: RouteLanes
    length_m: LengthM | None


class RouteRequest(Request, kw_only=True, frozen=True):
    """Drive through these lanes, from where the car is.

    Attributes:
        via: Lane names to pass in this order; empty: circulate without end.
        laps: How often to pass `via`.
        speed_mps: Desired speed on free road; None: the lanes' limits.
        then: What to do on arrival: `stop` there, or `circulate` so as not to block the lane.
        replaces: Id of the only trip that this one may replace: a car that is on another, or that
            somebody else drives or drove since, refuses with `owned`. Empty: any.
    """

    KEY: ClassVar[str] = "v/{vehicle}/cmd/route"
    REPLY: ClassVar[type[Message]] = RouteReply
    SERVER: ClassVar[str] = "the program that drives {vehicle}"

    vehicle: str
    via: tuple[str, ...] = ()
    laps: int = 1
    speed_mps: float | None = None
    then: Literal["stop", "circulate"] = "stop"
    replaces: str = ""


MESSAGE = RouteRequest
