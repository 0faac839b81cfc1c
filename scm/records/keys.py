"""API keys and the roles they give."""

from typing import Literal

import msgspec

from scm.records.fields import Id, OwnerName

Role = Literal["viewer", "operator", "engineer", "admin"]


class KeyRow(msgspec.Struct, kw_only=True, frozen=True):
    """An API key without its secret.

    Attributes:
        id: Public part of the key.
        owner: Whose it is.
        role: What it is in the city, or what its holder may do.
        made_s: When it was made, seconds since 1970.
    """

    id: Id
    owner: OwnerName
    role: Role
    made_s: int


class AllKeys(msgspec.Struct, kw_only=True, frozen=True):
    """All API keys.

    Attributes:
        keys: By their id.
    """

    keys: tuple[KeyRow, ...]
