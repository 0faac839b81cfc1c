"""Where a car means to drive: the rest of its trip, as points on the floor."""

from collections.abc import Iterator, Sequence
from functools import cache

import numpy as np
from fastapi import APIRouter, Response

from scm.api.city import City, Name, json_response, not_found
from scm.api.roles import VIEWER
from scm.api.schemas import answer
from scm.arrays import Floats
from scm.geometry import Pose2
from scm.maps.route import LanePath, Roads
from scm.records.vehicles import PathRow

AHEAD_M = 12.0
STEP_M = 0.05
MOST_AWAY_M = 1.0  # farther from every lane of its trip, a car is not on it


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/vehicles", tags=["vehicles"], dependencies=[VIEWER])

    @cache
    def roads() -> Roads:
        return Roads(city.city_map)

    @routes.get(
        "/{name}/path",
        summary="A car's path ahead, at most 12 m of it",
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


def path_ahead(
    roads: Roads, route: Sequence[str], pose: Pose2, left_m: float | None
) -> tuple[Floats, bool]:
    """Return the points from a car on along its route, at most 12 m, and whether that is all of it.

    Args:
        roads: Of the map.
        route: Lane names in order; those that the map has not are left out.
        pose: Of the car.
        left_m: How far the trip still goes; None: for ever, round the lanes that close a circle.

    Returns:
        Points [m], shape (n, 2), map frame; empty when the car is not on the route.
    """
    lanes = [roads.lanes[name] for name in route if name in roads.lanes]
    here = _place(lanes, pose)
    if here is None:
        return np.empty((0, 2)), True
    index, start_m = here
    pieces = list[Floats]()
    rest_m = AHEAD_M if left_m is None else min(AHEAD_M, max(STEP_M, left_m))
    for lane, from_m in _from(lanes, index, start_m, endless=left_m is None):
        until_m = min(lane.length_m, from_m + rest_m)
        pieces.append(_points(lane, from_m, until_m))
        rest_m -= until_m - from_m
        if rest_m <= 0.0:
            break
    return np.vstack(pieces), left_m is not None and left_m <= AHEAD_M


def _place(lanes: Sequence[LanePath], pose: Pose2) -> tuple[int, float] | None:
    """Return on which lane of the route a car is, and where; None: on none of them."""
    best, nearest = None, MOST_AWAY_M
    for index, lane in enumerate(lanes):
        at_m, lateral_m = lane.project(pose.x, pose.y)
        lane_pose = lane.at(at_m)
        away = float(np.hypot(lane_pose.x - pose.x, lane_pose.y - pose.y))
        against = np.cos(lane_pose.yaw - pose.yaw) < 0.0
        if away + abs(lateral_m) * against < nearest:
            best, nearest = (index, at_m), away
    return best


def _from(
    lanes: Sequence[LanePath], index: int, start_m: float, *, endless: bool
) -> Iterator[tuple[LanePath, float]]:
    yield lanes[index], start_m
    for lane in lanes[index + 1 :]:
        yield lane, 0.0
    if not endless:
        return
    end = lanes[-1].points[-1]
    again = next((i for i, lane in enumerate(lanes) if _is_at(lane, end)), None)
    while again is not None:
        for lane in lanes[again:]:
            yield lane, 0.0


def _is_at(lane: LanePath, point: Floats) -> bool:
    return bool(np.hypot(*(lane.points[0] - point)) < STEP_M)


def _points(lane: LanePath, from_m: float, until_m: float) -> Floats:
    at_m = np.linspace(from_m, until_m, max(2, round((until_m - from_m) / STEP_M) + 1))
    xy = (np.interp(at_m, lane.s, lane.points[:, axis]) for axis in (0, 1))
    return np.column_stack(tuple(xy))
