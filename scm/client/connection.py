"""Requests to a city over HTTP: typed answers, problems as exceptions, retries.

Reads, and changes that carry an `Idempotency-Key`, are retried when the answer is
lost or the server is busy: under one key an effect happens once.
"""

import re
import threading
import uuid
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import Any, TypeVar
from urllib.parse import quote

import httpx
import msgspec
from websockets.exceptions import InvalidHandshake, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from scm.caller import program_name
from scm.client.key import key_of_environment
from scm.client.stream import Lines, LiveEvent, events_of
from scm.errors import LinkError, MessageError, ScmError
from scm.records.problems import Problem

TRIES = 4
PAUSE_S = 0.25
LONGEST_PAUSE_S = 5.0
SILENT_S = 5.0
AGAIN = frozenset({429, 502, 503, 504})
CONFLICT = 409
_PRODUCT = re.compile(r"[^\x21-\x2e\x30-\x7e]")  # what a product's name in a header cannot hold

T = TypeVar("T")
Values = Mapping[str, Any]


class ProblemError(ScmError):
    """The city refused.

    Attributes:
        problem: Its reason: `code` is for programs, `detail` for people.
    """

    def __init__(self, problem: Problem) -> None:
        super().__init__(f"{problem.status} {problem.code}: {problem.detail}")
        self.problem = problem


class Connection:
    """A connection to the interface of one city.

    Args:
        url: Where its dashboard is: `http://127.0.0.1:8000`.
        key: API key, where the city requires one; empty: of the file in `SCM_API_KEY_FILE`.
        timeout_s: For one answer.
        transport: Another way to the server than the network, for tests.

    Attributes:
        etag: ETag of the last answer; empty: it had none. Give it as `if_match` with a change of
            what that answer stated.
    """

    def __init__(
        self,
        url: str,
        key: str = "",
        *,
        timeout_s: float = 10.0,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        given = key or key_of_environment()
        headers = {"User-Agent": f"{_PRODUCT.sub('_', program_name())} scm-client"}
        headers |= {"Authorization": f"Bearer {given}"} if given else {}
        self._http = httpx.Client(
            base_url=url, headers=headers, timeout=timeout_s, transport=transport
        )
        self._closed = threading.Event()
        self._timeout_s = timeout_s
        self.etag = ""

    def close(self) -> None:
        """End the connection, and streams at their next turn."""
        self._closed.set()
        self._http.close()

    def request(
        self,
        method: str,
        path: str,
        kind: type[T],
        *,
        query: Values | None = None,
        headers: Values | None = None,
        body: Values | None = None,
        key: str | None = None,
    ) -> T:
        """Return the answer.

        Args:
            method: Of HTTP.
            path: Of the resource.
            kind: Of the answer.
            query: What is None is left out; likewise in `headers`.
            headers: Beside the usual ones.
            body: Sent as JSON; what is None is left to the server.
            key: Of a change that may be retried; empty: a new one. None: not a change, or one
                that must not be.

        Raises:
            ProblemError: when the city refuses.
            LinkError: when there is no answer.
            MessageError: when the answer is not of that kind.
        """
        content = None if body is None else msgspec.json.encode(_given(body))
        return _typed(self._send(method, path, query, headers, content, key), kind)

    def send_only(
        self,
        method: str,
        path: str,
        *,
        query: Values | None = None,
        headers: Values | None = None,
        body: Values | None = None,
        key: str | None = None,
    ) -> None:
        """Send a request whose answer has no body; otherwise as `ask`."""
        content = None if body is None else msgspec.json.encode(_given(body))
        self._send(method, path, query, headers, content, key)

    def fetch(
        self,
        path: str,
        *,
        query: Values | None = None,
        headers: Values | None = None,
    ) -> bytes:
        """Return what is no JSON, whole; raises as `ask`."""
        return self._send("GET", path, query, headers, None, None).content

    def send(
        self,
        method: str,
        path: str,
        kind: type[T],
        content: bytes,
        *,
        query: Values | None = None,
        headers: Values | None = None,
        key: str | None = None,
    ) -> T:
        """Send bytes that are no JSON, and return the answer; raises as `ask`."""
        media = "application/octet-stream"
        return _typed(self._send(method, path, query, headers, content, key, media), kind)

    def pieces(
        self, path: str, *, query: Values | None = None, headers: Values | None = None
    ) -> Iterator[bytes]:
        """Yield what is long or endless as it comes; raises as `ask`."""
        try:
            with self._http.stream(
                "GET", path, params=_given(query), headers=_given(headers)
            ) as response:
                _check(response)
                yield from response.iter_bytes()
        except httpx.TransportError as cause:
            raise _no_answer(cause) from cause

    def events(self, path: str, *, query: Values | None = None) -> Iterator[LiveEvent]:
        """Yield events until the caller stops, through losses of the connection.

        Raises:
            ProblemError: when the city refuses.
            LinkError: when the city cannot be reached several times in a row.
        """
        yield from events_of(lambda last_id: self._lines(path, query, last_id), self._pause)

    @contextmanager
    def socket(self, path: str, protocol: str) -> Iterator[ClientConnection]:
        """Open a WebSocket that speaks a protocol, and close it in the end.

        Raises:
            ProblemError: when the city refuses.
            LinkError: when it cannot be reached.
        """
        url, own = self._http.base_url, self._http.headers
        headers = {name: own[name] for name in ("User-Agent", "Authorization") if name in own}
        address = url.copy_with(scheme={"https": "wss"}.get(url.scheme, "ws"))
        with ExitStack() as opened:
            try:
                opening = connect(
                    str(address).rstrip("/") + path,
                    subprotocols=[Subprotocol(protocol)],
                    additional_headers=headers,
                    user_agent_header=None,
                    open_timeout=self._timeout_s,
                    close_timeout=PAUSE_S,
                    max_queue=None,
                )
                socket = opened.enter_context(opening)
            except InvalidStatus as refused:
                answer = refused.response
                raise _problem(answer.status_code, bytes(answer.body or b"")) from None
            except (OSError, InvalidHandshake) as cause:
                raise _no_answer(cause) from cause
            yield socket

    def _lines(self, path: str, query: Values | None, last_id: str) -> Lines:
        headers = {"Last-Event-ID": last_id} if last_id else {}
        timeout = httpx.Timeout(self._timeout_s, read=SILENT_S)
        with self._http.stream(
            "GET", path, params=_given(query), headers=headers, timeout=timeout
        ) as response:
            if response.status_code in AGAIN:  # a server that starts again, behind another one
                raise LinkError(str(_problem(response.status_code, response.read())))
            _check(response)
            yield from response.iter_lines()

    def _send(
        self,
        method: str,
        path: str,
        query: Values | None,
        headers: Values | None,
        content: bytes | None,
        key: str | None,
        media: str = "application/json",
    ) -> httpx.Response:
        carried = _given(headers)
        if content is not None:
            carried["Content-Type"] = media
        if key is not None:
            carried["Idempotency-Key"] = key or uuid.uuid4().hex

        def once() -> httpx.Response:
            return self._http.request(
                method, path, params=_given(query), headers=carried, content=content
            )

        response = self._again(once) if method == "GET" or key is not None else _reach(once)
        _check(response)
        self.etag = response.headers.get("ETag", "")
        return response

    def _again(self, once: Callable[[], httpx.Response]) -> httpx.Response:
        """Return an answer, with retries while they may help."""
        for number in range(TRIES - 1):
            try:
                response = _reach(once)
            except LinkError:
                self._pause(number)
                continue
            if response.status_code not in AGAIN and not _is_under_way(response):
                return response
            self._pause(number, response.headers.get("Retry-After", ""))
        return _reach(once)

    def _pause(self, number: int, at_least: str = "") -> bool:
        """Wait before trying again; return whether the connection was closed meanwhile."""
        at_least_s = float(at_least) if at_least.isascii() and at_least.isdigit() else 0.0
        pause_s = max(at_least_s, PAUSE_S * 2.0**number)
        return self._closed.wait(min(pause_s, LONGEST_PAUSE_S))


def part(value: str) -> str:
    """Return a value as a part of a path."""
    return quote(value, safe="")


def _given(values: Values | None) -> dict[str, Any]:
    return {name: value for name, value in (values or {}).items() if value is not None}


def _reach(once: Callable[[], httpx.Response]) -> httpx.Response:
    try:
        return once()
    except httpx.TransportError as cause:
        raise _no_answer(cause) from cause


def _typed(response: httpx.Response, kind: type[T]) -> T:
    """Return the record that an answer holds."""
    try:
        return msgspec.json.decode(response.content, type=kind)
    except msgspec.MsgspecError as cause:
        request = f"{response.request.method} {response.request.url.path}"
        msg = f"{request}: {cause}; expected {kind}: is the server another version?"
        raise MessageError(msg) from cause


def _is_under_way(response: httpx.Response) -> bool:
    """Return whether the city is still at the same change, whose first answer was lost."""
    return response.status_code == CONFLICT and _parsed(response.read()).code == "in_flight"


def _no_answer(cause: Exception) -> LinkError:
    why = f"{type(cause).__name__}: {cause}"
    return LinkError(f"no answer from the city: {why}; is `scm up` running?")


def _check(response: httpx.Response) -> None:
    """Raise what the city refused."""
    if not response.is_success:
        raise _problem(response.status_code, response.read())


def _problem(status: int, body: bytes) -> ProblemError:
    return ProblemError(_parsed(body, status))


def _parsed(body: bytes, status: int = 0) -> Problem:
    """Return the problem in an answer; an answer of another form, of a proxy, is its text."""
    absent = {"type": "about:blank", "title": "", "status": status, "code": ""}
    try:
        return msgspec.convert(absent | msgspec.json.decode(body, type=dict[str, Any]), Problem)
    except msgspec.MsgspecError:
        return msgspec.convert(absent | {"detail": body.decode(errors="replace")[:200]}, Problem)
