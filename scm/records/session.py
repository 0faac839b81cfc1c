"""The session of a browser."""

import msgspec

from scm.records.fields import OwnerName
from scm.records.keys import Role


class Session(msgspec.Struct, kw_only=True, frozen=True):
    """Who is calling.

    Attributes:
        owner: Whose key it is; without keys: `this machine`.
        role: What it is in the city, or what its holder may do.
    """

    owner: OwnerName
    role: Role


class Ended(msgspec.Struct, kw_only=True, frozen=True):
    """The cookie is removed."""
