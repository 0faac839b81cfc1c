"""Car files: those that this city knows by name, and new ones made from a few figures."""

import os
from functools import lru_cache
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Annotated, Literal

import msgspec
from fastapi import APIRouter, Query, Response
from fastapi import Path as InPath
from pydantic import BaseModel, ConfigDict, Field

from scm.api.city import City, IdempotencyKey, json_response, not_found
from scm.api.problem import RefusedError
from scm.api.roles import ADMIN, VIEWER
from scm.api.schemas import answer, answer_file
from scm.errors import CarError
from scm.maps.bends import misfit
from scm.records.city_map import CityMap
from scm.v2x.message import Refused
from scm.vehicles.car import Car, car_of_text, load_car
from scm.vehicles.car_files import OWN_CARS, TYPES_DIR, car_files, own_folder
from scm.vehicles.drivers.limits import turning_radius_m
from scm.vehicles.new_car import Figures, new_car_text

TOML = "application/toml"
PREVIEW = "preview"
"""No car file has this name: an address has it."""
CarName = Annotated[
    str,
    InPath(pattern=r"^[a-z0-9_-]{1,32}$", description="name of a car file", examples=["nigel"]),
]
_Length = Annotated[float | None, Field(gt=0.0, le=6.0)]


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


class NewCarBody(BaseModel):
    """What is known of a car; null: estimated from the shipped cars, with a large deviation."""

    model_config = ConfigDict(extra="forbid")

    car: str = Field(
        pattern=r"^[a-z][a-z0-9_-]{0,31}$", description="name of its file", examples=["buggy"]
    )
    scale: str = Field(
        "", pattern=r"^(1:[0-9]{1,3})?$", description="a label only", examples=["1:10"]
    )
    mass_kg: float = Field(ge=0.2, le=200.0, description="ready to drive", examples=[3.2])
    wheelbase_m: float = Field(
        ge=0.05, le=2.0, description="front axle to rear axle", examples=[0.324]
    )
    motor: Literal["geared", "direct"] = Field(
        "direct", description="geared: it holds the car when it is off; direct: it can be pushed"
    )
    top_speed_mps: float = Field(
        gt=0.0, le=50.0, description="at full throttle on the level", examples=[6.0]
    )
    acceleration_mps2: float | None = Field(
        None, gt=0.0, le=30.0, description="from standing, at full throttle", examples=[4.0]
    )
    driven: Literal["rear", "front", "all"] = Field("rear", description="which wheels")
    length_m: _Length = Field(None, description="of the whole car", examples=[0.5])
    width_m: _Length = Field(None, description="of the whole car", examples=[0.27])
    track_m: _Length = Field(None, description="middle of a wheel to the other's", examples=[0.24])
    wheel_radius_m: float | None = Field(
        None, ge=0.01, le=0.5, description="under load", examples=[0.055]
    )
    steering_limit_rad: float | None = Field(
        None, ge=0.05, le=1.0, description="of a front wheel, to either side", examples=[0.5]
    )
    tag_size_m: float = Field(
        0.0762, ge=0.0, le=1.0, description="black edge of the tag on its roof; 0: none"
    )
    lidar: bool = Field(default=False, description="whether it has one")
    camera: bool = Field(default=False, description="whether it has one")

    def figures(self) -> Figures:
        """Return the same as the physics takes it."""
        given = self.model_dump()
        return Figures(name=given.pop("car"), **given)


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/cars", tags=["cars"], dependencies=[VIEWER])

    @routes.get("", summary="All car files of this city", responses=answer(CarFiles))
    def all_cars() -> Response:
        try:
            files, folder = car_files(), own_folder()
        except CarError as error:
            raise _refused("conflict", str(error)) from error
        cars = tuple(_row(city.city_map, name, path) for name, path in sorted(files.items()))
        return json_response(CarFiles(cars=cars, folder="" if folder is None else folder.name))

    @routes.get(
        "/preview",
        summary="See the car file that figures lead to; nothing is written",
        responses=answer(CarFile),
    )
    def preview(figures: Annotated[NewCarBody, Query()]) -> Response:
        return json_response(_made(city.city_map, figures))

    @routes.get(
        "/{name}.toml",
        summary="Download a car file",
        response_class=Response,
        responses=answer_file(TOML, "The car file."),
    )
    def download(name: CarName) -> Response:
        path = _path(name)
        headers = {"Content-Disposition": f'attachment; filename="{name}.toml"'}
        return Response(path.read_bytes(), headers=headers, media_type=TOML)

    @routes.get("/{name}", summary="One car file", responses=answer(CarFile))
    def one_car(name: CarName) -> Response:
        path = _path(name)
        row = _row(city.city_map, name, path)
        return json_response(msgspec.structs.replace(row, text=path.read_text(encoding="utf-8")))

    _add_new(routes, city.city_map)
    return routes


def _add_new(routes: APIRouter, city_map: CityMap) -> None:
    @routes.post(
        "",
        summary="Write a new car file",
        status_code=201,
        dependencies=[ADMIN],
        responses=answer(CarFile, 201, "Vehicles can join with it."),
    )
    def write(body: NewCarBody, key: IdempotencyKey = "") -> Response:
        del key  # a second one of that name is refused
        made = _made(city_map, body)
        _write(body.car, made.text)
        return json_response(made, 201, {"Location": f"/api/v1/cars/{body.car}"})


def _made(city_map: CityMap, body: NewCarBody) -> CarFile:
    """Return the car file of figures.

    Raises:
        RefusedError: the name is taken, or numbers contradict each other.
    """
    try:
        if body.car == PREVIEW or body.car in car_files():
            raise _refused("conflict", f"car: there is a car file named {body.car!r} already")
        text = new_car_text(body.figures())
    except CarError as error:
        raise _refused("invalid", str(error)) from error
    car = car_of_text(text, Path(f"{body.car}.toml"))
    return msgspec.structs.replace(_described(city_map, car, shipped=False), text=text)


def _write(name: str, text: str) -> None:
    """Write a car file whole, or not at all; one of that name stays as it is."""
    folder = own_folder()
    if folder is None:
        detail = f"this city has no folder for car files: start it with {OWN_CARS}=FOLDER"
        raise _refused("conflict", detail)
    with NamedTemporaryFile("w", encoding="utf-8", dir=folder, suffix=".part") as part:
        part.write(text)
        part.flush()
        os.fsync(part.fileno())
        path = folder / f"{name}.toml"
        try:
            path.hardlink_to(part.name)
        except FileExistsError as error:
            detail = f"car: there is a car file named {name!r} already"
            raise _refused("conflict", detail) from error
        path.chmod(0o644)


def _refused(code: str, detail: str) -> RefusedError:
    return RefusedError(Refused(code=code, detail=detail))


def _path(name: str) -> Path:
    path = car_files().get(name)
    if path is None:
        raise not_found("car", name)
    return path


def _row(city_map: CityMap, name: str, path: Path) -> CarFile:
    shipped = path.parent == TYPES_DIR
    try:
        car = _loaded(path, path.stat().st_mtime_ns)
        return msgspec.structs.replace(_described(city_map, car, shipped=shipped), car=name)
    except (CarError, OSError) as error:
        text = str(error).replace(f"{path.parent}{os.sep}", "")
        return CarFile(car=name, shipped=shipped, problem=text)


@lru_cache(maxsize=256)
def _loaded(path: Path, _changed_ns: int) -> Car:
    return load_car(path)


def _described(city_map: CityMap, car: Car, *, shipped: bool) -> CarFile:
    rear, front = car.vector("body.footprint_x_m")
    right, left = car.vector("body.footprint_y_m")
    radius = turning_radius_m(car)
    return CarFile(
        car=car.name,
        scale=car.scale,
        shipped=shipped,
        rear_m=rear,
        front_m=front,
        right_m=right,
        left_m=left,
        wheelbase_m=car.value("body.wheelbase_m"),
        track_m=car.value("body.track_m"),
        wheel_radius_m=car.value("wheel.radius_m"),
        mass_kg=car.value("body.mass_kg"),
        turning_radius_m=round(radius, 4),
        misfit=misfit(city_map, radius, left - right),
    )
