"""The dashboard's files, answered from memory before any route is looked for.

A first visit requests some sixty files, on the processors that also run the city: each is read,
digested and compressed once, not for each request, and again only if it was edited. Browsers ask
each time whether theirs is still the one: no stale page, and nothing is sent twice.

A page is `static/index.html` with what its address needs: its style sheet, the modules it will
import, so that the browser need not find them one behind the other, and its frame, where
`static/frames` has one, which is seen until the modules draw the page.
"""

import functools
import gzip
import json
import mimetypes
import re
from collections.abc import Iterator
from http import HTTPStatus
from pathlib import Path
from typing import NamedTuple

from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

from scm.api import problem
from scm.api.based import PAGES
from scm.api.etag import etag_of, has_tag

STATIC_DIR = Path(__file__).parent / "static"
INDEX = STATIC_DIR / "index.html"
PLAIN = STATIC_DIR / "css" / "plain.css"
"""Style sheet of a page that has no rules of its own."""

LINKS, NEEDS, FRAME = "<!-- pages -->", "<!-- needs -->", "<main></main>"
"""What a page fills in, in `index.html`."""

NO_PAGES = ("/api/", "/ngsi-ld/", "/static/")
"""Prefixes of addresses that only programs request."""

_READS = frozenset({"GET", "HEAD"})
_IMPORT = re.compile(r'(?:\bfrom|^import)\s*"([\w@./-]+)"', re.MULTILINE)
_MAPPING = re.compile(r'<script type="importmap">(.*?)</script>', re.DOTALL)
_ADDRESS_IN = re.compile(r'((?:href|src)="|: ")/')
_Version = tuple[int, int]


class _Body(NamedTuple):
    """One form of a file, as it goes out."""

    data: bytes
    headers: tuple[tuple[bytes, bytes], ...]
    etag: str


class _File(NamedTuple):
    """A file as it is, and packed."""

    plain: _Body
    packed: _Body


class _Place(NamedTuple):
    """The route of an address, for the metrics of requests."""

    path_format: str


_STATIC = _Place("/static/{file}")


@functools.cache
def _files_in(folder: Path) -> dict[str, Path]:
    """Return the files by their address; each is read and compressed."""
    files = {
        f"/static/{path.relative_to(folder).as_posix()}": path
        for path in folder.rglob("*")
        if path.is_file() and path.suffix != ".html"
    }
    for page in PAGES:
        files.setdefault(f"/static/css/pages/{page}.css", PLAIN)
    for path in files.values():
        _file(path, _version(path))
    return files


class Dashboard:
    """ASGI middleware behind the gate: pages and their files; all else is passed on.

    An edited file is seen at the next visit; a new one, a frame or an import at the next start.

    Args:
        base: Path below which the server stands, see `scm.api.based`.
    """

    def __init__(self, app: ASGIApp, base: str = "") -> None:
        self._app = app
        self._base = base
        self._files = _files_in(STATIC_DIR)
        for page in PAGES:
            _page(page, base, _version(INDEX))

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer with a file, or pass a request on."""
        found = None
        if scope["type"] == "http" and scope["method"] in _READS:
            found = self._find(str(scope["path"]))
        if found is None:
            await self._app(scope, receive, send)
            return
        file, scope["route"], scope["path_params"] = found
        headers = Headers(scope=scope)
        packs = "gzip" in headers.get("accept-encoding", "")
        body = file.packed if packs else file.plain
        is_known = has_tag(headers.get("if-none-match", ""), body.etag)
        status = HTTPStatus.NOT_MODIFIED if is_known else HTTPStatus.OK
        await send(
            {"type": "http.response.start", "status": int(status), "headers": list(body.headers)}
        )
        await send({"type": "http.response.body", "body": b"" if is_known else body.data})

    def _find(self, path: str) -> tuple[_File, _Place, dict[str, str]] | None:
        if path.startswith("/static/"):
            file = self._files.get(path)
            if file is None:
                return None
            return _file(file, _version(file)), _STATIC, {"file": path.removeprefix("/static/")}
        if path == "/docs":
            file = STATIC_DIR / "docs.html"
            return _document(file, self._base, _version(file)), _Place(path), {}
        first = path.split("/")[1]
        name = first or next(iter(PAGES))
        if name not in PAGES or (not first and path != "/"):
            return None
        return _page(name, self._base, _version(INDEX)), _Place(f"/{first}"), {}


async def astray(request: Request, error: Exception) -> Response:
    """Answer an unknown address: a person gets the dashboard's page, programs a problem."""
    is_read = request.method == "GET" and "text/html" in request.headers.get("accept", "")
    if is_read and not request.url.path.startswith(NO_PAGES):
        text = index_text(request.app.state.base).replace(NEEDS, "")
        return HTMLResponse(text, HTTPStatus.NOT_FOUND, {"Cache-Control": "no-cache"})
    return await problem.on_http(request, error)


def _version(path: Path) -> _Version:
    stat = path.stat()
    return stat.st_mtime_ns, stat.st_size


@functools.cache
def _file(path: Path, _version: _Version) -> _File:
    media = mimetypes.guess_type(path.name)[0] or "text/plain"
    return _made(path.read_bytes(), media)


@functools.cache
def _page(name: str, base: str, _version: _Version) -> _File:
    return _made(page_text(name, base).encode(), "text/html")


@functools.cache
def _document(path: Path, base: str, _version: _Version) -> _File:
    return _made(_placed(path.read_text("utf-8"), base).encode(), "text/html")


def _made(data: bytes, media: str) -> _File:
    if media.startswith("text/"):
        media += "; charset=utf-8"
    packed = gzip.compress(data, mtime=0)
    if len(packed) >= len(data):
        return _File(_body(data, media), _body(data, media))
    return _File(_body(data, media), _body(packed, media, (b"content-encoding", b"gzip")))


def _body(data: bytes, media: str, *more: tuple[bytes, bytes]) -> _Body:
    etag = etag_of(data)
    headers = (
        (b"content-type", media.encode()),
        (b"content-length", str(len(data)).encode()),
        (b"cache-control", b"no-cache"),
        (b"vary", b"accept-encoding"),
        (b"etag", etag.encode()),
        *more,
    )
    return _Body(data, headers, etag)


def index_text(base: str = "") -> str:
    """Return the document of all pages, with addresses below a base path."""
    bar = (page for page in PAGES.values() if not page.under)
    links = "\n".join(f'<a href="/{page.name}">{page.title}</a>' for page in bar)
    return _placed(INDEX.read_text("utf-8").replace(LINKS, links), base)


def _placed(document: str, base: str) -> str:
    """Put a base path before all addresses of a document, and pass it to its modules."""
    if not base:
        return document
    document = _ADDRESS_IN.sub(rf"\g<1>{base}/", document)
    return document.replace('<html lang="en">', f'<html lang="en" data-base="{base}">')


def page_text(name: str, base: str = "") -> str:
    """Return the document of a page: what is seen before its modules run, and what they are."""
    frame = STATIC_DIR / "frames" / f"{name}.html"
    inside = frame.read_text("utf-8") if frame.is_file() else ""
    needs = [f'<link rel="stylesheet" href="/static/css/pages/{name}.css">']
    needs += [f'<link rel="modulepreload" href="{address}">' for address in modules_of(name)]
    shown = PAGES[name].under or name
    text = (
        index_text()
        .replace(NEEDS, "\n".join(needs))
        .replace(f'<a href="/{shown}">', f'<a href="/{shown}" aria-current="page">')
        .replace(FRAME, f'<main class="at-{name}">\n{inside}</main>')
    )
    return _placed(text, base)


@functools.cache
def modules_of(name: str) -> tuple[str, ...]:
    """Return the addresses of all modules that a page imports, the nearest first."""
    found = dict.fromkeys(["/static/js/app.js", _address(PAGES[name].module)])
    left = list(found)
    for address in left:  # which grows
        for module in _imports(address):
            if module not in found:
                found[module] = None
                left.append(module)
    return tuple(found)


def _imports(address: str) -> Iterator[str]:
    path = STATIC_DIR / address.removeprefix("/static/")
    yield from map(_address, _IMPORT.findall(path.read_text("utf-8")))


def _address(specifier: str) -> str:
    mapping = _import_map()
    if specifier in mapping:
        return mapping[specifier]
    return mapping["scm/"] + specifier.removeprefix("scm/")


@functools.cache
def _import_map() -> dict[str, str]:
    (mapping,) = _MAPPING.findall(index_text())
    return dict(json.loads(mapping)["imports"])
