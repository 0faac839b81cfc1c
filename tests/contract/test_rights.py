"""The table of rights holds what every part of a city really does, and no more than it means."""

import pytest

from scm.api.view import CityView
from scm.camera.part import CameraPart
from scm.clock import StepClock
from scm.eye.part import EyePart
from scm.maps.load import load_map
from scm.recorder.part import RecorderPart
from scm.runtime.lockstep import Lockstep
from scm.traffic.demand.part import DemandPart
from scm.traffic.demand.table import load_demand
from scm.traffic.misbehaviour.part import MisbehaviourPart
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.observation.part import ObserverPart
from scm.traffic.parking.part import ParkingPart
from scm.traffic.signals.part import TrafficPart
from scm.twin.part import TwinPart
from scm.v2x.exchange import Call
from scm.v2x.key import key_of, prefix, selector
from scm.v2x.message import Message, Request
from scm.v2x.messages import message_classes
from scm.v2x.messages.autonomy_plan import AutonomyPlan
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.costmap import Costmap
from scm.v2x.messages.network_view import NetworkView
from scm.v2x.messages.occupancy_map import OccupancyMap
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.rights import EVERY_REQUEST, rights_of
from scm.world.part import WorldPart
from vehicle_agent.agent import AgentPart


def covers(key, keys):
    """Return whether everything that a key expression stands for is in one of a list."""
    return any(_includes(one.split("/"), key.split("/")) for one in keys)


def _includes(wide, narrow):
    if wide == ["**"]:
        return not any(chunk.startswith("@") for chunk in narrow)
    if not wide or not narrow:
        return wide == narrow
    same = wide[0] == narrow[0] or (wide[0] == "*" and not narrow[0].startswith(("@", "**")))
    return same and _includes(wide[1:], narrow[1:])


class Noted:
    """A part, and the keys of all it hears, serves, says and asks."""

    def __init__(self, part):
        self._part = part
        self.said, self.heard, self.asked, self.served = set(), set(), set(), set()

    def __getattr__(self, name):
        return getattr(self._part, name)

    def _below(self, key):
        return key.removeprefix(prefix("city"))

    def note(self, outbox):
        part = self._part
        self.heard |= {self._below(selector("city", h.kind, h.where)) for h in part.subscriptions}
        self.served |= {self._below(selector("city", s.kind, s.where)) for s in part.services}
        for item in outbox:
            if isinstance(item, Call):
                self.asked.add(self._below(key_of("city", item.request)))
            elif isinstance(item, Message):
                self.said.add(self._below(key_of("city", item)))

    def step(self, now_ns, inbox):
        outbox = self._part.step(now_ns, inbox)
        self.note(outbox)
        return outbox

    def finish(self, now_ns):
        outbox = self._part.finish(now_ns)
        self.note(outbox)
        return outbox


@pytest.fixture(scope="module")
def city(tmp_path_factory):
    """All parts of a city after some of its time, with a car's agent among them."""
    city_map = load_map("driving_school")
    folder = tmp_path_factory.mktemp("rights")
    record = RecorderPart(folder / "all.mcap", "city")
    table = folder / "rush.csv"
    table.write_text("from,to,vehicles_per_hour\neast_loop,west_loop,3600\n")
    parts = [
        Noted(part)
        for part in (
            WorldPart(city_map, 0, (("n1", "nigel"),)),
            TrafficPart(city_map),
            MonitorPart(city_map),
            EyePart(city_map),
            CityView(),
            record,
            CameraPart(city_map, 0, clock=StepClock()),
            ObserverPart(city_map),
            MisbehaviourPart(city_map),
            ParkingPart(city_map),
            DemandPart(city_map, load_demand(table), 0.0),
            TwinPart(),
            AgentPart("n2", session="s1"),
        )
    ]
    with Lockstep(parts) as lockstep:
        lockstep.run_for(1.5)
        for request in (SpawnRequest(vehicle="n3"), RouteRequest(vehicle="n1", via=())):
            lockstep.call(request)
        lockstep.run_for(1.0)
    return {part.name: part for part in parts}


NAMES = (
    *("world", "traffic", "monitor", "eye", "api", "record", "camera"),
    *("observer", "misbehaviour", "parking", "demand", "twin", "n2"),
)


@pytest.mark.parametrize("name", NAMES)
def test_every_part_may_do_what_it_does(city, name):
    part = city[name]
    rights = rights_of("vehicle" if part.role == "v" else "part", name)
    for done, allowed in (
        (part.said, rights.publishes),
        (part.heard, rights.subscribes),
        (part.asked, rights.requests),
        (part.served, rights.services),
    ):
        assert [key for key in sorted(done) if not covers(key, allowed)] == []


def test_the_city_of_this_test_really_did_something(city):
    assert {"v/n2/state", "v2x/tx/n2/cam", "v/n2/trip"} <= city["n2"].said
    assert {"world/snapshot", "world/def", "v/n1/state", "v/n1/trip"} <= city["world"].said
    assert {"v/n2/join", "v/n2/remove"} <= city["n2"].asked
    assert "v/n2/cmd/*" not in city["n2"].served
    assert any(key.startswith("eye/pose/") for key in city["eye"].said)
    assert "world/spawn" in city["demand"].asked
    assert "traffic/counts" in city["observer"].said
    assert "parking/status" in city["parking"].said
    assert "misbehaviour/scores" in city["misbehaviour"].said


def test_a_driver_may_publish_what_agents_that_park_map_and_drive_by_a_network_do():
    keys = [
        selector("city", kind, {"vehicle": "n1"}).removeprefix(prefix("city"))
        for kind in (AutonomyStatus, AutonomyPlan, Costmap, OccupancyMap, NetworkView)
    ]
    assert all(covers(key, rights_of("driver", "park-n1").publishes) for key in keys)


def test_twin_may_send_cars():
    assert covers("v/n5/cmd/route", rights_of("part", "twin").requests)


def test_an_operator_may_ask_every_request_that_is_no_car_s_own():
    requests = {kind for kind in message_classes() if issubclass(kind, Request)}
    left_out = {
        kind.__name__
        for kind in requests
        if not covers(selector("city", kind, {}).removeprefix(prefix("city")), EVERY_REQUEST)
    }
    assert left_out == {"JoinRequest", "HandoverRequest"}
