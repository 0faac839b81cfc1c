"""The audit trail as the web sees it: what was changed through it, added; what all did, read.

World and signals note each request that they obey themselves (`scm.store.audit`). What the web
changes beyond that, its own files, jobs, keys and acknowledgements, it notes here, and every
refusal of a change too: who, from where, what, how it ended, how long it took.
"""

import asyncio
import logging
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import msgspec
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from scm.api.audit_text import AuditText
from scm.api.event_log import as_read
from scm.api.idempotency import CHANGES
from scm.api.trace import trace_id
from scm.clock import Clock
from scm.errors import StoreError
from scm.records.audit import AuditRow
from scm.store.audit import AuditLog, Deed
from scm.store.repository import Repository

_LOGGER = logging.getLogger(__name__)

STATION = "api"
BLOCK = 500
MOST_LOOKED_AT = 20_000


class AuditFilter(msgspec.Struct, kw_only=True, frozen=True):
    """Which entries are wanted; an empty field matches everything.

    Attributes:
        station: Who did it.
        by: Who requested it: a part of the name.
        kind: A part of the request's class or path.
        text: To be found anywhere in the entry; case does not matter, nor underscores or spaces.
    """

    station: str = ""
    by: str = ""
    kind: str = ""
    text: str = ""

    def passes(self, row: AuditRow) -> bool:
        """Return whether an entry is wanted."""
        return (
            self.station in ("", row.station)
            and self.by.casefold() in row.by.casefold()
            and self.kind.casefold() in row.kind.casefold()
            and (not self.text or as_read(self.text) in as_read(_text(row)))
        )


def newest_first(store: Repository, words: AuditText) -> Iterator[AuditRow]:
    """Yield entries newest first, at most `MOST_LOOKED_AT`."""
    log = AuditLog(store)
    last = log.head().number
    first = max(0, last - MOST_LOOKED_AT)
    while last > first:
        start = max(first, last - BLOCK)
        block = []
        for at, deed in log.deeds(start):
            if at > last:
                break
            block.append(_row(at, deed, words))
        yield from reversed(block)
        last = start


class Audited:
    """ASGI middleware behind the gate: notes every change, whether it was done or refused.

    It has a thread of its own: a store that is slow must not keep those waiting that renew leases.
    """

    def __init__(self, app: ASGIApp, *, store: Repository, clock: Clock) -> None:
        self._app = app
        self._log = AuditLog(store)
        self._clock = clock
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="audit")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, and note it when it was to change something."""
        if scope["type"] != "http" or scope["method"] not in CHANGES:
            await self._app(scope, receive, send)
            return
        began_ns = self._clock.now_ns()
        status = 500
        sizes = {"received": 0}

        async def counted() -> Message:
            message = await receive()
            sizes["received"] += len(message.get("body", b""))
            return message

        async def send_noted(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            await self._app(scope, counted, send_noted)
        finally:
            deed = _deed(scope, status, sizes["received"], began_ns, self._clock.now_ns())
            await asyncio.get_running_loop().run_in_executor(self._thread, self._note, deed)

    def _note(self, deed: Deed) -> None:
        try:
            self._log.note(deed)
        except StoreError as failure:  # the change is done: a failure would be a false reply
            _LOGGER.error("audit_failed kind=%r: %s", deed.kind, failure)  # noqa: TRY400


def _deed(scope: Scope, status: int, received: int, began_ns: int, ended_ns: int) -> Deed:
    client = scope.get("client")
    headers = dict(scope["headers"])
    request = {
        "role": scope.get("scm_role", ""),
        "address": str(client[0]) if client else "",
        "query": scope["query_string"].decode("latin-1")[:500],
        "bytes": received,
        "trace_id": trace_id(),
    }
    done = {"status": status, "ms": round((ended_ns - began_ns) / 1e6, 1)}
    return Deed(
        t_ns=began_ns,
        station=STATION,
        kind=f"{scope['method']} {scope['path']}"[:300],
        by=str(scope.get("scm_actor", "")),
        request_id=headers.get(b"idempotency-key", b"").decode("latin-1")[:128],
        request=_raw(request),
        reply=_raw(done),
    )


def _raw(body: object) -> msgspec.Raw:
    return msgspec.Raw(msgspec.json.encode(body))


def _row(number: int, deed: Deed, words: AuditText) -> AuditRow:
    request = _object(deed.request)
    return AuditRow(
        number=number,
        t_ns=deed.t_ns,
        station=deed.station,
        kind=deed.kind,
        text=words.of(deed.kind, request),
        by=deed.by or _self_named(deed.kind, request),
        request_id=deed.request_id,
        trace_id=str(request.get("trace_id", "")),
        request=request,
        reply=_object(deed.reply),
    )


def _self_named(kind: str, request: dict[str, Any]) -> str:
    """Return who made an entry of an older city that noted nobody: a joining car itself."""
    return str(request.get("vehicle", "")) if kind == "JoinRequest" else ""


def _object(raw: msgspec.Raw) -> dict[str, Any]:
    body = msgspec.json.decode(raw)
    return body if isinstance(body, dict) else {"value": body}


def _text(row: AuditRow) -> str:
    return msgspec.json.encode(row).decode()
