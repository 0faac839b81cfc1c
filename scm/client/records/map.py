"""Records of map.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

import msgspec

from scm.client.records.map_parts import Area, Floor, Lane, MapTag, VehicleTag, Wind
from scm.client.records.shared import Box, Camera, Light


class Conflict(msgspec.Struct, kw_only=True, frozen=True):
    """The stretch of a lane inside a junction where nobody may stop.

    Attributes:
        lane: Name of a lane.
        from_m: Behind the stop line.
        to_m: Where the rear axle of a car is when its tail has cleared every crossing lane.
    """

    lane: str
    from_m: float
    to_m: float


class Group(msgspec.Struct, kw_only=True, frozen=True):
    """A signal group and what it releases; `number` is its id in SPATEM.

    Attributes:
        name: What it is called.
        number: Its number.
        movement: Its way through the junction.
        more: Further ways, where an approach parts: straight on, left, right.
    """

    name: str
    number: int
    movement: Conflict
    more: tuple[Conflict, ...] = ()


class PlanStage(msgspec.Struct, kw_only=True, frozen=True):
    """Groups that are green together in a junction's own plan, and for how long.

    Attributes:
        groups: Signal groups.
        green_s: How long they are green [s].
    """

    groups: tuple[str, ...]
    green_s: float


class Junction(msgspec.Struct, kw_only=True, frozen=True):
    """Where lanes cross; which groups conflict is derived from the stretches' geometry.

    Attributes:
        name: What it is called.
        number: Its number.
        groups: Signal groups.
        plan: Name of the signal plan in force.
        stages: A cycle of its own, as the plan `own`; empty: it has the plans of all junctions.
    """

    name: str
    number: int
    groups: tuple[Group, ...]
    plan: str
    stages: tuple[PlanStage, ...] = ()


class Approach(msgspec.Struct, kw_only=True, frozen=True):
    """A way into a crossing: the line where a car's front gives way, and the ways from there.

    Attributes:
        name: What it is called.
        lane: Name of a lane.
        at_m: Where along the lane, from its start [m].
        ways: The stretch of a lane inside a junction where nobody may stop.
    """

    name: str
    lane: str
    at_m: float
    ways: tuple[Conflict, ...]


class Crossing(msgspec.Struct, kw_only=True, frozen=True):
    """Where lanes cross without lights: signs say who goes first, else right before left.

    Attributes:
        name: What it is called.
        approaches: A way into a crossing: the line where a car's front gives way, and the ways
            from there.
    """

    name: str
    approaches: tuple[Approach, ...]


class StopLine(msgspec.Struct, kw_only=True, frozen=True):
    """Where a car's front waits for a signal group before a junction.

    Attributes:
        name: What it is called.
        lane: Name of a lane.
        at_m: Where along the lane, from its start [m].
        junction: Name of a junction.
        group: Name of a signal group: heads that always show the same.
    """

    name: str
    lane: str
    at_m: float
    junction: str
    group: str


class Crosswalk(msgspec.Struct, kw_only=True, frozen=True):
    """Painted stripes across a lane: centre, direction of the lane there, and size [m].

    Attributes:
        name: What it is called.
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Direction, counter-clockwise from map x [rad].
        length_m: How long it is [m].
        width_m: How wide it is [m].
    """

    name: str
    x_m: float
    y_m: float
    yaw_rad: float
    length_m: float
    width_m: float


class Sign(msgspec.Struct, kw_only=True, frozen=True):
    """A traffic sign on a pole.

    Attributes:
        sign_id: Number of the sign.
        kind: `stop`, `give_way`, `speed_limit`, `no_left`, `only_right`, ...; see `maps.signs`.
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Where its face looks: towards the cars it is meant for.
        lane: The lane it holds for; without, that of the cars that its face looks at.
        at_m: Where on the lane it begins to hold, or where the line is that it means.
        value_mps: Of a speed limit.
    """

    sign_id: int
    kind: str
    x_m: float
    y_m: float
    yaw_rad: float
    lane: str | None = None
    at_m: float | None = None
    value_mps: float | None = None


class Wall(msgspec.Struct, kw_only=True, frozen=True):
    """An obstacle along a polyline that nobody can push.

    Attributes:
        points: Its centre line.
        closed: The last point is joined to the first.
        thickness_m: Across it; 0: the line itself is the face, as traced from a scan.
        height_m: Above the floor [m].
    """

    points: tuple[tuple[float, float], ...]
    closed: bool = False
    thickness_m: float = 0.01
    height_m: float = 0.2


class Spawn(msgspec.Struct, kw_only=True, frozen=True):
    """A place where a car may be put: on a lane, or anywhere by pose.

    Attributes:
        name: What it is called.
        lane: Name of a lane.
        at_m: Where along the lane, from its start [m].
        pose: x [m], y [m], yaw [rad].
    """

    name: str
    lane: str | None = None
    at_m: float | None = None
    pose: tuple[float, float, float] | None = None


class RadioChannel(msgspec.Struct, kw_only=True, frozen=True):
    """What the air does to frames; as it stands, nothing.

    See docs/radio.md.

    Attributes:
        range_m: How far frames reach; None: the map's `radio_range_m`, and hosted drivers hear
            all.
        loss: Share of frames that each receiver misses whatever the distance.
        fading_db: Standard deviation of the strength at a distance; 0: a sharp edge at the range.
        path_loss_exponent: How the strength falls with distance: 2 in the open.
        wall_db: What each wall between two stations takes.
        delay_ms: From antenna to reader; `jitter_ms` more at most, evenly spread.
        jitter_ms: How much longer it may take, evenly spread [ms].
        data_rate_mbps: Of the one channel; 0: endless.
        hidden_share: How much of the load at a receiver its senders do not hear themselves: these
            frames collide.
        congestion_control: Whether cars speak less on a busy channel.
    """

    range_m: float | None = None
    loss: float = 0.0
    fading_db: float = 0.0
    path_loss_exponent: float = 2.0
    wall_db: float = 0.0
    delay_ms: float = 0.0
    jitter_ms: float = 0.0
    data_rate_mbps: float = 0.0
    hidden_share: float = 0.0
    congestion_control: bool = False


class CityMap(msgspec.Struct, kw_only=True, frozen=True):
    """One city.

    Attributes:
        map_: Name of a map.
        name: What it is called.
        title: What people call it.
        source: Who told it.
        revision: Counts changes of the lanes that cars must know of.
        drives_on: The side of the road. On the left, rules are mirrored: left comes before right,
            and who turns right lets oncoming cars pass.
        floor: The ground plate: a rectangle [m], and how it holds, rolls and rises.
        wind: The air over the whole map.
        tag: An AprilTag that lies on the floor and fixes the frame; `size_m` is the black edge.
        first_vehicle_tag_id: AprilTag of the first car; the others follow.
        vehicle_tags: Which AprilTag is printed for a car: no other car is given it.
        lanes: Lanes.
        areas: Paved ground beside the lanes, a polygon: the open middle of a junction, a parking
            place.
        junctions: Junctions.
        crossings: Where lanes cross without lights: signs say who goes first, else right before
            left.
        stop_lines: Where a car's front waits for a signal group before a junction.
        lights: Lamps that burn.
        crosswalks: Painted stripes across a lane: centre, direction of the lane there, and size
            [m].
        signs: A traffic sign on a pole.
        walls: An obstacle along a polyline that nobody can push.
        boxes: Boxes that cars can push.
        spawns: A place where a car may be put: on a lane, or anywhere by pose.
        cameras: Cameras.
        radio_range_m: How far cars hear one another [m].
        radio: What the air does to frames; as it stands, nothing. See docs/radio.md.
        speed_advice: Whether drivers come to red lights no sooner than SPATEM lets them pass.
    """

    map_: Literal[1] = msgspec.field(name="map")
    name: str
    title: str
    source: str
    revision: int = 1
    drives_on: Literal["left", "right"] = "right"
    floor: Floor
    wind: Wind | None = None
    tag: MapTag
    first_vehicle_tag_id: int = 1
    vehicle_tags: tuple[VehicleTag, ...] = ()
    lanes: tuple[Lane, ...] = ()
    areas: tuple[Area, ...] = ()
    junctions: tuple[Junction, ...] = ()
    crossings: tuple[Crossing, ...] = ()
    stop_lines: tuple[StopLine, ...] = ()
    lights: tuple[Light, ...] = ()
    crosswalks: tuple[Crosswalk, ...] = ()
    signs: tuple[Sign, ...] = ()
    walls: tuple[Wall, ...] = ()
    boxes: tuple[Box, ...] = ()
    spawns: tuple[Spawn, ...] = ()
    cameras: tuple[Camera, ...] = ()
    radio_range_m: float = 20.0
    radio: RadioChannel | None = None
    speed_advice: bool = False
