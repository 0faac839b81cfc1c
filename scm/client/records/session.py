"""Records of session.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

import msgspec


class Session(msgspec.Struct, kw_only=True, frozen=True):
    """Who is calling.

    Attributes:
        owner: Whose key it is; without keys: `this machine`.
        role: What it is in the city, or what its holder may do.
    """

    owner: str
    role: Literal["admin", "engineer", "operator", "viewer"]


class Ended(msgspec.Struct, kw_only=True, frozen=True):
    """The cookie is forgotten: nothing more to say."""
