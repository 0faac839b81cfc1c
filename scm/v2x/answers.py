"""Answers by request id: whoever asks again gets the stored one, and the effect happens once.

An answer is kept for `KEPT_NS`, and at the very least for `SURE_NS`: when there is no room without
forgetting a younger one, new requests are refused until there is. A request id belongs to one
request: with another content it is refused, also while the first one is still being worked on.
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
    """An answer as it is stored.

    Attributes:
        t_ns: When the request arrived.
        asked: Digest of the request, its id included, its trace not.
        refused: Whether the reply is a `Refused`.
        reply: The reply as JSON.
    """

    t_ns: int
    digest: str = msgspec.field(name="asked")
    refused: bool
    reply: msgspec.Raw


@dataclass(slots=True)
class _Waiting:
    """A request under way, and all who asked it."""

    digest: str
    items: list[Incoming] = field(default_factory=list)


class AnswerCache:
    """The answers of one station.

    Args:
        stored: Answers of earlier runs, by key.
        most: How many are kept at most.

    Attributes:
        forgotten: Keys that a store need not hold any more; whoever takes them empties the list.
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
        """Return what a request that came in meets: an answer, an order to do it, or a wait.

        Args:
            item: The request.
            closed: Why nothing new can be done now; empty: it can.
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
            closed = f"{len(self._answers)} answers are kept already: ask again later"
        if closed:
            return _no(item, "offline", closed)
        self._waiting[key] = _Waiting(digest, [item])
        return "do"

    def record(self, answer: Answer) -> tuple[str, StoredAnswer] | None:
        """Return what is to be stored of an answer, with its key; None: nothing.

        That something cannot be done just now is not stored: asked again, it may be done.
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
        """Keep an answer that is safe; return it for everybody who waits for it.

        A second answer to the same request changes nothing.
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
    """Return what a request meets whose id came before."""
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
    """Return under what key the answer to a request is stored: safe, short, whatever its id is."""
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
    except MessageError as cause:  # stored by another version: it was done, and stays done
        detail = f"request_id: {request.request_id!r} was answered already; {cause}"
        return Refused(code="invalid", detail=detail)


def _no(item: Incoming, code: str, detail: str) -> Answer:
    return Answer(item, Refused(code=code, detail=detail))
