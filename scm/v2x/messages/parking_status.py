"""The bays of a map and the permission to drive to them, from the parking manager."""

from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from scm.records.fields import Name, TNs
from scm.records.floor import Record
from scm.v2x.message import Message


class BayState(Record, kw_only=True, frozen=True):
    """One bay.

    Attributes:
        state: `reserved`: for a car that is yet to park there; `occupied`: a car stands there.
        vehicle: That car; empty: none.
    """

    name: Name
    state: Literal["free", "reserved", "occupied"]
    vehicle: str = ""


class ParkingStatus(Message, kw_only=True, frozen=True):
    """Repeated at 2 Hz and sent at once on change.

    The permission to drive ends by itself, as that in ETSI TS 103 882 (MIM, `expirationTime`) does:
    a car that has not received a newer status by then stands.

    Attributes:
        bays: All bays, in the order of the map file.
        driver: The one car that may drive to its bay now; empty: none.
        permission_ms: How long it may, from when it receives this [ms].
        waiting: Cars that have a bay and wait, in the order of their turns.
        reason: Why nobody may drive though cars wait, in words.
    """

    KEY: ClassVar[str] = "parking/status"
    RATE_HZ: ClassVar[float | None] = 2.0

    t_ns: TNs
    bays: tuple[BayState, ...]
    driver: Annotated[str, Meta(examples=["n2"])] = ""
    permission_ms: int = 2000
    waiting: Annotated[tuple[str, ...], Meta(examples=[["n1", "n3"]])] = ()
    reason: str = ""


MESSAGE = ParkingStatus
