"""What is checked before any route runs: where a request comes from, and who may change things.

Without a key the interface is for this machine only: the bind address must be loopback, and the
Host header must name it, so that a web page elsewhere cannot reach it by renaming itself (DNS
rebinding). Changes must come from our own pages or from programs: a browser tells its origin.
"""

import base64
import hashlib
import hmac
import ipaddress
import re
from http import HTTPStatus
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from scm.api.problem import problem
from scm.errors import RunError

LOOPBACK_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})
_SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
_INLINE_SCRIPT = re.compile(r"<script(?![^>]*\bsrc=)[^>]*>(.*?)</script>", re.DOTALL)

_Refusal = tuple[int, str, str]


def is_loopback(host: str) -> bool:
    """Return whether only this machine can reach what is bound to `host`."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def check_bind(host: str, api_key: str | None) -> None:
    """Refuse to serve the network without a key.

    Raises:
        RunError: when `host` is not loopback and there is no key.
    """
    if not api_key and not is_loopback(host):
        msg = (
            f"api host: got {host!r} without an API key, which would let everybody on the network "
            "drive the city; expected 127.0.0.1, or an API key"
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
    """ASGI middleware: host, origin and key on the way in, security headers on the way out."""

    def __init__(self, app: ASGIApp, *, api_key: str | None, policy: str) -> None:
        self._app = app
        self._api_key = api_key
        self._headers = {
            "Content-Security-Policy": policy,
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Cross-Origin-Resource-Policy": "same-origin",
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request pass, or answer it with a problem."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(self._headers)
            await send(message)

        refusal = self._refusal(scope["method"], Headers(scope=scope))
        if refusal is None:
            await self._app(scope, receive, send_guarded)
            return
        status, code, detail = refusal
        response = problem(status, code, detail, instance=scope["path"])
        await response(scope, receive, send_guarded)

    def _refusal(self, method: str, headers: Headers) -> _Refusal | None:
        host = headers.get("host", "")
        if not self._api_key and _name_of(host) not in LOOPBACK_NAMES:
            detail = f"Host: got {host!r}, expected one of {sorted(LOOPBACK_NAMES)}"
            return HTTPStatus.FORBIDDEN, "host", detail
        if method in _SAFE_METHODS:
            return None
        origin = headers.get("origin")
        foreign = origin is not None and urlsplit(origin).netloc != host
        if foreign or headers.get("sec-fetch-site") == "cross-site":
            detail = f"Origin: got {origin!r}, expected this site ({host}) or none"
            return HTTPStatus.FORBIDDEN, "origin", detail
        if self._api_key and not self._has_key(headers):
            detail = "changes need the API key: send `Authorization: Bearer <key>`"
            return HTTPStatus.UNAUTHORIZED, "unauthorised", detail
        return None

    def _has_key(self, headers: Headers) -> bool:
        scheme, _, given = headers.get("authorization", "").partition(" ")
        wanted = (self._api_key or "").encode()
        return scheme.lower() == "bearer" and hmac.compare_digest(given.strip().encode(), wanted)


def _name_of(host: str) -> str:
    """Return a Host header without its port; empty when it cannot be read."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""
