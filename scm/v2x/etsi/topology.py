"""The lanes of a junction for MAPEM, built from a map file.

Lanes in are numbered from 1 in the order of the signal groups and their stop lines, then the lanes
out. SREM and SSEM refer to lanes by these numbers. A node list runs from the stop line outwards in
steps of 0.1 m of the table, up to its maximum length.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

from msgspec.structs import replace

from scm.errors import MapError
from scm.geometry import wrap_angle
from scm.maps.route import Roads
from scm.records.city_map import Junction
from scm.v2x.etsi.cam_spatem import SCALE
from scm.v2x.etsi.convert import REVISIONS, moment_of, position_of, roadside_station, station_id
from scm.v2x.etsi.mapem import (
    FARTHEST_CM,
    LEFT,
    MAX_APPROACHES,
    MAX_CONNECTIONS,
    MAX_LANE_WIDTH_CM,
    MAX_LANES,
    MAX_NODES,
    MAX_VELOCITY,
    RIGHT,
    STRAIGHT,
    U_TURN,
    ConnectingLane,
    Connection,
    IntersectionGeometry,
    LaneAttributes,
    MapemBody,
    MapLane,
    Node,
    NodeDelta,
    NodeList,
    NodeXy,
    Position3d,
    SpeedLimit,
)
from scm.v2x.etsi.parts import PROTOCOL_VERSION, IntersectionId

NODE_M = 0.1
_REST_M = 0.05
_CM = SCALE * 100.0
_PER_SPEED_STEP = SCALE / 0.02
_MANOEUVRE_BITS = 12


class Stretch(NamedTuple):
    """A lane of the map from `near_m` at the junction to `far_m` away from it."""

    lane: str
    near_m: float
    far_m: float


class Way(NamedTuple):
    """A path over the junction: numbers of the lanes in and out, and of the signal group."""

    lane_in: int
    lane_out: int
    group: int


class Topology(NamedTuple):
    """The numbered lanes of one junction; `group_in` has the group name of each lane in."""

    lanes_in: tuple[Stretch, ...]
    group_in: tuple[str, ...]
    lanes_out: tuple[Stretch, ...]
    ways: tuple[Way, ...]

    def lane_in(self, group: str) -> int | None:
        """Return the number of the first lane in that a group releases, or None."""
        return self.group_in.index(group) + 1 if group in self.group_in else None

    def group_of(self, lane: int) -> str | None:
        """Return the group that releases a lane in, or None if there is no such lane."""
        return self.group_in[lane - 1] if 1 <= lane <= len(self.group_in) else None

    def lane_out(self, name: str) -> int | None:
        """Return the number of the lane out on a lane of the map, or None."""
        numbers = (n for n, out in enumerate(self.lanes_out, len(self.lanes_in) + 1))
        return next(
            (n for n, out in zip(numbers, self.lanes_out, strict=True) if out.lane == name), None
        )


def topology_of(roads: Roads, junction: Junction) -> Topology:
    """Return the numbered lanes of a junction and the paths between them."""
    lanes_in: list[Stretch] = []
    group_in: list[str] = []
    leads: list[tuple[int, int, list[Stretch]]] = []
    for group in junction.groups:
        lines = roads.stop_lines_of(junction.name, group.name)
        starts = [(line.lane, line.at_m) for line in lines]
        for lane, at_m in starts or [(group.movement.lane, group.movement.from_m)]:
            lanes_in.append(Stretch(lane, at_m, 0.0))
            group_in.append(group.name)
            ends = [
                end for move in group.movements for end in _ends(roads, lane, move.lane, move.to_m)
            ]
            leads.append((len(lanes_in), group.number, ends))
    lanes_out = list(dict.fromkeys(end for _, _, ends in leads for end in ends))
    first = len(lanes_in) + 1
    ways = tuple(
        Way(number, first + lanes_out.index(end), group)
        for number, group, ends in leads
        for end in ends
    )
    return Topology(tuple(lanes_in), tuple(group_in), tuple(lanes_out), ways)


def _ends(roads: Roads, start: str, over: str, to_m: float) -> Iterator[Stretch]:
    """Yield the lanes out of a path that enters from lane `start` and crosses on lane `over`."""
    if over != start and over not in roads.successors(start):
        return
    length = roads.length_of(over)
    if length - to_m > _REST_M:
        yield Stretch(over, to_m, length)
        return
    for lane in roads.successors(over):
        yield Stretch(lane, 0.0, roads.length_of(lane))


def mapem_of(roads: Roads, junction: Junction) -> MapemBody:
    """Return the MAPEM of a junction, sent by its roadside station, without a time.

    Raises:
        MapError: when the junction has too many lanes, or is too large for a node list.
    """
    topology = topology_of(roads, junction)
    stretches = (*topology.lanes_in, *topology.lanes_out)
    if not stretches or len(stretches) > MAX_LANES:
        msg = f"junction {junction.name}: expected 1 to {MAX_LANES} lanes, got {len(stretches)}"
        raise MapError(msg)
    ends = [roads.lane(stretch.lane).at(stretch.near_m) for stretch in topology.lanes_in]
    middle = (sum(end.x for end in ends) / len(ends), sum(end.y for end in ends) / len(ends))
    place = position_of(*middle)
    lane = roads.definition(topology.lanes_in[0].lane)
    limit = SpeedLimit(speed=min(MAX_VELOCITY, round(lane.speed_limit_mps * _PER_SPEED_STEP)))
    geometry = IntersectionGeometry(
        name=junction.name,
        id=IntersectionId(id=junction.number),
        revision=roads.city_map.revision % REVISIONS,
        ref_point=Position3d(latitude=place.latitude, longitude=place.longitude),
        lane_width=min(MAX_LANE_WIDTH_CM, round(lane.width_m * _CM)),
        speed_limits=(limit,),
        lane_set=tuple(
            _lane(roads, topology, number, middle) for number in range(1, len(stretches) + 1)
        ),
    )
    return MapemBody(
        protocol_version=PROTOCOL_VERSION,
        station_id=station_id(roadside_station(junction.name)),
        msg_issue_revision=0,
        layer_type="intersectionData",
        intersections=(geometry,),
    )


def mapem_at(body: MapemBody, t_ns: int) -> MapemBody:
    """Return a MAPEM with the time of sending."""
    return replace(body, timestamp=moment_of(t_ns)[0])


def _lane(roads: Roads, topology: Topology, number: int, middle: tuple[float, float]) -> MapLane:
    inward = len(topology.lanes_in)
    leads_in = number <= inward
    stretch = topology.lanes_in[number - 1] if leads_in else topology.lanes_out[number - inward - 1]
    approach = number if number <= MAX_APPROACHES else None
    ways = [way for way in topology.ways if way.lane_in == number]
    connections = tuple(_connection(roads, topology, way) for way in ways[:MAX_CONNECTIONS])
    turns = [connection.connecting_lane.maneuver or "" for connection in connections]
    return MapLane(
        lane_id=number,
        name=stretch.lane[:63] if stretch.lane.isascii() else None,  # an IA5String
        ingress_approach=approach if leads_in else None,
        egress_approach=None if leads_in else approach,
        lane_attributes=LaneAttributes(
            directional_use=("ingressPath",) if leads_in else ("egressPath",),
            shared_with=("individualMotorizedVehicleTraffic",),
        ),
        maneuvers=_either(turns) if turns else None,
        node_list=NodeList(nodes=_nodes(roads, stretch, middle)),
        connects_to=connections or None,
    )


def _connection(roads: Roads, topology: Topology, way: Way) -> Connection:
    before, after = (
        topology.lanes_in[way.lane_in - 1],
        topology.lanes_out[way.lane_out - len(topology.lanes_in) - 1],
    )
    turned = wrap_angle(
        roads.lane(after.lane).at(after.near_m).yaw - roads.lane(before.lane).at(before.near_m).yaw
    )
    return Connection(
        connecting_lane=ConnectingLane(lane=way.lane_out, maneuver=_manoeuvre(turned)),
        signal_group=way.group,
        connection_id=topology.ways.index(way) % 255 + 1,
    )


def _manoeuvre(turned_rad: float) -> str:
    if abs(turned_rad) <= math.radians(45.0):
        bit = STRAIGHT
    elif abs(turned_rad) > math.radians(135.0):
        bit = U_TURN
    else:
        bit = LEFT if turned_rad > 0.0 else RIGHT
    return "".join("1" if place == bit else "0" for place in range(_MANOEUVRE_BITS))


def _either(turns: list[str]) -> str:
    return "".join("1" if "1" in column else "0" for column in zip(*turns, strict=True))


def _nodes(roads: Roads, stretch: Stretch, middle: tuple[float, float]) -> tuple[Node, ...]:
    """Return the points of a stretch, each rounded at its place so that errors do not add up."""
    line = roads.lane(stretch.lane)
    length = stretch.far_m - stretch.near_m
    steps = min(MAX_NODES - 1, max(1, math.ceil(abs(length) / NODE_M)))
    nodes = []
    x, y = (round(value * _CM) for value in middle)
    for step in range(steps + 1):
        pose = line.at(stretch.near_m + length * step / steps)
        to_x, to_y = round(pose.x * _CM), round(pose.y * _CM)
        nodes.append((to_x - x, to_y - y))
        x, y = to_x, to_y
    if max(abs(value) for node in nodes for value in node) > FARTHEST_CM:
        msg = f"lane {stretch.lane}: expected nodes within {FARTHEST_CM / _CM:.1f} m of each other"
        raise MapError(msg)
    return tuple(Node(delta=NodeDelta(node_xy=NodeXy(x=dx, y=dy))) for dx, dy in nodes)
