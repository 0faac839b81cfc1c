"""Build and parse key expressions: `scm/@v1/<city>/<KEY of the message>`.

A chunk that begins with `@` is verbatim: `*` and `**` do not match it. `@v1` is the major version
of the key space; pictures on `v/n1/@camera/front` go only to those who subscribe to them by name,
not even to a recorder of everything.
"""

import re
from collections.abc import Mapping
from functools import lru_cache
from string import Formatter

from scm.errors import MessageError
from scm.v2x.message import Message

VERSION = "@v1"
_CHUNK = re.compile(r"[a-z0-9_-]{1,32}")


def check_name(name: str, what: str) -> str:
    """Return the name of a vehicle, station, city ... if it is valid in a key.

    Raises:
        MessageError: when it is not.
    """
    if not _CHUNK.fullmatch(name):
        msg = f"{what}: got {name!r}, expected 1 to 32 of a-z 0-9 _ -"
        raise MessageError(msg)
    return name


@lru_cache(maxsize=65536)
def is_name(name: str) -> bool:
    """Return whether the name of a vehicle, station, city ... is valid in a key."""
    return _CHUNK.fullmatch(name) is not None


def variables(kind: type[Message]) -> list[str]:
    """Return the names of the variable chunks in a message's key, in order."""
    return [name for _, name, _, _ in Formatter().parse(kind.KEY) if name]


@lru_cache(maxsize=256)
def _places(kind: type[Message]) -> tuple[tuple[int, str], ...]:
    chunks = kind.KEY.split("/")
    return tuple((i, c[1:-1]) for i, c in enumerate(chunks) if c.startswith("{"))


def prefix(city: str) -> str:
    """Return the key prefix of a city's messages, with the closing slash."""
    return f"scm/{VERSION}/{check_name(city, 'city')}/"


def key_of(city: str, message: Message) -> str:
    """Return the key of a message.

    Raises:
        MessageError: when a field used in the key is not a valid name.
    """
    return _key(city, type(message), names_of(message))


def names_of(message: Message) -> tuple[str, ...]:
    """Return a message's values for the variable chunks of its key, in order, unchecked."""
    return tuple([str(getattr(message, name)) for _, name in _places(type(message))])


@lru_cache(maxsize=65536)
def _key(city: str, kind: type[Message], values: tuple[str, ...]) -> str:
    chunks = {name: value for (_, name), value in zip(_places(kind), values, strict=True)}
    for name, value in chunks.items():
        check_name(value, f"{kind.__name__}.{name}")
    return prefix(city) + kind.KEY.format(**chunks)


def selector(city: str, kind: type[Message], where: Mapping[str, str]) -> str:
    """Return the key expression of a class of messages; `*` for chunks that `where` leaves out.

    Raises:
        MessageError: when `where` names an unknown chunk or an invalid name.
    """
    known = variables(kind)
    unknown = sorted(set(where) - set(known))
    if unknown:
        msg = (
            f"{kind.__name__}: its key {kind.KEY!r} has no part named {unknown[0]!r}, only {known}"
        )
        raise MessageError(msg)
    for name, value in where.items():
        check_name(value, f"{kind.__name__}.{name}")
    return prefix(city) + kind.KEY.format(**{name: where.get(name, "*") for name in known})


def everything(city: str) -> str:
    """Return the key expression that matches every message of a city."""
    return prefix(city) + "**"


def parse(city: str, kind: type[Message], key: str) -> dict[str, str]:
    """Return the variable chunks of a key by name.

    Raises:
        MessageError: when the key is not one of this class in this city.
    """
    if not matches(selector(city, kind, {}), key):
        msg = f"{kind.__name__}: got key {key!r}, expected {prefix(city)}{kind.KEY}"
        raise MessageError(msg)
    chunks = key.removeprefix(prefix(city)).split("/")
    return {name: chunks[i] for i, name in _places(kind)}


def agrees(key: str, message: Message) -> bool:
    """Return whether a message has the same names as the key it came on.

    No message agrees with a key with wildcards (as a query may have) or with invalid names.
    """
    names = names_in(type(message), key)
    if names is None:
        return False
    for field, name in names:  # noqa: SIM110  runs for each message: `all` takes twice as long
        if getattr(message, field) != name:
            return False
    return True


@lru_cache(maxsize=65536)
def names_in(kind: type[Message], key: str) -> tuple[tuple[str, str], ...] | None:
    """Return the fields and values in a key, or None if it is no key of this class."""
    chunks, own = key.split("/", 3)[-1].split("/"), kind.KEY.split("/")
    if len(chunks) != len(own):
        return None
    places = dict(_places(kind))
    if any(chunks[i] != word for i, word in enumerate(own) if i not in places):
        return None
    if not all(is_name(chunks[i]) for i in places):
        return None
    return tuple((field, chunks[i]) for i, field in places.items())


def matches(expression: str, key: str) -> bool:
    """Return whether a key matches an expression of literal chunks, `*` and a final `**`."""
    return intersects(expression, key)


def intersects(one: str, other: str) -> bool:
    """Return whether some key matches both expressions."""
    a, b = one.split("/"), other.split("/")
    for longer, shorter in ((a, b), (b, a)):
        if shorter[-1] == "**":
            rest = longer[len(shorter) - 1 :]
            if len(longer) < len(shorter) - 1 or any(chunk.startswith("@") for chunk in rest):
                return False
            a, b = longer[: len(shorter) - 1], shorter[:-1]
            break
    return len(a) == len(b) and all(map(_meet, a, b))


def _meet(one: str, other: str) -> bool:
    """Return whether two chunks intersect: equal, or one is `*` and the other is not verbatim."""
    return one == other or (one == "*" and other[:1] != "@") or (other == "*" and one[:1] != "@")
