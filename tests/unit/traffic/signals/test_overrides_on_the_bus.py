"""Wishes, detectors and priority as the traffic part hears and answers them in a city."""

import msgspec
import pytest

from scm.clock import NS_PER_S
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.signals.part import TrafficPart
from scm.v2x.etsi.convert import cam_of, station_id
from scm.v2x.etsi.priority_requests import PriorityRequest, answers_of, srem_of
from scm.v2x.message import Refused
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.signal_request import SignalReply, SignalRequest
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.srem import SremRx
from scm.v2x.messages.ssem import SsemTx
from scm.v2x.messages.vehicle_state import VehicleState

MAP = load_map("driving_school")
ROADS = Roads(MAP)


def messages(box):
    return [item.message for item in box.drain()]


def wish(city, verb, *groups, junction="crossing", **more):
    fields = {"by": "me", "reason": "test", **more}
    return city.call(SignalRequest(junction=junction, verb=verb, groups=groups, **fields))


def state_at(city, lane, s, vehicle="n1"):
    pose = ROADS.lane(lane).at(s)
    known = {"vehicle": vehicle, "x_m": pose.x, "y_m": pose.y, "yaw_rad": pose.yaw}
    fields = {f.name: 0 for f in msgspec.structs.fields(VehicleState) if f.required}
    fields |= {"mode": "idle", "source": "sim", "t_ns": city.now_ns, **known}
    return msgspec.convert(fields, VehicleState)


def hear_cam(city, lane, s):
    state = state_at(city, lane, s)
    body = cam_of(state, length_m=0.3, width_m=0.175, front_m=0.23)
    city.publish(CamRx(receiver="rsu-crossing", station="n1", t_ns=city.now_ns, body=body))


@pytest.fixture
def city():
    with Lockstep([TrafficPart(MAP, policy="actuated")]) as running:
        yield running


def test_a_wish_is_answered_with_what_is_in_force_and_told(city):
    events = city.subscribe(Subscription(CityEvent))
    city.run_for(6.0)
    reply = wish(city, "hold", "south_east", expires_s=30.0)
    assert isinstance(reply, SignalReply)
    assert (reply.policy, reply.pending) == ("actuated", "")
    (held,) = reply.wishes
    assert (held.verb, held.groups, held.by) == ("hold", ("south_east",), "me")
    assert held.ends_ns == pytest.approx(city.now_ns + 30 * NS_PER_S, abs=NS_PER_S)
    city.run_for(31.0)
    said = [event.name for event in messages(events)]
    assert said.count("signal_wish") == said.count("signal_wish_lapsed") == 1


def test_the_log_says_which_wishes_were_taken_back(city):
    events = city.subscribe(Subscription(CityEvent))
    wish(city, "clear", "south_east", clears="hold", expires_s=60.0)
    wish(city, "clear", expires_s=60.0)
    city.run_for(0.2)
    assert [event.text for event in messages(events)] == [
        "junction crossing takes back hold south_east (me asked: test)",
        "junction crossing takes back all wishes (me asked: test)",
    ]


def test_a_wish_for_what_is_not_there_is_refused(city):
    city.run_for(1.0)
    refusal = wish(city, "hold", "south_eastt")
    assert isinstance(refusal, Refused)
    assert "did you mean 'south_east'" in refusal.detail
    assert wish(city, "clear", junction="crosing").code == "not_found"


@pytest.mark.parametrize("expires_s", [901.0, 0.0, -1.0])
def test_no_wish_outlasts_fifteen_minutes(city, expires_s):
    city.run_for(1.0)
    refusal = wish(city, "hold", "south_east", expires_s=expires_s)
    assert refusal.code == "invalid"
    assert "900 at most" in refusal.detail


def test_a_car_heard_at_the_roadside_gets_its_green(city):
    spats = city.subscribe(Subscription(Spat))
    for _ in range(60):
        hear_cam(city, "crossing_south_west", 0.12)
        city.run_for(0.5)
    last = messages(spats)[-1]
    assert {g.group: g.colour for g in last.groups} == {"south_east": "red", "south_west": "green"}


def test_under_fixed_time_nobody_listens_to_cars_and_under_a_policy_somebody_does():
    fixed, actuated = TrafficPart(MAP), TrafficPart(MAP, policy="actuated")
    assert all(one.kind is not CamRx for one in fixed.subscriptions)
    assert Subscription(CamRx, {"receiver": "rsu-crossing"}) in actuated.subscriptions


def ask(city, verb="request", vehicle="n1", station="n1"):
    request = PriorityRequest(
        station_id=station_id(vehicle), number=3, junction=1, lane_in=2, verb=verb, role="ambulance"
    )
    body = srem_of(request, state_at(city, "crossing_south_west", 0.0, vehicle))
    city.publish(SremRx(receiver="rsu-crossing", station=station, t_ns=city.now_ns, body=body))


def test_an_ambulance_that_asks_is_answered_until_granted():
    with Lockstep([TrafficPart(MAP, policy="priority")]) as city:
        ssems, spats = city.subscribe(Subscription(SsemTx)), city.subscribe(Subscription(Spat))
        city.run_for(6.0)
        for _ in range(20):
            ask(city)
            city.run_for(1.0)
        said = [answers_of(m.body, station_id("n1"))[1, 3] for m in messages(ssems)]
        assert list(dict.fromkeys(said)) == ["processing", "granted"]
        last = messages(spats)[-1]
        assert last.mode == "preempt"
        assert next(g for g in last.groups if g.group == "south_west").colour == "green"
        ask(city, verb="cancel")
        city.run_for(3.0)
        messages(ssems)
        city.run_for(3.0)
        assert messages(ssems) == []


def test_nobody_asks_in_anothers_name():
    with Lockstep([TrafficPart(MAP, policy="priority")]) as city:
        ssems = city.subscribe(Subscription(SsemTx))
        city.run_for(6.0)
        ask(city, vehicle="ambulance", station="n1")
        city.run_for(3.0)
        assert messages(ssems) == []


def test_under_fixed_time_a_request_is_rejected():
    with Lockstep([TrafficPart(MAP)]) as city:
        ssems = city.subscribe(Subscription(SsemTx))
        ask(city)
        city.run_for(2.0)
        said = {answers_of(m.body, station_id("n1"))[1, 3] for m in messages(ssems)}
        assert said == {"rejected"}
