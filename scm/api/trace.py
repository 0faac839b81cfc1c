"""W3C trace context: the id that a caller gives a piece of work, or a new one, in answer and log.

A caller sends `traceparent: 00-<trace id>-<span id>-<flags>`; the trace id comes back in the header
`Trace-Id`, in problems, and with every failed request in the server's log. Requests to the city
carry the id along, a wheel's that of its connection: the part that serves one notes the id
in log and audit.
"""

import logging
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar
from urllib.parse import quote

import msgspec
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from scm.log import event
from scm.v2x.message import Request

R = TypeVar("R", bound=Request)
HEADER = "Trace-Id"
_PARENT = re.compile(r"(?!ff)[0-9a-f]{2}-(?!0{32})([0-9a-f]{32})-(?!0{16})[0-9a-f]{16}-[0-9a-f]{2}")
_LOGGER = logging.getLogger(__name__)
_current: ContextVar[str] = ContextVar("trace_id", default="")
_actor: ContextVar[str] = ContextVar("actor", default="")


def trace_id() -> str:
    """Return the id of the request that is being answered; empty outside of one."""
    return _current.get()


def trace_id_of(traceparent: str) -> str:
    """Return the trace id of a `traceparent`, or a new one where that cannot be read."""
    match = _PARENT.match(traceparent)
    return match[1] if match is not None else secrets.token_hex(16)


def traced(request: R) -> R:
    """Return a request to the city with the trace of what is being answered, and its caller."""
    return msgspec.structs.replace(request, trace_id=trace_id(), actor=_actor.get())


@contextmanager
def acting(actor: str) -> Iterator[None]:
    """Note the caller, for all requests to the city meanwhile."""
    token = _actor.set(actor)
    try:
        yield
    finally:
        _actor.reset(token)


class Traced:
    """ASGI middleware, outermost of all: every answer carries its trace id."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request under its trace id."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        own = trace_id_of(Headers(scope=scope).get("traceparent", ""))
        token = _current.set(own)

        async def send_traced(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message)[HEADER] = own
                if message["status"] >= 500:
                    _log_request(scope, message["status"], own)
            await send(message)

        try:
            await self._app(scope, receive, send_traced)
        finally:
            _current.reset(token)


def _log_request(scope: Scope, status: int, own: str) -> None:
    path = quote(str(scope["path"]))  # which may hold lines, and would write them into the log
    facts = {"method": scope["method"], "path": path, "status": status, "trace_id": own}
    event(_LOGGER, "request_failed", level=logging.WARNING, **facts)
