"""Build and parse key expressions: `scm/@v1/<city>/<KEY of the message>`.

The verbatim chunk `@v1` is the major version of the key space: `**` does not cross it.
"""

import re
from collections.abc import Mapping
from string import Formatter

from scm.errors import MessageError
from scm.v2x.message import Message

VERSION = "@v1"
_CHUNK = re.compile(r"[a-z0-9_-]{1,32}")


def check_name(name: str, what: str) -> str:
    """Return the name of a vehicle, station, city ... if it may stand in a key.

    Raises:
        MessageError: when it may not.
    """
    if not _CHUNK.fullmatch(name):
        msg = f"{what}: got {name!r}, expected 1 to 32 of a-z 0-9 _ -"
        raise MessageError(msg)
    return name


def variables(kind: type[Message]) -> list[str]:
    """Return the names of the variable chunks in a message's key, in order."""
    return [name for _, name, _, _ in Formatter().parse(kind.KEY) if name]


def prefix(city: str) -> str:
    """Return the part of the key that all messages of a city share, with the closing slash."""
    return f"scm/{VERSION}/{check_name(city, 'city')}/"


def key_of(city: str, message: Message) -> str:
    """Return the concrete key a message is sent on."""
    chunks = {name: str(getattr(message, name)) for name in variables(type(message))}
    for name, value in chunks.items():
        check_name(value, f"{type(message).__name__}.{name}")
    return prefix(city) + message.KEY.format(**chunks)


def selector(city: str, kind: type[Message], where: Mapping[str, str]) -> str:
    """Return the key expression that matches a class of messages, `*` where `where` is silent."""
    known = variables(kind)
    unknown = sorted(set(where) - set(known))
    if unknown:
        msg = (
            f"{kind.__name__}: its key {kind.KEY!r} has no part named {unknown[0]!r}, only {known}"
        )
        raise MessageError(msg)
    return prefix(city) + kind.KEY.format(**{name: where.get(name, "*") for name in known})


def matches(expression: str, key: str) -> bool:
    """Return whether a key matches an expression of literal chunks, `*` and a final `**`."""
    wanted, got = expression.split("/"), key.split("/")
    if wanted[-1] == "**":
        wanted = wanted[:-1]
        got = got[: len(wanted)]
    return len(wanted) == len(got) and all(w in ("*", g) for w, g in zip(wanted, got, strict=True))
