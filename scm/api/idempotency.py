"""Idempotency-Key: a change that is requested twice is done once, and answered twice.

The answer is stored for a caller and key, with a digest of the request. The same request again
gets the stored answer with `Idempotency-Replayed: true`; another request under the key is 422
`idempotency_mismatch`; one that comes while the first is under way is 409 `in_flight`. A refusal
had no effect and is not stored: a retry tries again. After a failure of the server it is unknown
whether there was an effect: the request runs again, and the key, which it carries to the bus as
its id, keeps the effect single; but no other request may use it.
"""

import hashlib
from collections import OrderedDict
from dataclasses import dataclass, field

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from scm.api.gate import caller_of
from scm.api.problem import problem
from scm.clock import NS_PER_S, Clock

MAX_ANSWERS = 2000
STORED_NS = 3600 * NS_PER_S
LARGEST_KEY = 128
LARGEST_ANSWER = 256 * 1024
LARGEST_DIGESTED = 1024 * 1024
CHANGES = frozenset({"POST", "PUT", "PATCH", "DELETE"})
_HEADERS = frozenset({"content-type", "location", "etag", "link", "cache-control"})


@dataclass(slots=True)
class _Answer:
    status: int = 0
    headers: list[tuple[bytes, bytes]] = field(default_factory=list)
    body: bytes = b""
    is_whole: bool = False
    is_too_large: bool = False
    sets_cookie: bool = False

    def note(self, message: Message) -> None:
        """Keep a piece of an answer that is being sent."""
        if message["type"] == "http.response.start":
            self.status = message["status"]
            named = [(name.decode("latin-1").lower(), value) for name, value in message["headers"]]
            self.sets_cookie = any(name == "set-cookie" for name, _ in named)
            self.headers = [(name.encode(), value) for name, value in named if name in _HEADERS]
        elif message["type"] == "http.response.body":
            piece = message.get("body", b"")
            self.is_too_large = self.is_too_large or len(self.body) + len(piece) > LARGEST_ANSWER
            if not self.is_too_large:
                self.body += piece
            self.is_whole = not message.get("more_body", False)

    @property
    def can_be_stored(self) -> bool:
        """Whether the change took effect, the answer is all here, and it holds no secret."""
        is_here = self.is_whole and not self.is_too_large and not self.sets_cookie
        return 200 <= self.status < 300 and is_here

    def again(self) -> Response:
        """Return the same answer, marked as such."""
        response = Response(self.body, self.status)
        response.raw_headers = [
            *self.headers,
            (b"content-length", str(len(self.body)).encode()),
            (b"idempotency-replayed", b"true"),
        ]
        return response


@dataclass(slots=True)
class _Entry:
    digest: bytes
    since_ns: int
    answer: _Answer | None = None
    in_flight: bool = True


class Idempotent:
    """ASGI middleware behind the gate, which knows who calls."""

    def __init__(self, app: ASGIApp, *, clock: Clock) -> None:
        self._app = app
        self._clock = clock
        self._entries: OrderedDict[tuple[str, str], _Entry] = OrderedDict()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Do a change, or answer it as before."""
        key = _key_of(scope)
        if not key:
            await self._app(scope, receive, send)
            return
        body = await _read(receive)
        digest = _digest(scope, body)
        mine = (caller_of(scope), key)
        self._forget()
        known = self._entries.get(mine)
        if known is not None and (known.digest != digest or known.in_flight or known.answer):
            await _as_known(known, digest, key, scope)(scope, receive, send)
            return
        entry = self._entries[mine] = _Entry(digest, self._clock.now_ns())
        answer = _Answer()

        async def send_noted(message: Message) -> None:
            answer.note(message)
            await send(message)

        try:
            _name_caller(scope, key)
            await self._app(scope, _again(body, receive), send_noted)
        finally:
            self._store(mine, entry, answer)

    def _store(self, mine: tuple[str, str], entry: _Entry, answer: _Answer) -> None:
        entry.in_flight = False
        if answer.can_be_stored:
            entry.answer = answer
        elif 0 < answer.status < 500:
            self._entries.pop(mine, None)

    def _forget(self) -> None:
        oldest_ns = self._clock.now_ns() - STORED_NS
        while self._entries:
            mine, entry = next(iter(self._entries.items()))
            if len(self._entries) <= MAX_ANSWERS and entry.since_ns >= oldest_ns:
                return
            del self._entries[mine]


def _key_of(scope: Scope) -> str:
    """Return the key of a change; empty: there is none, or the route itself will refuse it."""
    if scope["type"] != "http" or scope["method"] not in CHANGES:
        return ""
    key = Headers(scope=scope).get("idempotency-key", "")
    return key if len(key) <= LARGEST_KEY else ""


def _name_caller(scope: Scope, key: str) -> None:
    """Put the caller's name before a key, where callers have one.

    The key is the request's id on the bus, which knows no callers: two who
    count from 1 must not get one another's answers.
    """
    if scope.get("scm_key"):
        own = f"{caller_of(scope)}.{key}"
        if len(own) > LARGEST_KEY:
            own = f"{caller_of(scope)}.{hashlib.sha256(key.encode()).hexdigest()}"
        MutableHeaders(scope=scope)["Idempotency-Key"] = own


def _as_known(known: _Entry, digest: bytes, key: str, scope: Scope) -> Response:
    if known.digest != digest:
        detail = f"Idempotency-Key {key!r}: got another request than before; expected a new key"
        return problem(422, "idempotency_mismatch", detail, instance=scope["path"])
    if known.answer is None:
        detail = f"Idempotency-Key {key!r}: the first request is still under way; try again"
        refused = problem(409, "in_flight", detail, instance=scope["path"])
        refused.headers["Retry-After"] = "1"
        return refused
    return known.answer.again()


async def _read(receive: Receive) -> list[Message]:
    """Return the pieces of a body, as far as they count for its digest."""
    pieces: list[Message] = []
    size = 0
    while size < LARGEST_DIGESTED:
        message = await receive()
        pieces.append(message)
        size += len(message.get("body", b""))
        if message["type"] != "http.request" or not message.get("more_body", False):
            break
    return pieces


def _again(pieces: list[Message], receive: Receive) -> Receive:
    """Return a `receive` that gives pieces already read, then continues."""
    left = iter(pieces)

    async def replay() -> Message:
        for message in left:
            return message
        return await receive()

    return replay


def _digest(scope: Scope, pieces: list[Message]) -> bytes:
    """Return what identifies this request: of a large body its first MiB and its length."""
    digest = hashlib.sha256(f"{scope['method']} {scope['path']}?".encode())
    digest.update(scope["query_string"] + b"\n")
    digest.update(Headers(scope=scope).get("content-length", "").encode() + b"\n")
    for message in pieces:
        digest.update(message.get("body", b""))
    return digest.digest()
