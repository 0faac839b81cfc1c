"""What is checked before any route runs: where a request comes from, and whose it is.

Without keys the interface is for this machine only, and whoever calls is its admin: the bind
address must be loopback, and the Host header must name it, so that a web page elsewhere cannot
reach it by renaming itself (DNS rebinding). With keys, everything below `/api` and `/ngsi-ld`, and
`/metrics`, needs one. Changes must come from our own pages or from programs: a browser tells its
origin, which has to be our host or one that may; a page that sends a key in the header may be
anywhere, for none elsewhere can without our consent. With keys a change must carry its key in the
header: the cookie, which pages have for streams and pictures, is for reading.
A WebSocket is a change from its first byte. Pages cannot give it a header, nor may a key stand in
an address, which is logged: they offer it as the subprotocol `scm.key.<key>`, which is not chosen.
Endless streams check again as they run: an expired key ends its streams.
"""

import base64
import hashlib
import logging
import math
import re
from collections.abc import Collection
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from scm.api.auth_throttle import REFILL_PER_S, Brake
from scm.api.keys import KeyRing
from scm.api.known_keys import Known, KnownKeys
from scm.api.problem import problem
from scm.api.trace import acting
from scm.clock import NS_PER_S, Clock, WallClock
from scm.errors import RunError, StoreError
from scm.log import event
from scm.v2x.access import is_loopback

LOOPBACK_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})
COOKIE = "scm_key"
KEY_PROTOCOL = "scm.key."
GUARDED = ("/api/", "/ngsi-ld/", "/metrics")
OPEN = frozenset({"/api/v1/openapi.json"})
STOP = "/api/v1/stop"
RETRY_S = str(math.ceil(1.0 / REFILL_PER_S))
KEY_LOOKED_NS = NS_PER_S
DASHBOARD = "dashboard"
MAX_PROGRAM = 64  # characters of a program's name
_SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
_INLINE_SCRIPT = re.compile(r"<script(?![^>]*\bsrc=)[^>]*>(.*?)</script>", re.DOTALL)

_Refusal = tuple[int, str, str]


class _KeyEndedError(Exception):
    """The key of an answer that is being given."""


_log = logging.getLogger(__name__)


def check_bind(host: str, keys: KeyRing | None) -> None:
    """Refuse to serve the network to everybody.

    Raises:
        RunError: when `host` is not loopback and there is no key that anybody could have.
    """
    if not is_loopback(host) and (keys is None or next(keys.records(), None) is None):
        msg = (
            f"api host: got {host!r} without an API key, which would let everybody on the network "
            "drive the city; expected 127.0.0.1, or a store of keys (`scm key add`, --keys)"
        )
        raise RunError(msg)


def content_policy(page: str) -> str:
    """Return the Content-Security-Policy for a page: only our own files, and its inline scripts."""
    hashes = [
        "'sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() + "'"
        for text in _INLINE_SCRIPT.findall(page)
    ]
    scripts = " ".join(["'self'", *hashes])
    return (
        f"default-src 'none'; script-src {scripts}; style-src 'self'; "
        "img-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'; "
        "frame-ancestors 'none'"
    )


class Gate:
    """ASGI middleware: host, origin and key on the way in, security headers on the way out.

    A route finds in the scope whose request it is: `scm_role`, `scm_owner`, `scm_key`, and who
    calls, in words: `scm_actor`; the stop also whether the store of keys said so just now:
    `scm_is_sure`.
    """

    def __init__(
        self,
        app: ASGIApp,
        *,
        keys: KnownKeys | None,
        policy: str,
        origins: Collection[str] = (),
        brake: Brake | None = None,
        clock: Clock | None = None,
    ) -> None:
        self._app = app
        self._keys = keys
        self._sites = frozenset(filter(None, map(_site_of, origins)))
        self._clock = clock or WallClock()
        self._brake = brake or Brake(self._clock)
        self._headers = {
            "Content-Security-Policy": policy,
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Cross-Origin-Resource-Policy": "same-origin",
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request pass, or answer it with a problem."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return

        async def send_guarded(message: Message) -> None:
            if message["type"] in ("http.response.start", "websocket.http.response.start"):
                own = MutableHeaders(scope=message)
                for name, value in self._headers.items():
                    own.setdefault(name, value)
            await send(message)

        headers = Headers(scope=scope)
        is_safe = scope["type"] == "http" and scope["method"] in _SAFE_METHODS
        refusal = self._refusal(headers, is_safe=is_safe) or await self._admit(
            scope, headers, is_safe=is_safe
        )
        if refusal is None:
            await self._pass(scope, receive, send_guarded)
            return
        status, code, detail = refusal
        response = problem(status, code, detail, instance=scope["path"])
        if status == HTTPStatus.TOO_MANY_REQUESTS:
            response.headers["Retry-After"] = RETRY_S
        await response(scope, receive, send_guarded)

    async def _pass(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request in; end an answer without end when its key ends."""
        scope["scm_actor"] = _actor_of(scope)
        with acting(scope["scm_actor"]):
            await self._pass_while_known(scope, receive, send)

    async def _pass_while_known(self, scope: Scope, receive: Receive, send: Send) -> None:
        key = str(scope.get("scm_key", ""))
        if self._keys is None or scope["type"] != "http" or not key:
            await self._app(scope, receive, send)
            return
        keys, looked_ns, is_endless = self._keys, self._clock.now_ns(), False

        async def send_while_known(message: Message) -> None:
            nonlocal looked_ns, is_endless
            if message["type"] == "http.response.start":
                is_endless = "content-length" not in Headers(raw=message["headers"])
            elif is_endless and self._clock.now_ns() - looked_ns >= KEY_LOOKED_NS:
                looked_ns = self._clock.now_ns()
                if await _has_ended(keys, key):
                    raise _KeyEndedError
            await send(message)

        try:
            await self._app(scope, receive, send_while_known)
        except _KeyEndedError:
            await send({"type": "http.response.body", "body": b""})

    def _refusal(self, headers: Headers, *, is_safe: bool) -> _Refusal | None:
        host = headers.get("host", "")
        if self._keys is None and _name_of(host) not in LOOPBACK_NAMES:
            detail = f"Host: got {host!r}, expected one of {sorted(LOOPBACK_NAMES)}"
            return HTTPStatus.FORBIDDEN, "host", detail
        if is_safe and not _is_embedded_elsewhere(headers):
            return None
        if self._keys is not None and "authorization" in headers:
            return None  # no page elsewhere can send that without our consent, which none gets
        origin = headers.get("origin")
        site = None if origin is None else _site_of(origin)
        foreign = site not in (None, host) and site not in self._sites
        if is_safe or foreign or headers.get("sec-fetch-site") == "cross-site":
            detail = f"Origin: got {origin!r}, expected this site ({host}) or none"
            return HTTPStatus.FORBIDDEN, "origin", detail
        return None

    async def _admit(self, scope: Scope, headers: Headers, *, is_safe: bool) -> _Refusal | None:
        """Note whose request it is, or refuse it."""
        if self._keys is None:
            scope.update(scm_role="admin", scm_owner="this machine", scm_key="")
            return None
        path = str(scope["path"])
        if not path.startswith(GUARDED) or path in OPEN:
            return None
        key = _key_of(headers, with_cookie=is_safe) or _key_offered(scope)
        try:
            known = await self._known(self._keys, key, path)
        except StoreError as failure:
            event(_log, "keys_not_read", level=logging.ERROR, reason=repr(str(failure)))
            detail = "the store of API keys cannot be read now"
            return HTTPStatus.SERVICE_UNAVAILABLE, "offline", detail
        record = known.record
        if record is None:
            return self._refuse_key(_address(scope), key, path)
        scope.update(scm_role=record.role, scm_owner=record.owner, scm_key=key)
        scope["scm_is_sure"] = known.is_sure
        return None

    def _refuse_key(self, address: str, key: str, path: str) -> _Refusal:
        """Refuse who has no key, or a wrong one: after many of these, to wait.

        A valid key never comes here: guesses with its public part, which is no secret, must
        not keep its owner out. The city stop is never delayed.
        """
        if key and self._brake.wait_s(address, key) > 0.0 and path != STOP:
            detail = f"this key was wrong too often from {address}; wait a little"
            return HTTPStatus.TOO_MANY_REQUESTS, "too_many", detail
        if key:
            self._brake.note_wrong(address, key)
        detail = "this needs an API key: send `Authorization: Bearer <key>`"
        return HTTPStatus.UNAUTHORIZED, "unauthorised", detail

    @staticmethod
    async def _known(keys: KnownKeys, key: str, path: str) -> Known:
        return await keys.find_for_stop(key) if path == STOP else Known(await keys.find(key))


async def _has_ended(keys: KnownKeys, key: str) -> bool:
    """Return whether a key has ended; a store that does not answer ends nothing."""
    try:
        return await keys.find(key) is None
    except StoreError:
        return False


def _is_embedded_elsewhere(headers: Headers) -> bool:
    """Return whether a page of another site sent this; it could not read the answer.

    Its pictures and frames would let us work, and use up what its reader may ask. A link that a
    person follows is none of these.
    """
    follows = headers.get("sec-fetch-mode") == "navigate"
    is_shown = headers.get("sec-fetch-dest", "document") == "document"
    elsewhere = headers.get("sec-fetch-site") in ("cross-site", "same-site")
    return elsewhere and not (follows and is_shown)


def caller_of(scope: Scope) -> str:
    """Return what identifies a caller: the public part of its key, or its address."""
    key = str(scope.get("scm_key", ""))
    return key.split("_")[1] if key.count("_") > 1 else _address(scope)


def _actor_of(scope: Scope) -> str:
    """Return who calls, for the audit: the owner of its key and its program, where that is known.

    A page of ours is the `dashboard`; a program is called as it calls itself in `User-Agent`.
    """
    headers = Headers(scope=scope)
    if "origin" in headers or "sec-fetch-mode" in headers:
        program = DASHBOARD
    else:
        given = re.split(r"[/ ]", headers.get("user-agent", ""), maxsplit=1)[0]
        program = re.sub(r"[^\w.+-]", "_", given)[:MAX_PROGRAM] or "an unnamed program"
    if not scope.get("scm_key"):
        return program
    owner = str(scope["scm_owner"])
    return owner if program == DASHBOARD else f"{owner} ({program})"


def _key_of(headers: Headers, *, with_cookie: bool) -> str:
    """Return the key a request carries; empty: none."""
    scheme, _, given = headers.get("authorization", "").partition(" ")
    if scheme.lower() == "bearer":
        return given.strip()
    if not with_cookie:
        return ""
    try:
        cookie = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return ""
    return cookie.value if cookie is not None else ""


def _key_offered(scope: Scope) -> str:
    """Return the key among the subprotocols that a WebSocket offers; empty: none."""
    offered = scope.get("subprotocols", ())
    keys = (name for name in offered if name.startswith(KEY_PROTOCOL))
    return str(next(keys, "")).removeprefix(KEY_PROTOCOL)


def _address(scope: Scope) -> str:
    client = scope.get("client")
    return str(client[0]) if client else ""


def _site_of(origin: str) -> str:
    """Return name and port of an Origin header; empty when it cannot be read."""
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return ""


def _name_of(host: str) -> str:
    """Return a Host header without its port; empty when it cannot be read."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""
