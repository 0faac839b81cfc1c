"""The bridge beside a real world on a stepped clock; the script is what the test says."""

import base64
import json
import math

import pytest

from scm.errors import RunError
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.exchange import Call, Incoming
from scm.v2x.message import Refused
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.join_request import JoinReply
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.remove_request import RemoveRequest
from scm.v2x.messages.signal_request import SignalRequest
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.world_definition import WorldDefinition
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.world.part import WorldPart
from vehicle_agent.devkit.bridge import FIRST_PICTURE_TIMEOUT_NS, DevkitPart, Wanted
from vehicle_agent.devkit.heads import Heads

S = 1_000_000_000
CITY = load_map("driving_school")
ROTATION = {"PosZ": "0", "RotX": "0", "RotY": "0", "RotZ": "0", "RotW": "1"}


class HeldScript:
    is_open = True
    failure = None
    detail = "talks with the test"


class Stage:
    def __init__(self, wanted, hosted=1, traffic=False):
        self.script = HeldScript()
        cars = tuple((f"n{number + 1}", "nigel") for number in range(hosted))
        parts = [WorldPart(CITY, hosted=cars)]
        if traffic:
            parts += [TrafficPart(CITY), MonitorPart(CITY)]
        self.lockstep = Lockstep(parts)
        self.part = DevkitPart("devkit-4567", wanted, "session")
        self.part.connect(self.script)
        self.snapshots = self.lockstep.subscribe(Subscription(WorldSnapshot))
        self.spats = self.lockstep.subscribe(Subscription(Spat))
        self.statuses = self.lockstep.subscribe(
            Subscription(PartStatus, {"station": "devkit-4567"})
        )
        self.commands = self.lockstep.subscribe(Subscription(DriveCommand))
        self.cars = {}
        self.lockstep.run_for(0.2)
        self.lockstep.add(self.part)
        self.lockstep.run_for(0.1)

    def say(self, span_s, each_s=0.05, **keys):
        """Reply at a rate, as a script does; return the first car."""
        said = {key.replace("_", " "): str(value) for key, value in keys.items()}
        for _ in range(round(span_s / each_s)):
            self.part.on_reply(said, self.lockstep.now_ns)
            self.lockstep.run_for(each_s)
        return self.car()

    def wait(self, span_s):
        self.lockstep.run_for(span_s)
        return self.car()

    def car(self, name="n1"):
        for item in self.snapshots.drain():
            self.cars = {row.vehicle: row for row in item.message.vehicles}
        return self.cars.get(name)

    def lamps(self):
        groups = [item.message.groups for item in self.spats.drain()][-1]
        return {group.group: group.colour for group in groups}


@pytest.fixture
def stage(request):
    made = Stage(*getattr(request, "param", (Wanted(("n1",)),)))
    with made.lockstep:
        yield made


def told(stage):
    return stage.statuses.drain()[-1].message.detail


def test_a_script_drives_a_car_by_its_lease(stage):
    assert stage.car().owner == "world"
    car = stage.say(2.0, V1_Throttle=0.6, V1_Steering=0.5)
    assert (car.owner, car.mode) == ("devkit-4567", "drive")
    assert car.speed_mps > 0.1
    assert car.steering_rad == pytest.approx(0.5 * 0.5236, abs=0.01)
    assert "n1 drives" in told(stage)


@pytest.mark.parametrize("stage", [(Wanted(("n1",), sign="right"),)], indirect=True)
def test_plus_can_be_right(stage):
    assert stage.say(1.0, V1_Throttle=0.6, V1_Steering=0.5).steering_rad < -0.2


def test_headlights_and_indicators_reach_the_car(stage):
    keys = {"V1_Throttle": 0.5, "V1_Steering": 0, "V1_Headlights": 2, "V1_Indicators": 3}
    lights = {name for _ in range(30) for name in stage.say(0.05, **keys).lights}
    assert {"head_high", "head_low", "tail", "left", "right"} <= lights


def test_each_reply_is_one_command_and_a_slow_script_keeps_its_car_going(stage):
    stage.say(0.5, V1_Throttle=0.5, V1_Steering=1)
    stage.commands.drain()
    stage.say(1.0, each_s=0.02, V1_Throttle=0.5, V1_Steering=1)
    assert len(stage.commands.drain()) == pytest.approx(50, abs=4)
    car = stage.say(1.8, each_s=0.9, V1_Throttle=0.5, V1_Steering=1)
    assert len(stage.commands.drain()) == pytest.approx(36, abs=5)
    assert car.mode == "drive"
    assert car.speed_mps > 0.1


def test_a_script_that_is_silent_for_a_second_stops_its_car_and_keeps_it(stage):
    stage.say(1.0, V1_Throttle=0.6, V1_Steering=1)
    assert stage.wait(0.8).speed_mps > 0.1
    car = stage.wait(1.5)
    assert car.speed_mps == pytest.approx(0.0, abs=0.01)
    assert car.owner == "devkit-4567"
    assert car.steering_rad > 0.1


def test_a_script_that_goes_gives_the_car_back(stage):
    stage.say(1.0, V1_Throttle=0.6, V1_Steering=0)
    stage.script.is_open = False
    car = stage.wait(0.5)
    assert car.owner == "world"
    assert car.speed_mps == pytest.approx(0.0, abs=0.05)


def test_the_bridge_that_ends_gives_the_car_back(stage):
    stage.say(1.0, V1_Throttle=0.6, V1_Steering=0)
    stage.lockstep.remove(stage.part)
    assert stage.wait(0.2).owner == "world"


def steal(stage):
    request = LeaseRequest(
        vehicle="n1", owner="ada", verb="steal", reason="too fast", ttl_ms=60_000
    )
    reply = stage.lockstep.call(request)
    assert isinstance(reply, LeaseReply)
    return reply.epoch


def test_who_takes_the_car_keeps_it_until_the_script_connects_anew(stage):
    stage.say(1.0, V1_Throttle=0.6, V1_Steering=0)
    epoch = steal(stage)
    assert stage.say(0.7, V1_Throttle=0.6, V1_Steering=0).owner == "ada"
    release = LeaseRequest(vehicle="n1", owner="ada", verb="release", epoch=epoch)
    assert not isinstance(stage.lockstep.call(release), Refused)
    assert stage.say(3.0, V1_Throttle=0.6, V1_Steering=0).owner == "world"
    assert "taken over" in told(stage)
    stage.script.is_open = False
    stage.wait(0.1)
    stage.script.is_open = True
    assert stage.say(1.0, V1_Throttle=0.6, V1_Steering=0).owner == "devkit-4567"


def test_a_lease_that_lapsed_is_asked_for_again(stage):
    stage.say(1.0, V1_Throttle=0.6, V1_Steering=0)
    stage.lockstep.kill(stage.part)
    stage.wait(1.5)
    assert stage.car().owner == "world"
    stage.lockstep.add(stage.part)
    assert stage.say(1.0, V1_Throttle=0.6, V1_Steering=0).owner == "devkit-4567"


@pytest.mark.parametrize("stage", [(Wanted(("n2", "n1"), cameras=()), 2)], indirect=True)
def test_two_cars_are_v1_and_v2_in_the_order_of_the_options(stage):
    keys = {"V1_Throttle": 0.8, "V2_Throttle": 0.0, "V1_Steering": 1, "V2_Steering": 0}
    stage.say(1.0, **keys)
    assert stage.car("n2").speed_mps > 0.15
    assert stage.car("n1").speed_mps == pytest.approx(0.0, abs=0.01)
    data = json.loads(stage.part.packet().text(1)[3:])[1]
    for number, name in ((1, "n2"), (2, "n1")):
        x, y, _ = (float(word) for word in data[f"V{number} Position"].split())
        assert math.hypot(x - stage.car(name).x_m, y - stage.car(name).y_m) < 0.02


@pytest.mark.parametrize("stage", [(Wanted(("n1",), cameras=()),)], indirect=True)
def test_the_packet_is_what_the_car_says(stage):
    stage.wait(0.5)
    data = json.loads(stage.part.packet().text(1)[3:])[1]
    assert len(data) == 15 + len(CITY.lights)
    before = [int(word) for word in data["V1 Encoder Ticks"].split()]
    stage.say(1.0, V1_Throttle=0.8, V1_Steering=0)
    data = json.loads(stage.part.packet().text(1)[3:])[1]
    after = [int(word) for word in data["V1 Encoder Ticks"].split()]
    assert all(b > a + 500 for a, b in zip(before, after, strict=True))
    ranges = [float(word) for word in data["V1 LIDAR Range Array"].split()]
    assert sum(map(math.isfinite, ranges)) > 300


def test_the_first_packet_has_a_picture_of_each_camera(stage):
    stage.wait(1.0)
    assert stage.part.packet() is None
    assert "a picture of n1 rear" in stage.statuses.drain()[-1].message.detail
    for camera, payload in (("front", b"first"), ("rear", b"second")):
        assert stage.part.packet() is None
        size = {"width_px": 4, "height_px": 3}
        frame = CameraFrame(vehicle="n1", camera=camera, t_ns=0, payload=payload, **size)
        stage.part.step(stage.lockstep.now_ns, [Incoming(frame, stage.lockstep.now_ns)])
    data = json.loads(stage.part.packet().text(1)[3:])[1]
    seen = [base64.b64decode(data[f"V1 {name} Camera Image"]) for name in ("Front", "Rear")]
    assert seen == [b"first", b"second"]


@pytest.mark.parametrize("stage", [(Wanted(("n1",), cameras=("front",)),)], indirect=True)
def test_without_any_picture_packets_are_black_in_the_end_and_the_bridge_says_so(stage, caplog):
    stage.wait(0.5)
    assert stage.part.packet() is None
    stage.part.step(stage.lockstep.now_ns + FIRST_PICTURE_TIMEOUT_NS, [])
    assert "V1 Front Camera Image" in stage.part.packet().text(1)
    assert "n1 front: no picture for 10 s" in caplog.text
    assert "rear" not in caplog.text


def test_nothing_costly_is_heard_while_no_script_is_there(stage):
    kinds = {subscriptions.kind for subscriptions in stage.part.subscriptions}
    assert {LidarScan, CameraFrame} <= kinds
    stage.script.is_open = False
    stage.wait(0.1)
    assert not {LidarScan, CameraFrame} & {
        subscriptions.kind for subscriptions in stage.part.subscriptions
    }


@pytest.mark.parametrize("stage", [(Wanted(("n1",), cameras=("front",)),)], indirect=True)
def test_only_the_cameras_that_are_wanted_are_asked_for(stage):
    wished = [h.where["camera"] for h in stage.part.subscriptions if h.kind is CameraFrame]
    assert wished == ["front"]


@pytest.mark.parametrize("stage", [(Wanted(("ghost",)),)], indirect=True)
def test_a_car_that_is_not_there_is_told_and_waited_for(stage, caplog):
    stage.wait(3.0)
    assert stage.part.packet() is None
    assert "no car ghost in this city" in caplog.text
    assert "waits for ghost" in told(stage)


@pytest.mark.parametrize("stage", [(Wanted(("v1",), spawns=()), 0)], indirect=True)
def test_a_car_can_be_brought_and_is_taken_away_again(stage):
    car = stage.wait(1.0)
    assert stage.car("v1") is not None
    stage.say(1.0, V1_Throttle=0.6, V1_Steering=0)
    assert stage.car("v1").speed_mps > 0.1
    stage.lockstep.remove(stage.part)
    stage.wait(0.2)
    assert stage.car("v1") is None
    assert car is None


def requests_of(calls, kind):
    return [call for call in calls if isinstance(call, Call) and isinstance(call.request, kind)]


def test_a_spawn_that_answers_late_is_asked_again_under_its_id_and_leaves_no_car_behind():
    part = DevkitPart("d", Wanted(("v1",), spawns=()), "run")
    (first,) = requests_of(part.step(0, []), SpawnRequest)
    late = Refused(code="timeout", detail="no answer within 10 s")
    (again,) = requests_of(part.step(11 * S, [Incoming(late, 11 * S, first)]), SpawnRequest)
    assert again.request.request_id == first.request.request_id != ""
    (gone,) = requests_of(part.finish(12 * S), RemoveRequest)
    assert gone.request.vehicle == "v1"
    full = Refused(code="full", detail="no place is free")
    (other,) = requests_of(part.step(13 * S, [Incoming(full, 13 * S, again)]), SpawnRequest)
    assert other.request.request_id != first.request.request_id
    there = Refused(code="owned", detail="there is already one named 'v1'")
    part.step(14 * S, [Incoming(there, 14 * S, other)])
    assert not requests_of(part.finish(15 * S), RemoveRequest)


@pytest.mark.parametrize("stage", [(Wanted(("v1",), spawns=()), 0)], indirect=True)
def test_reset_puts_a_car_back_to_where_it_began_once_for_each_rise(stage):
    stage.wait(0.5)
    began = stage.car("v1")
    keys = {"V1_Throttle": 0.8, "V1_Steering": 0}
    stage.say(3.0, **keys)
    far = stage.car("v1")
    assert math.hypot(far.x_m - began.x_m, far.y_m - began.y_m) > 0.3
    stage.say(0.4, **keys, V1_Reset="True")
    near = stage.car("v1")
    assert math.hypot(near.x_m - began.x_m, near.y_m - began.y_m) < 0.1
    stage.say(2.5, **keys, V1_Reset="True")
    again = stage.car("v1")
    assert math.hypot(again.x_m - began.x_m, again.y_m - began.y_m) > 0.2
    assert again.owner == "devkit-4567"


def test_a_car_of_the_citys_own_is_not_reset(stage, caplog):
    stage.say(1.0, V1_Throttle=0.6, V1_Steering=0)
    before = stage.car()
    stage.say(0.3, V1_Throttle=0.6, V1_Steering=0, V1_Reset=1)
    after = stage.car()
    assert math.hypot(after.x_m - before.x_m, after.y_m - before.y_m) < 0.2
    assert caplog.text.count("was not spawned by this bridge") == 1


@pytest.mark.parametrize("stage", [(Wanted(("n1",), spawns=()),)], indirect=True)
def test_a_car_that_was_there_before_stays_when_the_bridge_ends(stage):
    stage.say(1.0, V1_Throttle=0.6, V1_Steering=0)
    assert stage.car().owner == "devkit-4567"
    stage.lockstep.remove(stage.part)
    assert stage.wait(0.2) is not None


@pytest.mark.parametrize("stage", [(Wanted(("ghost",)), 0, True)], indirect=True)
def test_a_scripts_green_is_an_operators_hold(stage):
    keys = {"V1_Throttle": 0, "V1_Steering": 0}
    own = CITY.lights[0].group
    other = {"south_east": "south_west", "south_west": "south_east"}[own]
    stage.say(45.0, each_s=0.5, **keys, TL1_State=3)
    seen = set()
    for _ in range(12):
        stage.say(1.0, each_s=0.5, **keys, TL1_State=3)
        lamps = stage.lamps()
        seen.add((lamps[own], lamps[other]))
    assert seen == {("green", "red")}
    for _ in range(60):
        stage.say(0.5, each_s=0.5, **keys, TL1_State=0)
        if stage.lamps()[other] == "green":
            return  # it is taken back: the other way has its turn again
    pytest.fail(f"{other} was not green within 30 s")


def test_lights_by_option_have_their_order(stage):
    part = DevkitPart("d", Wanted(("n1",), lights=(3, 1)))
    stage.lockstep.add(part)
    stage.wait(0.1)
    heads = part._heads._heads
    by_id = {light.light_id: light for light in CITY.lights}
    assert heads == tuple((by_id[i].junction, by_id[i].group) for i in (3, 1))


def test_an_unknown_light_stops_the_bridge_in_words(stage):
    stage.lockstep.add(DevkitPart("d", Wanted(("n1",), lights=(9,))))
    with pytest.raises(RunError, match="--light 9: map driving_school has no such light, only 1"):
        stage.wait(0.1)


def test_a_fault_on_the_scripts_thread_ends_the_bridge(stage):
    stage.script.failure = ZeroDivisionError("a fault of ours")
    with pytest.raises(ZeroDivisionError):
        stage.wait(0.1)
    stage.script.failure = None


def asked(calls):
    return [(call.request.verb, call.request.groups) for call in calls if isinstance(call, Call)]


def test_wishes_of_lights_are_made_renewed_and_taken_back():
    heads = Heads("script")
    heads.learn([("j", "a"), ("j", "b"), ("j", "a")])
    assert heads.step(0, [None, None, None]) == []
    assert asked(heads.step(0, [3, 1, None])) == [
        ("omit", ("b",)), ("force_off", ("b",)), ("hold", ("a",)), ("call", ("a",)),
    ]  # fmt: skip
    assert heads.step(9_999_999_999, [3, 1, None]) == []
    assert len(heads.step(10_000_000_000, [3, 1, None])) == 4
    assert asked(heads.step(10_000_000_001, [2, 1, 0])) == [
        ("clear", ("a",)), ("omit", ("b",)), ("force_off", ("b",)),
    ]  # fmt: skip
    assert asked(heads.step(10_000_000_002, [3, 0, 1])) == [
        ("clear", ("b",)), ("omit", ("a",)), ("force_off", ("a",)),
    ]  # fmt: skip
    assert heads.step(10_000_000_003, [1, 0, 3]) == []
    assert asked(heads.release()) == [("clear", ("a",))]
    assert heads.release() == []


def test_what_a_junction_refuses_is_told_once(caplog):
    heads = Heads("script")
    request = SignalRequest(junction="j", verb="hold", by="script")
    for _ in range(3):
        heads.replied(request, Refused(code="invalid", detail="they conflict"))
    assert caplog.text.count("they conflict") == 1


@pytest.mark.parametrize("stage", [(Wanted(("p1",), cosim=True), 1)], indirect=True)
def test_a_script_can_place_a_car_itself(stage):
    keys = {"V1_Throttle": 0, "V1_Steering": 0, "V1_CoSim": 1}
    keys |= {f"V1_{key}": value for key, value in ROTATION.items()}
    for number in range(40):
        stage.say(0.05, **keys, V1_PosX=0.5 + 0.01 * number, V1_PosY=1.2)
    car = stage.car("p1")
    assert car.kind == "remote"
    assert (car.x_m, car.y_m) == (pytest.approx(0.89, abs=0.02), 1.2)
    assert car.speed_mps == pytest.approx(0.2, abs=0.01)
    data = json.loads(stage.part.packet().text(1)[3:])[1]
    assert float(data["V1 Position"].split()[1]) == 1.2
    stage.lockstep.remove(stage.part)
    stage.wait(0.2)
    assert stage.car("p1") is None


def test_a_placed_car_is_told_to_its_script_though_the_city_lets_it_hear_nothing():
    part = DevkitPart("p1", Wanted(("p1",), cosim=True), "session")
    part.connect(HeldScript())
    add_car = JoinReply(vehicle="p1", x_m=1.0, y_m=2.0, yaw_rad=0.0, tag_id=1, epoch=1, t_ns=0)
    (call,) = [out for out in part.step(0, []) if isinstance(out, Call)]
    known = Incoming(WorldDefinition(t_ns=0, seed=0, map=CITY), 1)
    part.step(1, [known, Incoming(add_car, 1, call)])
    data = json.loads(part.packet().text(None)[2:])[1]
    assert data["V1 Position"].startswith("1.0000 2.0000")


def test_cosim_of_a_car_that_is_driven_is_refused_in_words(stage, caplog):
    keys = {f"V1_{key}": value for key, value in ROTATION.items()}
    stage.say(0.5, V1_Throttle=0, V1_Steering=0, V1_CoSim=1, V1_PosX=0, V1_PosY=0, **keys)
    assert caplog.text.count("start the bridge with --cosim") == 1


def test_heads_of_one_group_that_are_set_against_each_other_are_warned_of_once(caplog):
    heads = Heads("script")
    heads.learn([("crossing", "a"), ("crossing", "a"), ("crossing", "b")])
    for now_ns in (0, S, 2 * S):
        calls = heads.step(now_ns, [3, 1, 3])
    assert not calls
    assert caplog.text.count("lights of group a of crossing are set to red and to green") == 1
    heads.step(3 * S, [3, 3, 1])
    assert "group b" not in caplog.text
