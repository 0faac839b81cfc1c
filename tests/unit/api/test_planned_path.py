"""A car's way ahead: along its trip's lanes, from where it is."""

import numpy as np
import pytest

from scm.api.routes.planned_path import AHEAD_M, path_ahead
from scm.geometry import Pose2
from scm.maps.route import Roads
from scm.v2x.messages.trip import Trip


@pytest.fixture(scope="module")
def roads(city_map):
    return Roads(city_map)


@pytest.fixture
def place(roads):
    """The pose half a metre along the first lane, and a round of lanes from there."""
    name = next(iter(roads.lanes))
    return roads.loop(name), roads.lanes[name].at(0.5)


def lengths(points):
    return np.hypot(*np.diff(points, axis=0).T)


def test_the_way_begins_at_the_car_and_is_as_long_as_what_is_left(roads, place):
    route, pose = place
    points, is_whole = path_ahead(roads, route, pose, left_m=2.0)
    assert is_whole
    np.testing.assert_allclose(points[0], pose[:2], atol=0.01)
    assert lengths(points).sum() == pytest.approx(2.0, abs=0.02)  # chords of arcs are shorter
    assert lengths(points).max() < 0.06


def test_a_route_without_end_goes_round_up_to_the_horizon(roads, place):
    route, pose = place
    points, is_whole = path_ahead(roads, route, pose, left_m=None)
    assert not is_whole
    assert lengths(points).sum() == pytest.approx(AHEAD_M, abs=0.1)
    assert lengths(points).max() < 0.06  # no jump where the round closes


def test_a_car_that_is_not_on_its_route_has_no_way(roads, place):
    points, _ = path_ahead(roads, place[0], Pose2(50.0, 50.0, 0.0), left_m=None)
    assert points.shape == (0, 2)


def test_lanes_that_the_map_has_not_are_left_out(roads, place):
    route, pose = place
    points, _ = path_ahead(roads, ("nowhere", *route), pose, left_m=1.0)
    assert lengths(points).sum() == pytest.approx(1.0, abs=0.02)


def test_the_way_is_served_with_its_trip_and_empty_without_one(client, hear, snapshot, place):
    route, pose = place
    hear(1.0, snapshot(n1=pose, n2=(0.0, 0.0, 0.0)))
    told = {"vehicle": "n1", "trip_id": "t7", "t_ns": 1, "started_ns": 0}
    hear(1.0, Trip(**told, route=route, done_m=0.0, length_m=1.5))
    found = client("GET", "/api/v1/vehicles/n1/path").json()
    assert (found["trip_id"], found["is_whole"]) == ("t7", True)
    assert lengths(np.array(found["points_m"])).sum() == pytest.approx(1.5, abs=0.02)
    nowhere = client("GET", "/api/v1/vehicles/n2/path").json()
    assert (nowhere["trip_id"], nowhere["points_m"]) == (None, [])
    assert client("GET", "/api/v1/vehicles/n9/path").status_code == 404
