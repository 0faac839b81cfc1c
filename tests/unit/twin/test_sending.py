"""Cars are sent to where they decide whose a change is, if they have no other goal."""

import pytest
from msgspec.structs import replace

from scm.clock import NS_PER_S
from scm.disturbances import Disturbances
from scm.maps.load import load_map
from scm.records.twins import TwinDrive
from scm.twin.car import Setup, TwinCar
from scm.twin.places import PlaceWatch
from scm.twin.sending import BUSY_NS, LAPS, LASTS_NS, TRIP_KNOWN_NS, WAITS_NS, Sending
from scm.v2x.exchange import Call, Incoming
from scm.v2x.message import Refused
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.route_request import RouteReply
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.twin_send_request import TwinSendRequest
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from tests.unit.twin.test_causes import change

MAP = load_map("driving_school")
BEND = (2.6, 0.7)  # of the eastern loop
SENT = TwinSendRequest(vehicle="n3", send="n5", by="anna", reason="go on")


def state(vehicle, **more):
    known = {
        "vehicle": vehicle, "t_ns": 0, "seq": 1, "x_m": 1.0, "y_m": 0.3, "yaw_rad": 3.14,
        "speed_mps": 0.0, "yaw_rate_radps": 0.0, "steering_rad": 0.0, "throttle": 0.0,
        "source": "simulated",
    }  # fmt: skip
    return VehicleState(**known | more)


def trip(**more):
    """Return that of a car which circulates."""
    known = {"vehicle": "n5", "trip_id": "n5-1", "t_ns": 0, "route": ("west_loop",), "done_m": 0.0,
             "length_m": None, "started_ns": 0}  # fmt: skip
    return Trip(**known | more)


STANDS = trip(route=("crossing_south_west", "west_loop"), length_m=3.0, arrived_ns=5, trip_id="t")


class Town:
    """The city in which n3 has changed and n5 would decide; time passes as a test lets it."""

    def __init__(self, when="agreed", of=None, **drive):
        self.sending, self.now_ns = Sending(when), 100 * NS_PER_S
        setup = Setup(1.0, lambda car: None, PlaceWatch(1.0), Disturbances(), None, None, 0.0)
        self.car = TwinCar(state("n3"), self.now_ns, setup)
        self.car.remembers = lambda change: True
        self.car.newest_ns = self.now_ns
        self.cars = {"n3": self.car, "n5": TwinCar(state("n5"), self.now_ns, setup)}
        known = {"vehicle": "n5", "t_ns": 0, "x_m": BEND[0], "y_m": BEND[1]}
        self.car.changes.append(replace(change(), drive=TwinDrive(**known | drive)))
        self.receive(WorldDefinition(t_ns=0, seed=0, map=MAP), state("n5"), of or trip())

    def receive(self, *messages):
        for message in messages:
            self.sending.receive(message, self.now_ns)

    def step(self, seconds=0.1, *messages):
        """Return the requests and events of the next step."""
        self.now_ns += round(seconds * NS_PER_S)
        self.car.newest_ns = self.now_ns
        self.receive(*messages)
        return self.shown(self.sending.step(self.cars, self.now_ns))

    def agree(self, request=SENT):
        answer, _ = self.sending.agree(self.car, request)
        return answer

    def reply(self, call, message=None):
        request = call.request
        message = message or RouteReply(
            vehicle="n5", trip_id=request.request_id, route=request.via, length_m=5.0
        )
        item = Incoming(message, self.now_ns, call)
        return self.shown(self.sending.reply(item, self.cars))

    def send(self):
        """Let n5 be on its way; return its request."""
        self.step()
        (call,) = self.step()
        self.reply(call)
        self.on_its_way(call)
        return call.request

    def sends_nobody(self):
        return not self.step() and not self.step() and self.drive.state == "open"

    def on_its_way(self, call, **more):
        known = {"trip_id": call.request.request_id, "length_m": 30.0, "started_ns": self.now_ns}
        self.receive(trip(**known | more))

    @staticmethod
    def shown(out):
        return [one for one in out if isinstance(one, Call | CityEvent)]

    @property
    def drive(self):
        (one,) = self.car.changes
        return one.drive


def test_car_is_sent_through_the_place_when_an_operator_agrees():
    town = Town()
    assert town.step() == []
    answer = town.agree()
    assert isinstance(answer, TwinStatus)
    assert (answer.changes[0].drive.state, answer.changes[0].drive.by) == ("waiting", "anna")
    (call,) = town.step()
    request = call.request
    assert (request.vehicle, request.via, request.laps) == ("n5", ("east_loop",), LAPS)
    assert (request.then, request.replaces) == ("circulate", "n5-1")
    assert town.step() == []  # one request
    (event,) = town.reply(call)
    assert (event.name, event.vehicle, event.text) == (
        "car_sent", "n3", "n5 is sent through (2.6, 0.7), to decide whose n3's change is"
    )  # fmt: skip
    assert (town.drive.state, town.drive.sent) == ("under_way", 1)
    town.on_its_way(call)
    assert town.step() == []
    town.on_its_way(call, arrived_ns=town.now_ns)
    assert town.step() == []
    assert town.drive.state == "driven"
    assert town.step(1000.0) == []  # nobody is sent again


def test_idle_car_is_sent_without_an_operator_if_the_policy_is_so():
    town = Town("idle")
    town.send()
    assert (town.drive.state, town.drive.by) == ("under_way", "twin")
    assert Town("idle", sent=3).sends_nobody()


@pytest.mark.parametrize(
    ("messages", "words"),
    [
        ([trip(trip_id="t", length_m=9.0, via=("east_loop",))], "n5 is on its way elsewhere"),
        ([trip(trip_id="t", length_m=9.0, arrived_ns=7, then="circulate")], "n5 has just arrived"),
        ([state("n5", command_age_ms=20.0)], "somebody drives n5"),
        ([state("n5", mode="stop")], "n5 is stopped"),
    ],
)
@pytest.mark.parametrize("when", ["agreed", "idle"])
def test_car_that_is_not_idle_is_left_alone(when, messages, words):
    town = Town(when)
    town.receive(*messages)
    if when == "agreed":
        town.agree()
    assert town.step() == town.step() == []
    assert (town.drive.state, town.drive.reason) == ("waiting", words)
    town.receive(state("n5"), trip())
    (call,) = town.step()
    assert call.request.vehicle == "n5"


def test_car_whose_trip_somebody_ended_is_not_idle():
    town = Town()
    town.agree()
    assert town.step(1e-9 * TRIP_KNOWN_NS + 1.0) == []
    assert town.drive.reason == "somebody drove n5, and it stands since"


@pytest.mark.parametrize(("when", "for_ns"), [("agreed", WAITS_NS), ("idle", BUSY_NS)])
def test_car_that_is_never_idle_is_not_waited_for_for_ever(when, for_ns):
    town = Town(when, trip(length_m=9.0))
    if when == "agreed":
        town.agree()
    town.step()
    town.step(1e-9 * for_ns - 1.0)
    assert town.drive.state == "waiting"
    assert town.step(2.0) == []
    assert town.drive.state == "failed"
    assert town.drive.reason == "n5 was never idle: n5 is on its way elsewhere"
    assert not town.sending.reach_for("n3")("n5", BEND)  # another one is chosen


def test_car_that_stands_goes_back_to_its_lane():
    town = Town(of=STANDS)
    town.agree()
    (call,) = town.step()
    assert (call.request.via, call.request.then) == (("east_loop", "west_loop"), "stop")
    assert call.request.replaces == "t"


@pytest.mark.parametrize(("of", "via", "then"), [(trip(speed_mps=0.2), (), "circulate"),
                                                 (STANDS, ("west_loop",), "stop")])  # fmt: skip
def test_car_is_let_go_as_soon_as_it_is_decided(of, via, then):
    town = Town("idle", of)
    request = town.send()
    (one,) = town.car.changes
    town.car.changes[0] = replace(one, cause="car", decide_by="")
    (back,) = town.step()
    assert (back.request.via, back.request.then) == (via, then)
    assert (back.request.speed_mps, back.request.replaces) == (of.speed_mps, request.request_id)
    assert town.drive.state == "driven"
    assert town.step() == town.reply(back) == []


@pytest.mark.parametrize("cause", ["undecided", "car"])
def test_car_that_refuses_is_not_requested_again(cause):
    town = Town("idle")
    town.step()
    (call,) = town.step()
    if cause == "car":  # decided before it answered
        (one,) = town.car.changes
        town.car.changes[0] = replace(one, cause="car", drive=None)
        (back,) = town.step()
        assert back.request.replaces == call.request.request_id
    detail = "n5: it is on trip 'x', expected 'n5-1'"
    assert town.reply(call, Refused(code="owned", detail=detail)) == []
    assert town.step() == []
    if cause == "undecided":
        assert (town.drive.state, town.drive.reason, town.drive.sent) == ("failed", detail, 0)
        assert not town.sending.reach_for("n3")("n5", BEND)
        assert town.sending.reach_for("n4")("n5", BEND)


def test_drive_ends_after_a_bounded_time():
    town = Town("idle")
    request = town.send()
    on_it = trip(trip_id=request.request_id, length_m=30.0)
    assert town.step(1e-9 * LASTS_NS - 1.0, on_it) == []
    (back,) = town.step(2.0)
    assert (back.request.via, back.request.replaces) == ((), request.request_id)
    assert (town.drive.state, town.drive.reason) == ("failed", "n5 was not through after 180 s")


def test_car_that_gets_another_goal_is_let_alone():
    town = Town("idle")
    town.send()
    town.receive(trip(trip_id="t", length_m=3.0, started_ns=town.now_ns + NS_PER_S))
    assert town.step(2.0) == []
    assert (town.drive.state, town.drive.reason) == ("failed", "n5 was sent elsewhere meanwhile")


def test_car_that_somebody_drives_since_is_let_alone():
    town = Town("idle")
    town.send()
    assert town.step(1e-9 * TRIP_KNOWN_NS + 1.0) == []
    assert town.drive.reason == "n5 was driven by somebody else"


def test_car_goes_on_if_the_one_that_changed_leaves():
    town = Town("idle")
    request = town.send()
    del town.cars["n3"]
    (back,) = town.step()
    assert back.request.replaces == request.request_id
    assert town.step() == []


def test_one_car_decides_one_change_at_a_time():
    town = Town("idle")
    (first,) = town.car.changes
    town.car.changes.append(replace(first, noticed_ns=first.noticed_ns + 1))
    town.step()
    (call,) = town.step()
    town.reply(call)
    town.on_its_way(call)
    assert town.step() == []
    assert [one.drive.state for one in town.car.changes] == ["under_way", "waiting"]
    assert town.car.changes[1].drive.reason == "n5 is on such a drive already"


def test_car_that_circulates_needs_no_goal_to_drive_anywhere():
    anywhere = {"x_m": None, "y_m": None}
    circulates = Town("idle", **anywhere)
    assert circulates.sends_nobody()
    refused = circulates.agree()
    assert (refused.code, refused.detail) == (
        "invalid", "n5 drives about already: it needs no goal"
    )  # fmt: skip
    stands = Town("idle", STANDS, **anywhere)
    request = stands.send()
    assert (request.via, request.then, request.replaces) == ((), "circulate", "t")
    assert stands.step(1e-9 * LASTS_NS - 1.0, trip(trip_id=request.request_id)) == []
    (back,) = stands.step(2.0)
    assert (back.request.via, back.request.then) == (("west_loop",), "stop")
    assert stands.drive.state == "driven"


def test_agreement_to_what_is_not_open_is_refused_in_words():
    other = Town().agree(replace(SENT, send="n9"))
    assert (other.code, other.detail) == (
        "not_found", "no change of n3 waits to be decided by 'n9', expected n5"
    )  # fmt: skip
    town = Town()
    town.agree()
    assert town.agree().code == "not_found"  # it is agreed to already
    late = Town()
    late.car.remembers = lambda change: False
    assert late.agree().detail.startswith("what n3 drove before it changed is forgotten")


@pytest.mark.parametrize(("point", "reaches"), [(BEND, True), ((1.4, 1.4), False)])
def test_place_beside_all_lanes_cannot_be_reached(point, reaches):
    assert Town().sending.reach_for("n3")("n5", point) is reaches
    off_lane = Town()
    off_lane.receive(state("n5", x_m=1.4, y_m=1.4))
    assert not off_lane.sending.reach_for("n3")("n5", point)
    assert not Sending().reach_for("n3")("n5", point)  # no map yet


@pytest.mark.parametrize("was", ["open", "waiting", "under_way"])
def test_restart_repeats_no_drive(was):
    town = Town("idle", state=was, sent=1)
    stored = tuple(town.car.changes)
    town.car = TwinCar(state("n3"), town.now_ns, town.car._setup, changes=stored)
    town.cars["n3"], town.sending = town.car, Sending("idle")
    town.receive(WorldDefinition(t_ns=0, seed=0, map=MAP), state("n5"), trip())
    assert town.step() == town.step() == []
    assert town.drive.state == "failed"
    assert "what cars drove before is forgotten" in town.drive.reason
