"""The map as data: the contents of a map file, and what travels to agents without that file.

Frame: x right, y up on the floor, lengths in metre, yaw counter-clockwise from x in radian. The
map's tag fixes it: its centre is the origin unless the file puts the tag elsewhere. Positions along
a lane (`at_m`) count from its start.
"""

from typing import Literal

import msgspec

Point = tuple[float, float]


class Record(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Base of everything in a map file: unknown keys are refused."""


class Samples(Record, kw_only=True, frozen=True):
    """The grey values of a picture that a map names; the loader puts them in, for the map travels.

    Attributes:
        kind: What a value is: `uint8`, `uint16` or `float32`, little-endian.
        packed: The values, row by row from the top, deflated.
    """

    rows: int
    columns: int
    kind: Literal["uint8", "uint16", "float32"]
    packed: bytes


class FrictionMap(Record, kw_only=True, frozen=True):
    """A grey picture of how the floor holds: between black and white it is interpolated.

    Attributes:
        image: Grey picture (PNG, PGM ...) beside the map file.
        x_m: What the whole picture covers; likewise `y_m`. Around it the floor's own values hold.
        grip: Factor on the tyres' friction where it is black, and where it is white.
        rolling: Likewise, coefficient of rolling resistance on top of the tyres' own.
    """

    image: str
    x_m: tuple[float, float]
    y_m: tuple[float, float]
    grip: tuple[float, float] = (0.0, 1.0)
    rolling: tuple[float, float] = (0.0, 0.0)
    samples: Samples | None = None


class HeightMap(Record, kw_only=True, frozen=True):
    """A picture of hills and hollows; around it the floor is level, so its rim must be at 0.

    Attributes:
        image: Grey picture of 8 or 16 bits (PNG, PGM ...) or NPY file beside the map file.
        m_per_grey: Height of one grey value, or of a value of 1 in an NPY file.
        zero_grey: The value at height 0.
    """

    image: str
    x_m: tuple[float, float]
    y_m: tuple[float, float]
    m_per_grey: float
    zero_grey: float = 0.0
    samples: Samples | None = None


class Patch(Record, kw_only=True, frozen=True):
    """A piece of other floor: circle, rectangle or polygon; a later one lies on an earlier one.

    Attributes:
        grip: Factor on the tyres' friction.
        rolling: Coefficient of rolling resistance on top of the tyres' own.
    """

    name: str
    grip: float = 1.0
    rolling: float = 0.0
    x_m: float | None = None
    y_m: float | None = None
    yaw_rad: float = 0.0
    radius_m: float | None = None
    length_m: float | None = None
    width_m: float | None = None
    points: tuple[Point, ...] = ()


class Ramp(Record, kw_only=True, frozen=True):
    """A plane that rises along `yaw_rad` from one height to another; centre and size [m]."""

    name: str
    x_m: float
    y_m: float
    yaw_rad: float = 0.0
    length_m: float
    width_m: float
    from_m: float = 0.0
    to_m: float


class Plate(Record, kw_only=True, frozen=True):
    """A level piece of floor with an edge to be driven over: a rectangle or a convex polygon."""

    name: str
    height_m: float
    x_m: float | None = None
    y_m: float | None = None
    yaw_rad: float = 0.0
    length_m: float | None = None
    width_m: float | None = None
    points: tuple[Point, ...] = ()


class Floor(Record, kw_only=True, frozen=True):
    """The ground plate: a rectangle [m], and how it holds, rolls and rises.

    Attributes:
        grip: Factor on the tyres' friction everywhere else.
        rolling: Likewise, coefficient of rolling resistance on top of the tyres' own.
    """

    x_m: tuple[float, float]
    y_m: tuple[float, float]
    colour: str = "#5f6368"
    grip: float = 1.0
    rolling: float = 0.0
    friction_map: FrictionMap | None = None
    height_map: HeightMap | None = None
    patches: tuple[Patch, ...] = ()
    ramps: tuple[Ramp, ...] = ()
    plates: tuple[Plate, ...] = ()

    @property
    def is_level(self) -> bool:
        """Whether nothing on it slopes and it has no edges."""
        return not (self.ramps or self.plates or self.height_map)


class Wind(Record, kw_only=True, frozen=True):
    """The air over the whole map.

    Attributes:
        x_mps: Where it blows to, along map x; likewise `y_mps`.
        gust_mps: Standard deviation of its gusts, along x and along y.
        gust_s: How long a gust lasts.
    """

    x_mps: float = 0.0
    y_mps: float = 0.0
    gust_mps: float = 0.0
    gust_s: float = 1.0


class MapTag(Record, kw_only=True, frozen=True):
    """An AprilTag that lies on the floor and fixes the frame; `size_m` is the black edge."""

    tag_id: int
    x_m: float = 0.0
    y_m: float = 0.0
    yaw_rad: float = 0.0
    size_m: float


class VehicleTag(Record, kw_only=True, frozen=True):
    """Which AprilTag is printed for a car: no other car is given it."""

    vehicle: str
    tag_id: int


class Segment(Record, kw_only=True, frozen=True):
    """A piece of a lane's centre line: straight (`length_m`), or an arc.

    Attributes:
        radius_m: Of the arc, positive.
        angle_rad: Turned along the arc, + = left.
    """

    length_m: float | None = None
    radius_m: float | None = None
    angle_rad: float | None = None


class Lane(Record, kw_only=True, frozen=True):
    """A way for cars: centre line from a start pose through segments, and what follows it."""

    name: str
    width_m: float
    start: tuple[float, float, float]
    segments: tuple[Segment, ...]
    next: tuple[str, ...] = ()
    speed_limit_mps: float


class StopLine(Record, kw_only=True, frozen=True):
    """Where a car's front waits for a signal group before a junction."""

    name: str
    lane: str
    at_m: float
    junction: str
    group: str


class Conflict(Record, kw_only=True, frozen=True):
    """The stretch of a lane inside a junction where nobody may stop.

    Attributes:
        from_m: Behind the stop line.
        to_m: Where the rear axle of a car is when its tail has cleared every crossing lane.
    """

    lane: str
    from_m: float
    to_m: float


class Group(Record, kw_only=True, frozen=True):
    """A signal group and what it releases; `number` is its id in SPATEM.

    Attributes:
        movement: Its way through the junction.
        more: Further ways, where an approach parts: straight on, left, right.
    """

    name: str
    number: int
    movement: Conflict
    more: tuple[Conflict, ...] = ()

    @property
    def movements(self) -> tuple[Conflict, ...]:
        """All ways that it releases."""
        return (self.movement, *self.more)


class PlanStage(Record, kw_only=True, frozen=True):
    """Groups that are green together in a junction's own plan, and for how long."""

    groups: tuple[str, ...]
    green_s: float


class Junction(Record, kw_only=True, frozen=True):
    """Where lanes cross; which groups conflict is derived from the stretches' geometry.

    Attributes:
        stages: A cycle of its own, as the plan `own`; empty: it has the plans of all junctions.
    """

    name: str
    number: int
    groups: tuple[Group, ...]
    plan: str
    stages: tuple[PlanStage, ...] = ()


class Approach(Record, kw_only=True, frozen=True):
    """A way into a crossing: the line where a car's front gives way, and the ways from there."""

    name: str
    lane: str
    at_m: float
    ways: tuple[Conflict, ...]


class Crossing(Record, kw_only=True, frozen=True):
    """Where lanes cross without lights: signs decide who goes first, else right before left."""

    name: str
    approaches: tuple[Approach, ...]


class Light(Record, kw_only=True, frozen=True):
    """A three-lamp head on a pole; it shows its group's colour.

    Attributes:
        yaw_rad: Where the lamps look: towards the cars they are meant for.
    """

    light_id: int
    x_m: float
    y_m: float
    yaw_rad: float
    junction: str
    group: str


class Crosswalk(Record, kw_only=True, frozen=True):
    """Painted stripes across a lane: centre, direction of the lane there, and size [m]."""

    name: str
    x_m: float
    y_m: float
    yaw_rad: float
    length_m: float
    width_m: float


class Area(Record, kw_only=True, frozen=True):
    """Paved ground beside the lanes, a polygon: the open middle of a junction, a parking place."""

    name: str
    points: tuple[Point, ...]


class Sign(Record, kw_only=True, frozen=True):
    """A traffic sign on a pole.

    Attributes:
        kind: `stop`, `give_way`, `speed_limit`, `no_left`, `only_right`, ...; see `maps.signs`.
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


class Wall(Record, kw_only=True, frozen=True):
    """An obstacle along a polyline that nobody can push.

    Attributes:
        points: Its centre line.
        closed: The last point is joined to the first.
        thickness_m: Across it; 0: the line itself is the face, as traced from a scan.
    """

    points: tuple[Point, ...]
    closed: bool = False
    thickness_m: float = 0.01
    height_m: float = 0.2


class Box(Record, kw_only=True, frozen=True):
    """A construction box on the floor.

    Attributes:
        mass_kg: Of one that cars can push; without it nobody moves the box.
        friction: Between the box and the floor.
    """

    name: str
    x_m: float
    y_m: float
    yaw_rad: float = 0.0
    length_m: float
    width_m: float
    height_m: float = 0.2
    mass_kg: float | None = None
    friction: float = 0.5


class Spawn(Record, kw_only=True, frozen=True):
    """A place where a car may be put: on a lane, or anywhere by pose."""

    name: str
    lane: str | None = None
    at_m: float | None = None
    pose: tuple[float, float, float] | None = None


class Camera(Record, kw_only=True, frozen=True):
    """An overhead camera, looking down: a pinhole with OpenCV's distortion, or a fisheye.

    Attributes:
        x_m, y_m, z_m: Optical centre in the map frame.
        yaw_rad: Direction of the image's right edge over the floor (x of the picture).
        tilt_x_rad, tilt_y_rad: Small rotations about the picture's x and y away from straight down.
        lens: `fisheye` is OpenCV's model of wide lenses (angle, not tangent, over the picture).
        distortion: k1, k2, p1, p2, k3; of a fisheye k1, k2, k3, k4, 0.
        place_std: Standard deviations of x, y, z [m], yaw, tilt x, tilt y [rad], as `scm eye
            locate` found them; without, the Eye takes millimetres and half a milliradian.
        rolling_s: From the exposure of the first row to that of the last; 0: all at once.
    """

    name: str
    x_m: float
    y_m: float
    z_m: float
    yaw_rad: float = 0.0
    tilt_x_rad: float = 0.0
    tilt_y_rad: float = 0.0
    width_px: int
    height_px: int
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


class CityMap(Record, kw_only=True, frozen=True):
    """One city.

    Attributes:
        revision: Counts changes of the lanes that cars must know of.
        drives_on: The side of the road. On the left, rules are mirrored: left comes before right,
            and who turns right lets oncoming cars pass.
        speed_advice: Whether drivers come to red lights no sooner than SPATEM lets them pass.
    """

    map: Literal[1]
    name: str
    title: str
    source: str
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
    cameras: tuple[Camera, ...] = ()
    radio_range_m: float = 20.0
    radio: RadioChannel = RadioChannel()
    speed_advice: bool = False
