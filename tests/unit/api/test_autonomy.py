"""Cars that park themselves: a goal is sent, and what their agents report is shown."""

import pytest

from scm.api.routes.autonomy import autonomy_of
from scm.v2x.messages.autonomy_plan import AutonomyPlan
from scm.v2x.messages.autonomy_status import AutonomyStatus
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
