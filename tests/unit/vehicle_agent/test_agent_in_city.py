"""Agents in a whole city on a stepped clock: world, signals, cars."""

import itertools
import math

import pytest

from scm.clock import NS_PER_MS
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.message import Refused
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.plan_request import PlanRequest
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.stop_request import StopRequest
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.world.part import WorldPart
from vehicle_agent.agent import AgentPart

FRONT_M = 0.23


@pytest.fixture(scope="module")
def city_map():
    return load_map("driving_school")


@pytest.fixture
def city(city_map):
    parts = [WorldPart(city_map), TrafficPart(city_map), MonitorPart(city_map)]
    with Lockstep(parts) as running:
        yield running


class Watch:
    """What a script hears of the city."""

    def __init__(self, city, *more):
        self.city = city
        kinds = (WorldSnapshot, VehicleState, Trip, Contact, Spat, *more)
        self.boxes = {kind: city.subscribe(Subscription(kind)) for kind in kinds}

    def all(self, kind):
        return [item.message for item in self.boxes[kind].drain()]

    def state(self, name):
        """Return the newest state of a car, or None."""
        for state in self.all(VehicleState):
            if state.vehicle == name:
                self.boxes[name] = state
        return self.boxes.get(name)


@pytest.fixture
def watch(city):
    return Watch(city)


def crossings(city_map, snapshots):
    """Yield (t_ns, vehicle, stop line) whenever a front bumper passes a stop line."""
    roads = Roads(city_map)
    before = {}
    for snapshot, car in ((s, c) for s in snapshots for c in s.vehicles):
        pose = city_pose(car)
        place = roads.nearest(pose)
        fronts = {place.lane: place.s + FRONT_M}
        for line in roads.stop_lines_on(place.lane):
            last = before.get((car.vehicle, place.lane))
            if last is not None and last <= line.at_m < fronts[place.lane]:
                yield snapshot.t_ns, car.vehicle, line
        before[car.vehicle, place.lane] = fronts[place.lane]


def city_pose(car):
    from scm.geometry import Pose2

    return Pose2(car.x_m, car.y_m, car.yaw_rad)


def colour_at(spats, t_ns, group):
    received = [spat for spat in spats if spat.t_ns <= t_ns]
    return next(g.colour for g in received[-1].groups if g.group == group)


@pytest.fixture(scope="module")
def drive(city_map):
    """What was received in 30 s of four agents, by kind: most pass their light twice."""
    parts = [WorldPart(city_map), TrafficPart(city_map), MonitorPart(city_map)]
    with Lockstep(parts) as running:
        watch = Watch(running)
        for seed, name in enumerate(("n1", "n2", "n3", "n4")):
            running.add(AgentPart(name, seed=seed))
        running.run_for(30.0)
        return {kind: watch.all(kind) for kind in (WorldSnapshot, Spat, Contact)}


def test_four_agents_drive_without_contact_or_red_light_violation(city_map, drive):
    snapshots, spats = drive[WorldSnapshot], drive[Spat]
    passed = list(crossings(city_map, snapshots))
    assert len(passed) >= 6
    wrong = [p for p in passed if colour_at(spats, p[0], p[2].group) not in ("green", "yellow")]
    assert wrong == []
    assert drive[Contact] == []
    roads = Roads(city_map)
    settled = [car for s in snapshots if s.t_ns > 4 * 10**9 for car in s.vehicles]
    assert len({car.vehicle for car in settled}) == 4
    assert max(abs(roads.nearest(city_pose(car)).lateral) for car in settled) < 0.02


def test_agents_keep_a_gap_between_bumpers(drive):
    nearest = min(
        math.hypot(a.x_m - b.x_m, a.y_m - b.y_m)
        for snapshot in drive[WorldSnapshot]
        for a, b in itertools.combinations(snapshot.vehicles, 2)
    )
    assert nearest > 0.30


def test_the_same_city_runs_twice_bit_for_bit(city_map):
    def run():
        agents = [AgentPart("n1", seed=1), AgentPart("n2", seed=2)]
        with Lockstep([WorldPart(city_map), TrafficPart(city_map), *agents]) as city:
            watch = Watch(city, VehicleSensors)
            city.run_for(8.0)
            return watch.all(VehicleState), watch.all(VehicleSensors), watch.all(Trip)

    first, second = run(), run()
    assert len(first[0]) > 700
    assert first == second


def test_sensors_are_simulated_only_for_subscribers_and_read_as_if_always_wanted(city_map):
    class Sender(AgentPart):
        def step(self, now_ns, inbox):
            outbox = super().step(now_ns, inbox)
            self.sent = [one for one in outbox if isinstance(one, VehicleSensors)]
            return outbox

    def run(silent_s):
        agent = Sender("n1", seed=1)
        with Lockstep([WorldPart(city_map), agent]) as city:
            for _ in range(round(silent_s / 0.02)):
                city.run_for(0.02)
                assert agent.sent == []
            box = city.subscribe(Subscription(VehicleSensors))
            city.run_for(2.0 - silent_s)
            return [item.message for item in box.drain()]

    whole, late = run(0.0), run(1.0)
    assert 1e9 < late[0].t_ns < 1.15e9, "a subscriber is found out within 100 ms"
    settled = [one for one in late if one.t_ns > 1.4e9]  # each kind has read since
    assert len(settled) > 20
    assert settled == [one for one in whole if one.t_ns >= settled[0].t_ns]


def test_an_agent_that_leaves_is_taken_off_the_map(city, watch):
    agent = AgentPart("n1")
    city.add(agent)
    city.run_until(lambda: watch.state("n1") is not None, 3.0)
    city.remove(agent)
    city.run_for(0.5)
    assert watch.all(WorldSnapshot)[-1].vehicles == ()


def test_a_leaseholder_takes_over_and_his_silence_ends_in_a_lasting_stop(city, watch):
    city.add(AgentPart("n1"))
    city.run_until(lambda: watch.state("n1") is not None, 3.0)
    lease = city.call(LeaseRequest(vehicle="n1", owner="hand", verb="acquire"))
    for seq in range(40):
        city.publish(command("n1", lease.epoch, seq, throttle=0.4, steering=0.0))
        city.call(LeaseRequest(vehicle="n1", owner="hand", verb="renew", epoch=lease.epoch), 0.05)
        city.run_for(0.05)
    driven = watch.state("n1")
    assert (driven.epoch, driven.throttle, driven.mode) == (lease.epoch, 0.4, "drive")
    city.run_for(0.35)
    assert watch.state("n1").mode == "stop"
    city.run_for(5.0)
    after = watch.state("n1")
    assert after.mode == "stop"
    assert abs(after.speed_mps) < 1e-3


def test_a_new_order_lets_the_cars_own_driver_go_on_under_a_newer_epoch(city, watch):
    city.add(AgentPart("n1"))
    city.run_until(lambda: watch.state("n1") is not None, 3.0)
    lease = city.call(LeaseRequest(vehicle="n1", owner="hand", verb="acquire"))
    city.publish(command("n1", lease.epoch, 1))
    city.run_for(3.0)
    assert watch.state("n1").mode == "stop"
    assert not isinstance(city.call(RouteRequest(vehicle="n1")), Refused)
    city.run_for(2.0)
    state = watch.state("n1")
    assert state.mode == "drive"
    assert state.epoch > lease.epoch
    assert state.speed_mps > 0.1


def test_an_old_epoch_commands_nobody(city, watch):
    city.add(AgentPart("n1"))
    city.run_until(lambda: watch.state("n1") is not None, 3.0)
    before = watch.state("n1").epoch
    city.publish(command("n1", before - 1, 1, throttle=-1.0))
    city.publish(command("n1", before, 10**6, throttle=-1.0))
    city.run_for(0.1)
    assert watch.state("n1").throttle > 0.0
    assert watch.state("n1").epoch == before


def test_the_city_stop_stops_the_car_and_its_release_lets_it_drive(city, watch):
    city.add(AgentPart("n1"))
    city.run_for(3.0)
    city.call(StopRequest(engaged=True, by="test"))
    city.run_for(0.5)
    assert watch.state("n1").mode == "stop"
    assert abs(watch.state("n1").speed_mps) < 0.01
    city.call(StopRequest(engaged=False, by="test"))
    city.run_for(1.0)
    assert watch.state("n1").mode == "drive"


def test_flashing_red_is_a_stop_sign(city, city_map, watch):
    city.add(AgentPart("n1"))
    city.call(PlanRequest(junction="crossing", plan="flash", by="test"))
    city.run_for(12.0)
    assert list(crossings(city_map, watch.all(WorldSnapshot)))
    assert "sign" in {trip.waiting_for for trip in watch.all(Trip)}


def test_without_signals_the_car_waits_at_its_line(city_map):
    with Lockstep([WorldPart(city_map), AgentPart("n1")]) as city:
        watch = Watch(city)
        city.run_for(15.0)
        assert list(crossings(city_map, watch.all(WorldSnapshot))) == []
        assert watch.all(Trip)[-1].waiting_for == "signal"


def test_a_lost_link_stops_the_car_within_the_dead_man_times(city_map):
    world = WorldPart(city_map)
    with Lockstep([world, TrafficPart(city_map), AgentPart("n1")]) as city:
        watch = Watch(city)
        city.run_for(3.0)
        assert watch.state("n1").speed_mps > 0.1
        city.remove(world)
        city.run_for(1.9)
        assert watch.state("n1").mode == "stop"
        assert abs(watch.state("n1").speed_mps) < 0.01


def test_a_restarted_city_is_joined_again(city_map):
    world = WorldPart(city_map)
    with Lockstep([world, TrafficPart(city_map), AgentPart("n1")]) as city:
        city.run_for(3.0)
        city.remove(world)
        city.run_for(3.0)
        city.add(WorldPart(city_map))
        watch = Watch(city)
        city.run_for(5.0)
        assert [car.vehicle for car in watch.all(WorldSnapshot)[-1].vehicles] == ["n1"]
        assert watch.state("n1").speed_mps > 0.1


def test_a_trip_arrives_and_the_car_goes_on(city, watch):
    city.add(AgentPart("n1"))
    city.run_for(1.0)
    request = RouteRequest(
        vehicle="n1", via=("east_loop", "west_loop"), then="circulate", request_id="t-1"
    )
    reply = city.call(request)
    assert reply.route[-1] == "west_loop"
    ends = []

    def arrived():
        ends.extend(trip for trip in watch.all(Trip) if trip.arrived_ns is not None)
        return bool(ends)

    city.run_until(arrived, 90.0)
    assert ends[0].trip_id == "t-1"
    assert ends[0].done_m == pytest.approx(reply.length_m, abs=0.03)
    city.run_for(2.0)
    assert watch.all(Trip)[-1].trip_id != "t-1"


def command(vehicle, epoch, seq, throttle=0.0, steering=0.0):
    return DriveCommand(
        vehicle=vehicle, t_ns=0, epoch=epoch, seq=seq, throttle=throttle, steering=steering
    )


def test_states_are_sent_every_twenty_milliseconds(city, watch):
    city.add(AgentPart("n1"))
    city.run_for(3.0)
    times = [state.t_ns for state in watch.all(VehicleState)]
    assert {b - a for a, b in itertools.pairwise(times)} == {20 * NS_PER_MS}
