"""A city cut into regions, tick by tick beside the same city in one world."""

from collections import Counter

import msgspec
import numpy as np
import pytest

from scm.errors import MapError, MessageError, RunError
from scm.maps.load import load_map
from scm.maps.route import roads_of
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import BasePart
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.exchange import Answer
from scm.v2x.message import Refused
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.join_request import JoinRequest
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.light_request import LightRequest
from scm.v2x.messages.remove_request import RemoveRequest
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.stop_request import StopRequest
from scm.world.part import WorldPart
from scm.world.regions.cut import cut_map
from scm.world.regions.exchange import RegionNews, decode, encode
from scm.world.regions.ownership import CarsSeen, Ownership
from scm.world.regions.part import RegionsPart
from scm.world.regions.transfer import digest

CITY, CARS, SECONDS, SEED = "grid:5x4:3", 110, 4.0, 3
EVERY = 10  # ticks between two looks at the cars' whole states
SCANNED = {f"n{k}" for k in range(1, 100, 9)}  # scans of all cars take most of the time
REQUESTS = (
    LeaseRequest(vehicle="n7", owner="me", verb="acquire", ttl_ms=60_000),
    RemoveRequest(vehicle="n20"),
    SpawnRequest(vehicle="late"),
    RouteRequest(vehicle="late"),
    RouteRequest(vehicle="n3", speed_mps=0.15),
    LightRequest(vehicle="n30", headlights="low", indicators="left"),
)


class Recorder(BasePart):
    """A world whose messages are all wanted; it notes what is sent, and what the cars are."""

    def __init__(self, part, worlds):
        self._part, self._worlds = part, worlds
        self.name, self.role, self.period_ns = part.name, part.role, part.period_ns
        self.services = part.services
        self.sent, self.cars = [], []
        part.attach(
            lambda kind, where: kind is not LidarScan or where.get("vehicle", "n1") in SCANNED
        )

    @property
    def subscriptions(self):
        return self._part.subscriptions

    def step(self, now_ns, inbox):
        out = self._part.step(now_ns, inbox)
        self.sent.append(Counter(words(one) for one in out))
        if len(self.sent) % EVERY == 0:
            self.cars.append(cars_of(self._worlds, now_ns))
        return out


def words(outgoing):
    """Return the content of an outgoing item, with every bit of its floats."""
    content = outgoing.reply if isinstance(outgoing, Answer) else outgoing
    return type(content).__name__, msgspec.msgpack.encode(content)


def cars_of(worlds, now_ns):
    """Return a digest of each car's whole state, by name, from the world that simulates it."""
    found = {}
    for world in worlds:
        here = {
            name: digest(world, car, now_ns)
            for name, car in world.cars.hosted.items()
            if not world.cars.arrays.elsewhere[car.index]
        }
        assert not here.keys() & found.keys()
        found |= here
    return found


def run(part, worlds):
    """Run a city with its signals, and ask for what operators and agents ask for meanwhile."""
    city_map = worlds[0].city_map
    recorder = Recorder(part, worlds)
    with Lockstep([recorder, TrafficPart(city_map), MonitorPart(city_map)]) as city:
        city.run_for(0.5)
        answers = [city.call(request) for request in REQUESTS]
        for k in range(round(10 * SECONDS)):
            command = {"t_ns": city.now_ns, "seq": k, "throttle": 0.4, "steering": 0.2}
            city.publish(DriveCommand(vehicle="n7", epoch=answers[0].epoch, **command))
            if k == 10 * SECONDS - 8:
                answers.append(city.call(StopRequest(engaged=True, by="me")))
            city.run_for(0.1)
    return recorder, answers


def hosted(count):
    return tuple((f"n{i + 1}", "nigel") for i in range(count))


@pytest.fixture(scope="module")
def whole():
    part = WorldPart(load_map(CITY), SEED, hosted(CARS), room=8)
    recorder, answers = run(part, [part.world])
    kinds = {kind for sent in recorder.sent for kind, _ in sent}
    assert {"LidarScan", "VehicleSensors", "DenmTx", "CamTx", "RadioStatus", "Trip"} <= kinds
    assert not [answer for answer in answers if isinstance(answer, Refused)]
    return recorder, answers


@pytest.mark.parametrize(("regions", "by"), [(3, "bisection"), (4, None)])
def test_city_in_regions_equals_one_world_bit_by_bit(whole, regions, by):
    expected, answers = whole
    part = RegionsPart(load_map(CITY), regions, SEED, hosted(CARS), room=8, by=by)
    got, same_answers = run(part, [region.world for region in part.regions])
    for tick, (wanted, sent) in enumerate(zip(expected.sent, got.sent, strict=True)):
        assert sent == wanted, f"tick {tick}: {list((sent - wanted) + (wanted - sent))[:4]}"
    assert same_answers == answers
    assert got.cars == expected.cars
    moved = sum(region.ownership.moved for region in part.regions) // 2
    assert moved >= 10
    assert sum(region.ownership.missed for region in part.regions) == 0
    assert all(region.world.cars.arrays.elsewhere.any() for region in part.regions)


def test_removed_car_belongs_to_no_region():
    part = RegionsPart(load_map(CITY), 2, SEED, hosted(4), room=4)
    with Lockstep([part]) as city:
        city.run_for(0.1)
        for region in part.regions:  # it is about to go over
            index = region.world.cars.hosted["n2"].index
            region.ownership.next[index] = 1 - region.ownership.owner[index]
        city.call(RemoveRequest(vehicle="n2"))
        city.run_for(0.1)
    for region in part.regions:
        assert region.ownership.owner[index] == region.ownership.next[index] == -1


def test_agents_cars_are_refused_where_a_city_is_cut():
    part = RegionsPart(load_map(CITY), 2, SEED)
    with Lockstep([part]) as city:
        answer = city.call(JoinRequest(vehicle="n1", kind="remote", session="s", car="nigel"))
    assert isinstance(answer, Refused)
    assert "regions" in answer.detail


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda body: body[:-3], "message of a region"),
        (lambda body: news(region=1, tick=9), "expected tick 1, got 9"),
        (lambda body: news(region=1, tick=1, indices=b"1234"), "4 and 5 \\* 8 a car"),
        (lambda body: news(region=1, tick=1, indices=b"\xff" * 4, motion=b"8" * 40), "from 0 to"),
    ],
)
def test_wrong_message_of_a_region_is_refused_with_its_reason(change, message):
    body = news(region=1, tick=1)
    assert decode(body, 1, 8)[0].region == 1
    with pytest.raises(MessageError, match=message):
        decode(change(body), 1, 8)


def news(**given):
    return encode(RegionNews(**{"indices": b"", "motion": b"", **given}), [[]])[0]


def test_cars_that_may_touch_have_the_owner_of_the_first_of_them():
    cut = cut_map(load_map(CITY), 2, by="bisection")
    row = cut.cells.shape[0] // 2
    column = int(np.flatnonzero(np.diff(cut.cells[row]))[0])
    left, low, edge = cut.frame
    at, y = left + edge * (column + 1), low + edge * (row + 0.5)  # the cut runs along x = at
    gap = 0.3 + 0.02  # of cars 0.3 m long
    x = at + gap * np.array([-2.0, -1.0, 0.0, 1.0, 9.0]) + 0.01
    owners = []
    for speed in (0.0, 1.0):
        ownership = Ownership(cut, 0, 5, None)
        cars = CarsSeen(
            np.arange(5), x, np.full(5, y), np.zeros(5), np.full(5, 0.15),
            np.tile([0.3, 0.2], (5, 1)), np.zeros(5, np.bool_),
        )  # fmt: skip
        ownership.decide(cars, speed)
        owners.append(ownership.next.tolist())
    first, second = cut.cells[row, column], cut.cells[row, column + 1]
    assert owners[0] == [first] * 2 + [second] * 3  # at rest they stay apart
    assert owners[1] == [first] * 4 + [second]


def test_region_whose_queue_reaches_far_beyond_it_looks_everywhere():
    cut = cut_map(load_map(CITY), 2)
    left, low, edge = cut.frame
    places = np.argwhere(cut.cells == 1)
    farthest = places[np.argmax([not cut.within(0, 4.0)[row, column] for row, column in places])]
    ownership = Ownership(cut, 0, 1, None)
    ownership.owner[0] = ownership.next[0] = 0
    for place, far in ((np.argwhere(cut.cells == 0)[0], False), (farthest, True)):
        y, x = np.array([low, left]) + edge * (place + 0.5)
        assert ownership.reaches_far(np.array([x]), np.array([y])) == far


def test_too_fast_a_car_ends_the_run_with_its_speed():
    ownership = Ownership(cut_map(load_map(CITY), 2), 0, 1, None)
    cars = CarsSeen(np.arange(1), *np.zeros((4, 1)), np.array([[0.3, 0.2]]), np.zeros(1, np.bool_))
    with pytest.raises(RunError, match=r"12\.0 m/s"):
        ownership.decide(cars, 12.0)


@pytest.mark.parametrize("by", ["metis", "bisection"])
@pytest.mark.parametrize("regions", [2, 3, 4, 7])
def test_cut_shares_traffic_and_leaves_junctions_whole(by, regions):
    city_map = load_map("grid:7x6:4")
    cut, roads = cut_map(city_map, regions, by=by), roads_of(city_map)
    cars = np.zeros(regions)
    for junction in city_map.junctions:
        inside = set()
        for group in junction.groups:
            for way in group.movements:
                for s in np.linspace(way.from_m, min(way.to_m, roads.length_of(way.lane)), 9):
                    pose = roads.lanes[way.lane].at(float(s))
                    inside.add(cut.region_of(pose.x, pose.y))
        assert len(inside) == 1
    for spawn in city_map.spawns:
        pose = roads.spawn_pose(spawn.name)
        cars[cut.region_of(pose.x, pose.y)] += 1
    assert cars.max() <= 1.35 * cars.mean()


@pytest.mark.parametrize("regions", [0, 65, 13])
def test_map_that_cannot_be_cut_says_why(regions):
    with pytest.raises(MapError, match="regions"):
        cut_map(load_map("grid:3x3"), regions)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("proving_ground", "boxes that cars can push"),
        ("examples/cities/half_loop_east.toml", "neighbours"),
    ],
)
def test_a_map_that_regions_do_not_know_whole_is_refused(name, says):
    with pytest.raises(MapError, match=says):
        cut_map(load_map(name), 2)
