"""Records of keys.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

import msgspec


class KeyRow(msgspec.Struct, kw_only=True, frozen=True):
    """An API key without its secret.

    Attributes:
        id: Public part of the key.
        owner: Whose it is.
        role: What it is in the city, or what its holder may do.
        made_s: When it was made, seconds since 1970.
    """

    id: str
    owner: str
    role: Literal["admin", "engineer", "operator", "viewer"]
    made_s: int


class AllKeys(msgspec.Struct, kw_only=True, frozen=True):
    """All API keys.

    Attributes:
        keys: By their id.
    """

    keys: tuple[KeyRow, ...]
