"""What a map says of signs and of crossings without lights: every problem, as sentences."""

from collections.abc import Iterator, Mapping, Sequence

from scm.errors import nearest
from scm.maps.polyline import extent
from scm.maps.signs import (
    LINE_DISTANCE_M,
    PRECEDENCE,
    SIGN_KINDS,
    SPEED_LIMIT,
    TURNS,
    allowed_next,
    lines_of,
)
from scm.records.city_map import Approach, CityMap, Conflict, Lane, Sign

MAX_DEPTH = 3  # of yielding chains that are followed


def rule_problems(city_map: CityMap) -> Iterator[str]:
    """Doubt signs and crossings; lanes must have been doubted before."""
    lanes = {lane.name: lane for lane in city_map.lanes}
    lines = lines_of(city_map)
    for index, sign in enumerate(city_map.signs):
        yield from _sign(f"signs[{index}] ({sign.sign_id})", sign, lanes, lines)
    yield from _ways_left(city_map, lanes)
    for index, crossing in enumerate(city_map.crossings):
        where = f"crossings[{index}] ({crossing.name})"
        if len(crossing.approaches) < 2:
            count = len(crossing.approaches)
            yield f"{where}.approaches: expected at least 2, got {count}"
        for number, approach in enumerate(crossing.approaches):
            yield from _approach(f"{where}.approaches[{number}] ({approach.name})", approach, lanes)
    names = [junction.name for junction in city_map.junctions]
    for index, crossing in enumerate(city_map.crossings):
        if crossing.name in names:
            yield f"crossings[{index}].name: {crossing.name!r} is already that of a junction"


def _sign(
    where: str, sign: Sign, lanes: Mapping[str, Lane], lines: Sequence[tuple[str, float]]
) -> Iterator[str]:
    """Doubt one sign: its kind, its lane, its value, the line it means."""
    if sign.kind not in SIGN_KINDS:
        known = nearest(sign.kind, list(SIGN_KINDS))
        yield f"{where}.kind: no kind {sign.kind!r}{known}; expected one of {', '.join(SIGN_KINDS)}"
    if (sign.value_mps is not None) != (sign.kind == SPEED_LIMIT):
        wanted = "a speed" if sign.kind == SPEED_LIMIT else f"none for {sign.kind}"
        yield f"{where}.value_mps: expected {wanted}, got {sign.value_mps}"
    if (sign.lane is None) != (sign.at_m is None):
        yield f"{where}: expected lane and at_m together or neither, got one of them"
    if sign.lane is None or sign.at_m is None:
        return
    if sign.lane not in lanes:
        yield f"{where}.lane: no lane {sign.lane!r}{nearest(sign.lane, list(lanes))}"
        return
    yield from _place(f"{where}.at_m", sign.at_m, lanes[sign.lane])
    if sign.kind in PRECEDENCE and not any(
        lane == sign.lane and abs(at - sign.at_m) <= LINE_DISTANCE_M for lane, at in lines
    ):
        yield (
            f"{where}: expected a line within {LINE_DISTANCE_M} m of at_m = {sign.at_m} on lane "
            f"{sign.lane!r} at which cars {sign.kind.replace('_', ' ')}, got none"
        )


def _ways_left(city_map: CityMap, lanes: Mapping[str, Lane]) -> Iterator[str]:
    """Doubt that turn signs leave a way."""
    turns: dict[str, list[Sign]] = {}
    for sign in city_map.signs:
        if sign.kind in TURNS and sign.lane in lanes:
            turns.setdefault(sign.lane or "", []).append(sign)
    for name, signs in turns.items():
        lane = lanes[name]
        known = all(after in lanes for after in lane.next)
        if known and lane.next and not allowed_next(lane, lanes, tuple(signs)):
            kinds = " and ".join(sign.kind for sign in signs)
            yield (
                f"signs ({', '.join(str(sign.sign_id) for sign in signs)}): {kinds} leave no way "
                f"from lane {name!r}; expected one of {', '.join(lane.next)} to be allowed"
            )


def _approach(where: str, approach: Approach, lanes: Mapping[str, Lane]) -> Iterator[str]:
    """Doubt the line of an approach, and that its ways lead over the crossing from there."""
    if approach.lane not in lanes:
        yield f"{where}.lane: no lane {approach.lane!r}{nearest(approach.lane, list(lanes))}"
        return
    yield from _place(f"{where}.at_m", approach.at_m, lanes[approach.lane])
    if not approach.ways:
        yield f"{where}.ways: expected at least one, got none"
    reached = _reached(approach.lane, lanes)
    for number, way in enumerate(approach.ways):
        yield from _way(f"{where}.ways[{number}]", way, approach, lanes, reached)


def _way(
    where: str,
    way: Conflict,
    approach: Approach,
    lanes: Mapping[str, Lane],
    reached: frozenset[str],
) -> Iterator[str]:
    if way.lane not in lanes:
        yield f"{where}.lane: no lane {way.lane!r}{nearest(way.lane, list(lanes))}"
        return
    yield from _place(f"{where}.from_m", way.from_m, lanes[way.lane])
    yield from _place(f"{where}.to_m", way.to_m, lanes[way.lane])
    if way.from_m >= way.to_m:
        yield f"{where}.to_m: expected more than from_m = {way.from_m}, got {way.to_m}"
    if way.lane not in reached:
        names = ", ".join(sorted(reached))
        yield (
            f"{where}.lane: {way.lane!r} does not follow lane {approach.lane!r}; expected one of "
            f"{names}"
        )
    elif way.lane == approach.lane and way.from_m < approach.at_m:
        yield f"{where}.from_m: expected at least at_m = {approach.at_m}, got {way.from_m}"


def _reached(start: str, lanes: Mapping[str, Lane]) -> frozenset[str]:
    """Return a lane and those that follow it soon."""
    found, edge = {start}, {start}
    for _ in range(MAX_DEPTH):
        edge = {name for lane in edge for name in lanes[lane].next if name in lanes} - found
        found |= edge
    return frozenset(found)


def _place(where: str, at_m: float, lane: Lane) -> Iterator[str]:
    length = sum(extent(segment)[0] for segment in lane.segments)
    if not 0.0 <= at_m <= length + 1e-9:
        yield f"{where}: expected 0 to {length:.4f} (the length of lane {lane.name!r}), got {at_m}"
