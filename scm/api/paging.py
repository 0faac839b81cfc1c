"""Pages of a long list: a cursor instead of a number, so that what is added does not move them.

A page is requested by `limit` and `cursor`; the answer names the next one in its body and, as
RFC 8288 defines, in `Link`. A cursor is opaque to its reader: the key of the last row already sent.
"""

import base64
import binascii
import re
from collections import Counter
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Annotated, TypeVar
from urllib.parse import urlencode

from fastapi import Query, Request, Response

from scm.api.city import json_response
from scm.api.problem import RefusedError
from scm.records.page import Page, T

R = TypeVar("R")
MOST = 500
_CURSOR = re.compile(r"k([1-9][0-9]{0,5})?:(.*)", re.DOTALL)

Limit = Annotated[int, Query(ge=1, le=MOST, description="rows a page", examples=[100])]
Cursor = Annotated[
    str,
    Query(
        max_length=6000,
        description="`next` of the page before; empty: the first page",
        examples=["czo0MQ"],
    ),
]


def page_of(
    rows: Iterable[T],
    key: Callable[[T], str],
    *,
    keep: Callable[[T], bool] = lambda _: True,
    limit: int = 100,
    cursor: str = "",
) -> Page[T]:
    """Cut a page from rows in their order.

    Args:
        rows: All of them; those up to the cursor's are skipped.
        key: Identifies a row and never changes; rows need not be sorted by it. Of rows
            that have the same one the cursor counts which it is.
        keep: Which rows are wanted. What may cease to be true of a row belongs here: a cursor holds
            although its row is not wanted any more.
        limit: Rows a page.
        cursor: Of the page before.

    Raises:
        RefusedError: when the cursor is none of ours, or its row is gone.
    """
    wanted = _read(cursor) if cursor else None
    found: list[T] = []
    alike = Counter[str]()
    last = ("", 0)
    for row in rows:
        name = key(row)
        alike[name] += 1
        if wanted is not None:
            if (name, alike[name]) == wanted:
                wanted = None
            continue
        if not keep(row):
            continue
        if len(found) == limit:
            return Page(items=tuple(found), next=cursor_at(*last))
        last = name, alike[name]
        found.append(row)
    if wanted is not None:
        raise _bad(cursor, "its row is gone: begin again")
    return Page(items=tuple(found), next=None)


def page_of_names(
    names: Iterable[str], row: Callable[[str], R], *, limit: int, cursor: str
) -> Page[R]:
    """Cut a page from the names of files, and read the row of each.

    Args:
        names: All of them in order.
        row: Reads one; what it refuses was deleted meanwhile, and is left out.
        limit: Rows a page.
        cursor: Of the page before.

    Raises:
        RefusedError: when the cursor is none of ours, or its file is gone.
    """
    page = page_of(names, str, limit=limit, cursor=cursor)
    rows = []
    for name in page.items:
        with suppress(RefusedError):
            rows.append(row(name))
    return Page(items=tuple(rows), next=page.next)


def cursor_at(key: str, number: int = 1) -> str:
    """Return the cursor behind the row of that key; of several, of the one of that number."""
    which = f"k{number}" if number > 1 else "k"
    return base64.urlsafe_b64encode(f"{which}:{key}".encode()).decode().rstrip("=")


def page_response(request: Request, page: Page[T]) -> Response:
    """Return a page as JSON, with the next one's address in `Link`."""
    if page.next is None:
        return json_response(page)
    query = {**request.query_params, "cursor": page.next}
    link = f'<{request.url.path}?{urlencode(query)}>; rel="next"'
    return json_response(page, headers={"Link": link})


def _read(cursor: str) -> tuple[str, int]:
    padded = cursor + "=" * (-len(cursor) % 4)
    try:
        text = base64.b64decode(padded, altchars=b"-_", validate=True).decode()
    except (binascii.Error, UnicodeDecodeError, ValueError):
        text = ""
    match = _CURSOR.fullmatch(text)
    if match is None:
        raise _bad(cursor, "it is none of ours")
    return match[2], int(match[1] or 1)


def _bad(cursor: str, why: str) -> RefusedError:
    detail = f"cursor: got {cursor!r}, expected `next` of the page before: {why}"
    return RefusedError.of("invalid", detail)
