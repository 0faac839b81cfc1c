"""Records of map_parts.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

import msgspec


class Samples(msgspec.Struct, kw_only=True, frozen=True):
    """The grey values of a picture that a map names; the loader puts them in, for the map ....

    Attributes:
        rows: Rows.
        columns: Values in a row.
        kind: What a value is: `uint8`, `uint16` or `float32`, little-endian.
        packed: The values, row by row from the top, deflated.
    """

    rows: int
    columns: int
    kind: Literal["float32", "uint16", "uint8"]
    packed: bytes


class FrictionMap(msgspec.Struct, kw_only=True, frozen=True):
    """A grey picture of how the floor holds: between black and white it is interpolated.

    Attributes:
        image: Grey picture (PNG, PGM ...) beside the map file.
        x_m: What the whole picture covers; likewise `y_m`. Around it the floor's own values hold.
        y_m: Up on the map [m].
        grip: Factor on the tyres' friction where it is black, and where it is white.
        rolling: Likewise, coefficient of rolling resistance on top of the tyres' own.
        samples: The grey values of a picture that a map names; the loader puts them in, for the
            map travels.
    """

    image: str
    x_m: tuple[float, float]
    y_m: tuple[float, float]
    grip: tuple[float, float] = (0.0, 1.0)
    rolling: tuple[float, float] = (0.0, 0.0)
    samples: Samples | None = None


class HeightMap(msgspec.Struct, kw_only=True, frozen=True):
    """A picture of hills and hollows; around it the floor is level, so its rim must be at 0.

    Attributes:
        image: Grey picture of 8 or 16 bits (PNG, PGM ...) or NPY file beside the map file.
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        m_per_grey: Height of one grey value, or of a value of 1 in an NPY file.
        zero_grey: The value at height 0.
        samples: The grey values of a picture that a map names; the loader puts them in, for the
            map travels.
    """

    image: str
    x_m: tuple[float, float]
    y_m: tuple[float, float]
    m_per_grey: float
    zero_grey: float = 0.0
    samples: Samples | None = None


class Patch(msgspec.Struct, kw_only=True, frozen=True):
    """A piece of other floor: circle, rectangle or polygon; a later one lies on an ....

    Attributes:
        name: What it is called.
        grip: Factor on the tyres' friction.
        rolling: Coefficient of rolling resistance on top of the tyres' own.
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Direction, counter-clockwise from map x [rad].
        radius_m: Radius [m].
        length_m: How long it is [m].
        width_m: How wide it is [m].
        points: Its corners, or the points along it: x, y [m].
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
    points: tuple[tuple[float, float], ...] = ()


class Ramp(msgspec.Struct, kw_only=True, frozen=True):
    """A plane that rises along `yaw_rad` from one height to another; centre and size [m].

    Attributes:
        name: What it is called.
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Direction, counter-clockwise from map x [rad].
        length_m: How long it is [m].
        width_m: How wide it is [m].
        from_m: Where it begins [m].
        to_m: Where it ends [m].
    """

    name: str
    x_m: float
    y_m: float
    yaw_rad: float = 0.0
    length_m: float
    width_m: float
    from_m: float = 0.0
    to_m: float


class Plate(msgspec.Struct, kw_only=True, frozen=True):
    """A level piece of floor with an edge to be driven over: a rectangle or a convex polygon.

    Attributes:
        name: What it is called.
        height_m: Above the floor [m].
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Direction, counter-clockwise from map x [rad].
        length_m: How long it is [m].
        width_m: How wide it is [m].
        points: Its corners, or the points along it: x, y [m].
    """

    name: str
    height_m: float
    x_m: float | None = None
    y_m: float | None = None
    yaw_rad: float = 0.0
    length_m: float | None = None
    width_m: float | None = None
    points: tuple[tuple[float, float], ...] = ()


class Floor(msgspec.Struct, kw_only=True, frozen=True):
    """The ground plate: a rectangle [m], and how it holds, rolls and rises.

    Attributes:
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        colour: Colour.
        grip: Factor on the tyres' friction everywhere that nothing else is said.
        rolling: Likewise, coefficient of rolling resistance on top of the tyres' own.
        friction_map: A grey picture of how the floor holds: between black and white it is
            interpolated.
        height_map: A picture of hills and hollows; around it the floor is level, so its rim must
            be at 0.
        patches: A piece of other floor: circle, rectangle or polygon; a later one lies on an
            earlier one.
        ramps: A plane that rises along `yaw_rad` from one height to another; centre and size [m].
        plates: A level piece of floor with an edge to be driven over: a rectangle or a convex
            polygon.
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


class Wind(msgspec.Struct, kw_only=True, frozen=True):
    """The air over the whole map.

    Attributes:
        x_mps: Where it blows to, along map x; likewise `y_mps`.
        y_mps: Along map y [m/s].
        gust_mps: Standard deviation of its gusts, along x and along y.
        gust_s: How long a gust lasts.
    """

    x_mps: float = 0.0
    y_mps: float = 0.0
    gust_mps: float = 0.0
    gust_s: float = 1.0


class MapTag(msgspec.Struct, kw_only=True, frozen=True):
    """An AprilTag that lies on the floor and fixes the frame; `size_m` is the black edge.

    Attributes:
        tag_id: Number of an AprilTag.
        x_m: To the right on the map [m].
        y_m: Up on the map [m].
        yaw_rad: Direction, counter-clockwise from map x [rad].
        size_m: Edge of its black square [m].
    """

    tag_id: int
    x_m: float = 0.0
    y_m: float = 0.0
    yaw_rad: float = 0.0
    size_m: float


class VehicleTag(msgspec.Struct, kw_only=True, frozen=True):
    """Which AprilTag is printed for a car: no other car is given it.

    Attributes:
        vehicle: Name of a car.
        tag_id: Number of an AprilTag.
    """

    vehicle: str
    tag_id: int


class Segment(msgspec.Struct, kw_only=True, frozen=True):
    """A piece of a lane's centre line: straight (`length_m`), or an arc.

    Attributes:
        length_m: How long it is [m].
        radius_m: Of the arc, positive.
        angle_rad: Turned along the arc, + = left.
    """

    length_m: float | None = None
    radius_m: float | None = None
    angle_rad: float | None = None


class Lane(msgspec.Struct, kw_only=True, frozen=True):
    """A way for cars: centre line from a start pose through segments, and what follows it.

    Attributes:
        name: What it is called.
        width_m: How wide it is [m].
        start: Pose of its start: x [m], y [m], yaw [rad].
        segments: Its pieces, one after the other.
        next_: What follows.
        speed_limit_mps: Highest speed allowed [m/s].
    """

    name: str
    width_m: float
    start: tuple[float, float, float]
    segments: tuple[Segment, ...]
    next_: tuple[str, ...] = msgspec.field(name="next", default=())
    speed_limit_mps: float


class Area(msgspec.Struct, kw_only=True, frozen=True):
    """Paved ground beside the lanes, a polygon: the open middle of a junction, a parking ....

    Attributes:
        name: What it is called.
        points: Its corners, or the points along it: x, y [m].
    """

    name: str
    points: tuple[tuple[float, float], ...]
