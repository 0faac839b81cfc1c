"""A car that a script places, in virtual time: its speeds in its own frame, and its reports."""

import math

import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.v2x.message import Refused
from scm.v2x.messages.join_request import JoinReply, JoinRequest
from vehicle_agent.devkit.cosim import CosimCar

WELCOME = JoinReply(vehicle="p1", x_m=1.0, y_m=2.0, yaw_rad=0.5, tag_id=3, epoch=7, t_ns=0)


@pytest.fixture
def joined():
    car = CosimCar("p1", "nigel", "session")
    (call,) = car.step(0)
    assert isinstance(call.request, JoinRequest)
    car.replied(WELCOME)
    return car


def test_it_stands_where_the_city_put_it_until_the_script_places_it(joined):
    (state,) = joined.step(0)
    assert (state.x_m, state.y_m, state.yaw_rad, state.epoch) == (1.0, 2.0, 0.5, 7)
    assert (state.speed_mps, state.lateral_speed_mps, state.yaw_rate_radps) == (0.0, 0.0, 0.0)


def test_speeds_are_in_the_frame_of_the_car(joined):
    along, left = 0.03, 0.01
    yaw = 2.5
    joined.place((0.0, 0.0, yaw - 0.02), NS_PER_S)
    x = along * math.cos(yaw) - left * math.sin(yaw)
    y = along * math.sin(yaw) + left * math.cos(yaw)
    joined.place((x, y, yaw), NS_PER_S + 100 * NS_PER_MS)
    (state,) = joined.step(NS_PER_S + 100 * NS_PER_MS)
    assert (state.x_m, state.y_m, state.yaw_rad) == (x, y, yaw)
    speeds = state.speed_mps, state.lateral_speed_mps, state.yaw_rate_radps
    assert speeds == pytest.approx((0.3, 0.1, 0.2))


def test_it_turns_the_short_way_round(joined):
    joined.place((0.0, 0.0, math.pi - 0.01), NS_PER_S)
    joined.place((0.0, 0.0, 0.01 - math.pi), NS_PER_S + 100 * NS_PER_MS)
    assert joined.step(NS_PER_S + 100 * NS_PER_MS)[0].yaw_rate_radps == pytest.approx(0.2)


def test_it_stands_half_a_second_after_the_last_word(joined):
    joined.place((0.0, 0.0, 0.0), NS_PER_S)
    said_ns = NS_PER_S + 50 * NS_PER_MS
    joined.place((0.1, 0.0, 0.0), said_ns)
    joined.place((0.1, 0.0, 0.0), said_ns)  # the same word, seen again
    assert joined.step(said_ns + 499 * NS_PER_MS)[0].speed_mps == pytest.approx(2.0)
    assert joined.step(said_ns + 520 * NS_PER_MS)[0].speed_mps == 0.0


def test_a_leap_after_a_long_silence_is_no_speed(joined):
    joined.place((0.0, 0.0, 0.0), NS_PER_S)
    joined.place((3.0, 0.0, 0.0), 2 * NS_PER_S)
    assert joined.step(2 * NS_PER_S)[0].speed_mps == 0.0


def test_it_reports_at_50_hz_and_counts(joined):
    states = [state for t in range(0, 1000, 5) for state in joined.step(t * NS_PER_MS)]
    assert [state.seq for state in states] == list(range(1, 51))


def test_it_asks_once_a_second_and_says_once_why_it_may_not_join(caplog):
    car = CosimCar("p1", "nigel", "session")
    asked = [call.request for t in range(0, 3000, 100) for call in car.step(t * NS_PER_MS)]
    assert len({request.request_id for request in asked}) == len(asked) == 3
    for _ in range(3):
        car.replied(Refused(code="owned", detail="there is one named p1"))
    assert caplog.text.count("there is one named p1") == 1
    assert car.detail == "p1 is about to join"
    assert car.leave() == []
