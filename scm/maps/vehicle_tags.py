"""Which tag belongs to which car by its name, so that it can be printed before the car comes.

A map binds names in `[[vehicle_tags]]`. Of the others, the city's own names have one by their
number: `n1` has `first_vehicle_tag_id`, `n2` the next. Any other car wears what it says when it
joins, or gets the lowest free one.
"""

import re

from scm.records.city_map import CityMap

LAST_TAG_ID = 586
"""The family tag36h11 has no other."""
_NUMBERED = re.compile(r"n([1-9][0-9]{0,2})")


def reserved_tags(city_map: CityMap) -> set[int]:
    """Return the tags that are given to no car but the one that the map says: also the floor's."""
    return {city_map.tag.tag_id, *(one.tag_id for one in city_map.vehicle_tags)}


def bound_tag(city_map: CityMap, vehicle: str) -> int | None:
    """Return the tag that belongs to a car of this name; None: its name has none."""
    bound = {one.vehicle: one.tag_id for one in city_map.vehicle_tags}
    if vehicle in bound:
        return bound[vehicle]
    numbered = _NUMBERED.fullmatch(vehicle)
    if numbered is None:
        return None
    tag_id = city_map.first_vehicle_tag_id + int(numbered[1]) - 1
    return None if tag_id in reserved_tags(city_map) or tag_id > LAST_TAG_ID else tag_id
