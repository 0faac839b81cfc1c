"""What bodies of requests have in common."""

from typing import Annotated

import msgspec
from msgspec import Meta

By = Annotated[
    str,
    Meta(
        max_length=64,
        description="who requests it, for the log; empty: the caller",
        examples=["ada"],
    ),
]
Reason = Annotated[
    str, Meta(max_length=500, description="why, for the log", examples=["school is out"])
]


class Body(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Base of bodies in JSON: unknown fields are refused."""
