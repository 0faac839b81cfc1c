"""A SUMO network as plain records, through `sumolib`: lanes, connections, signal programs.

OpenStreetMap and OpenDRIVE become SUMO networks by `netconvert`, which comes with SUMO.
"""

import math
import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal
from urllib.parse import quote
from xml.etree import ElementTree

from scm.errors import MapError, reading
from scm.records.city_map import Point

CAR = "passenger"
LETTERS = frozenset("rugGsyYoO")
OFF = frozenset("oO")
_FOREIGN = {
    ".osm": "netconvert --osm-files {} -o {}.net.xml",
    ".xodr": "netconvert --opendrive-files {} -o {}.net.xml",
}
_PLAIN = frozenset("_.#-")


@dataclass(frozen=True, slots=True)
class NetHead:
    """What a network's first lines say; full-scale metres.

    Attributes:
        size_m: Width and depth; None: the file does not say.
        drives_on: The side of the road.
    """

    size_m: tuple[float, float] | None
    drives_on: Literal["right", "left"]


@dataclass(frozen=True, slots=True)
class NetLane:
    """A lane for cars; full-scale metres and m/s."""

    name: str
    edge: str
    points: tuple[Point, ...]
    width_m: float
    speed_mps: float


@dataclass(frozen=True, slots=True)
class NetLink:
    """A way from one lane to another over a junction.

    Attributes:
        direction: SUMO's: `s` straight, `l`, `r`, `L`, `R`, `t` and `T` back again.
        state: SUMO's: `M` has priority, `m` gives way, `=` right before left, `s` stop, `w` all
            stop, `o` and `O` under a signal.
        signal: The traffic light that controls it; empty: none.
        number: Its place in the states of that light's phases; -1: none.
    """

    start: str
    end: str
    node: str
    direction: str
    state: str
    signal: str
    number: int

    @property
    def turns_back(self) -> bool:
        """Whether it leads back to where it comes from."""
        return self.direction in {"t", "T"}


@dataclass(frozen=True, slots=True)
class NetPhase:
    """How long a traffic light shows what, a letter for each link.

    Attributes:
        state: `G`, `g` green; `y`, `Y` yellow; `r` red; `u` red and yellow; `s` red, but a turn
            may go after a stop; `o`, `O` off.
        following: Numbers of the phases that may come next; empty: the next one.
    """

    duration_s: float
    state: str
    following: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Net:
    """What is imported of a network.

    Attributes:
        shapes: Of junctions.
        programs: By traffic light, the one that SUMO would run: the last.
        renamed: Edges whose id holds characters that no name here may have: id, name.
    """

    name: str
    head: NetHead
    lanes: tuple[NetLane, ...]
    links: tuple[NetLink, ...]
    shapes: Mapping[str, tuple[Point, ...]]
    programs: Mapping[str, tuple[NetPhase, ...]]
    renamed: Mapping[str, str]


def read_head(path: Path) -> NetHead:
    """Return what a network says before its first edge, without reading on.

    Raises:
        MapError: there is no such file, or it is no SUMO network.
    """
    if not path.is_file():
        raise MapError(f"{path}: there is no such file; expected a SUMO network (.net.xml)")
    if path.suffix in _FOREIGN:
        call = _FOREIGN[path.suffix].format(path, path.stem)
        raise MapError(f"{path}: expected a SUMO network; convert it first: {call}")
    head = NetHead(None, "right")
    with reading(path, "a SUMO network", MapError), path.open("rb") as file:
        for number, (_, element) in enumerate(ElementTree.iterparse(file, ["start"])):
            if number == 0:
                _check_root(path, element.tag)
                on_left = element.get("lefthand") in {"1", "true", "yes", "on", "t", "True"}
                head = replace(head, drives_on="left" if on_left else "right")
            elif element.tag == "location":
                return replace(head, size_m=_size(element.get("convBoundary", "")))
            elif element.tag in {"edge", "junction"}:
                break
    return head


def _check_root(path: Path, tag: str) -> None:
    if tag != "net":
        raise MapError(f"{path}: expected a SUMO network, which begins with <net>; got <{tag}>")


def _size(boundary: str) -> tuple[float, float] | None:
    try:
        left, low, right, high = map(float, boundary.split(","))
    except ValueError:
        return None
    return right - left, high - low


def read_net(path: Path) -> Net:
    """Return what a network holds for cars.

    Raises:
        MapError: sumolib is missing, the file cannot be read, or it has no lane for cars.
    """
    head = read_head(path)
    try:
        import sumolib  # noqa: PLC0415 an extra
    except ImportError as error:
        raise MapError(
            f"{path}: SUMO networks are read by sumolib, which is missing: pip install 'scm[sumo]'"
        ) from error
    try:
        net = sumolib.net.readNet(str(path), withLatestPrograms=True)
    except Exception as error:
        why = f"{error} is missing" if isinstance(error, KeyError) else error
        raise MapError(f"{path}: cannot be read as a SUMO network: {why}") from error
    edges = {edge.getID(): plain(edge.getID()) for edge in net.getEdges(withInternal=False)}
    lanes = tuple(_lanes(net, edges))
    if not lanes:
        raise MapError(f"{path}: expected lanes for cars (class {CAR}), got none")
    for lane in lanes:
        if not 0.0 < lane.speed_mps < math.inf or not 0.0 < lane.width_m < math.inf:
            got = f"{lane.speed_mps:g} m/s, {lane.width_m:g} m"
            raise MapError(f"{path}: lane {lane.name!r}: expected a speed and a width, got {got}")
    programs = {light.getID(): _phases(light) for light in net.getTrafficLights()}
    links = _links(net, edges, {lane.name for lane in lanes})
    _check_programs(path, links, programs)
    return Net(
        name=path.name.removesuffix(".net.xml"),
        head=head,
        lanes=lanes,
        links=tuple(_without_dark(links, programs)),
        shapes={node.getID(): _flat(node.getShape()) for node in net.getNodes()},
        programs=programs,
        renamed={edge: name for edge, name in edges.items() if edge != name},
    )


def plain(name: str) -> str:
    """Return a SUMO id as a name of ours, another one for each id.

    Letters of any script, digits, `_`, `.`, `#` and `-` stay; what else there is, and dots after
    a dot, are percent-encoded, as in a URL: `a/b` is `a%2Fb`.
    """
    encoded = "".join(c if _is_plain(c) else quote(c, safe="") for c in name)
    return re.sub(r"(?<=\.)\.", "%2E", encoded)  # `..` joins lanes to ways


def _is_plain(c: str) -> bool:
    if c.isascii():
        return c.isalnum() or c in _PLAIN
    return unicodedata.category(c)[0] not in "CZ"


def _lanes(net: Any, edges: Mapping[str, str]) -> Iterator[NetLane]:
    for edge in net.getEdges(withInternal=False):
        for lane in edge.getLanes():
            points = _flat(lane.getShape())
            if lane.allows(CAR) and len(points) > 1:
                yield NetLane(
                    name=_lane_name(lane, edges),
                    edge=edges[edge.getID()],
                    points=points,
                    width_m=float(lane.getWidth()),
                    speed_mps=float(lane.getSpeed()),
                )


def _lane_name(lane: Any, edges: Mapping[str, str]) -> str:
    return f"{edges[lane.getEdge().getID()]}_{lane.getIndex()}"


def _links(net: Any, edges: Mapping[str, str], lanes: set[str]) -> list[NetLink]:
    """Return the ways between lanes for cars, each once."""
    found: dict[tuple[str, str], NetLink] = {}
    for edge in net.getEdges(withInternal=False):
        for link in (link for links in edge.getOutgoing().values() for link in links):
            start = _lane_name(link.getFromLane(), edges)
            end = _lane_name(link.getToLane(), edges)
            if start in lanes and end in lanes:
                found.setdefault(
                    (start, end),
                    NetLink(
                        start=start,
                        end=end,
                        node=edge.getToNode().getID(),
                        direction=link.getDirection(),
                        state=link.getState(),
                        signal=link.getTLSID() or "",
                        number=int(link.getTLLinkIndex()),
                    ),
                )
    return list(found.values())


def _phases(light: Any) -> tuple[NetPhase, ...]:
    programs = list(light.getPrograms().values())
    if not programs:
        return ()
    return tuple(
        NetPhase(float(phase.duration), str(phase.state), tuple(phase.next))
        for phase in programs[-1].getPhases()
    )


def _check_programs(
    path: Path, links: Iterable[NetLink], programs: Mapping[str, tuple[NetPhase, ...]]
) -> None:
    """Refuse programs that do not say what each link is shown.

    Raises:
        MapError: naming the light and the phase.
    """
    for link in links:
        for number, phase in enumerate(programs.get(link.signal, ()), start=1):
            where = f"{path}: traffic light {link.signal!r}: phase {number}, state {phase.state!r}"
            if not 0 <= link.number < len(phase.state):
                raise MapError(
                    f"{where}: expected a letter for each link, got {len(phase.state)} and the "
                    f"link {link.number} from {link.start!r} to {link.end!r}: let netconvert "
                    f"write its program anew (--tls.rebuild)"
                )
            if not 0.0 <= phase.duration_s < math.inf:
                raise MapError(f"{where}: duration: expected 0 s or more, got {phase.duration_s:g}")
            unknown = sorted(set(phase.state) - LETTERS)
            if unknown:
                raise MapError(
                    f"{where}: expected letters of {''.join(sorted(LETTERS))}, got "
                    f"{', '.join(map(repr, unknown))}"
                )


def _without_dark(
    links: Iterable[NetLink], programs: Mapping[str, tuple[NetPhase, ...]]
) -> Iterator[NetLink]:
    """Yield links; one whose light is always off has no signal: `O` goes first, `o` gives way."""
    for link in links:
        shown = {phase.state[link.number] for phase in programs.get(link.signal, ())}
        if shown and shown <= OFF:
            state = "M" if shown == {"O"} else "m"
            yield replace(link, state=state, signal="", number=-1)
        else:
            yield link


def _flat(shape: Any) -> tuple[Point, ...]:
    """Return a shape without heights and without points that repeat the one before."""
    points: list[Point] = []
    for point in shape:
        flat = (float(point[0]), float(point[1]))
        if not points or flat != points[-1]:
            points.append(flat)
    return tuple(points)
