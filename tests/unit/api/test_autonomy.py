"""Cars that park themselves: a goal is sent, and what their agents report is shown."""

import base64
import math
import zlib

import pytest

from scm.api.room_maps import room_maps_of
from scm.api.routes.autonomy import autonomy_of
from scm.v2x.messages.autonomy_plan import AutonomyPlan
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.costmap import Costmap
from scm.v2x.messages.occupancy_map import OccupancyMap
from scm.v2x.messages.park_request import ParkReply, ParkRequest

GOAL = "/api/v1/vehicles/n1/goal"


@pytest.fixture
def status():
    return AutonomyStatus(
        vehicle="n1", t_ns=1, state="recover", reason="waits", goal_x_m=0.75, goal_y_m=0.0,
        goal_yaw_rad=0.0, x_m=0.1, y_m=0.2, yaw_rad=0.3, position_std_m=0.01, yaw_std_rad=0.02,
    )  # fmt: skip


def test_a_goal_is_sent_to_the_agent_and_its_pose_returned(client, fake_city):
    fake_city.answers[ParkRequest] = ParkReply(vehicle="n1", x_m=0.75, y_m=0.0, yaw_rad=0.0)
    reply = client("POST", GOAL, json={"goal": "bay_3"})
    assert (reply.status_code, reply.json()["x_m"]) == (200, 0.75)
    (request,) = fake_city.asked
    assert (request.vehicle, request.goal) == ("n1", "bay_3")
    assert client("POST", GOAL, json={"goal": ""}).status_code == 422
    assert len(fake_city.asked) == 1


def test_the_newest_report_is_shown_for_some_seconds(client, hear, status):
    missing = client("GET", GOAL)
    assert missing.status_code == 404
    assert "expected `vehicle-agent park --vehicle n1`" in missing.json()["detail"]
    hear(1.0, status)
    shown = client("GET", GOAL).json()
    assert (shown["state"], shown["reason"], shown["goal_x_m"]) == ("recover", "waits", 0.75)
    assert (shown["x_m"], shown["position_std_m"]) == (0.1, 0.01)
    hear(6.1)
    assert client("GET", GOAL).status_code == 404


def test_the_newest_plan_is_served(client, hear):
    address = "/api/v1/vehicles/n1/plan"
    assert client("GET", address).status_code == 404
    hear(1.0, AutonomyPlan(vehicle="n1", t_ns=1, path=((0.0, 0.0, 0.0), (0.1, 0.0, 0.0))))
    assert client("GET", address).json()["path"] == [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]


def test_the_reports_of_all_cars_are_a_topic(view, hear, status):
    hear(1.0, status)
    assert autonomy_of(view.picture()) == (status,)
    hear(6.1)
    assert autonomy_of(view.picture()) == ()


CELLS = bytes((0, 100, 255, 0, 0, 100))


def room(t_ns=1_000_000_000, **changes):
    """Return a map of 2 x 3 cells on which the car is at (1, 0), turned by 90 degrees."""
    fields = {
        "vehicle": "n1", "t_ns": t_ns, "rows": 2, "columns": 3, "cell_m": 0.05, "x_m": -1.0,
        "y_m": 2.0, "car_x_m": 1.0, "car_y_m": 0.0, "car_yaw_rad": 0.5 * math.pi, "state": "map",
        "reason": "goes on", "path": ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), "payload": CELLS,
    }  # fmt: skip
    return OccupancyMap(**fields | changes)


def test_a_map_is_served_and_placed_where_its_car_is(client, hear, snapshot):
    missing = client("GET", "/api/v1/vehicles/n1/map")
    assert missing.status_code == 404
    assert "expected `vehicle-agent map --vehicle n1`" in missing.json()["detail"]
    hear(1.0, room())
    shown = client("GET", "/api/v1/vehicles/n1/map").json()
    assert (shown["state"], shown["reason"], shown["rows"]) == ("map", "goes on", 2)
    assert zlib.decompress(base64.b64decode(shown["cells"])) == CELLS
    assert shown["path"][-1] == [1.0, 0.0, 0.0]
    assert shown["origin_x_m"] is None
    hear(1.1, snapshot(0.9, n1=(2.0, 0.5, 0.0)), snapshot(1.1, tick=2, n1=(2.2, 0.5, 0.0)))
    shown = client("GET", "/api/v1/vehicles/n1/map").json()
    # The car at (2.1, 0.5) heads along x; on its map, turned by -90 degrees, it came 1 m.
    assert shown["origin_yaw_rad"] == pytest.approx(-0.5 * math.pi, abs=1e-4)
    assert (shown["origin_x_m"], shown["origin_y_m"]) == pytest.approx((2.1, 1.5))


def test_maps_are_a_topic_that_forgets_them_after_a_minute(view, hear):
    hear(1.0, room())
    (row,) = room_maps_of(view.picture())
    assert (row.vehicle, row.columns) == ("n1", 3)
    hear(62.0)
    assert room_maps_of(view.picture()) == ()


def test_a_damaged_map_leaves_the_one_before(client, hear):
    hear(1.0, room())
    hear(1.1, room(2_000_000_000, payload=CELLS[1:]))
    assert client("GET", "/api/v1/vehicles/n1/map").json()["t_ns"] == 1_000_000_000


def test_a_costmap_is_subscribed_to_while_somebody_requests_it(client, view, hear, monkeypatch):
    monkeypatch.setattr("scm.api.routes.autonomy.PATIENCE_S", 0.1)
    costmap = Costmap(
        vehicle="n1", t_ns=1, rows=1, columns=1, cell_m=0.02, x_m=0.0, y_m=0.0, step_m=0.01,
        half_width_m=0.09, payload=zlib.compress(b"\x05"),
    )  # fmt: skip

    def subscribed():
        return [one.where for one in view.subscriptions if one.kind is Costmap]

    hear(1.0, costmap)
    assert subscribed() == []
    missing = client("GET", "/api/v1/vehicles/n1/costmap")
    assert missing.status_code == 404
    assert subscribed() == [{"vehicle": "n1"}]
    hear(1.5, costmap)
    shown = client("GET", "/api/v1/vehicles/n1/costmap").json()
    assert zlib.decompress(base64.b64decode(shown["payload"])) == b"\x05"
    hear(8.0)
    assert subscribed() == []
