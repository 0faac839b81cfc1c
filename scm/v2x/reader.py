"""Decode arriving bytes; invalid messages are dropped, counted and logged.

There is at most one log entry per second.
"""

import logging
from collections.abc import Callable

from scm.clock import NS_PER_S, Clock
from scm.errors import MessageError, ScmError
from scm.log import event
from scm.v2x.copies import Copies, content_of
from scm.v2x.exchange import Incoming
from scm.v2x.key import agrees
from scm.v2x.message import Message, decode

_log = logging.getLogger(__name__)


Check = Callable[[Message, int], None]


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
