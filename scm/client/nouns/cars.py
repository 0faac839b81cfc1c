"""Operations on cars of a city.

Written by docs/make/client.py: do not change it here.
"""

from collections.abc import Iterator
from typing import Literal

from scm.client.operation import Noun, operation
from scm.records.cars import CarFile, CarFiles


class CarsNoun(Noun):
    """Operations on cars."""

    @operation("GET", "/api/v1/cars")
    def all_cars(self) -> CarFiles:
        """All car files of this city."""

    @operation("POST", "/api/v1/cars")
    def write(
        self,
        *,
        car: str,
        scale: str = "",
        mass_kg: float,
        wheelbase_m: float,
        motor: Literal["direct", "geared"] = "direct",
        top_speed_mps: float,
        acceleration_mps2: float | None = None,
        driven: Literal["all", "front", "rear"] = "rear",
        length_m: float | None = None,
        width_m: float | None = None,
        track_m: float | None = None,
        wheel_radius_m: float | None = None,
        steering_limit_rad: float | None = None,
        tag_size_m: float = 0.0762,
        lidar: bool = False,
        camera: bool = False,
        idempotency_key: str = "",
    ) -> CarFile:
        """Write a new car file.

        Args:
            car: name of its file
            scale: a label only
            mass_kg: ready to drive
            wheelbase_m: front axle to rear axle
            motor: geared: it holds the car when it is off; direct: it can be pushed
            top_speed_mps: at full throttle on the level
            acceleration_mps2: from standing, at full throttle
            driven: which wheels
            length_m: of the whole car
            width_m: of the whole car
            track_m: middle of a wheel to the other's
            wheel_radius_m: under load
            steering_limit_rad: of a front wheel, to either side
            tag_size_m: black edge of the tag on its roof; 0: none
            lidar: whether it has one
            camera: whether it has one
        """

    @operation("GET", "/api/v1/cars/preview")
    def preview(
        self,
        *,
        car: str,
        scale: str = "",
        mass_kg: float,
        wheelbase_m: float,
        motor: Literal["direct", "geared"] = "direct",
        top_speed_mps: float,
        acceleration_mps2: float | None = None,
        driven: Literal["all", "front", "rear"] = "rear",
        length_m: float | None = None,
        width_m: float | None = None,
        track_m: float | None = None,
        wheel_radius_m: float | None = None,
        steering_limit_rad: float | None = None,
        tag_size_m: float = 0.0762,
        lidar: bool = False,
        camera: bool = False,
    ) -> CarFile:
        """See the car file that figures lead to; nothing is written.

        Args:
            car: name of its file
            scale: a label only
            mass_kg: ready to drive
            wheelbase_m: front axle to rear axle
            motor: geared: it holds the car when it is off; direct: it can be pushed
            top_speed_mps: at full throttle on the level
            acceleration_mps2: from standing, at full throttle
            driven: which wheels
            length_m: of the whole car
            width_m: of the whole car
            track_m: middle of a wheel to the other's
            wheel_radius_m: under load
            steering_limit_rad: of a front wheel, to either side
            tag_size_m: black edge of the tag on its roof; 0: none
            lidar: whether it has one
            camera: whether it has one
        """

    @operation("GET", "/api/v1/cars/{name}.toml")
    def download(self, name: str) -> Iterator[bytes]:
        """Download a car file.

        Args:
            name: name of a car file
        """

    @operation("GET", "/api/v1/cars/{name}")
    def one_car(self, name: str) -> CarFile:
        """One car file.

        Args:
            name: name of a car file
        """
