"""A car with dynamics of its own (or a real one) requests to join the city."""

from typing import ClassVar

from scm.v2x.message import Message, Request


class JoinReply(Message, kw_only=True, frozen=True):
    """Welcome: where to start, and the lease under which the agent drives its own car.

    Attributes:
        tag_id: The AprilTag on its roof.
        epoch: Of the agent's lease; renewed by every `VehicleState` it sends.
    """

    KEY: ClassVar[str] = "v/{vehicle}/join/reply"

    vehicle: str
    x_m: float
    y_m: float
    yaw_rad: float
    tag_id: int
    epoch: int
    t_ns: int


class JoinRequest(Request, kw_only=True, frozen=True):
    """Join with a body of one's own.

    Attributes:
        session: The agent's bus session; its disappearance ends the stay.
        kind: `remote` (own dynamics) or `real`.
        car: Car file's name: what the city draws and lets others collide with.
        spawn: Spawn place, or `X,Y,DEG`; empty: the first free one.
        tag_id: The AprilTag that is glued onto its roof; None: it gets the lowest free one.
    """

    KEY: ClassVar[str] = "v/{vehicle}/join"
    REPLY: ClassVar[type[Message]] = JoinReply
    SERVER: ClassVar[str] = "the world"

    vehicle: str
    session: str
    kind: str = "remote"
    car: str = "nigel"
    spawn: str = ""
    tag_id: int | None = None


MESSAGE = JoinRequest
