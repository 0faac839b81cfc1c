"""The audit log: who did what, when and by which request, in entries chained by their hashes.

Each entry's body begins with the SHA-256 of the whole body before it, so to change, drop or insert
one breaks the chain from there on. Who could rewrite the whole file could rewrite the whole chain:
keep `head()` somewhere else now and then, and give it to `verify`.
"""

import hashlib
from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from scm.errors import StoreError
from scm.store.repository import Repository

FIRST = "0" * 64
UNREADABLE = "unreadable"
_HEX = 64
_PAGE = 500


class Deed(msgspec.Struct, kw_only=True, frozen=True):
    """One thing that somebody had done.

    Attributes:
        t_ns: When the request arrived, on the clock of whoever did it.
        station: Who did it: `world`, `traffic`.
        kind: The request's class.
        by: Who asked, in their own words; empty: the request does not say.
        request_id: Of the request; empty: it had none.
        request: All of it.
        reply: What was answered.
    """

    t_ns: int
    station: str
    kind: str
    by: str = ""
    request_id: str = ""
    request: msgspec.Raw = msgspec.Raw(b"{}")
    reply: msgspec.Raw = msgspec.Raw(b"{}")


class Head(NamedTuple):
    """The newest entry: its number, and the hash that the next one will hold."""

    number: int
    digest: str


class AuditLog:
    """The audit log of a store."""

    def __init__(self, repository: Repository) -> None:
        self._repository = repository

    def note(self, deed: Deed) -> int:
        """Add an entry; return its number.

        Raises:
            StoreError: when it cannot be stored.
        """
        with (
            self._repository.transaction()
        ):  # between reading the last one and adding nobody writes
            body = self.head().digest.encode() + msgspec.json.encode(deed)
            return self._repository.append("audit", body)

    def head(self) -> Head:
        """Return number and hash of the newest entry; (0, zeros) of an empty log."""
        last = self._repository.last("audit")
        return Head(0, FIRST) if last is None else Head(last.number, _digest(last.body))

    def deeds(self, after: int = 0) -> Iterator[tuple[int, Deed]]:
        """Yield number and content of the entries after a number.

        One that cannot be read comes as the kind `UNREADABLE`, with the cause as its reply: it must
        not hide the others.
        """
        for number, body in self._bodies(after):
            try:
                yield number, msgspec.json.decode(body[_HEX:], type=Deed)
            except (msgspec.MsgspecError, UnicodeDecodeError) as cause:
                why = {"code": UNREADABLE, "detail": f"audit: entry {number}: {cause}"}
                reply = msgspec.Raw(msgspec.json.encode(why))
                yield number, Deed(t_ns=0, station="", kind=UNREADABLE, reply=reply)

    def verify(self, head: Head | None = None) -> Head:
        """Check the whole chain; return its head.

        Args:
            head: As it was noted elsewhere before; the chain must hold it unchanged.

        Raises:
            StoreError: naming the first entry that is broken.
        """
        before = Head(0, FIRST)
        for number, body in self._bodies(0):
            if number != before.number + 1:
                msg = f"audit: entry {before.number + 1} is missing, the next one is {number}"
                raise StoreError(msg)
            if body[:_HEX] != before.digest.encode():
                msg = f"audit: entry {number} does not follow entry {before.number} as it is now"
                raise StoreError(msg)
            before = Head(number, _digest(body))
            if head is not None and number == head.number and before != head:
                msg = f"audit: entry {number} is another one than was noted before"
                raise StoreError(msg)
        if head is not None and before.number < head.number:
            msg = f"audit: entry {before.number + 1} is missing: {head.number} were noted before"
            raise StoreError(msg)
        return before

    def _bodies(self, after: int) -> Iterator[tuple[int, bytes]]:
        while page := self._repository.entries("audit", after, _PAGE):
            yield from page
            after = page[-1].number


def _digest(body: bytes) -> str:
    return hashlib.sha256(body).hexdigest()
