"""Decode arriving bytes; invalid messages are dropped, counted and logged.

There is at most one log entry per second. Copies of one message on several keys (one radio frame
for many receivers) differ only in the first variable part of their key, which is also their first
field; a subscriber that wants such a message once reads it once.
"""

import logging
from collections.abc import Callable
from functools import lru_cache

from scm.clock import NS_PER_S, Clock
from scm.errors import MessageError, ScmError
from scm.log import event
from scm.v2x.exchange import Incoming
from scm.v2x.key import agrees, names_in
from scm.v2x.message import Message, decode

_log = logging.getLogger(__name__)

MIN_REMEMBERED = 2048
"""At least this many are remembered, at most twice as many: two seconds of a thousand cars."""


Check = Callable[[Message, int], None]


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


class Reader:
    """Decodes the arrivals of one bus.

    Args:
        clock: For the rate of log entries.
        check: Raises a `ScmError` for decodable messages that must not be trusted.

    Attributes:
        rejected: Number of arrivals that could not be decoded or came on a wrong key.
    """

    def __init__(self, clock: Clock, check: Check | None = None) -> None:
        self._clock = clock
        self._check = check
        self._quiet_until_ns: int | None = None
        self._copies = Copies()
        self.rejected = 0

    def read(
        self, kind: type[Message], key: str, body: bytes, attachment: bytes | None, t_ns: int
    ) -> Incoming | None:
        """Return the decoded item, or None when it was dropped."""
        try:
            message = decode(kind, body, attachment)
        except MessageError as cause:
            self.reject(key, str(cause))
            return None
        if not agrees(key, message):
            self.reject(key, "the names inside are not those of its key")
            return None
        if self._check is not None:
            try:
                self._check(message, t_ns)
            except ScmError as cause:
                self.reject(key, str(cause))
                return None
        return Incoming(message, t_ns)

    def read_once(
        self, kind: type[Message], key: str, body: bytes, attachment: bytes | None, t_ns: int
    ) -> Incoming | None:
        """Return the decoded item, or None for a copy of an earlier one.

        Dropped items are not remembered, so they cannot suppress valid ones.
        """
        content = content_of(kind, key, body)
        if content is not None and self._copies.has(content):
            return None
        incoming = self.read(kind, key, body, attachment, t_ns)
        if incoming is not None and content is not None:
            self._copies.add(content)
        return incoming

    def reject(self, key: str, reason: str) -> None:
        """Count and log a rejected item."""
        self.rejected += 1
        now_ns = self._clock.now_ns()
        if self._quiet_until_ns is None or now_ns >= self._quiet_until_ns:
            self._quiet_until_ns = now_ns + NS_PER_S
            event(
                _log,
                "message_rejected",
                level=logging.WARNING,
                key=key,
                reason=reason,
                rejected=self.rejected,
            )


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
