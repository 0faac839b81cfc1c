"""Cars that drive from one city into the next: each exactly once, whole, and only where it may."""

import math
import random

import numpy as np
import pytest
from msgspec.structs import replace

from bench.handover import TwoCities, endless_road, half_loop, moment
from scm.errors import StoreError
from scm.geometry import Pose2
from scm.runtime.lockstep import Lockstep
from scm.store.memory import MemoryStore
from scm.v2x.faults import FaultRates
from scm.v2x.message import Refused
from scm.v2x.messages.handover_request import HandoverReply, HandoverRequest
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.stop_request import StopRequest
from scm.vehicles.handed import digest_of
from scm.world.border import request_of
from scm.world.handover import reply_to_handover, state_of
from scm.world.part import WorldPart
from scm.world.requests import reply_to

HISTORIES = 80
ENDLESS = {"west": endless_road("west", "east"), "east": endless_road("east", "west")}


def without_signals(city):
    return replace(half_loop(city), junctions=(), stop_lines=())


LOOP = {"west": without_signals("west"), "east": without_signals("east")}
MS = 1_000_000


def two(west=("w1",), east=(), maps=ENDLESS, seed=0, **options):
    return TwoCities(maps, {"west": west, "east": east}, seed, **options)


def until(cities, condition, timeout_s=20.0):
    for _ in range(int(timeout_s / 0.02)):
        if condition():
            return
        cities.tick()
    raise AssertionError(f"did not happen within {timeout_s} s")


def whole(cities):
    return not +cities.lost and not +cities.doubled


def test_no_car_is_lost_or_doubled_whatever_fails():
    short = {"west": endless_road("west", "east", 0.8), "east": endless_road("east", "west", 0.8)}
    cities, crossed = two(("w1",), ("e1",), maps=short, seed=34), 0
    before = {name: cities.where(name) for name in cities.names}
    for history in range(HISTORIES):
        moment(cities, random.Random(history), bring=True)
        assert whole(cities), f"history {history}: {cities.lost} {cities.doubled}"
        for name, city in before.items():
            now = cities.where(name)
            crossed += now not in (None, city)
            before[name] = now or city
    cities.restore_link()
    until(cities, lambda: all(cities.where(name) for name in cities.names))
    assert whole(cities)
    assert crossed > HISTORIES // 3  # else the histories have shown nothing


@pytest.mark.parametrize("order", [("west", "east"), ("east", "west")])
def test_car_drives_over_the_border_as_in_one_city(order):
    west, east = LOOP["west"], LOOP["east"]
    after = {"west_out": ("east_in",), "east_out": ("west_in",)}
    lanes = [
        replace(lane, next=after.get(lane.name, lane.next)) for lane in (*west.lanes, *east.lanes)
    ]
    floor = replace(west.floor, x_m=(-5.2, 5.2))
    one = replace(west, lanes=tuple(lanes), floor=floor, neighbours=())
    start = SpawnRequest(vehicle="w1", spawn="border")
    cities, alone = two((), maps=LOOP, order=order), WorldPart(one, room=4)
    with Lockstep([alone]) as single:
        for part, run in ((cities.worlds["west"], cities.run), (alone, single)):
            run.run_for(0.1)
            reply_to(part.world, start, run.now_ns)
            car = part.world.cars.hosted["w1"]
            part.world.trips.circulate(car.index, "w1", car.pose, run.now_ns)
            part.world.cars.arrays.driven[car.index] = True
        came_ns = None
        while came_ns is None or cities.run.now_ns < came_ns + 2000 * MS:
            cities.run.run_for(0.02)
            single.run_for(0.02)
            city = cities.where("w1")
            if city is None:  # the next city steps before this one: it comes with the next tick
                continue
            car, same = cities.worlds[city].world.cars.hosted["w1"], alone.world.cars.hosted["w1"]
            if city == "east" and came_ns is None:
                came_ns = cities.run.now_ns
            ours = [v for x in car.fleet.variables(car.row).values() for v in x.tolist()]
            theirs = [v for x in same.fleet.variables(same.row).values() for v in x.tolist()]
            np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)
        packs, packs_alone = (
            part.world.cars.garage.packs("nigel") for part in (cities.worlds["east"], alone)
        )
        assert packs.drawn_as(car.row) == pytest.approx(packs_alone.drawn_as(same.row), rel=1e-9)


def test_car_is_turned_into_the_frame_of_the_next_city():
    origin = Pose2(1.6, 0.0, 0.3)
    turned = ENDLESS["east"].lanes[0]
    maps = dict(ENDLESS)
    neighbour = replace(ENDLESS["west"].neighbours[0], origin=(*origin,))
    maps["west"] = replace(ENDLESS["west"], neighbours=(neighbour,))
    start = origin.inverse() @ Pose2(1.6, 0.0, 0.0)
    maps["east"] = replace(ENDLESS["east"], lanes=(replace(turned, start=(*start,)),))
    cities = two(maps=maps)
    until(cities, lambda: cities.worlds["west"].world.border.leaving)
    until(cities, lambda: cities.where("w1") == "east")
    car = cities.worlds["east"].world.cars.hosted["w1"]
    along, left = start.inverse().apply(car.pose.x, car.pose.y)
    assert 0.0 <= along < 0.02
    assert left == pytest.approx(0.0, abs=1e-3)
    assert car.speed == pytest.approx(0.267, abs=0.01)


def test_tag_lights_and_epoch_go_over():
    cities = two()
    cities.tick()
    car = cities.worlds["west"].world.cars.hosted["w1"]
    car.switches, epoch, tag_id = car.switches.updated("low", "left"), car.lease.epoch, car.tag_id
    until(cities, lambda: cities.where("w1") == "east")
    there = cities.worlds["east"].world.cars.hosted["w1"]
    assert there.switches == car.switches
    assert there.tag_id == tag_id
    assert there.lease.epoch > epoch
    assert there.is_sent


def test_car_waits_at_the_border_while_the_next_city_is_away_and_then_drives_on():
    cities = two()
    cities.cut()
    for _ in range(400):
        cities.tick()
    car = cities.worlds["west"].world.cars.hosted["w1"]
    front = car.pose.x + car.car.vector("body.footprint_x_m")[1]
    assert 1.5 < front <= 1.6
    assert abs(car.speed) < 0.01
    assert cities.worlds["west"].world.border.approaching["w1"].why in ("timeout", "offline")
    cities.restore_link()
    until(cities, lambda: cities.where("w1") == "east", 5.0)
    assert whole(cities)


def test_transfer_under_way_outlives_both_worlds_and_the_link():
    cities = two()
    until(cities, lambda: cities.worlds["west"].world.border.approaching)
    until(cities, lambda: cities.worlds["west"].world.border.approaching["w1"].until_ns)
    until(cities, lambda: cities.worlds["west"].world.cars.hosted["w1"].pose.x > 1.59)
    cities.cut()
    until(cities, lambda: cities.worlds["west"].world.border.leaving)
    cities.kill("west")
    cities.kill("east")
    for _ in range(100):
        cities.tick()
    assert cities.where("w1") is None
    cities.restore_link()
    until(cities, lambda: cities.where("w1") == "east", 3.0)
    until(cities, lambda: not cities.worlds["west"].world.border.leaving, 3.0)
    assert whole(cities)


def test_transfer_that_comes_twice_is_applied_once():
    cities = two()
    cities.faults.link_rates = FaultRates(duplicate=1.0, late=0.5, late_s=3.0)
    until(cities, lambda: cities.where("w1") == "east", 40.0)
    for _ in range(300):
        cities.tick()
    assert whole(cities)


def test_transfer_leaves_only_when_it_is_stored():
    class Sick(MemoryStore):
        sick = False

        def transaction(self):
            if self.sick:
                raise StoreError("the disk is full")
            return super().transaction()

    cities = two(())
    store = Sick()
    part = WorldPart(ENDLESS["west"], 0, (("w1", "nigel"),), room=4, city="west")
    cities.run.kill(cities.worlds["west"])
    cities.worlds["west"] = part
    cities.run.add(part, store, "west")
    for _ in range(3000):
        if part.world.border.approaching and part.world.cars.hosted["w1"].pose.x > 1.55:
            break
        cities.run.run_for(0.02)
    store.sick = True
    cities.run.run_for(2.0)
    assert part.world.border.leaving
    assert cities.where("w1") is None  # neither sent nor lost
    store.sick = False
    cities.run.run_for(1.0)
    assert cities.where("w1") == "east"


def test_refused_car_is_put_back_at_the_border():
    cities = two()
    west, east = (cities.worlds[city].world for city in ("west", "east"))
    until(cities, lambda: west.border.approaching and west.border.approaching["w1"].until_ns)
    until(cities, lambda: west.cars.hosted["w1"].pose.x > 1.59)
    spawned = reply_to(east, SpawnRequest(vehicle="w1", spawn="s2"), cities.run.now_ns)
    assert not isinstance(spawned, Refused)
    until(cities, lambda: west.border.leaving)
    until(cities, lambda: "w1" in west.cars.hosted, 3.0)
    assert not west.border.leaving
    for _ in range(50):
        cities.tick()
    car = west.cars.hosted["w1"]
    assert 1.2 < car.pose.x < 1.45
    assert abs(car.speed) < 0.01
    assert "w1" in east.cars.hosted


def test_car_of_the_next_city_counts_as_the_car_ahead():
    cities = two((), maps=LOOP)
    west, east = (cities.worlds[city].world for city in ("west", "east"))
    cities.tick()
    east_place = SpawnRequest(vehicle="e1", spawn="0.75,-0.8,0")
    assert not isinstance(reply_to(east, east_place, cities.run.now_ns), Refused)
    reply_to(west, SpawnRequest(vehicle="w1", spawn="border"), cities.run.now_ns)
    car = west.cars.hosted["w1"]
    west.trips.circulate(car.index, "w1", car.pose, cities.run.now_ns)
    west.cars.arrays.driven[car.index] = True
    for _ in range(600):
        cities.run.run_for(0.02)
    assert cities.where("w1") == "east"
    there = east.cars.hosted["w1"]
    gap = 0.75 + there.car.vector("body.footprint_x_m")[0] - there.pose.x
    gap -= there.car.vector("body.footprint_x_m")[1]
    assert 0.05 < gap < 0.3
    assert abs(there.speed) < 0.01


def test_car_slows_down_for_a_car_behind_the_border_before_it_crosses():
    cities = two((), maps=LOOP)
    west, east = (cities.worlds[city].world for city in ("west", "east"))
    cities.tick()
    reply_to(east, SpawnRequest(vehicle="e1", spawn="0.50,-0.8,0"), cities.run.now_ns)
    reply_to(west, SpawnRequest(vehicle="w1", spawn="border"), cities.run.now_ns)
    car = west.cars.hosted["w1"]
    west.trips.circulate(car.index, "w1", car.pose, cities.run.now_ns)
    west.cars.arrays.driven[car.index] = True
    fastest = last = 0.0
    while "w1" in west.cars.hosted:
        last = car.speed
        fastest = max(fastest, last)
        cities.run.run_for(0.02)
    assert fastest > 0.25
    assert last < 0.2


def test_car_stops_behind_a_car_that_stands_just_behind_the_border():
    cities = two((), maps=LOOP)
    west, east = (cities.worlds[city].world for city in ("west", "east"))
    cities.tick()
    reply_to(east, SpawnRequest(vehicle="e1", spawn="0.30,-0.8,0"), cities.run.now_ns)
    reply_to(west, SpawnRequest(vehicle="w1", spawn="border"), cities.run.now_ns)
    car = west.cars.hosted["w1"]
    west.trips.circulate(car.index, "w1", car.pose, cities.run.now_ns)
    west.cars.arrays.driven[car.index] = True
    for _ in range(500):
        cities.run.run_for(0.02)
    assert west.drivers.waiting[car.index] >= 0
    assert car.pose.x + car.car.vector("body.footprint_x_m")[1] <= 0.0
    assert west.border.approaching["w1"].why == "occupied"
    assert len(west.border.ghosts) == 1


def asks(world, **changes):
    """Return what east answers to a request for a place of a car of west, with changes."""
    request = HandoverRequest(
        city="west",
        phase="reserve",
        vehicle="w1",
        epoch=5,
        lane="road",
        border=(0.0, 0.0, 0.0),
        car="nigel",
        digest=digest_of("nigel"),
    )
    return reply_to_handover(world, replace(request, **changes), 0, [])


@pytest.fixture
def east():
    return WorldPart(ENDLESS["east"], 0, room=2, city="east").world


def test_place_is_reserved(east):
    reply = asks(east)
    assert isinstance(reply, HandoverReply)
    assert reply.valid_ms > 0


@pytest.mark.parametrize(
    ("changes", "code", "words"),
    [
        ({"city": "north"}, "not_neighbour", "north is no neighbour of east: expected one of west"),
        ({"lane": "raod"}, "invalid", "did you mean 'road'"),
        ({"border": (0.1, 0.0, 0.0)}, "invalid", "compare the origins"),
        ({"border": (0.0, 0.0, 0.2)}, "invalid", "compare the origins"),
        ({"car": "nigle"}, "unknown_car", "did you mean 'nigel'"),
        ({"car": "../../etc/passwd"}, "unknown_car", "no car file"),
        ({"digest": "0"}, "unknown_car", "has other effects or numbers here"),
        ({"vehicle": "No Name"}, "invalid", "no valid name"),
        ({"vehicle": "world"}, "owned", "already a car named 'world'"),
        ({"phase": "commit"}, "invalid", "state: expected the car"),
    ],
)
def test_wrong_request_is_refused_with_its_reason(east, changes, code, words):
    reply = asks(east, **changes)
    assert code in (getattr(reply, "code", ""), getattr(reply, "refused", ""))
    assert words in reply.detail


def test_car_whose_name_is_taken_is_refused(east):
    reply_to(east, SpawnRequest(vehicle="w1", spawn="s2"), 0)
    assert asks(east).code == "owned"


def test_stopped_city_takes_no_cars(east):
    reply_to(east, StopRequest(engaged=True, by="ann"), 0)
    assert asks(east).code == "stopped"


def test_full_city_takes_no_cars(east):
    reply_to(east, SpawnRequest(vehicle="e1", spawn="s1"), 0)
    reply_to(east, SpawnRequest(vehicle="e2", spawn="s2"), 0)
    assert asks(east).code == "full"


def test_place_with_a_car_on_it_is_refused(east):
    reply_to(east, SpawnRequest(vehicle="e1", spawn="s0"), 0)
    assert asks(east).code == "occupied"


def test_place_that_another_car_has_is_refused(east):
    asks(east, vehicle="w2")
    reply = asks(east)
    assert reply.code == "occupied"
    assert "w2 comes first" in reply.detail


def test_refused_transfer_is_refused_again_and_older_ones_are_stale(east):
    out = []
    first = HandoverRequest(
        city="west",
        phase="commit",
        vehicle="w1",
        epoch=5,
        lane="road",
        border=(0.0, 0.0, 0.0),
        car="nigel",
        digest="0",
    )
    refused = reply_to_handover(east, first, 0, out)
    assert refused.refused == "unknown_car"
    right = replace(first, digest=digest_of("nigel"))
    assert reply_to_handover(east, right, 0, []) == refused
    assert reply_to_handover(east, replace(right, epoch=4), 0, []).refused == "stale"


def handed(change=lambda state: {}):
    """Return a transfer of a car of west, with changes of its state."""
    west = WorldPart(ENDLESS["west"], 0, room=2, city="west").world
    reply_to(west, SpawnRequest(vehicle="w1", spawn="s0"), 0)
    car, (road,) = west.cars.hosted["w1"], west.border.exits.values()
    car.fleet.place(car.row, road.end)
    state = state_of(west, car, road, 0)
    state = replace(state, driver=replace(state.driver, decided_ns=0))  # it has not driven
    state = replace(state, **change(state))
    return replace(request_of(west, car, road), phase="commit", state=state)


def with_speed(*values):
    """Return a change of a car's velocity."""
    return lambda state: {
        "variables": tuple(
            replace(one, values=values) if one.name == "vx_world" else one
            for one in state.variables
        )
    }


def test_transfer_of_a_whole_car_is_taken(east):
    request = handed()
    assert isinstance(reply_to_handover(east, request, 0, []), HandoverReply)
    assert east.cars.hosted["w1"].pose == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda _: {"variables": ()}, "expected one value of x_cog"),
        (with_speed(0.0, 0.0), "vx_world: got 2 values, expected 1"),
        (with_speed(1e300), "beyond every physical range"),
        (lambda _: {"drawn_as": math.inf}, "beyond every physical range"),
        (lambda _: {"origin": (5.0, 0.0, 0.0)}, "is not at the border"),
        (lambda _: {"tag_id": 10**9}, "expected 0 to 586"),
        (lambda state: {"driver": replace(state.driver, decided_ns=-(2**62))}, "decided_ns"),
    ],
)
def test_transfer_of_a_car_that_cannot_be_is_refused_and_leaves_no_car(east, change, words):
    reply = reply_to_handover(east, handed(change), 0, [])
    assert reply.refused == "invalid"
    assert words in reply.detail
    assert not east.cars.hosted


def test_car_on_its_way_keeps_its_name():
    cities = two()
    west = cities.worlds["west"].world
    until(cities, lambda: west.border.approaching and west.border.approaching["w1"].until_ns)
    until(cities, lambda: west.cars.hosted["w1"].pose.x > 1.59)
    cities.cut()
    until(cities, lambda: west.border.leaving)
    refused = reply_to(west, SpawnRequest(vehicle="w1", spawn="s0"), cities.run.now_ns)
    assert refused.code == "owned"
