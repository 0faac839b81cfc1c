"""Hand a hosted car over to the next city: a place is reserved for it, then it goes over whole."""

from typing import Annotated, ClassVar, Literal

from msgspec import Meta, Struct

from scm.records.fields import CarName, CityName, LaneName, TagId, VehicleName
from scm.v2x.message import Message, Request

Pose = Annotated[
    tuple[float, float, float],
    Meta(description="x [m], y [m], yaw [rad].", examples=[[12.0, 0.5, 0.0]]),
]

HandedName = Annotated[
    str,
    Meta(pattern=r"^[a-z0-9_-]{1,32}$", description="Name of a car.", examples=["n1"]),
]


class NamedValues(Struct, kw_only=True, frozen=True):
    """One variable or parameter of a car's physics, by the name that the physics page gives it."""

    name: str
    values: tuple[float, ...]


class CommandPast(Struct, kw_only=True, frozen=True):
    """Past commands of a car whose actuators answer late; see `vehicles.command_delay`."""

    knots: tuple[tuple[float, float, float], ...]
    newest: int
    before: tuple[float | None, float | None]


class HandedDriver(Struct, kw_only=True, frozen=True):
    """What a car's driver remembers that does not depend on the map.

    Attributes:
        wheels_rad: Angle that it believes its wheels have.
        commanded_rad: Angle that it commanded last.
        setpoint_mps: Of its speed control; `integral` of the same.
        decided_ns: How long before `HandedCar.t_ns` it decided last.
        seed: Chooses where it turns while it circulates.
        speed_mps: Desired speed on free road; None: the lanes' limits.
        then: What it does at the end of its route, as in `RouteRequest`.
    """

    wheels_rad: float
    commanded_rad: float
    setpoint_mps: float
    integral: float
    decided_ns: int
    seed: int
    speed_mps: float | None = None
    then: Literal["stop", "circulate"] = "circulate"


class HandedCar(Struct, kw_only=True, frozen=True):
    """The whole state of a car at the instant at which it leaves.

    Attributes:
        t_ns: That instant, on the clock of the city that it leaves.
        variables: States, inputs and results of its physics. World frame: that of the city it
            leaves.
        parameters: Numbers of its physics, effects included.
        origin: Origin of the map that it leaves, in the map that it enters.
        drawn_as: Charge drawn from its battery [A*s].
        headlights, indicators: As they are switched.
    """

    t_ns: int
    variables: tuple[NamedValues, ...]
    parameters: tuple[NamedValues, ...]
    origin: Pose
    driver: HandedDriver
    past: CommandPast | None = None
    drawn_as: float = 0.0
    tag_id: TagId
    headlights: Literal["off", "low", "high"] = "off"
    indicators: Literal["off", "left", "right", "hazard"] = "off"


class HandoverReply(Message, kw_only=True, frozen=True):
    """The place is reserved, or the transfer is decided: the car is stored there, or refused.

    A refused place is answered with `Refused`, a refused transfer with this message: it is final,
    and must not be mistaken for a failure of the bus.

    Attributes:
        epoch: Of the transfer that is answered.
        valid_ms: How long the place is reserved.
        refused: The code of a refused transfer; empty: the car came.
        detail: Of the refusal, one sentence for people.
    """

    KEY: ClassVar[str] = "handover/{city}/reply"

    city: CityName
    vehicle: VehicleName
    epoch: int
    valid_ms: int = 0
    refused: str = ""
    detail: str = ""


class HandoverRequest(Request, kw_only=True, frozen=True):
    """Reserve a place for a car that comes to the border, or take the car.

    A transfer is identified by city, car and epoch. To commit one again changes nothing: it is
    answered as the first time.

    Attributes:
        city: The city that the car leaves.
        phase: `reserve` a place, or `commit` the transfer.
        epoch: The car's next one; of two transfers of a car the later one has the higher epoch.
        lane: Lane that it goes on in.
        border: Where that lane must begin: the end of the lane it leaves, in the map it enters.
        car: Name of its car file.
        digest: Of that file's effects and numbers.
        state: The car, with `commit`.
    """

    KEY: ClassVar[str] = "handover/{city}"
    REPLY: ClassVar[type[Message]] = HandoverReply
    SERVER: ClassVar[str] = "the world behind the border"
    HAS_EFFECT: ClassVar[bool] = False  # for the audit log: traffic is no deed of anybody

    city: CityName
    phase: Literal["reserve", "commit"]
    vehicle: HandedName
    epoch: int
    lane: LaneName
    border: Pose
    car: CarName
    digest: str
    state: HandedCar | None = None


MESSAGE = HandoverRequest
