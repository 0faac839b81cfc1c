"""Driving a car by hand: what travels over the WebSocket `scm.drive.v1`, both ways."""

from typing import Annotated

import msgspec

PROTOCOL = "scm.drive.v1"


class Acquired(msgspec.Struct, kw_only=True, frozen=True, tag="taken"):
    """The wheel is yours."""

    vehicle: str
    owner: str
    epoch: int


class DriveStatus(msgspec.Struct, kw_only=True, frozen=True, tag="told"):
    """What became of your newest packet.

    Attributes:
        seq, t_ms: Of that packet, to measure the way; None: none came yet.
        why: `driving`, `released` (no hand on the dead-man) or `silent` (no packet for 250 ms).
        throttle, steering: The command in force.
        mode: The car's, as the world last reported it: `stop` also while the city is stopped.
    """

    seq: int | None
    t_ms: float | None
    why: str
    throttle: float
    steering: float
    mode: str
    speed_mps: float | None


class Over(msgspec.Struct, kw_only=True, frozen=True, tag="over"):
    """You do not hold the wheel: refused, lost, or given back; the connection ends.

    Attributes:
        code: `given_back`, `abandoned`, `lost`, `ended`, or the city's word for its refusal.
    """

    code: str
    detail: str


class AcquirePacket(
    msgspec.Struct, kw_only=True, frozen=True, tag="take", forbid_unknown_fields=True
):
    """The first packet of a person; with a `reason` the car is taken over from its owner."""

    reason: Annotated[str, msgspec.Meta(max_length=500)] = ""


class DrivePacket(
    msgspec.Struct, kw_only=True, frozen=True, tag="drive", forbid_unknown_fields=True
):
    """The command requested now.

    Attributes:
        seq: Counts up, below 2^53: more than that is no exact number in a browser.
        t_ms: On the person's clock; comes back in the answer to this packet.
        held: Whether a hand is on the dead-man: a key, a trigger, a pad.
        throttle: -1 to 1, + = forward.
        steering: -1 to 1, + = left.
    """

    seq: Annotated[int, msgspec.Meta(ge=-(2**53), le=2**53)]
    t_ms: float
    held: bool
    throttle: float
    steering: float


class GiveBackPacket(
    msgspec.Struct, kw_only=True, frozen=True, tag="give_back", forbid_unknown_fields=True
):
    """The last word of a person."""


Packet = AcquirePacket | DrivePacket | GiveBackPacket
