"""A map as the text of a map file: what is as by default is left out."""

import json
from collections.abc import Iterator
from typing import Any

import msgspec

from scm.records.city_map import CityMap


def map_toml(city_map: CityMap) -> str:
    """Return the map file of a map; reading it gives the same map."""
    return "\n".join(_table(_own_values(city_map), ())) + "\n"


def _own_values(record: msgspec.Struct) -> dict[str, Any]:
    """Return what a record says beyond its defaults."""
    values = {}
    for field in msgspec.structs.fields(type(record)):
        value = getattr(record, field.name)
        if value is None or (not field.required and value == field.default):
            continue
        values[field.name] = value
    return values


def _table(values: dict[str, Any], path: tuple[str, ...]) -> Iterator[str]:
    """Yield the lines of a table: its own values first, then what has a header of its own."""
    headed = {key: value for key, value in values.items() if _has_header(value, path)}
    for key, value in values.items():
        if key not in headed:
            yield f"{key} = {_inline(value)}"
    for key, value in headed.items():
        name = ".".join((*path, key))
        for record in value if isinstance(value, tuple) else (value,):
            yield ""
            yield f"[[{name}]]" if isinstance(value, tuple) else f"[{name}]"
            yield from _table(_own_values(record), (*path, key))


def _has_header(value: Any, path: tuple[str, ...]) -> bool:
    if isinstance(value, tuple):
        return not path and bool(value) and isinstance(value[0], msgspec.Struct)
    return isinstance(value, msgspec.Struct) and not path


def _inline(value: Any) -> str:
    if isinstance(value, msgspec.Struct):
        pairs = (f"{key} = {_inline(one)}" for key, one in _own_values(value).items())
        return "{" + ", ".join(pairs) + "}"
    if isinstance(value, tuple):
        return "[" + ", ".join(_inline(one) for one in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return repr(value)
