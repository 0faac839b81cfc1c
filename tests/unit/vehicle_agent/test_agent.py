"""The agent as a part: one message at a time."""

import subprocess
import sys

import msgspec
import numpy as np
import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import CarError, MessageError, RunError
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.records.city_map import RadioChannel
from scm.v2x.exchange import Answer, Call, Incoming
from scm.v2x.message import Refused
from scm.v2x.messages.cam import CamTx
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.echo_request import EchoReply, EchoRequest
from scm.v2x.messages.join_request import JoinReply, JoinRequest
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.messages.light_request import LightReply, LightRequest
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.radio_status import RadioStatus
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from vehicle_agent.agent import AgentPart

EPOCH = 10


@pytest.fixture(scope="module")
def city_map():
    return load_map("driving_school")


@pytest.fixture(scope="module")
def spawn(city_map):
    return Roads(city_map).spawn_pose("a")


class Desk:
    """One agent, and a city played by hand that answers its renewals."""

    def __init__(self, city_map, spawn, **options):
        self.map, self.spawn = city_map, spawn
        self.part = AgentPart("n7", **{"session": "s1", **options})
        self.now_ns = 0
        self.asked = []
        self.answers_renewals = True

    def step(self, *messages, replies=()):
        """Let 20 ms pass; return what the agent sends apart from calls."""
        self.now_ns += 20 * NS_PER_MS
        inbox = [Incoming(message, self.now_ns) for message in messages]
        inbox += [Incoming(reply, self.now_ns, call) for call, reply in replies]
        if self.answers_renewals:
            inbox += [
                Incoming(lease(call.request.epoch), self.now_ns, call)
                for call in self.asked
                if isinstance(call.request, LeaseRequest) and call.request.verb == "renew"
            ]
        outbox = self.part.step(self.now_ns, inbox)
        self.asked = [item for item in outbox if isinstance(item, Call)]
        return [item for item in outbox if not isinstance(item, Call)]

    def steps(self, span_s):
        """Let a while pass; return the last state."""
        for _ in range(round(span_s / 0.02)):
            sent = self.step()
        return one(sent, VehicleState)

    def join(self):
        self.step(WorldDefinition(t_ns=1, seed=0, map=self.map))
        (call,) = self.asked
        self.step(replies=[(call, welcome(self.spawn))])
        return self


def welcome(pose):
    return JoinReply(
        vehicle="n7", x_m=pose.x, y_m=pose.y, yaw_rad=pose.yaw, tag_id=3, epoch=EPOCH, t_ns=0
    )


def lease(epoch):
    return LeaseReply(vehicle="n7", owner="n7", epoch=epoch, ttl_ms=1000)


def command(epoch, seq=1, throttle=0.3):
    return DriveCommand(vehicle="n7", t_ns=0, epoch=epoch, seq=seq, throttle=throttle, steering=0.0)


def one(outbox, kind):
    found = [item for item in outbox if isinstance(item, kind)]
    return found[0] if found else None


@pytest.fixture
def desk(city_map, spawn):
    return Desk(city_map, spawn)


@pytest.fixture
def inside(desk):
    return desk.join()


def test_it_says_nothing_of_a_car_before_it_is_in(desk):
    assert {type(item) for item in desk.step()} == {PartStatus}
    assert desk.asked == []


def test_it_asks_to_join_once_it_knows_the_map(desk, city_map):
    desk.step(WorldDefinition(t_ns=1, seed=0, map=city_map))
    (call,) = desk.asked
    assert call.request == JoinRequest(
        request_id=call.request.request_id, vehicle="n7", session="s1"
    )


def test_without_a_session_it_learns_its_own_from_its_presence(city_map, spawn):
    desk = Desk(city_map, spawn, session="")
    desk.step(WorldDefinition(t_ns=1, seed=0, map=city_map))
    assert desk.asked == []
    desk.step(Presence(role="v", station="n7", session="m4", alive=True))
    assert desk.asked[0].request.session == "m4"


def test_it_reports_from_where_the_city_placed_it(inside, spawn):
    outbox = inside.step()
    state = one(outbox, VehicleState)
    assert (state.x_m, state.y_m) == (
        pytest.approx(spawn.x, abs=1e-3),
        pytest.approx(spawn.y, abs=1e-3),
    )
    assert (state.source, state.epoch, state.car) == ("simulated", EPOCH, "nigel")


def test_it_sends_state_sensors_cam_and_trip(desk):
    desk.step(WorldDefinition(t_ns=1, seed=0, map=desk.map))
    outbox = desk.step(replies=[(desk.asked[0], welcome(desk.spawn))])
    sent = {type(item) for item in outbox}
    assert sent >= {VehicleState, CamTx, Trip, VehicleSensors}


def test_states_are_numbered_without_gaps(inside):
    first, second = (one(inside.step(), VehicleState).seq for _ in range(2))
    assert second == first + 1


def test_it_drives_by_itself(inside):
    assert inside.steps(2.0).speed_mps > 0.2


def test_a_repeated_definition_changes_nothing(inside, city_map):
    outbox = inside.step(WorldDefinition(t_ns=1, seed=0, map=city_map))
    assert one(outbox, VehicleState) is not None


def test_a_new_world_is_joined_anew(inside, city_map):
    outbox = inside.step(WorldDefinition(t_ns=2, seed=0, map=city_map))
    assert one(outbox, VehicleState) is None
    inside.now_ns += NS_PER_S
    inside.step()
    assert isinstance(inside.asked[0].request, JoinRequest)


def test_no_answer_of_the_city_for_a_second_ends_in_a_stop_and_a_wish_for_a_new_lease(inside):
    inside.steps(2.0)
    inside.answers_renewals = False
    state = inside.steps(1.5)
    assert state.mode == "stop"
    assert abs(state.speed_mps) < 0.01
    wishes = [call.request.verb for call in inside.asked]
    inside.steps(0.18)
    assert set(wishes + [call.request.verb for call in inside.asked]) <= {"acquire"}


def test_after_a_lost_link_it_drives_on_under_the_newer_epoch_only(inside):
    inside.steps(2.0)
    inside.answers_renewals = False
    inside.steps(2.5)
    inside.answers_renewals = True
    assert inside.steps(1.0).mode == "stop"
    while not inside.asked:
        inside.step()
    inside.step(replies=[(inside.asked[0], lease(EPOCH + 5))])
    state = inside.steps(1.0)
    assert (state.mode, state.epoch) == ("drive", EPOCH + 5)


def test_an_agent_switches_the_lights_of_its_car(inside):
    reply = one(inside.step(LightRequest(vehicle="n7", headlights="low")), Answer).reply
    assert reply == LightReply(vehicle="n7", headlights="low", indicators="off")
    assert {"head_low", "tail"} <= set(one(inside.step(), VehicleState).lights)


def test_an_agent_echoes_whoever_drives_its_car(inside):
    inside.step(command(EPOCH + 1))
    reply = one(inside.step(EchoRequest(vehicle="n7")), Answer).reply
    assert isinstance(reply, EchoReply)
    assert reply.vehicle == "n7"


def test_hazard_lights_flash_when_commands_stay_away(inside):
    inside.step(command(EPOCH + 1))
    lit = [one(inside.step(), VehicleState).lights for _ in range(120)]
    assert any("left" in lights and "right" in lights for lights in lit[60:])
    assert not any("left" in lights for lights in lit[:45])


def test_a_foreign_command_with_a_newer_epoch_takes_over(inside):
    state = one(inside.step(command(EPOCH + 1, throttle=0.3)), VehicleState)
    assert state.epoch == EPOCH + 1
    assert state.throttle != 0.3, "it tells what led here, not what comes"
    state = one(inside.step(), VehicleState)
    assert (state.throttle, state.steering) == (0.3, 0.0)


def test_it_tells_the_age_of_a_foreign_command_and_none_of_its_own_driver_s(inside):
    assert inside.steps(0.1).command_age_ms is None
    inside.step(command(EPOCH + 1))
    assert inside.steps(0.1).command_age_ms == pytest.approx(100.0)


def test_a_simulated_body_counts_what_it_draws(inside):
    first, later = inside.steps(0.02), inside.steps(1.0)
    assert 1.0 > first.battery_charge > later.battery_charge > 0.9999
    assert 12.0 < later.battery_v < 12.58


@pytest.mark.parametrize("epoch", [EPOCH - 1, EPOCH])
def test_a_foreign_command_without_a_newer_epoch_is_ignored(inside, epoch):
    inside.steps(0.5)
    state = one(inside.step(command(epoch, seq=10**6, throttle=-0.9)), VehicleState)
    assert state.throttle > 0.0
    assert state.epoch == EPOCH


def test_while_another_drives_a_route_is_refused(inside):
    inside.step(command(EPOCH + 1))
    answer = one(inside.step(RouteRequest(vehicle="n7")), Answer)
    assert answer.reply.code == "owned"


def test_a_route_for_idle_cars_is_refused_until_the_car_has_its_lease_again(inside):
    inside.step(command(EPOCH + 1, throttle=0.0))
    inside.steps(1.5)  # nobody commands it any more
    answer = one(inside.step(RouteRequest(vehicle="n7", replaces="n7-1")), Answer)
    assert answer.reply.code == "owned"
    assert inside.part._link.standing == "foreign"


def test_a_route_that_may_replace_one_trip_replaces_no_other(inside):
    answer = one(inside.step(RouteRequest(vehicle="n7", replaces="n7-9")), Answer)
    assert (answer.reply.code, "it is on trip 'n7-1'" in answer.reply.detail) == ("owned", True)
    answer = one(inside.step(RouteRequest(vehicle="n7", replaces="n7-1")), Answer)
    assert isinstance(answer.reply, RouteReply)


def test_given_back_before_a_wall_it_stands_and_says_why(inside):
    inside.step(command(EPOCH + 1, throttle=0.0))
    inside.steps(1.5)
    inside.part._body.place(Pose2(0.328, 1.134, 1.152), inside.now_ns)
    answer = one(inside.step(RouteRequest(vehicle="n7")), Answer)
    assert (answer.reply.code, "wall" in answer.reply.detail) == ("invalid", True)
    assert inside.part._link.standing == "foreign"
    assert inside.steps(1.0).throttle == 0.0


def test_a_route_is_taken_with_its_lanes(inside):
    request = RouteRequest(vehicle="n7", via=("west_loop",))
    answer = one(inside.step(request), Answer)
    assert isinstance(answer.reply, RouteReply)
    assert answer.reply.route[-1] == "west_loop"


def test_an_impossible_route_is_refused_in_words(inside):
    answer = one(inside.step(RouteRequest(vehicle="n7", via=("wset_loop",))), Answer)
    assert (answer.reply.code, "west_loop" in answer.reply.detail) == ("invalid", True)


def test_outside_a_route_is_refused(desk):
    answer = one(desk.step(RouteRequest(vehicle="n7")), Answer)
    assert answer.reply.code == "offline"


def test_a_contact_moves_the_body(inside):
    before = one(inside.step(), VehicleState)
    hit = Contact(
        vehicle="n7", t_ns=0, dvx_mps=0.0, dvy_mps=0.0, dyaw_rate_radps=0.0, dx_m=0.05, dy_m=0.0
    )
    after = one(inside.step(hit), VehicleState)
    assert after.x_m - before.x_m == pytest.approx(0.05, abs=5e-3)


def test_a_contact_that_no_car_could_have_is_not_felt(inside):
    before = one(inside.step(), VehicleState)
    still = {"dvx_mps": 0.0, "dvy_mps": 0.0, "dyaw_rate_radps": 0.0}
    hit = Contact(vehicle="n7", t_ns=0, **still, dy_m=-1e308)
    nudge = Contact(vehicle="n7", t_ns=0, **still, dx_m=0.05)
    after = one(inside.step(hit, nudge), VehicleState)
    assert (after.x_m - before.x_m, after.y_m - before.y_m) == pytest.approx((0.05, 0.0), abs=5e-3)


def test_a_monitor_fault_heard_outside_is_known_inside(desk):
    desk.step(MonitorStatus(junction="crossing", t_ns=0, fault="conflict", since_ns=0))
    desk.join()
    assert desk.part._session.signals.received.fault.all()


def test_what_keeps_it_outside_is_told(desk, city_map):
    desk.step(WorldDefinition(t_ns=1, seed=0, map=city_map))
    desk.step(replies=[(desk.asked[0], Refused(code="full", detail="no place is free"))])
    desk.now_ns += NS_PER_S
    assert "no place is free" in one(desk.step(), PartStatus).detail


def test_beside_all_lanes_it_stands_says_why_and_obeys_a_leaseholder(city_map):
    desk = Desk(city_map, Pose2(50.0, 50.0, 0.0)).join()
    sent = [item for _ in range(60) for item in desk.step()]
    assert {item.throttle for item in sent if isinstance(item, VehicleState)} == {0.0}
    assert "n7: no lane" in one(sent, PartStatus).detail
    desk.step(command(EPOCH + 1, throttle=0.3))
    assert one(desk.step(), VehicleState).throttle == 0.3


@pytest.mark.parametrize(
    ("options", "error"),
    [({"car": "nigal"}, CarError), ({"body": "simulatd"}, RunError)],
)
def test_what_it_is_made_of_must_exist(options, error):
    with pytest.raises(error, match=r"nigel|simulated"):
        AgentPart("n7", **options)


def test_its_name_must_fit_into_a_key():
    with pytest.raises(MessageError):
        AgentPart("N 7")


def test_the_agent_itself_loads_without_the_physics_compiler():
    code = "import sys, vehicle_agent.agent; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], timeout=120.0, check=False).returncode == 0


@pytest.mark.parametrize(("is_on", "station"), [(True, "n7"), (True, "n8"), (False, "n7")])
def test_a_car_speaks_less_when_the_world_tells_it_that_the_channel_is_busy(
    city_map, spawn, is_on, station
):
    radio = RadioChannel(data_rate_mbps=6.0, congestion_control=is_on)
    desk = Desk(msgspec.structs.replace(city_map, radio=radio), spawn).join()
    spoke = []
    for second in range(8):
        desk.step(RadioStatus(t_ns=second, stations=(station,), busy=(0.9,)))
        spoke += [desk.now_ns for _ in range(49) if one(desk.step(), CamTx)]
    gaps = np.diff([t_ns for t_ns in spoke if t_ns > NS_PER_S])
    obeys = is_on and station == "n7"
    assert (gaps.min() >= NS_PER_S) == obeys
