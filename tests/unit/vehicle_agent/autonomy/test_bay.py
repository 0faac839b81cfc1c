"""Cars ask the parking manager for a bay, wait for their turn, and stand without a permission."""

import pytest
from msgspec.structs import replace

from scm.clock import NS_PER_S
from scm.maps.load import load_map
from scm.maps.route import roads_of
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.parking.part import ParkingPart
from scm.v2x.message import Refused
from scm.v2x.messages.bay_request import BayReply, BayRequest
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.park_request import ParkReply, ParkRequest
from scm.v2x.messages.parking_status import BayState, ParkingStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.part import WorldPart
from vehicle_agent.autonomy.bay import BayClient
from vehicle_agent.autonomy.parking import Report
from vehicle_agent.autonomy.part import ParkPart, Wanted

LOT = load_map("parking_lot")
GIVEN = BayReply(vehicle="n1", bay="a1", x_m=0.0, y_m=1.7, yaw_rad=1.57)


def status(driver="", waiting=(), reason=""):
    bays = (BayState(name="a1", state="reserved", vehicle="n1"),)
    return ParkingStatus(t_ns=0, bays=bays, driver=driver, waiting=waiting, reason=reason)


class Client:
    """A client at a time of the test."""

    def __init__(self, goal="any"):
        self.client, self.now_ns = BayClient("n1", "park-n1", "s"), 0
        self.client.begin(goal)

    def step(self, span_s=0.0):
        self.now_ns += round(span_s * NS_PER_S)
        return [call.request for call in self.client.step(self.now_ns)]

    def reply(self, request, reply):
        return self.client.replied(request, reply, self.now_ns)

    def hear(self, *facts):
        self.client.receive(status(*facts), self.now_ns)
        return self.waits()

    def waits(self):
        return self.client.waits(self.now_ns)


@pytest.fixture
def given():
    client = Client()
    client.reply(client.step()[0], GIVEN)
    return client


@pytest.mark.parametrize(("goal", "bay"), [("any", ""), ("a3", "a3")])
def test_request_is_repeated_with_its_id_until_it_is_answered(goal, bay):
    client = Client(goal)
    (first,) = client.step()
    assert isinstance(first, BayRequest)
    assert first.bay == bay
    assert client.step(0.5) == []
    assert client.reply(first, Refused(code="timeout", detail="no answer")) is None
    assert client.waits() == "no answer"
    assert client.step(0.6) == [first]
    assert client.reply(first, GIVEN) == GIVEN
    assert client.step(1.0) == []


def test_it_waits_in_words_and_drives_when_it_is_its_turn(given):
    assert given.waits() == "the parking manager is silent"
    assert given.hear("n2", ("n1",)) == "waits for its turn: n2 drives"
    assert given.hear("", ("n1",), "n9 drives without a bay").endswith("n9 drives without a bay")
    assert given.hear("n1") == ""


def test_permission_ends_by_itself(given):
    given.hear("n1")
    given.step(1.9)
    assert given.waits() == ""
    given.step(0.2)
    assert given.waits() == "the parking manager is silent"


def test_bay_that_the_manager_has_forgotten_is_requested_again(given):
    given.step(2.1)
    given.hear("n2")
    assert given.waits().startswith("waits")
    (again,) = given.step()
    assert again.request_id != "park-n1-bay-s-1"
    assert given.waits() == "requests a bay"


def test_parked_car_needs_no_permission(given):
    given.client.end()
    assert given.step(5.0) == []
    assert given.waits() == ""


def test_reply_to_an_older_request_is_ignored(given):
    given.client.begin("a3")
    (new,) = given.step()
    assert given.reply(BayRequest(request_id="park-n1-bay-s-1", vehicle="n1"), GIVEN) is None
    assert given.reply(new, GIVEN) == GIVEN


def city_of(*agents):
    return Lockstep([WorldPart(LOT, 1, ()), ParkingPart(LOT), *agents])


def test_goal_request_for_a_bay_is_answered_with_the_manager_s_reply():
    part = ParkPart("park-n1", Wanted("n1", spawn="a"))
    with city_of(part) as city:
        city.run_for(2.5)
        reply = city.call(ParkRequest(vehicle="n1", goal="b1"))
        assert isinstance(reply, ParkReply)
        assert (reply.x_m, reply.y_m, reply.yaw_rad) == tuple(roads_of(LOT).spawn_pose("b1"))


def test_full_lot_is_a_failure_in_words():
    one = LOT.bays[0]
    part = ParkPart("park-n1", Wanted("n1", "any", spawn="a"))
    world = WorldPart(LOT, 1, ())
    world.world.host("n9", "nigel", roads_of(LOT).spawn_pose(one.name), 0)
    with Lockstep([world, ParkingPart(replace(LOT, bays=(one,))), part]) as city:
        city.run_until(lambda: part.is_over, 5.0)
        assert part._report().state == "failed"
        assert part._report().reason == f"all 1 bays are taken: {one.name} by n9"


def test_without_a_manager_the_car_stands_and_says_so():
    part = ParkPart("park-n1", Wanted("n1", "any", spawn="a"))
    with Lockstep([WorldPart(LOT, 1, ()), part]) as city:
        city.run_for(3.0)
        assert part._report() == Report(
            "plan", "the parking manager is not running, or cannot be reached"
        )


def test_car_stands_while_the_manager_is_gone_and_goes_on_with_a_new_one():
    part = ParkPart("park-n1", Wanted("n1", "any", spawn="a"))
    manager = ParkingPart(LOT)
    with Lockstep([WorldPart(LOT, 1, ()), manager, part]) as city:
        city.run_for(6.0)
        assert part._report().state == "drive"
        city.kill(manager)
        city.run_for(3.0)
        assert part._report() == Report("plan", "the parking manager is silent")
        states = city.subscribe(Subscription(VehicleState))
        city.run_for(3.0)
        speeds = [abs(item.message.speed_mps) for item in states.drain()]
        assert max(speeds) < 0.005
        city.add(ParkingPart(LOT))
        city.run_until(lambda: part._report().state == "drive", 5.0)


@pytest.mark.slow
def test_three_cars_park_in_turn_without_contact():
    agents = [
        ParkPart(f"park-n{k}", Wanted(f"n{k}", "any", spawn=place), seed)
        for k, (place, seed) in enumerate(zip("abc", "123", strict=True), start=1)
    ]
    world = WorldPart(LOT, 1, ())
    manager = ParkingPart(LOT)
    with Lockstep([world, manager, *agents]) as city:
        contacts = city.subscribe(Subscription(Contact))
        statuses = city.subscribe(Subscription(ParkingStatus))
        for agent in agents:  # they park in this order, and each leaves then
            city.run_until(lambda agent=agent: agent.is_over, 40.0)
            assert agent.parking.report.state == "parked"
            city.remove(agent)
        city.run_for(1.0)
        last = [item.message for item in statuses.drain()][-1]
        parked = {row.vehicle: row.name for row in last.bays if row.state == "occupied"}
        assert parked == dict(
            zip([f"n{k}" for k in range(1, 4)], [bay.name for bay in LOT.bays], strict=False)
        )
        assert not contacts.drain()
