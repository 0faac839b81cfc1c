"""Records of cars.

Written by docs/make/client.py: do not change it here.
"""

import msgspec


class CarFile(msgspec.Struct, kw_only=True, frozen=True):
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

    car: str
    scale: str = ""
    shipped: bool
    problem: str = ""
    rear_m: float = 0.0
    front_m: float = 0.0
    right_m: float = 0.0
    left_m: float = 0.0
    wheelbase_m: float = 0.0
    track_m: float = 0.0
    wheel_radius_m: float = 0.0
    mass_kg: float = 0.0
    turning_radius_m: float = 0.0
    misfit: str = ""
    text: str = ""


class CarFiles(msgspec.Struct, kw_only=True, frozen=True):
    """The car files of this city.

    Attributes:
        cars: By name.
        folder: Name of the folder that new ones are written to; empty: there is none.
    """

    cars: tuple[CarFile, ...]
    folder: str
