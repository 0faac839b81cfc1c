"""The city: what it is, which map it lies on, who is there, and how its clock runs."""

from importlib.metadata import version

import msgspec
from fastapi import APIRouter, Response

from scm.api.city import City, Name, json_response, not_found
from scm.api.roles import VIEWER
from scm.api.schemas import answer
from scm.api.stations import StationRow
from scm.clock import seconds

INTERFACE = "v1"
SOFTWARE = version("scm")


class CityRow(msgspec.Struct, kw_only=True, frozen=True):
    """One city.

    Attributes:
        name: Chunk of all its keys on the bus.
        map: Name of its map; `title` is for people.
        software: Version of this program.
        interface: Version of this interface, the first chunk of all addresses.
        seed: Of all its randomness; None: the world was not heard yet.
        lanes: How many the map has; likewise `junctions`.
        vehicles: How many cars are on the map.
        t_ns: Time of the world; None: it was not heard yet.
        tick: Of the world's newest snapshot; None: likewise.
        real_time_factor: Simulated over elapsed time, over the last second.
        snapshot_age_s: How long ago the world was heard.
        stopped: Whether the city-wide stop is engaged.
        parts: Its own processes that are there.
    """

    name: str
    map: str
    title: str
    software: str
    interface: str
    seed: int | None
    lanes: int
    junctions: int
    vehicles: int
    t_ns: int | None
    tick: int | None
    real_time_factor: float
    snapshot_age_s: float | None
    stopped: bool
    parts: tuple[StationRow, ...]


class Cities(msgspec.Struct, kw_only=True, frozen=True):
    """The cities that this server shows.

    Attributes:
        cities: One: a server belongs to a city.
    """

    cities: tuple[CityRow, ...]


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/cities", tags=["cities"], dependencies=[VIEWER])

    @routes.get("", summary="The cities that this server shows: its own", responses=answer(Cities))
    async def all_cities() -> Response:
        return json_response(Cities(cities=(_row(city),)))

    @routes.get("/{name}", summary="One city", responses=answer(CityRow))
    async def one_city(name: Name) -> Response:
        if name != city.name:
            raise not_found("city", name)
        return json_response(_row(city))

    return routes


def _row(city: City) -> CityRow:
    picture = city.view.picture()
    held, told = picture.snapshot, picture.definition
    world = held.message if held is not None else None
    return CityRow(
        name=city.name,
        map=city.city_map.name,
        title=city.city_map.title,
        software=SOFTWARE,
        interface=INTERFACE,
        seed=told.seed if told is not None else None,
        lanes=len(city.city_map.lanes),
        junctions=len(city.city_map.junctions),
        vehicles=len(world.vehicles) if world is not None else 0,
        t_ns=world.t_ns if world is not None else None,
        tick=world.tick if world is not None else None,
        real_time_factor=round(world.real_time_factor, 3) if world is not None else 0.0,
        snapshot_age_s=round(seconds(picture.now_ns - held.arrived_ns), 3) if held else None,
        stopped=picture.stop is not None and picture.stop.engaged,
        parts=tuple(row for row in picture.stations if row.role == "part" and row.alive),
    )
