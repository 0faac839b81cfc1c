"""Car files: those that this city knows by name, and new ones made from a few figures."""

import os
from functools import lru_cache
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Annotated

import msgspec
from fastapi import APIRouter, Response
from fastapi import Path as InPath

from scm.api.city import City, IdempotencyKey, json_response, not_found
from scm.api.inputs import FromQuery, Json
from scm.api.problem import RefusedError
from scm.api.roles import ADMIN, VIEWER
from scm.api.schemas import answer, answer_file
from scm.errors import CarError
from scm.maps.bends import misfit
from scm.records.cars import CarFile, CarFiles, NewCarBody
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
    def preview(figures: FromQuery[NewCarBody]) -> Response:
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
    def write(body: Json[NewCarBody], key: IdempotencyKey = "") -> Response:
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
        given = msgspec.structs.asdict(body)
        text = new_car_text(Figures(name=given.pop("car"), **given))
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
