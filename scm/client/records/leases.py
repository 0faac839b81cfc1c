"""Records of leases.

Written by docs/make/client.py: do not change it here.
"""

import msgspec


class LeaseRow(msgspec.Struct, kw_only=True, frozen=True):
    """Who drives a car.

    Attributes:
        vehicle: Name of a car.
        owner: `world` or the car's own name while nobody else does.
        epoch: Grows with each change of owner; commands carry it.
        left_ms: Until it ends if it is not renewed; None: it is at home, and never ends.
    """

    vehicle: str
    owner: str
    epoch: int
    left_ms: float | None


class PageLeaseRow(msgspec.Struct, kw_only=True, frozen=True):
    """Some rows of a list.

    Attributes:
        items: The rows of this page.
        next_: Cursor of those after them; null at the end.
    """

    items: tuple[LeaseRow, ...]
    next_: str | None = msgspec.field(name="next")


class LeaseReply(msgspec.Struct, kw_only=True, frozen=True):
    """The lease as it stands after the request.

    Attributes:
        vehicle: Name of a car.
        owner: Who holds it now; `world` when nobody else does.
        epoch: To be put into every drive command.
        ttl_ms: How long it lives without renewal.
    """

    vehicle: str
    owner: str
    epoch: int
    ttl_ms: int
