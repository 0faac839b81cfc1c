"""The floor of a map: patches, ramps, plates, pictures of its friction and height; and the wind."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scm.records.fields import (
    XM,
    YM,
    ColourName,
    HeightM,
    ImageFile,
    LengthM,
    Name,
    Points,
    WidthM,
    XRangeM,
    YawRad,
    YRangeM,
)


class Record(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Base of everything in a map file: unknown keys are refused."""


class Samples(Record, kw_only=True, frozen=True):
    """The grey values of a picture that a map names; the loader puts them in, for the map travels.

    Attributes:
        rows: Rows.
        columns: Values in a row.
        kind: What a value is: `uint8`, `uint16` or `float32`, little-endian.
        packed: The values, row by row from the top, deflated.
    """

    rows: int
    columns: int
    kind: Literal["uint8", "uint16", "float32"]
    packed: Annotated[bytes, Meta(examples=["eJxjYAAAAAEAAQ=="])]


class FrictionMap(Record, kw_only=True, frozen=True):
    """A grey picture of how the floor holds: between black and white it is interpolated.

    Attributes:
        image: Grey picture (PNG, PGM ...) beside the map file.
        x_m: What the whole picture covers; likewise `y_m`. Around it the floor's own values hold.
        grip: Factor on the tyres' friction where it is black, and where it is white.
        rolling: Likewise, coefficient of rolling resistance on top of the tyres' own.
    """

    image: ImageFile
    x_m: XRangeM
    y_m: YRangeM
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

    image: ImageFile
    x_m: XRangeM
    y_m: YRangeM
    m_per_grey: float
    zero_grey: float = 0.0
    samples: Samples | None = None


class Patch(Record, kw_only=True, frozen=True):
    """A piece of other floor: circle, rectangle or polygon; a later one lies on an earlier one.

    Attributes:
        grip: Factor on the tyres' friction.
        rolling: Coefficient of rolling resistance on top of the tyres' own.
        radius_m: Radius [m].
    """

    name: Name
    grip: float = 1.0
    rolling: float = 0.0
    x_m: XM | None = None
    y_m: YM | None = None
    yaw_rad: YawRad = 0.0
    radius_m: float | None = None
    length_m: LengthM | None = None
    width_m: WidthM | None = None
    points: Points = ()


class Ramp(Record, kw_only=True, frozen=True):
    """A plane that rises along `yaw_rad` from one height to another; centre and size [m].

    Attributes:
        from_m: Where it begins [m].
        to_m: Where it ends [m].
    """

    name: Name
    x_m: XM
    y_m: YM
    yaw_rad: YawRad = 0.0
    length_m: LengthM
    width_m: WidthM
    from_m: float = 0.0
    to_m: float


class Plate(Record, kw_only=True, frozen=True):
    """A level piece of floor with an edge to be driven over: a rectangle or a convex polygon."""

    name: Name
    height_m: HeightM
    x_m: XM | None = None
    y_m: YM | None = None
    yaw_rad: YawRad = 0.0
    length_m: LengthM | None = None
    width_m: WidthM | None = None
    points: Points = ()


class Floor(Record, kw_only=True, frozen=True):
    """The ground plate: a rectangle [m], and how it holds, rolls and rises.

    Attributes:
        grip: Factor on the tyres' friction everywhere else.
        rolling: Likewise, coefficient of rolling resistance on top of the tyres' own.
    """

    x_m: XRangeM
    y_m: YRangeM
    colour: ColourName = "#5f6368"
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
        y_mps: Along map y [m/s].
        gust_mps: Standard deviation of its gusts, along x and along y.
        gust_s: How long a gust lasts.
    """

    x_mps: float = 0.0
    y_mps: float = 0.0
    gust_mps: float = 0.0
    gust_s: float = 1.0
