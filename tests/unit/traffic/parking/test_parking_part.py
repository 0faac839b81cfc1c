"""The parking manager on a bus: repeated requests, its status, and a new one in its place."""

from msgspec.structs import replace

from scm.clock import NS_PER_S
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.parking.part import ParkingPart
from scm.v2x.message import Refused
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.bay_request import BayReply, BayRequest
from scm.v2x.messages.parking_status import ParkingStatus
from scm.v2x.messages.part_status import PartStatus

LOT = load_map("parking_lot")


def report(city, reply, state="plan"):
    goal = {"goal_x_m": reply.x_m, "goal_y_m": reply.y_m, "goal_yaw_rad": reply.yaw_rad}
    city.publish(AutonomyStatus(vehicle=reply.vehicle, t_ns=city.now_ns, state=state, **goal))


def test_repeated_request_gets_its_answer_again_though_the_car_has_changed_its_bay():
    request = BayRequest(vehicle="n1", request_id="r1")
    with Lockstep([ParkingPart(LOT)]) as city:
        city.run_for(2.2)
        first = city.call(request)
        assert isinstance(first, BayReply)
        other = city.call(BayRequest(vehicle="n1", request_id="r2", bay="b4"))
        assert other.bay == "b4"
        assert city.call(request) == first
        changed = city.call(replace(request, vehicle="n2"))
        assert isinstance(changed, Refused)


def test_status_comes_twice_a_second_and_at_once_on_change():
    with Lockstep([ParkingPart(LOT)]) as city:
        statuses = city.subscribe(Subscription(ParkingStatus))
        words = city.subscribe(Subscription(PartStatus))
        city.run_for(2.25)
        assert len(statuses.drain()) == 5
        city.call(BayRequest(vehicle="n1"))
        (status,) = (item.message for item in statuses.drain())
        assert status.driver == "n1"
        detail = words.drain()[-1].message.detail
        assert detail == f"1 of {len(LOT.bays)} bays in use, n1 drives, 0 wait"


def test_new_manager_goes_on_where_the_dead_one_stopped():
    manager, heir = ParkingPart(LOT), ParkingPart(LOT)
    with Lockstep([manager]) as city:
        city.run_for(2.2)
        replies = [city.call(BayRequest(vehicle=name)) for name in ("n1", "n2")]
        city.kill(manager)
        city.add(heir)
        refused = city.call(BayRequest(vehicle="n3"))
        assert refused.code == "offline"
        statuses = city.subscribe(Subscription(ParkingStatus))
        end_ns = city.now_ns + 3 * NS_PER_S
        while city.now_ns < end_ns:
            for reply in replies:
                report(city, reply)
            city.run_for(0.2)
        last = statuses.drain()[-1].message
        assert (last.driver, last.waiting) == ("n1", ("n2",))
        assert city.call(BayRequest(vehicle="n3")).bay == LOT.bays[2].name
