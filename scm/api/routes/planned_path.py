"""Where a car means to drive: the rest of its trip, as points on the floor."""

from functools import cache

from fastapi import APIRouter, Response

from scm.api.city import City, Name, json_response, not_found
from scm.api.planned_path import path_ahead
from scm.api.roles import VIEWER
from scm.api.schemas import answer
from scm.geometry import Pose2
from scm.maps.route import Roads
from scm.records.vehicles import PathRow


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/vehicles", tags=["vehicles"], dependencies=[VIEWER])

    @cache
    def roads() -> Roads:
        return Roads(city.city_map)

    @routes.get(
        "/{name}/path",
        summary="A car's way ahead, at most 12 m of it",
        responses=answer(PathRow),
    )
    def path(name: Name) -> Response:
        picture = city.view.picture()
        cars = () if picture.snapshot is None else picture.snapshot.message.vehicles
        car = next((car for car in cars if car.vehicle == name), None)
        if car is None:
            raise not_found("car", name)
        held = picture.trips.get(name)
        if held is None or held.message.arrived_ns is not None:
            nowhere = PathRow(vehicle=name, trip_id=None, points_m=(), is_whole=True)
            return json_response(nowhere)
        trip = held.message
        left_m = None if trip.length_m is None else trip.length_m - trip.done_m
        pose = Pose2(car.x_m, car.y_m, car.yaw_rad)
        points, is_whole = path_ahead(roads(), trip.route, pose, left_m)
        row = PathRow(
            vehicle=name,
            trip_id=trip.trip_id,
            points_m=tuple((round(x, 3), round(y, 3)) for x, y in points.tolist()),
            is_whole=is_whole,
        )
        return json_response(row)

    return routes
