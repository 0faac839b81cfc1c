"""The cars of the next city near the border, for the drivers on this side."""

from typing import ClassVar

from msgspec import Struct

from scm.records.fields import XM, YM, CarName, CityName, VehicleName, YawRad
from scm.v2x.message import Message


class BorderCar(Struct, kw_only=True, frozen=True, gc=False):
    """One car; pose of its rear axle in the map of the city that receives the message."""

    vehicle: VehicleName
    car: CarName
    x_m: XM
    y_m: YM
    yaw_rad: YawRad
    speed_mps: float
    yaw_rate_radps: float


class BorderCars(Message, kw_only=True, frozen=True):
    """All cars near a border, published on the keys of the city next to it.

    Attributes:
        city: The city that the cars are in.
    """

    KEY: ClassVar[str] = "border/{city}"
    RATE_HZ: ClassVar[float | None] = 10.0

    city: CityName
    t_ns: int
    cars: tuple[BorderCar, ...] = ()


MESSAGE = BorderCars
