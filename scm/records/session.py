"""The session of a browser."""

import msgspec

from scm.records.keys import Role


class Session(msgspec.Struct, kw_only=True, frozen=True):
    """Who is calling.

    Attributes:
        owner: Whose key it is; without keys: `this machine`.
    """

    owner: str
    role: Role


class Ended(msgspec.Struct, kw_only=True, frozen=True):
    """The cookie is removed."""
