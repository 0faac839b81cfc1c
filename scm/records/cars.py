"""Car files."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scm.records.body import Body
from scm.records.fields import CarName, Text


class CarFile(msgspec.Struct, kw_only=True, frozen=True, omit_defaults=False):
    """A car file.

    Attributes:
        car: Name of the file, which a vehicle gives when it joins.
        scale: Label of the file, such as 1:14; empty: none.
        shipped: Whether it comes with the software.
        problem: Why the file cannot be used, in words; empty: it can.
        rear_m: Rear end of the outline, x from the rear axle, forward [m].
        front_m: Front end of the outline [m].
        right_m: Right end of the outline, y, left positive [m].
        left_m: Left end of the outline [m].
        wheelbase_m: Front axle to rear axle [m].
        track_m: Left wheel's middle to right wheel's [m].
        wheel_radius_m: Rolling radius [m].
        mass_kg: The whole car [kg].
        turning_radius_m: Of the tightest circle that the middle of the rear axle drives [m].
        misfit: What of this city's lanes it cannot follow, in a sentence; empty: nothing.
        text: The file itself, TOML; empty in lists.
    """

    car: CarName
    scale: Annotated[str, Meta(examples=["1:14"])] = ""
    shipped: bool
    problem: Annotated[str, Meta(examples=["body.mass_kg: missing"])] = ""
    rear_m: float = 0.0
    front_m: float = 0.0
    right_m: float = 0.0
    left_m: float = 0.0
    wheelbase_m: float = 0.0
    track_m: float = 0.0
    wheel_radius_m: float = 0.0
    mass_kg: float = 0.0
    turning_radius_m: float = 0.0
    misfit: Annotated[str, Meta(examples=["it is 0.27 m wide, ..."])] = ""
    text: Text = ""


class CarFiles(msgspec.Struct, kw_only=True, frozen=True):
    """The car files of this city.

    Attributes:
        cars: By name.
        folder: Name of the folder that new ones are written to; empty: there is none.
    """

    cars: tuple[CarFile, ...]
    folder: Annotated[str, Meta(examples=["cars"])]


class NewCarBody(Body, kw_only=True, frozen=True):
    """What is known of a car; null: estimated from the shipped cars, with a large deviation."""

    car: Annotated[
        str,
        Meta(pattern="^[a-z][a-z0-9_-]{0,31}$", description="name of its file", examples=["buggy"]),
    ]
    scale: Annotated[
        str, Meta(pattern="^(1:[0-9]{1,3})?$", description="a label only", examples=["1:10"])
    ] = ""
    mass_kg: Annotated[float, Meta(ge=0.2, le=200.0, description="ready to drive", examples=[3.2])]
    wheelbase_m: Annotated[
        float, Meta(ge=0.05, le=2.0, description="front axle to rear axle", examples=[0.324])
    ]
    motor: Annotated[
        Literal["geared", "direct"],
        Meta(description="geared: it holds the car when it is off; direct: it can be pushed"),
    ] = "direct"
    top_speed_mps: Annotated[
        float, Meta(gt=0.0, le=50.0, description="at full throttle on the level", examples=[6.0])
    ]
    acceleration_mps2: (
        Annotated[
            float,
            Meta(gt=0.0, le=30.0, description="from standing, at full throttle", examples=[4.0]),
        ]
        | None
    ) = None
    driven: Annotated[Literal["rear", "front", "all"], Meta(description="which wheels")] = "rear"
    length_m: (
        Annotated[float, Meta(gt=0.0, le=6.0, description="of the whole car", examples=[0.5])]
        | None
    ) = None
    width_m: (
        Annotated[float, Meta(gt=0.0, le=6.0, description="of the whole car", examples=[0.27])]
        | None
    ) = None
    track_m: (
        Annotated[
            float,
            Meta(gt=0.0, le=6.0, description="middle of a wheel to the other's", examples=[0.24]),
        ]
        | None
    ) = None
    wheel_radius_m: (
        Annotated[float, Meta(ge=0.01, le=0.5, description="under load", examples=[0.055])] | None
    ) = None
    steering_limit_rad: (
        Annotated[
            float,
            Meta(ge=0.05, le=1.0, description="of a front wheel, to either side", examples=[0.5]),
        ]
        | None
    ) = None
    tag_size_m: Annotated[
        float, Meta(ge=0.0, le=1.0, description="black edge of the tag on its roof; 0: none")
    ] = 0.0762
    lidar: Annotated[bool, Meta(description="whether it has one")] = False
    camera: Annotated[bool, Meta(description="whether it has one")] = False
