"""The command of the lease's owner to a car: throttle and steering."""

from typing import ClassVar, Literal

from scm.v2x.message import Delivery, Message


class DriveCommand(Message, kw_only=True, frozen=True):
    """Throttle and steering for the next instant; silence is a stop.

    Attributes:
        epoch: Of the sender's lease; a car ignores commands of an older epoch than it has seen.
        seq: Counts up within an epoch; a repeated or older one is ignored.
        throttle: -1 to 1, + forward.
        steering: -1 to 1 of the car's steering limit, + = left.
        headlights, indicators: How the lights are switched from now on; None: as they were.
    """

    KEY: ClassVar[str] = "v/{vehicle}/cmd/drive"
    RATE_HZ: ClassVar[float | None] = 20.0
    DELIVERY: ClassVar[Delivery] = Delivery.COMMAND

    vehicle: str
    t_ns: int
    epoch: int
    seq: int
    throttle: float
    steering: float
    headlights: Literal["off", "low", "high"] | None = None
    indicators: Literal["off", "left", "right", "hazard"] | None = None


MESSAGE = DriveCommand
