"""The observer against the lockstep world: counts, queues, and every violation with evidence."""

import math
from collections import Counter

import numpy as np
import pytest

from scm.maps.grid_city import grid_city
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.records.signals import SignalGroup
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import BasePart, Subscription
from scm.traffic.observation.part import ObserverPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.join_request import JoinReply, JoinRequest
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.violation import Violation
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.world.driving import send
from scm.world.part import WorldPart

FRONT_M = 0.23
POSE_STD_M, YAW_STD_RAD, SPEED_STD_MPS = 0.005, 0.01, 0.03
SCHOOL = load_map("driving_school")
SIGNED = grid_city(3, 3, signs=True)
NS = 10**9
SPAN_S = 60.0


class NoisyEye(BasePart):
    """Stands for cameras: tracks from the truth of the world, with noise that they tell."""

    name, role, period_ns = "eye", "part", 100_000_000
    subscriptions, services = (Subscription(WorldSnapshot),), ()

    def __init__(self):
        self._random = np.random.default_rng(1)

    def step(self, now_ns, inbox):
        if not inbox:
            return []
        return [self._track(car, now_ns) for car in inbox[-1].message.vehicles]

    def _track(self, car, now_ns):
        noise = self._random.normal(size=4).tolist()
        return track(
            car.vehicle,
            now_ns,
            car.x_m + POSE_STD_M * noise[0],
            car.y_m + POSE_STD_M * noise[1],
            car.yaw_rad + YAW_STD_RAD * noise[2],
            car.speed_mps + SPEED_STD_MPS * noise[3],
        )

    def finish(self, now_ns):
        return []


def track(vehicle, t_ns, x, y, yaw, speed):
    variances = (POSE_STD_M**2, POSE_STD_M**2, YAW_STD_RAD**2, SPEED_STD_MPS**2, 1e-4, 1e-4)
    return EyeTrack(
        vehicle=vehicle, tag_id=1, t_ns=t_ns, x_m=x, y_m=y, yaw_rad=yaw, speed_mps=speed,
        lateral_speed_mps=0.0, yaw_rate_radps=0.0, age_s=0.0, stale=False,
        covariance=tuple(map(tuple, np.diag(variances).tolist())),
    )  # fmt: skip


def lines_of(city_map):
    lines = {line.lane: line.at_m for line in city_map.stop_lines}
    crossings = city_map.crossings
    return lines | {a.lane: a.at_m for crossing in crossings for a in crossing.approaches}


def driven(city_map, cars, span_s, *, eye):
    """Return true passages and the observer's counts by lane, and the violations it told."""
    part, observer = WorldPart(city_map, 1, room=cars), ObserverPart(city_map)
    world, lines, truth = part.world, lines_of(city_map), Counter()
    for i in range(cars):
        place = city_map.spawns[i * len(city_map.spawns) // cars]
        car = world.host(f"n{i}", "nigel", world.roads.spawn_pose(place.name), 0)
        send(world, car, RouteRequest(vehicle=car.name), 0)
    traffic = [TrafficPart(city_map)] if city_map.junctions else []
    cameras = [NoisyEye()] if eye else []
    names, before = world.drivers.lane_graph.names, None
    with Lockstep([part, *traffic, *cameras, observer]) as city:
        told = city.subscribe(Subscription(Violation))
        for _ in range(round(span_s / 0.05)):
            city.run_for(0.05)
            lane, front = world.drivers.lane[:cars].copy(), world.drivers.s[:cars] + FRONT_M
            if before is not None:
                for i in np.flatnonzero(lane == before[0]):
                    at_m = lines.get(names[lane[i]], math.inf)
                    truth[names[lane[i]]] += bool(before[1][i] < at_m <= front[i])
            before = lane, front
        counts = observer.counters.counts(city.now_ns)
        violations = [item.message for item in told.drain()]
    return truth, counts, violations


@pytest.fixture(scope="module")
def school():
    return driven(SCHOOL, 6, SPAN_S, eye=True)


@pytest.fixture(scope="module")
def signed():
    return driven(SIGNED, 6, 40.0, eye=False)


def test_ordinary_traffic_breaks_no_rule(school, signed):
    assert [v.text for v in school[2]] == []
    assert [v.text for v in signed[2]] == []


@pytest.mark.parametrize("which", ["school", "signed"])
def test_counters_agree_with_the_truth_within_two_percent(which, request):
    truth, counts, _ = request.getfixturevalue(which)
    counted = {row.lane: row.passed for row in counts.approaches}
    total = sum(truth.values())
    assert total >= 4
    assert sum(counted.values()) == pytest.approx(total, rel=0.02)
    for lane, passed in counted.items():
        assert abs(passed - truth[lane]) <= max(1, 0.02 * truth[lane])


def test_speeds_and_flows_are_those_of_the_cars(school):
    truth, counts, _ = school
    for row in counts.approaches:
        assert row.flow_hz == pytest.approx(row.passed / counts.window_s)
        assert 0.15 < row.speed_mps < 0.27
        assert row.headway_s == pytest.approx(SPAN_S / truth[row.lane], rel=0.35)
        assert row.level in "ABC"


# ------------------------------------------------------------------- provoked in the lockstep city
GRID = grid_city(2, 3)
ROADS = Roads(GRID)
LANE, WAY, AFTER = "j0_0_n", "j0_1_nn", "j0_1_n"


class Ghost(BasePart):
    """A car that drives as it is told, and says so itself."""

    name, role, period_ns = "ghost", "v", 50_000_000
    subscriptions, services = (), ()

    def __init__(self, place_at):
        self._place_at, self._seq = place_at, 0
        self._random = np.random.default_rng(2)

    def step(self, now_ns, inbox):
        self._seq += 1
        (x, y, yaw), speed = self._place_at(now_ns / NS)
        noise = self._random.normal(size=2).tolist()
        state = VehicleState(
            vehicle="ghost", t_ns=now_ns, seq=self._seq, x_m=x + 0.003 * noise[0],
            y_m=y + 0.003 * noise[1], yaw_rad=yaw, speed_mps=speed, yaw_rate_radps=0.0,
            steering_rad=0.0, throttle=0.0, source="simulated",
        )  # fmt: skip
        return [state]

    def finish(self, now_ns):
        return []


class Lamps(BasePart):
    """A junction whose approach from the south turns at given times [s]."""

    name, role, period_ns = "traffic", "part", 100_000_000
    subscriptions, services = (), ()

    def __init__(self, *turns):
        self._turns = turns

    def step(self, now_ns, inbox):
        colour, since = [(c, t) for t, c in self._turns if t * NS <= now_ns][-1]
        group = SignalGroup(group="n", colour=colour, since_ns=round(since * NS), min_end_ns=now_ns)
        return [
            Spat(junction="j0_1", t_ns=now_ns, seq=1, mode="plan", plan="calm", groups=(group,))
        ]

    def finish(self, now_ns):
        return []


def along(way_m, speed, city=ROADS, lanes=(LANE, WAY, AFTER)):
    """Return the pose at a distance along the lanes, and the speed."""
    for lane in lanes:
        length = city.length_of(lane)
        if way_m <= length or lane == lanes[-1]:
            return tuple(city.lanes[lane].at(way_m)), speed
        way_m -= length
    raise AssertionError


def found(place_at, span_s=20.0, city_map=GRID, lamps=((0.0, "red"),)):
    parts = [Lamps(*lamps), Ghost(place_at), ObserverPart(city_map)]
    with Lockstep(parts) as city:
        told, events = (
            city.subscribe(Subscription(Violation)),
            city.subscribe(Subscription(CityEvent)),
        )
        city.run_for(span_s)
        violations = [item.message for item in told.drain()]
        assert len(events.drain()) == len(violations)
    return violations


LINE_M = ROADS.stop_lines_on(LANE)[0].at_m
LENGTH_M = ROADS.length_of(LANE)


def test_a_red_light_is_told_once_with_the_signal_and_the_track():
    (one,) = found(lambda t: along(1.0 + 0.2 * t, 0.2))
    assert (one.kind, one.vehicle, one.junction) == ("red_light", "ghost", "j0_1")
    assert one.signal.colour == "red"
    assert one.t_ns / NS == pytest.approx((LINE_M - FRONT_M - 1.0) / 0.2, abs=0.15)
    assert set(one.sources) == {"self", "spat"}
    assert one.certainty > 0.99
    assert one.lane == LANE
    assert len(one.track) > 20
    assert one.track[0].t_ns < one.t_ns - 2 * NS
    assert all(a.t_ns < b.t_ns for a, b in zip(one.track, one.track[1:], strict=False))


@pytest.mark.parametrize("colour", ["green", "yellow", "dark"])
def test_no_other_colour_is_a_red_light(colour):
    assert found(lambda t: along(1.0 + 0.2 * t, 0.2), lamps=((0.0, colour),)) == []


def test_who_passes_just_as_it_turns_red_or_before_is_not_blamed():
    passes_s = (LINE_M - FRONT_M - 1.0) / 0.2
    for red_s in (passes_s - 0.2, passes_s + 0.5):
        lamps = ((0.0, "yellow"), (red_s, "red"))
        assert found(lambda t: along(1.0 + 0.2 * t, 0.2), lamps=lamps) == []
    lamps = ((0.0, "yellow"), (passes_s - 1.0, "red"))
    assert [v.kind for v in found(lambda t: along(1.0 + 0.2 * t, 0.2), lamps=lamps)] == [
        "red_light"
    ]


def stops_at(front_m):
    """Return a car that drives up and stands with its front so far beyond the line."""
    stand_m = LINE_M - FRONT_M + front_m

    def place_at(t):
        way = 1.0 + 0.2 * t
        return along(min(way, stand_m), 0.2 if way < stand_m else 0.0)

    return place_at


def test_a_car_that_stands_beyond_its_line_at_red_is_told():
    (one,) = found(stops_at(0.12))
    assert one.kind == "stop_line"
    assert one.signal.colour == "red"
    assert "0.12 m beyond" in one.text or "0.11 m" in one.text or "0.13 m" in one.text


@pytest.mark.parametrize("front_m", [-0.05, 0.0, 0.03])
def test_a_car_that_stands_at_its_line_is_not_blamed_for_noise(front_m):
    assert found(stops_at(front_m)) == []


def test_a_stop_sign_is_obeyed_only_by_who_stops():
    roads = Roads(SIGNED)
    sign = next(sign for sign in SIGNED.signs if sign.kind == "stop")
    lane = sign.lane
    way = roads.successors(lane)[0]
    lanes = (lane, way, *roads.successors(way))

    def runs(t):
        return along(1.0 + 0.2 * t, 0.2, roads, lanes)

    def stops(t):
        stand_m = sign.at_m - FRONT_M - 0.02
        rolls_s = (stand_m - 1.0) / 0.2
        way_m = 1.0 + 0.2 * (t if t < rolls_s else max(rolls_s, t - 2.0))
        return along(way_m, 0.0 if rolls_s <= t < rolls_s + 2.0 else 0.2, roads, lanes)

    (one,) = found(runs, city_map=SIGNED)
    assert one.kind == "stop_line"
    assert "stop sign" in one.text
    assert found(stops, city_map=SIGNED) == []


def test_speed_is_told_once_and_again_after_a_while_of_keeping_to_it():
    def fast(t):
        return along(0.2 + 0.02 * t, 0.45)

    (one,) = found(fast, lamps=((0.0, "green"),))
    assert one.kind == "speed"
    assert "0.45 m/s" in one.text
    assert "0.25 m/s are allowed" in one.text
    assert found(lambda t: along(0.2 + 0.02 * t, 0.30), lamps=((0.0, "green"),)) == []

    def twice(t):
        return along(0.2 + 0.02 * t, 0.45 if t % 10.0 < 5.0 else 0.2)

    assert [v.kind for v in found(twice, 20.0, lamps=((0.0, "green"),))] == ["speed", "speed"]
    assert found(lambda t: along(0.2, 0.45 if t % 2.0 < 0.5 else 0.2)) == []


def test_driving_against_the_direction_is_told_once():
    def against(t):
        (x, y, yaw), speed = along(2.5 - 0.15 * t, 0.15)
        return (x, y, yaw + math.pi), speed

    (one,) = found(against, 12.0)
    assert one.kind == "wrong_way"
    assert LANE in one.text


def test_driving_backwards_is_told_and_a_short_way_back_is_not():
    (one,) = found(lambda t: along(2.5 - 0.15 * t, -0.15), 10.0)
    assert one.kind == "wrong_way"
    assert "backwards" in one.text
    assert found(lambda t: along(2.5 - 0.15 * min(t, 2.0), -0.15 if t < 2.0 else 0.0)) == []


def test_a_collision_in_the_world_is_told_once_for_the_pair():
    world = WorldPart(GRID, 1)
    with Lockstep([world, ObserverPart(GRID)]) as city:
        told = city.subscribe(Subscription(Violation))
        contacts = city.subscribe(Subscription(Contact))
        places = [f"{LANE}_0", f"{LANE}_2"]
        for name, place in zip(("r1", "r2"), places, strict=True):
            request = JoinRequest(vehicle=name, session="s", spawn=place)
            assert isinstance(city.call(request), JoinReply)
        pose = ROADS.spawn_pose(places[1])
        for k in range(100):
            for name, back_m, speed in (("r1", max(0.22, 0.6 - 0.01 * k), 0.2), ("r2", 0.0, 0.0)):
                x, y = pose.apply(-back_m, 0.0)
                state = VehicleState(
                    vehicle=name, t_ns=city.now_ns, seq=k, x_m=x, y_m=y, yaw_rad=pose.yaw,
                    speed_mps=speed, yaw_rate_radps=0.0, steering_rad=0.0, throttle=0.0,
                    source="simulated",
                )  # fmt: skip
                city.publish(state)
            city.run_for(0.02)
        violations = [item.message for item in told.drain()]
        assert len(contacts.drain()) > 2
    assert [v.text for v in violations] == [violations[0].text]
    assert {violations[0].vehicle, *violations[0].against} == {"r1", "r2"}
    assert "contact" in violations[0].sources
    assert violations[0].track


def test_a_collision_of_cars_that_the_world_drives_is_told_once_for_the_pair():
    part = WorldPart(GRID, 1, room=2)
    behind, ahead = (ROADS.spawn_pose(f"{LANE}_{i}") for i in (0, 2))
    x, y = ahead.apply(-0.31, 0.0)
    for name, pose, speed in (("n1", behind._replace(x=x, y=y), 0.3), ("n2", ahead, 0.0)):
        car = part.world.host(name, "nigel", pose, 0)
        car.fleet.place(car.row, pose, speed)
    with Lockstep([part, ObserverPart(GRID)]) as city:
        told, contacts = (
            city.subscribe(Subscription(Violation)),
            city.subscribe(Subscription(Contact)),
        )
        city.run_for(1.5)
        violations = [item.message for item in told.drain()]
        blows = [item.message for item in contacts.drain()]
    assert [v.kind for v in violations] == ["collision"]
    assert {violations[0].vehicle, *violations[0].against} == {"n1", "n2"}
    assert {blow.vehicle for blow in blows} == {"n1", "n2"}
    lost = sum(blow.dvx_mps for blow in blows), sum(blow.dvy_mps for blow in blows)
    assert lost == pytest.approx((0.0, 0.0), abs=1e-9)
