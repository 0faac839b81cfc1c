"""Copies of one message on several keys: a frame of the air reaches many receivers.

They differ in the first variable part of their key, which is their first field too, and are
the same byte for byte after it. Who wants such a message once need not read it seven times.
"""

from functools import lru_cache

from scm.v2x.key import names_in
from scm.v2x.message import Message

MIN_REMEMBERED = 2048
"""As many are remembered at least, twice as many at most: two seconds of a thousand cars."""


class Copies:
    """What was read lately of messages that come in copies."""

    def __init__(self) -> None:
        self._new: set[bytes] = set()
        self._old: set[bytes] = set()

    def has(self, content: bytes) -> bool:
        """Return whether the same was read before, on whichever key."""
        return content in self._new or content in self._old

    def add(self, content: bytes) -> None:
        """Remember what was read."""
        if len(self._new) >= MIN_REMEMBERED:
            self._new, self._old = set(), self._new
        self._new.add(content)


def content_of(kind: type[Message], key: str, body: bytes) -> bytes | None:
    """Return what all copies of a message share; None: it does not begin as its key says."""
    head, cut = _head(kind, key)
    return body[cut:] if head and body.startswith(head) else None


@lru_cache(maxsize=65536)
def _head(kind: type[Message], key: str) -> tuple[bytes, int]:
    """Return how the text of a message on a key begins, and where the part of one copy ends."""
    names = names_in(kind, key)
    if names is None:
        return b"", 0
    words = [f'"{field}":"{name}",' for field, name in names]
    return ("{" + "".join(words)).encode(), 1 + len(words[0])
