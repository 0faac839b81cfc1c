"""A server that stands below a path of its host: `/city` of `https://lab.example/city`.

Requests come with that path before them, or without it where the proxy takes it off. Pages, cookies
and places that answers point to have it always: that is where a browser finds them.
"""

import re
from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from scm.errors import RunError

_BASE = re.compile(r"(/[A-Za-z0-9][A-Za-z0-9._~-]*)+")
_PLACES = re.compile(r"(?<=<)/|^/")
_COOKIE_PATH = re.compile(r"(?i)(;\s*path=)/")


PAGE_LIST = Path(__file__).parent / "static" / "js" / "pages" / "index.js"
_PAGE = re.compile(
    r'name: "([a-z]+)", title: "([^"]+)",(?: under: "([a-z]+)",)? load: \(\) => import\("([^"]+)"\)'
)


class Page(NamedTuple):
    """One page of the dashboard, as `static/js/pages/index.js` lists it.

    Attributes:
        name: First part of its address; what follows is the page's own.
        title: In the title bar.
        under: The page that it is reached from; empty: it is in the title bar itself.
        module: What the browser loads to draw it.
    """

    name: str
    title: str
    under: str
    module: str


PAGES = {page[0]: Page(*page) for page in _PAGE.findall(PAGE_LIST.read_text("utf-8"))}
RESERVED = (*PAGES, "api", "static", "docs", "ngsi-ld", "metrics")


class Site(NamedTuple):
    """Where people find a server.

    Attributes:
        base: The path below its host, `/city`; empty: the host itself.
        origins: Of pages that may change things besides our own host's: `https://lab.example`,
            where a proxy calls us by another name.
    """

    base: str = ""
    origins: Collection[str] = ()


HERE = Site()


def check_base(base: str) -> str:
    """Return a base path without a slash at its end.

    Raises:
        RunError: when it is no such path, or the server's own addresses begin like that.
    """
    path = base.rstrip("/")
    if path and (not _BASE.fullmatch(path) or path.split("/")[1] in RESERVED):
        msg = f"base: got {base!r}, expected a path like /city, none of {', '.join(RESERVED)}"
        raise RunError(msg)
    return path


class Based:
    """ASGI middleware, the outermost: takes the base off requests and puts it before answers."""

    def __init__(self, app: ASGIApp, base: str) -> None:
        self._app = app
        self._base = base

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on as if the server stood at the root."""
        if not self._base or scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        path = str(scope["path"])
        if path == self._base or path.startswith(f"{self._base}/"):
            path = path.removeprefix(self._base) or "/"
            scope = {**scope, "path": path, "raw_path": path.encode()}

        async def send_placed(message: Message) -> None:
            if message["type"] in ("http.response.start", "websocket.http.response.start"):
                self._place(MutableHeaders(scope=message))
            await send(message)

        await self._app(scope, receive, send_placed)

    def _place(self, headers: MutableHeaders) -> None:
        for name in ("location", "link"):
            if name in headers:
                headers[name] = _PLACES.sub(f"{self._base}/", headers[name])
        cookies = headers.getlist("set-cookie")
        if cookies:
            del headers["set-cookie"]
            for cookie in cookies:
                headers.append("set-cookie", _COOKIE_PATH.sub(rf"\g<1>{self._base}/", cookie))
