"""Leases: who drives a car."""

from typing import Annotated

import msgspec
from msgspec import Meta

from scm.records.body import Body
from scm.records.fields import OwnerName, VehicleName


class LeaseRow(msgspec.Struct, kw_only=True, frozen=True):
    """Who drives a car.

    Attributes:
        owner: `world` or the car's own name if it is free.
        epoch: Grows with each change of owner; commands carry it.
        left_ms: Until it ends if it is not renewed; None: it is at home, and never ends.
    """

    vehicle: VehicleName
    owner: OwnerName
    epoch: int
    left_ms: float | None


class AcquireBody(Body, kw_only=True, frozen=True):
    """A car to drive."""

    program: Annotated[
        str,
        Meta(
            pattern=r"^[a-z0-9_-]{0,32}$",
            description="distinguishes programs of one caller: each holds its own leases",
            examples=["lane_keeper"],
        ),
    ] = ""
    ttl_ms: Annotated[
        int,
        Meta(
            ge=100, le=60000, description="how long it lives unless renewed [ms]", examples=[1000]
        ),
    ] = 1000
    reason: Annotated[
        str,
        Meta(
            max_length=500,
            description="why it is taken over from its owner; empty: only if it is free",
            examples=["n1 blocks the crossing"],
        ),
    ] = ""


class RenewBody(Body, kw_only=True, frozen=True):
    """A lease to keep."""

    program: Annotated[
        str,
        Meta(
            pattern=r"^[a-z0-9_-]{0,32}$",
            description="as when it was taken",
            examples=["lane_keeper"],
        ),
    ] = ""
    epoch: Annotated[int, Meta(ge=0, description="as the lease was given", examples=[12])]
    ttl_ms: Annotated[
        int,
        Meta(
            ge=100, le=60000, description="how long it lives unless renewed [ms]", examples=[1000]
        ),
    ] = 1000
