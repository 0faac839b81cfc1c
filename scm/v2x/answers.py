"""Stored answers by request id: a repeated request gets the stored answer, so its effect is once.

An answer is stored for `RETENTION_NS`, at least for `MIN_RETENTION_NS`: if the cache is full of
younger answers, new requests are refused. A request id belongs to one request: with other content
it is refused, even while the first one is still being processed.
"""

import hashlib
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, cast

import msgspec

from scm.clock import NS_PER_S
from scm.errors import MessageError
from scm.v2x.exchange import Answer, Incoming
from scm.v2x.message import Message, Refused, Request, decode, encode

RETENTION_NS = 24 * 3600 * NS_PER_S
MIN_RETENTION_NS = 600 * NS_PER_S
MAX_ANSWERS = 65_536
MAX_WAITING = 64
MAX_ID_LENGTH = 256
TRANSIENT = ("offline", "timeout")


class StoredAnswer(msgspec.Struct, kw_only=True, frozen=True):
    """A stored answer.

    Attributes:
        t_ns: When the request arrived.
        digest: Of the request with its id, without its trace; `asked` in the store.
        refused: Whether the reply is a `Refused`.
        reply: The reply as JSON.
    """

    t_ns: int
    digest: str = msgspec.field(name="asked")
    refused: bool
    reply: msgspec.Raw


@dataclass(slots=True)
class _Waiting:
    """A request in progress, and all copies of it."""

    digest: str
    items: list[Incoming] = field(default_factory=list)


class AnswerCache:
    """The stored answers of one station.

    Args:
        stored: Answers of earlier runs, by key.
        most: Maximum number of stored answers.

    Attributes:
        dropped: Keys that can be deleted from a store; the reader empties the list.
    """

    def __init__(
        self, stored: Mapping[str, StoredAnswer] | None = None, most: int = MAX_ANSWERS
    ) -> None:
        by_age = sorted((stored or {}).items(), key=lambda item: item[1].t_ns)
        self._answers = OrderedDict(by_age[-most:])
        self._waiting: dict[str, _Waiting] = {}
        self._most = most
        self.dropped = [key for key, _ in by_age[:-most]]

    def check(self, item: Incoming, closed: str = "") -> Answer | Literal["do", "wait"]:
        """Return a request's stored answer, or whether to do it now or to wait for a running one.

        Args:
            item: The request.
            closed: Why no new requests are accepted now; empty: they are.
        """
        request = _request(item)
        if not request.request_id:
            return _no(item, "offline", closed) if closed else "do"
        if len(request.request_id) > MAX_ID_LENGTH:
            got = len(request.request_id)
            detail = f"request_id: got {got} characters, expected at most {MAX_ID_LENGTH}"
            return _no(item, "invalid", detail)
        self._forget(item.t_ns)
        key, digest = key_of(request), _digest(request)
        known = self._answers.get(key) or self._waiting.get(key)
        if known is not None:
            return _again(item, known, digest)
        if not closed and not self._has_room(item.t_ns):
            closed = f"{len(self._answers)} answers are stored already: try again later"
        if closed:
            return _no(item, "offline", closed)
        self._waiting[key] = _Waiting(digest, [item])
        return "do"

    def record(self, answer: Answer) -> tuple[str, StoredAnswer] | None:
        """Return an answer's key and stored form, or None if it is not stored.

        Refusals for a temporary reason are not stored, so that a repeated request can succeed.
        """
        request, reply = _request(answer.to), answer.reply
        if not request.request_id or (isinstance(reply, Refused) and reply.code in TRANSIENT):
            return None
        return key_of(request), StoredAnswer(
            t_ns=answer.to.t_ns,
            digest=_digest(request),
            refused=isinstance(answer.reply, Refused),
            reply=msgspec.Raw(encode(answer.reply)[0]),
        )

    def complete(self, answer: Answer) -> list[Answer]:
        """Store an answer and return it for every copy of its request.

        A second answer to the same request is ignored.
        """
        request = _request(answer.to)
        if not request.request_id:
            return [answer]
        key, record = key_of(request), self.record(answer)
        if key in self._answers:
            return []
        if record is not None:
            self._answers[key] = record[1]
        waiting = self._waiting.pop(key, None)
        others = waiting.items if waiting is not None else []
        mine = [item for item in others if item is not answer.to]
        return [answer, *(Answer(item, answer.reply) for item in mine)]

    def _has_room(self, now_ns: int) -> bool:
        if len(self._answers) + len(self._waiting) < self._most:
            return True
        oldest = next(iter(self._answers.values()), None)
        if oldest is None or now_ns - oldest.t_ns < MIN_RETENTION_NS:
            return False
        self._drop_oldest()
        return True

    def _forget(self, now_ns: int) -> None:
        while self._answers and now_ns - next(iter(self._answers.values())).t_ns > RETENTION_NS:
            self._drop_oldest()

    def _drop_oldest(self) -> None:
        self.dropped.append(self._answers.popitem(last=False)[0])


def _again(item: Incoming, known: StoredAnswer | _Waiting, digest: str) -> Answer | Literal["wait"]:
    """Return the result for a request whose id is known."""
    request = _request(item)
    if known.digest != digest:
        detail = f"request_id: {request.request_id!r} was used for another request already"
        return _no(item, "invalid", detail)
    if isinstance(known, StoredAnswer):
        return Answer(item, _reply(request, known))
    if len(known.items) < MAX_WAITING:
        known.items.append(item)
    return "wait"


def key_of(request: Request) -> str:
    """Return the key of a request's answer: short and valid for any request id."""
    digest = hashlib.blake2b(request.request_id.encode(), digest_size=16).hexdigest()
    return f"{type(request).__name__}/{digest}"


def _digest(request: Request) -> str:
    untraced = msgspec.structs.replace(request, trace_id="", actor="")
    return hashlib.blake2b(encode(untraced)[0], digest_size=16).hexdigest()


def _request(item: Incoming) -> Request:
    return cast("Request", item.message)


def _reply(request: Request, stored: StoredAnswer) -> Message:
    kind = Refused if stored.refused else request.REPLY
    try:
        return decode(kind, bytes(stored.reply))
    except MessageError as cause:  # stored by another version: the request was done
        detail = f"request_id: {request.request_id!r} was answered already; {cause}"
        return Refused(code="invalid", detail=detail)


def _no(item: Incoming, code: str, detail: str) -> Answer:
    return Answer(item, Refused(code=code, detail=detail))
