"""A map with another radio: what a command says in the place of what the map says."""

from collections.abc import Iterable
from typing import Any

import msgspec

from scm.errors import MapError, nearest
from scm.maps.check import problems_of
from scm.records.city_map import CityMap, RadioChannel

_SWITCHES = {"true": True, "false": False}


def with_radio(city_map: CityMap, settings: Iterable[str]) -> CityMap:
    """Return a map with another radio, `key=value` each.

    Raises:
        MapError: naming the setting, what was expected and got.
    """
    given: dict[str, Any] = msgspec.to_builtins(city_map.radio)
    for setting in settings:
        key, _, value = setting.partition("=")
        if key not in RadioChannel.__struct_fields__:
            keys = list(RadioChannel.__struct_fields__)
            msg = f"radio {key!r}: expected one of {', '.join(keys)}{nearest(key, keys)}"
            raise MapError(msg)
        given[key] = _SWITCHES.get(value, value)
    try:
        radio = msgspec.convert(given, RadioChannel, strict=False)
    except msgspec.ValidationError as cause:
        msg = f"radio: {cause}"
        raise MapError(msg) from cause
    changed = msgspec.structs.replace(city_map, radio=radio)
    problems = problems_of(changed)
    if problems:
        raise MapError("; ".join(problems))
    return changed
