"""SUMO's route files: who sets out when, from where, by which way, as SUMO reads them.

    number with end          so many, evenly spread from begin to end
    vehsPerHour, period      evenly, until end, or until there were `number` of them
    period="exp(rate)"       at random, `rate` a second (Poisson)
    probability              each second one with this probability
    begin, end, depart       seconds, h:m:s, or days:h:m:s; an <interval>'s hold for its flows
    route, via               edges that are passed one after the other
    departLane, arrivalLane  a number is that lane; in words, the one of the quickest way
    distributions            of routes and of types: a draw for each car

What cannot be followed is refused. What only says how SUMO's drivers or pictures are (`NO_EFFECT`)
is reported.
"""

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import accumulate, islice, takewhile
from itertools import count as counting
from pathlib import Path
from random import Random
from typing import NamedTuple, TypeVar
from xml.etree import ElementTree

from scm.errors import DemandError, nearest, reading
from scm.maps.sumo_read import plain
from scm.vehicles.car_files import car_files

Element = ElementTree.Element

DAY_S = 86_400.0
HOUR_S = 3600.0
MAX_CARS_PER_FLOW = 100_000  # of a flow; 3600 an hour are 86 400 a day
DEFAULT_CAR = "nigel"
DEFAULT_TYPE = "DEFAULT_VEHTYPE"
CAR_CLASSES = ("passenger", "private", "taxi", "hov", "evehicle", "ignoring")
RATES = ("vehsPerHour", "perHour", "period", "probability")
LANES = frozenset({"random", "free", "allowed", "best", "best_prob", "first", "current"})
NO_EFFECT = frozenset({
    "color", "departPos", "departSpeed", "departPosLat", "arrivalPos", "arrivalSpeed",
    "arrivalPosLat", "speedFactor", "insertionChecks", "parkingBadges", "line", "reroute",
    "arrival", "exitTimes", "cost", "savings", "routeLength", "last",
})  # fmt: skip
_EXPONENTIAL = re.compile(r"exp\((?P<rate>[^()]*)\)")
_WHO = {"id", "type", "route", "from", "to", "via", "departLane", "arrivalLane"}
_READ = {
    "flow": {*_WHO, "begin", "end", "number", *RATES},
    "trip": {*_WHO, "depart"},
    "vehicle": {*_WHO, "depart"},
    "route": {"id", "edges", "refId", "probability"},
    "routeDistribution": {"id", "routes", "probabilities"},
    "vTypeDistribution": {"id", "vTypes", "probabilities"},
    "interval": {"id", "begin", "end"},
}
_INSIDE = {
    "flow": {"route", "routeDistribution"},
    "vehicle": {"route", "routeDistribution"},
    "routeDistribution": {"route"},
    "vTypeDistribution": {"vType"},
    "interval": {"flow", "trip", "vehicle"},
    "routes": {*_READ, "vType"},
}


Thing = TypeVar("Thing")
Drawn = list[tuple[float, Thing]]  # things, each with its weight


class Way(NamedTuple):
    """Edges that a car passes, by the names that an imported map has for them."""

    start: str
    via: tuple[str, ...]
    end: str


class Departures(NamedTuple):
    """Cars that go the same way, and when they want to set out [s of the day]."""

    name: str
    way: Way
    car: str
    at_s: tuple[float, ...]


def read_routes(path: Path, warn: Callable[[str], None]) -> list[Departures]:
    """Return who sets out by a SUMO route file.

    Args:
        path: Of the file.
        warn: Called with what the file says and has no effect here.

    Raises:
        DemandError: naming element and attribute of what is wrong, or cannot be followed.
    """
    with reading(path, "an XML file", DemandError):
        root = ElementTree.parse(path).getroot()
    if root.tag != "routes":
        raise DemandError(f"{path}: expected a SUMO route file, <routes>, got <{root.tag}>")
    idle: Counter[str] = Counter()
    _check(root, path, idle)
    if idle:
        known = ", ".join(f"{key} ({count})" for key, count in sorted(idle.items()))
        warn(f"{path}: no effect here, where cars drive as their car files say: {known}")
    _check_ids(root, path)
    file = _RouteFile(root, path)
    return [row for entry, interval in _entries(root) for row in file.departures(entry, interval)]


def _check_ids(root: Element, path: Path) -> None:
    ids = Counter((entry.tag == "flow", entry.get("id")) for entry, _ in _entries(root))
    for (is_flow, name), count in ids.items():
        if count > 1:
            what = "flows" if is_flow else "cars"
            raise DemandError(f"{path}: {count} {what} have the id {name!r}, expected each once")


def number_of(given: object, where: str) -> float:
    """Return a number that is not negative; DemandError otherwise."""
    try:
        value = float(str(given))
    except ValueError as error:
        raise DemandError(f"{where}: expected a number, got {given!r}") from error
    if not 0.0 <= value < math.inf:
        raise DemandError(f"{where}: expected 0 or more, got {given!r}")
    return value


def _check(element: Element, path: Path, idle: Counter[str]) -> None:
    """Refuse elements and attributes that nothing here reads; count those without effect."""
    for child in element:
        where = _where(path, child)
        if child.tag == "vType":
            _check_type(child, where, idle)
        elif child.tag == "param":
            idle["param"] += 1
        elif child.tag not in _INSIDE.get(element.tag, ()):
            msg = f"not read in <{element.tag}>, only cars and their ways are; take it out"
            raise DemandError(f"{where}: {msg}")
        else:
            _check_keys(child, where, idle)
            _check(child, path, idle)


def _check_keys(element: Element, where: str, idle: Counter[str]) -> None:
    read = _READ[element.tag]
    for key in element.attrib.keys() - read:
        if key not in NO_EFFECT:
            known = ", ".join(sorted(read))
            raise DemandError(f"{where}: {key} is not read{nearest(key, [*read])}, only {known}")
        idle[key] += 1


def _check_type(element: Element, where: str, idle: Counter[str]) -> None:
    """Refuse types of what is no car, or of other numbers of them; their driving has no effect."""
    if (kind := element.get("vClass", "passenger")) not in CAR_CLASSES:
        known = ", ".join(CAR_CLASSES)
        raise DemandError(f"{where}: vClass: only cars drive here: expected {known}, got {kind!r}")
    if number_of(element.get("scale", "1"), f"{where}: scale") != 1.0:
        raise DemandError(f"{where}: scale: expected 1; give its flows other numbers instead")
    for key in element.attrib.keys() - {"id", "vClass", "scale", "probability"}:
        idle[f"vType {key}"] += 1


def _where(path: Path, element: Element) -> str:
    return f"{path}: {_name(element)}"


def _name(element: Element) -> str:
    name = element.get("id")
    return element.tag if name is None else f"{element.tag} {name!r}"


def _entries(root: Element) -> Iterator[tuple[Element, Mapping[str, str]]]:
    """Yield flows, trips and vehicles, each with the attributes of the interval it stands in."""
    for element in root:
        if element.tag == "interval":
            yield from ((child, element.attrib) for child in element if child.tag != "param")
        elif element.tag in {"flow", "trip", "vehicle"}:
            yield element, {}


class _RouteFile:
    """What a route file defines by name: ways, cars, and distributions of them."""

    def __init__(self, root: Element, path: Path) -> None:
        self._path = path
        self._car_files = car_files()
        self._ways: dict[str, Drawn[Way]] = {}
        self._cars: dict[str, Drawn[str]] = {}
        for element in root:
            name = element.get("id", "")
            if element.tag in {"route", "routeDistribution"}:
                self._ways[name] = self._ways_in(element)
            elif element.tag in {"vType", "vTypeDistribution"}:
                self._cars[name] = self._cars_in(element)

    def departures(self, entry: Element, interval: Mapping[str, str]) -> list[Departures]:
        """Return who sets out by a flow, trip or vehicle: a row for each way and car."""
        where, random = _where(self._path, entry), Random(entry.get("id"))
        if entry.tag == "flow":
            times = _flow_times(entry.attrib, interval, random, where)
        else:
            times = [_seconds(entry.get("depart", ""), f"{where}: depart")]
        ways, cars = self._ways_of(entry, where), self._cars_of(entry, where)
        found: dict[tuple[Way, str], list[float]] = {}
        for at_s in times:
            way = _on_lanes(_draw(ways, random), entry, where)
            found.setdefault((way, _draw(cars, random)), []).append(at_s)
        return [Departures(_name(entry), *pair, tuple(at_s)) for pair, at_s in found.items()]

    def _ways_of(self, entry: Element, where: str) -> Drawn[Way]:
        """Return the ways of a flow, trip or vehicle."""
        own = [child for child in entry if child.tag in {"route", "routeDistribution"}]
        given = [key for key in ("route", "from", "to") if key in entry.attrib]
        if len(own) == 1 and not given:
            return self._ways_in(own[0])
        if given == ["route"] and not own:
            return _known(self._ways, entry.get("route", ""), f"{where}: route")
        if given == ["from", "to"] and not own:
            edges = (entry.get("from", ""), *entry.get("via", "").split(), entry.get("to", ""))
            return [(1.0, _way(edges, where))]
        got = " and ".join([*given, *(child.tag for child in own)]) or "none of them"
        raise DemandError(f"{where}: expected from and to, or one route; got {got}")

    def _ways_in(self, element: Element) -> Drawn[Way]:
        """Return the ways of a route or of a distribution of routes."""
        where = _where(self._path, element)
        if element.tag == "routeDistribution":
            return _mixed(element, ("route", "routes"), self._ways, self._ways_in, where)
        if (other := element.get("refId")) is not None:
            return _known(self._ways, other, f"{where}: refId")
        return [(1.0, _way(element.get("edges", "").split(), f"{where}: edges"))]

    def _cars_of(self, entry: Element, where: str) -> Drawn[str]:
        """Return the cars of a flow, trip or vehicle."""
        name = entry.get("type", DEFAULT_TYPE)
        if name not in self._cars and name in {DEFAULT_TYPE, *self._car_files}:
            return [(1.0, DEFAULT_CAR if name == DEFAULT_TYPE else name)]
        return _known(self._cars, name, f"{where}: type", self._car_files)

    def _cars_in(self, element: Element) -> Drawn[str]:
        """Return the cars that stand for a type or a distribution of types."""
        if element.tag == "vTypeDistribution":
            where = _where(self._path, element)
            return _mixed(element, ("vType", "vTypes"), self._cars, self._cars_in, where)
        name = element.get("id", "")
        return [(1.0, name if name in self._car_files else DEFAULT_CAR)]


def _way(edges: Sequence[str], where: str) -> Way:
    if not edges:
        raise DemandError(f"{where}: expected at least one edge, got none")
    start, *rest = [plain(edge) for edge in edges]
    return Way(start, tuple(rest[:-1]), rest[-1] if rest else start)


def _on_lanes(way: Way, entry: Element, where: str) -> Way:
    """Return a way from and to the very lanes that an entry names by number."""

    def on_lane(edge: str, key: str) -> str:
        lane = entry.get(key, "best")
        return edge if lane in LANES else f"{edge}_{_count(lane, f'{where}: {key}')}"

    return Way(on_lane(way.start, "departLane"), way.via, on_lane(way.end, "arrivalLane"))


def _known(
    table: Mapping[str, Drawn[Thing]], name: str, where: str, more: Iterable[str] = ()
) -> Drawn[Thing]:
    if name not in table:
        hint = nearest(name, [*table, *more])
        raise DemandError(f"{where}: the file defines no {name!r}{hint}")
    return table[name]


def _mixed(
    element: Element,
    keys: tuple[str, str],
    table: dict[str, Drawn[Thing]],
    things_in: Callable[[Element], Drawn[Thing]],
    where: str,
) -> Drawn[Thing]:
    """Return what a distribution draws from: its children, and those that it names."""
    parts: list[tuple[str, Drawn[Thing]]] = []
    for child in element.iterfind(keys[0]):
        things = things_in(child)
        table.setdefault(child.get("id", ""), things)
        parts.append((child.get("probability", "1"), things))
    names = element.get(keys[1], "").split()
    weights = element.get("probabilities", "").split() or ["1"] * len(names)
    if len(weights) != len(names):
        msg = f"expected one for each of {len(names)}, got {len(weights)}"
        raise DemandError(f"{where}: probabilities: {msg}")
    parts += [
        (weight, _known(table, name, f"{where}: {keys[1]}"))
        for weight, name in zip(weights, names, strict=True)
    ]
    found = [
        (number_of(weight, f"{where}: probability") * share, thing)
        for weight, things in parts
        for share, thing in things
    ]
    if not sum(weight for weight, _ in found) > 0.0:
        raise DemandError(f"{where}: expected something to draw from, got nothing")
    return found


def _draw(things: Drawn[Thing], random: Random) -> Thing:
    if len(things) == 1:
        return things[0][1]
    return random.choices([thing for _, thing in things], [weight for weight, _ in things])[0]


def _flow_times(
    own: Mapping[str, str], interval: Mapping[str, str], random: Random, where: str
) -> list[float]:
    """Return when a flow's cars set out; its interval says what it does not say itself."""
    rates = [key for key in RATES if key in own]
    if len(rates) > 1 or (rates and {"end", "number"} <= own.keys()):
        got = " and ".join([*rates, *(key for key in ("end", "number") if key in own)])
        msg = f"expected one of {', '.join(RATES)}, with end or number; got {got}"
        raise DemandError(f"{where}: {msg}")
    most = _count(own["number"], f"{where}: number") if "number" in own else MAX_CARS_PER_FLOW + 1
    is_open = bool(rates) and "number" in own
    begin_s, end_s = _span({**interval, **own}, is_open=is_open, where=where)
    if rates:
        key = rates[0]
        times = _times_by(key, own[key], begin_s, random, f"{where}: {key}")
    elif "number" in own:
        times = _evenly(begin_s, (end_s - begin_s) / max(1, most), f"{where}: number")
    else:
        raise DemandError(f"{where}: expected number or one of {', '.join(RATES)}")
    found = list(
        islice(takewhile(lambda at_s: at_s < end_s, times), min(most, MAX_CARS_PER_FLOW + 1))
    )
    if len(found) > MAX_CARS_PER_FLOW:
        raise DemandError(f"{where}: expected at most {MAX_CARS_PER_FLOW} cars in a flow, got more")
    return found


def _span(given: Mapping[str, str], *, is_open: bool, where: str) -> tuple[float, float]:
    """Return when a flow begins and ends: with the day, unless it ends with its number."""
    begin_s = _seconds(given.get("begin", "0"), f"{where}: begin")
    if "end" in given:
        end_s = _seconds(given["end"], f"{where}: end")
    else:
        end_s = math.inf if is_open else max(DAY_S, begin_s + 1.0)
    if begin_s >= end_s:
        raise DemandError(f"{where}: end: expected after begin = {begin_s:g} s, got {end_s:g} s")
    return begin_s, end_s


def _times_by(
    key: str, value: str, begin_s: float, random: Random, where: str
) -> Iterator[float]:  # fmt: skip
    """Return the times of a flow's rate, without end."""
    if key == "probability":
        share = _positive(value, where)
        if share > 1.0:
            raise DemandError(f"{where}: expected at most 1, got {value!r}")
        return _by_chance(begin_s, share, random)
    if key == "period" and (found := _EXPONENTIAL.fullmatch(value.strip())):
        rate = _positive(found["rate"], where)
        _check_gap(1.0 / rate, where)
        gaps = (random.expovariate(rate) for _ in counting())
        return islice(accumulate(gaps, initial=begin_s), 1, None)
    if key == "period":
        return _evenly(begin_s, _seconds(value, where), where)
    return _evenly(begin_s, HOUR_S / _positive(value, where), where)


def _by_chance(begin_s: float, share: float, random: Random) -> Iterator[float]:
    """Yield the seconds in which a car sets out, each with the same probability."""
    at_s = begin_s - 1.0
    while True:
        misses = math.log(1.0 - random.random()) / math.log1p(-share) if share < 1.0 else 0.0
        at_s += 1.0 + math.floor(misses)
        yield at_s


def _evenly(begin_s: float, gap_s: float, where: str) -> Iterator[float]:
    _check_gap(gap_s, where)
    return (begin_s + k * gap_s for k in counting())


def _check_gap(gap_s: float, where: str) -> None:
    if gap_s < 1.0:
        got = f"got one each {gap_s:g} s"
        raise DemandError(f"{where}: expected at most {HOUR_S:g} cars an hour, {got}")


def _positive(given: str, where: str) -> float:
    value = number_of(given, where)
    if value == 0.0:
        raise DemandError(f"{where}: expected more than 0, got {given!r}")
    return value


def _count(given: str, where: str) -> int:
    value = number_of(given, where)
    if not value.is_integer():
        raise DemandError(f"{where}: expected a whole number, got {given!r}")
    return int(value)


def _seconds(given: str, where: str) -> float:
    """Return a time in seconds, from seconds, h:m:s or days:h:m:s."""
    parts = given.split(":")
    try:
        if len(parts) in {1, 3, 4}:
            units = (1.0, 60.0, 3600.0, DAY_S)
            return sum(
                number_of(part, where) * unit
                for part, unit in zip(reversed(parts), units, strict=False)
            )
    except DemandError:
        pass
    raise DemandError(f"{where}: expected seconds, h:m:s or days:h:m:s, got {given!r}")
