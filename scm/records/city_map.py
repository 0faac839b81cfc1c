"""The map as data: the contents of a map file, and what travels to agents without that file.

Frame: x right, y up on the floor, lengths in metre, yaw counter-clockwise from x in radian. The
map's tag fixes it: its centre is the origin unless the file puts the tag elsewhere. Positions along
a lane (`at_m`) count from its start.
"""

from typing import Annotated, Literal

from msgspec import Meta

from scm.records.fields import (
    XM,
    YM,
    AtM,
    CityName,
    GroupName,
    GroupNames,
    HeightM,
    HeightPx,
    JunctionName,
    KindName,
    LaneName,
    LengthM,
    Name,
    Number,
    PlanName,
    Points,
    SourceName,
    TagId,
    Title,
    VehicleName,
    WidthM,
    WidthPx,
    YawRad,
)
from scm.records.floor import Floor, Record, Wind

Point = tuple[float, float]

NEIGHBOUR_MESSAGES = ("states", "cams", "denms", "cpms", "spatem", "mapem", "events")
"""What a city may let a neighbour see of it, by name."""

ANY_BAY = "any"
"""As a goal: whichever bay the parking manager gives."""


class MapTag(Record, kw_only=True, frozen=True):
    """An AprilTag that lies on the floor and fixes the frame; `size_m` is the black edge.

    Attributes:
        size_m: Edge of its black square [m].
    """

    tag_id: TagId
    x_m: XM = 0.0
    y_m: YM = 0.0
    yaw_rad: YawRad = 0.0
    size_m: float


class VehicleTag(Record, kw_only=True, frozen=True):
    """Which AprilTag is printed for a car: no other car is given it."""

    vehicle: VehicleName
    tag_id: TagId


class Segment(Record, kw_only=True, frozen=True):
    """A piece of a lane's centre line: straight (`length_m`), or an arc.

    Attributes:
        radius_m: Of the arc, positive.
        angle_rad: Turned along the arc, + = left.
    """

    length_m: LengthM | None = None
    radius_m: float | None = None
    angle_rad: float | None = None


class Lane(Record, kw_only=True, frozen=True):
    """A way for cars: centre line from a start pose through segments, and what follows it.

    Attributes:
        segments: Its pieces, one after the other.
        speed_limit_mps: Highest speed allowed [m/s].
    """

    name: Name
    width_m: WidthM
    start: Annotated[
        tuple[float, float, float],
        Meta(
            description="Pose of its start: x [m], y [m], yaw [rad].",
            examples=[[0.701, 1.168, -0.087]],
        ),
    ]
    segments: tuple[Segment, ...]
    next: Annotated[
        tuple[str, ...], Meta(description="What follows.", examples=[["east_loop"]])
    ] = ()
    speed_limit_mps: float


class StopLine(Record, kw_only=True, frozen=True):
    """Where a car's front waits for a signal group before a junction."""

    name: Name
    lane: LaneName
    at_m: AtM
    junction: JunctionName
    group: GroupName


class Conflict(Record, kw_only=True, frozen=True):
    """The stretch of a lane inside a junction where no car may stop.

    Attributes:
        from_m: Behind the stop line.
        to_m: Where the rear axle of a car is when its tail has cleared every crossing lane.
    """

    lane: LaneName
    from_m: float
    to_m: float


class Group(Record, kw_only=True, frozen=True):
    """A signal group and what it releases; `number` is its id in SPATEM.

    Attributes:
        movement: Its way through the junction.
        more: Further ways, where an approach parts: straight on, left, right.
    """

    name: Name
    number: Number
    movement: Conflict
    more: tuple[Conflict, ...] = ()

    @property
    def movements(self) -> tuple[Conflict, ...]:
        """All ways that it releases."""
        return (self.movement, *self.more)


class PlanStage(Record, kw_only=True, frozen=True):
    """Groups that are green together in a junction's own plan, and for how long.

    A record beside `SignalStage`: of the map file's format, which refuses unknown keys.

    Attributes:
        green_s: How long they are green [s].
    """

    groups: GroupNames
    green_s: float


class Junction(Record, kw_only=True, frozen=True):
    """Where lanes cross; which groups conflict is derived from the stretches' geometry.

    Attributes:
        groups: Signal groups.
        stages: A cycle of its own, as the plan `own`; empty: it has the plans of all junctions.
    """

    name: Name
    number: Number
    groups: tuple[Group, ...]
    plan: PlanName
    stages: tuple[PlanStage, ...] = ()


class Approach(Record, kw_only=True, frozen=True):
    """A way into a crossing: the line where a car's front gives way, and the ways from there."""

    name: Name
    lane: LaneName
    at_m: AtM
    ways: tuple[Conflict, ...]


class Crossing(Record, kw_only=True, frozen=True):
    """Where lanes cross without lights: signs decide who goes first, else right before left."""

    name: Name
    approaches: tuple[Approach, ...]


class Light(Record, kw_only=True, frozen=True):
    """A three-lamp head on a pole; it shows its group's colour.

    Attributes:
        light_id: Number of the signal head.
        yaw_rad: Where the lamps look: towards the cars they are meant for.
    """

    light_id: int
    x_m: XM
    y_m: YM
    yaw_rad: YawRad
    junction: JunctionName
    group: GroupName


class Crosswalk(Record, kw_only=True, frozen=True):
    """Painted stripes across a lane: centre, direction of the lane there, and size [m]."""

    name: Name
    x_m: XM
    y_m: YM
    yaw_rad: YawRad
    length_m: LengthM
    width_m: WidthM


class Area(Record, kw_only=True, frozen=True):
    """Paved ground beside the lanes, a polygon: the open middle of a junction, a parking place."""

    name: Name
    points: Points


class Sign(Record, kw_only=True, frozen=True):
    """A traffic sign on a pole.

    Attributes:
        sign_id: Number of the sign.
        kind: `stop`, `give_way`, `speed_limit`, `no_left`, `only_right`, ...; see `maps.signs`.
        yaw_rad: Where its face looks: towards the cars it is meant for.
        lane: The lane it holds for; without, that of the cars that its face looks at.
        at_m: Where on the lane it begins to hold, or where the line is that it means.
        value_mps: Of a speed limit.
    """

    sign_id: int
    kind: KindName
    x_m: XM
    y_m: YM
    yaw_rad: YawRad
    lane: LaneName | None = None
    at_m: AtM | None = None
    value_mps: float | None = None


class Wall(Record, kw_only=True, frozen=True):
    """An obstacle along a polyline that cannot be pushed.

    Attributes:
        points: Its centre line.
        closed: The last point is joined to the first.
        thickness_m: Across it; 0: the line itself is the face, as traced from a scan.
    """

    points: Points
    closed: bool = False
    thickness_m: float = 0.01
    height_m: HeightM = 0.2


class Box(Record, kw_only=True, frozen=True):
    """A construction box on the floor.

    Attributes:
        mass_kg: Of one that cars can push; without it the box is fixed.
        friction: Between the box and the floor.
        mapped: Whether agents' maps have it; false: only their sensors can tell them of it.
    """

    name: Name
    x_m: XM
    y_m: YM
    yaw_rad: YawRad = 0.0
    length_m: LengthM
    width_m: WidthM
    height_m: HeightM = 0.2
    mass_kg: float | None = None
    friction: float = 0.5
    mapped: bool = True


class Spawn(Record, kw_only=True, frozen=True):
    """A place where a car may be put: on a lane, or anywhere by pose."""

    name: Name
    lane: LaneName | None = None
    at_m: AtM | None = None
    pose: (
        Annotated[
            tuple[float, float, float],
            Meta(description="x [m], y [m], yaw [rad].", examples=[[1.384, 0.655, -0.785]]),
        ]
        | None
    ) = None


class Bay(Record, kw_only=True, frozen=True):
    """A marked place where one car parks.

    Attributes:
        pose: Of the rear axle of a car parked there.
        length_m, width_m: Of the marking, which lies about the middle of a Nigel parked there.
    """

    name: Name
    pose: Annotated[
        tuple[float, float, float],
        Meta(description="x [m], y [m], yaw [rad].", examples=[[-1.2, 1.45, 1.5708]]),
    ]
    length_m: LengthM = 0.45
    width_m: WidthM = 0.45


class Camera(Record, kw_only=True, frozen=True):
    """An overhead camera, looking down: a pinhole with OpenCV's distortion, or a fisheye.

    Attributes:
        x_m, y_m, z_m: Optical centre in the map frame.
        yaw_rad: Direction of the image's right edge over the floor (x of the picture).
        tilt_x_rad, tilt_y_rad: Small rotations about the picture's x and y away from straight down.
        fx_px: Focal length along a row [px].
        fy_px: Focal length along a column [px].
        cx_px: Principal point, column [px].
        cy_px: Principal point, row [px].
        lens: `fisheye` is OpenCV's model of wide lenses (angle, not tangent, over the picture).
        distortion: k1, k2, p1, p2, k3; of a fisheye k1, k2, k3, k4, 0.
        rate_hz: How often a second.
        noise_sigma: Standard deviation of a grey value.
        place_std: Standard deviations of x, y, z [m], yaw, tilt x, tilt y [rad], as `scm eye
            locate` found them; without, the Eye takes millimetres and half a milliradian.
        rolling_s: From the exposure of the first row to that of the last; 0: all at once.
    """

    name: Name
    x_m: XM
    y_m: YM
    z_m: float
    yaw_rad: YawRad = 0.0
    tilt_x_rad: float = 0.0
    tilt_y_rad: float = 0.0
    width_px: WidthPx
    height_px: HeightPx
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    lens: Literal["pinhole", "fisheye"] = "pinhole"
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    rate_hz: float = 10.0
    noise_sigma: float = 2.0
    place_std: tuple[float, float, float, float, float, float] | None = None
    rolling_s: float = 0.0


class RadioChannel(Record, kw_only=True, frozen=True):
    """What the air does to frames; as it stands, nothing. See docs/radio.md.

    Attributes:
        range_m: How far frames reach; None: the map's `radio_range_m`, and hosted drivers receive
            all.
        loss: Share of frames that each receiver misses whatever the distance.
        fading_db: Standard deviation of the strength at a distance; 0: a sharp edge at the range.
        path_loss_exponent: How the strength falls with distance: 2 in the open.
        wall_db: What each wall between two stations takes.
        delay_ms: From antenna to reader; `jitter_ms` more at most, evenly spread.
        jitter_ms: How much longer it may take, evenly spread [ms].
        data_rate_mbps: Of the one channel; 0: endless.
        hidden_share: How much of the load at a receiver its senders do not receive themselves:
            these frames collide.
        congestion_control: Whether cars send less on a busy channel.
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


class BorderRoad(Record, kw_only=True, frozen=True):
    """A road over the border: lane `out` of this map ends where lane `to` of the other begins."""

    out: LaneName
    to: LaneName


class Neighbour(Record, kw_only=True, frozen=True):
    """A city that cars drive on to, where its map lies in this one, and what it may see.

    Attributes:
        city: Its name on the bus.
        roads: The roads that lead there.
        messages: What it may see of this city, of `NEIGHBOUR_MESSAGES`; empty: nothing but the cars
            that are handed over.
    """

    city: CityName
    origin: Annotated[
        tuple[float, float, float],
        Meta(
            description="Origin of its map in this map: x [m], y [m], yaw [rad].",
            examples=[[12.0, 0.0, 0.0]],
        ),
    ] = (0.0, 0.0, 0.0)
    roads: tuple[BorderRoad, ...] = ()
    messages: Annotated[
        tuple[str, ...],
        Meta(description="What it may see of this city.", examples=[["states", "cams"]]),
    ] = ()


class CityMap(Record, kw_only=True, frozen=True):
    """One city.

    Attributes:
        map: Name of a map.
        revision: Counts changes of the lanes that cars must know of.
        drives_on: The side of the road. On the left, rules are mirrored: left comes before right,
            and who turns right lets oncoming cars pass.
        first_vehicle_tag_id: AprilTag of the first car; the others follow.
        lanes: Lanes.
        junctions: Junctions.
        lights: Lamps that burn.
        boxes: Boxes that cars can push.
        bays: Where cars park.
        cameras: Cameras.
        neighbours: Cities next to this one; see docs/cities.md.
        radio_range_m: Range of the radio between cars [m].
        speed_advice: Whether drivers come to red lights no sooner than SPATEM lets them pass.
    """

    map: Literal[1]
    name: Name
    title: Title
    source: SourceName
    revision: int = 1
    drives_on: Literal["right", "left"] = "right"
    floor: Floor
    wind: Wind = Wind()
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
    bays: tuple[Bay, ...] = ()
    cameras: tuple[Camera, ...] = ()
    neighbours: tuple[Neighbour, ...] = ()
    radio_range_m: float = 20.0
    radio: RadioChannel = RadioChannel()
    speed_advice: bool = False
