"""The city: what it is, which map it lies on, who is there, and how its clock runs."""

from importlib.metadata import version

from fastapi import APIRouter, Response

from scm.api.city import City, Name, json_response, not_found
from scm.api.roles import VIEWER
from scm.api.schemas import answer
from scm.clock import seconds
from scm.records.cities import Cities, CityRow

INTERFACE = "v1"
SOFTWARE = version("scm")


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
    held, definition = picture.snapshot, picture.definition
    world = held.message if held is not None else None
    return CityRow(
        name=city.name,
        map=city.city_map.name,
        title=city.city_map.title,
        software=SOFTWARE,
        interface=INTERFACE,
        seed=definition.seed if definition is not None else None,
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
