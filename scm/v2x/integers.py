"""Detect messages with an integer of more than 64 bits.

Floats, arrays and other languages cannot hold it. Only fields without bounds in their class are
checked: four numbers of a car's state, instead of all 570 bytes of its text.
"""

from collections.abc import Callable
from functools import lru_cache
from operator import attrgetter
from typing import Any

import msgspec
from msgspec import inspect

_SMALLEST, _LARGEST = -(2**63), 2**63 - 1
_WITHOUT = (
    inspect.BoolType,
    inspect.BytesType,
    inspect.FloatType,
    inspect.LiteralType,
    inspect.NoneType,
    inspect.StrType,
)

Check = Callable[[Any], bool]


def are_short(message: msgspec.Struct) -> bool:
    """Return whether all integers of a message have at most 64 bits."""
    check = _check_of(type(message))
    return check is None or check(message)


@lru_cache(maxsize=256)
def _check_of(kind: type[msgspec.Struct]) -> Check | None:
    return _check(inspect.type_info(kind))


def _check(info: inspect.Type) -> Check | None:
    """Return the check for values of a type, or None if they cannot hold a long integer."""
    info = info.type if isinstance(info, inspect.Metadata) else info
    match info:
        case inspect.IntType():
            return None if _is_bounded(info) else _is_short
        case inspect.StructType():
            return _of_struct(info)
        case inspect.VarTupleType() | inspect.ListType():
            return _of_each(_check(info.item_type))
        case inspect.TupleType():
            return None if all(_check(one) is None for one in info.item_types) else _of_any
        case inspect.UnionType():
            return None if all(_check(one) is None for one in info.types) else _of_union(info)
    return None if isinstance(info, _WITHOUT) else _of_any


def _is_bounded(info: inspect.IntType) -> bool:
    return (info.ge, info.gt) != (None, None) and (info.le, info.lt) != (None, None)


def _is_short(value: int) -> bool:
    return _SMALLEST <= value <= _LARGEST


def _of_struct(info: inspect.StructType) -> Check | None:
    """Return a check of a struct's fields, all its plain integers in one pass: Spat has dozens."""
    fields = [(field.name, field.type) for field in info.fields if _check(field.type) is not None]
    numbers = [name for name, kind in fields if _is_number(kind)]
    checks = [(name, _check(kind)) for name, kind in fields if name not in numbers]
    # One name more, since `attrgetter` of a single one returns no tuple.
    numbers_of = attrgetter(*numbers, numbers[0]) if numbers else lambda _value: ()

    def check_fields(value: object) -> bool:
        for number in numbers_of(value):
            if number is not None and not _SMALLEST <= number <= _LARGEST:
                return False
        for name, check in checks:
            if check is not None and not check(getattr(value, name)):
                return False
        return True

    return check_fields if fields else None


def _is_number(info: inspect.Type) -> bool:
    """Return whether values of a type are integers, or None."""
    info = info.type if isinstance(info, inspect.Metadata) else info
    if isinstance(info, inspect.UnionType):
        return all(isinstance(one, inspect.NoneType) or _is_number(one) for one in info.types)
    return isinstance(info, inspect.IntType)


def _of_each(check: Check | None) -> Check | None:
    return None if check is None else lambda values: all(map(check, values))


def _of_union(info: inspect.UnionType) -> Check:
    """Return a check for structs and integers; other values are searched completely."""
    checks: dict[type, Check | None] = {int: _is_short, type(None): None, float: None, str: None}
    for one in info.types:
        plain = one.type if isinstance(one, inspect.Metadata) else one
        if isinstance(plain, inspect.StructType):
            checks[plain.cls] = _check(plain)

    def check_one(value: object) -> bool:
        check = checks.get(type(value), _of_any)
        return check is None or check(value)

    return check_one


def _of_any(value: object) -> bool:
    return _are_short(msgspec.to_builtins(value))


def _are_short(value: object) -> bool:
    if isinstance(value, dict):
        return all(map(_are_short, value.values()))
    if isinstance(value, list | tuple):
        return all(map(_are_short, value))
    return not isinstance(value, int) or _is_short(value)
