"""A method of the client that is one operation of the interface: it sends its arguments."""

import re
from collections.abc import Callable, Iterator
from functools import cache, wraps
from inspect import Signature, signature
from typing import Any, TypeVar

from scm.client.connection import Connection, part
from scm.client.stream import LiveEvent

HEADERS = ("if_match", "if_none_match")
F = TypeVar("F", bound=Callable[..., Any])


class Noun:
    """Operations on one noun of the interface.

    Arguments that mean the same in each of them are not explained there:

    - `name`: on the bus, of the vehicle, junction, camera or station that it is about.
    - `idempotency_key`: same key, same effect, once; empty: a new one.
    - `limit`: rows of a page; `cursor`: `next` of the page before, empty: the first page.
    - `if_match`: ETag of the state that was edited, `*`: whichever there is; `if_none_match`: `*`:
      only where there is none yet.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection


def operation(method: str, path: str) -> Callable[[F], F]:
    """Make a function without a body a method that asks the city, and returns what it answers.

    An argument goes where its name stands in the path, else into the headers (`HEADERS`), and else
    into the query of what only looks or deletes, or of bytes that are sent (`content`), or into the
    body. A `_` at the end of a name is not sent.
    """

    def method_of(function: F) -> F:
        names = re.findall(r"\{(\w+)\}", path)
        shape = cache(lambda: signature(function))

        @wraps(function)
        def call(noun: Noun, *args: Any, **kwargs: Any) -> Any:
            bound = shape().bind(noun, *args, **kwargs)
            bound.apply_defaults()
            _, *given = bound.arguments.items()
            left = dict(given)
            filled = path.format(**{name: part(left.pop(name)) for name in names})
            values = {name.rstrip("_"): value for name, value in left.items()}
            return _answer(noun._connection, method, filled, values, shape())  # noqa: SLF001

        return call  # type: ignore[return-value]

    return method_of


def _answer(
    connection: Connection, method: str, path: str, values: dict[str, Any], shape: Signature
) -> Any:
    """Return the answer, by what the method says that it returns."""
    kind, key = shape.return_annotation, values.pop("idempotency_key", None)
    content = values.pop("content", None)
    headers = {name.replace("_", "-"): values.pop(name) for name in HEADERS if name in values}
    if kind == Iterator[LiveEvent]:
        return connection.events(path, query=values)
    if kind == Iterator[bytes]:
        return connection.pieces(path, query=values, headers=headers)
    if kind is bytes:
        return connection.fetch(path, query=values, headers=headers)
    if content is not None:
        return connection.send(method, path, kind, content, query=values, headers=headers, key=key)
    looks = method in ("GET", "DELETE")
    query, body = (values, None) if looks else (None, values or None)
    if kind is None:
        connection.send_only(method, path, query=query, headers=headers, body=body, key=key)
        return None
    return connection.request(method, path, kind, query=query, headers=headers, body=body, key=key)
