"""The values of an ETSI field that are no numbers: the codes "unavailable" and "out of range".

Each integer of the seven messages is declared with `coded`, its codes beside its range, and read
with `number_of`. So the definitions are the only table; `codes_in` lists it.

Codes after TS 102 894-2 v1.3.1 and v2.3.1 (common data dictionary) and SAE J2735 in TS 103 301.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import NamedTuple

import msgspec
from msgspec import Meta, inspect

_KEY = "etsi_codes"


class Codes(NamedTuple):
    """The values of one field that are no numbers.

    Attributes:
        unavailable: Unknown to the sender; reserved values count as such.
        out_of_range: The quantity exceeds the field's range.
    """

    unavailable: Sequence[int] = ()
    out_of_range: Sequence[int] = ()


def coded(
    low: int, high: int, *, unavailable: int | range | None = None, out_of_range: Sequence[int] = ()
) -> Meta:
    """Return the declaration of an integer field: its range and its codes."""
    none = (unavailable,) if isinstance(unavailable, int) else unavailable or ()
    return Meta(ge=low, le=high, extra={_KEY: Codes(none, out_of_range)})


@cache
def codes_of(record: type[msgspec.Struct]) -> Mapping[str, Codes]:
    """Return the codes of a record's own integer fields, by field name."""
    return {
        field.name: codes
        for field in inspect.type_info(record).fields  # type: ignore[attr-defined]
        if (codes := _codes(field.type)) is not None
    }


def number_of(record: msgspec.Struct, field: str) -> int | None:
    """Return the number in a field, or None if it is absent or a code.

    Raises:
        KeyError: when the record's definition declares no such field with `coded`.
    """
    value: int | None = getattr(record, field)
    return number_in(type(record), field, value)


def scaled(record: msgspec.Struct, field: str, unit: float) -> float | None:
    """Return a field's number times its unit, or None if it is absent or a code."""
    number = number_of(record, field)
    return None if number is None else number * unit


def number_in(record: type[msgspec.Struct], field: str, value: int | None) -> int | None:
    """Return a value of a record's field as `number_of` does."""
    codes = codes_of(record)[field]
    return None if value in codes.unavailable or value in codes.out_of_range else value


def is_out_of_range(record: msgspec.Struct, field: str) -> bool:
    """Return whether a field holds the code "out of range"."""
    return getattr(record, field) in codes_of(type(record))[field].out_of_range


def codes_in(record: type[msgspec.Struct], path: str = "") -> Iterator[tuple[str, Codes | None]]:
    """Yield (path, codes) of every integer in a record; None: it is not declared with `coded`."""
    for field in inspect.type_info(record).fields:  # type: ignore[attr-defined]
        yield from _within(field.type, f"{path}.{field.name}".lstrip("."))


def _within(info: inspect.Type, path: str) -> Iterator[tuple[str, Codes | None]]:
    match info:
        case inspect.StructType():
            yield from codes_in(info.cls, path)
        case inspect.UnionType():
            for one in info.types:
                yield from _within(one, path)
        case inspect.VarTupleType():
            yield from _within(info.item_type, f"{path}[]")
        case inspect.Metadata(type=inspect.IntType()):
            yield path, _codes(info)
        case inspect.Metadata():
            yield from _within(info.type, path)
        case inspect.IntType():
            yield path, None


def _codes(info: inspect.Type) -> Codes | None:
    if isinstance(info, inspect.UnionType):
        return next((codes for one in info.types if (codes := _codes(one)) is not None), None)
    if not isinstance(info, inspect.Metadata):
        return None
    found: Codes | None = (info.extra or {}).get(_KEY)
    return found
