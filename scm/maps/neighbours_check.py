"""What a map says of the cities next to it: every problem, as sentences."""

from collections.abc import Iterator

from scm.errors import nearest
from scm.records.city_map import NEIGHBOUR_MESSAGES, CityMap, Lane


def neighbour_problems(city_map: CityMap) -> Iterator[str]:
    """Yield what is wrong with the neighbours.

    Whether the other city has the lane, and names this one, shows when both run: a car is refused
    at the border until they agree.
    """
    lanes = {lane.name: lane for lane in city_map.lanes}
    cities: dict[str, int] = {}
    out: dict[str, str] = {}
    for index, neighbour in enumerate(city_map.neighbours):
        where = f"neighbours[{index}] ({neighbour.city})"
        if neighbour.city in cities:
            first = f"neighbours[{cities[neighbour.city]}]"
            yield f"{where}.city: {neighbour.city!r} is already that of {first}; expected each once"
        cities.setdefault(neighbour.city, index)
        for number, road in enumerate(neighbour.roads):
            place = f"{where}.roads[{number}].out"
            yield from _out(place, road.out, lanes)
            if road.out in out:
                yield f"{place}: lane {road.out!r} already leads out at {out[road.out]}"
            out.setdefault(road.out, place)
        for name in neighbour.messages:
            if name not in NEIGHBOUR_MESSAGES:
                known = ", ".join(NEIGHBOUR_MESSAGES)
                guess = nearest(name, NEIGHBOUR_MESSAGES)
                yield f"{where}.messages: no message {name!r}{guess}; expected some of {known}"


def _out(where: str, name: str, lanes: dict[str, Lane]) -> Iterator[str]:
    """Check that a lane that leads out exists, and ends at the border."""
    if name not in lanes:
        choice = ", ".join(lanes) or "none: the map has no lanes"
        yield f"{where}: no lane {name!r}{nearest(name, list(lanes))}; expected one of {choice}"
    elif lanes[name].next:
        after = ", ".join(lanes[name].next)
        yield f"{where}: lane {name!r} ends at the border; expected no next lane, got {after}"
