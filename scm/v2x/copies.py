"""Copies of one message on several keys: one radio frame for many receivers.

Copies differ only in the first variable part of their key, which is also their first field. A
subscriber that wants such a message once reads it once.
"""

from functools import lru_cache

from scm.v2x.key import names_in
from scm.v2x.message import Message

MIN_REMEMBERED = 2048
"""At least this many are remembered, at most twice as many: two seconds of a thousand cars."""


class Copies:
    """The contents of recently read messages."""

    def __init__(self) -> None:
        self._new: set[bytes] = set()
        self._old: set[bytes] = set()

    def has(self, content: bytes) -> bool:
        """Return whether the same content was read before, on any key."""
        return content in self._new or content in self._old

    def add(self, content: bytes) -> None:
        """Remember content that was read."""
        if len(self._new) >= MIN_REMEMBERED:
            self._new, self._old = set(), self._new
        self._new.add(content)


def content_of(kind: type[Message], key: str, body: bytes) -> bytes | None:
    """Return the content that all copies share, or None if the body does not match its key."""
    head, cut = _head(kind, key)
    return body[cut:] if head and body.startswith(head) else None


@lru_cache(maxsize=65536)
def _head(kind: type[Message], key: str) -> tuple[bytes, int]:
    """Return the prefix of messages on a key, and the length of the part that differs."""
    names = names_in(kind, key)
    if names is None:
        return b"", 0
    words = [f'"{field}":"{name}",' for field, name in names]
    return ("{" + "".join(words)).encode(), 1 + len(words[0])
