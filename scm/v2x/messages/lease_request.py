"""Who may drive a car: leases with an epoch that only ever grows, granted by the world."""

from typing import ClassVar, Literal

from scm.records.fields import OwnerName, VehicleName
from scm.v2x.message import Message, Request


class LeaseReply(Message, kw_only=True, frozen=True):
    """The lease as it stands after the request.

    Attributes:
        owner: Who holds it now; `world` if it is free.
        epoch: To be put into every drive command.
        ttl_ms: How long it lives without renewal.
    """

    KEY: ClassVar[str] = "v/{vehicle}/lease/reply"

    vehicle: VehicleName
    owner: OwnerName
    epoch: int
    ttl_ms: int


class LeaseRequest(Request, kw_only=True, frozen=True):
    """Acquire, renew, release or steal the lease of a car.

    Attributes:
        owner: Who requests it.
        epoch: Of the lease to renew or release; ignored when acquiring.
        reason: Why it is stolen; must be given then, and is put into the event log.
    """

    KEY: ClassVar[str] = "v/{vehicle}/lease"
    REPLY: ClassVar[type[Message]] = LeaseReply
    SERVER: ClassVar[str] = "the world"

    vehicle: str
    owner: str
    verb: Literal["acquire", "renew", "release", "steal"]
    epoch: int = 0
    ttl_ms: int = 1000
    reason: str = ""


MESSAGE = LeaseRequest
