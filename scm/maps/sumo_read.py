"""A SUMO network as plain records, through `sumolib`: lanes, connections, kinds of junctions.

OpenStreetMap and OpenDRIVE become SUMO networks by `netconvert`, which comes with SUMO.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scm.errors import MapError
from scm.maps.model import Point

CAR = "passenger"
_FOREIGN = {
    ".osm": "netconvert --osm-files {} -o {}.net.xml",
    ".xodr": "netconvert --opendrive-files {} -o {}.net.xml",
}


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
        direction: SUMO's: `s` straight, `l`, `r`, `L`, `R`, `t` back again.
        state: SUMO's: `M` has priority, `m` gives way, `=` right before left, `s` stop, `w` all
            stop, `o` and `O` under a signal.
        signal: The traffic light that holds it; empty: none.
        number: Its place in the states of that light's phases; -1: none.
    """

    start: str
    end: str
    node: str
    direction: str
    state: str
    signal: str
    number: int


@dataclass(frozen=True, slots=True)
class NetPhase:
    """How long a traffic light shows what: a letter for each link, `G` and `g` are green."""

    duration_s: float
    state: str


@dataclass(frozen=True, slots=True)
class Net:
    """What is imported of a network; shapes by junction, programs by traffic light."""

    name: str
    lanes: tuple[NetLane, ...]
    links: tuple[NetLink, ...]
    shapes: dict[str, tuple[Point, ...]]
    programs: dict[str, tuple[NetPhase, ...]]


def read_net(path: Path) -> Net:
    """Return what a network holds for cars.

    Raises:
        MapError: sumolib is missing, the file cannot be read, or it has no lane for cars.
    """
    if not path.is_file():
        raise MapError(f"{path}: there is no such file; expected a SUMO network (.net.xml)")
    if path.suffix in _FOREIGN:
        call = _FOREIGN[path.suffix].format(path, path.stem)
        raise MapError(f"{path}: expected a SUMO network; convert it first: {call}")
    try:
        import sumolib  # noqa: PLC0415 an extra
    except ImportError as error:
        raise MapError(
            f"{path}: SUMO networks are read by sumolib, which is missing: pip install 'scm[sumo]'"
        ) from error
    try:
        net = sumolib.net.readNet(str(path), withPrograms=True)
    except Exception as error:
        why = f"{error} is missing" if isinstance(error, KeyError) else error
        raise MapError(f"{path}: cannot be read as a SUMO network: {why}") from error
    lanes = tuple(_lanes(net))
    if not lanes:
        raise MapError(f"{path}: expected lanes for cars (class {CAR}), got none")
    names = {lane.name for lane in lanes}
    links = tuple(link for link in _links(net) if link.start in names and link.end in names)
    shapes = {node.getID(): _flat(node.getShape()) for node in net.getNodes()}
    programs = {light.getID(): _phases(light) for light in net.getTrafficLights()}
    return Net(path.name.removesuffix(".net.xml"), lanes, links, shapes, programs)


def plain(name: str) -> str:
    """Return a SUMO id as a name of ours: other characters become underscores."""
    return re.sub(r"[^A-Za-z0-9_.#-]", "_", name)


def _lanes(net: Any) -> list[NetLane]:
    return [
        NetLane(
            plain(lane.getID()),
            plain(edge.getID()),
            _flat(lane.getShape()),
            float(lane.getWidth()),
            float(lane.getSpeed()),
        )
        for edge in net.getEdges(withInternal=False)
        for lane in edge.getLanes()
        if lane.allows(CAR) and len(lane.getShape()) > 1
    ]


def _links(net: Any) -> list[NetLink]:
    return [
        NetLink(
            plain(link.getFromLane().getID()),
            plain(link.getToLane().getID()),
            edge.getToNode().getID(),
            link.getDirection(),
            link.getState(),
            link.getTLSID() or "",
            int(link.getTLLinkIndex()),
        )
        for edge in net.getEdges(withInternal=False)
        for links in edge.getOutgoing().values()
        for link in links
    ]


def _phases(light: Any) -> tuple[NetPhase, ...]:
    """Return the phases of a light's program `0`, or of its first."""
    programs = light.getPrograms()
    if not programs:
        return ()
    program = programs.get("0") or next(iter(programs.values()))
    return tuple(NetPhase(float(p.duration), str(p.state)) for p in program.getPhases())


def _flat(shape: Any) -> tuple[Point, ...]:
    """Return a shape without heights and without points that repeat the one before."""
    points: list[Point] = []
    for point in shape:
        flat = (float(point[0]), float(point[1]))
        if not points or flat != points[-1]:
            points.append(flat)
    return tuple(points)
