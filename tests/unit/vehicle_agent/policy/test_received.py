"""What a car receives becomes the columns that a policy was trained with."""

import math
from dataclasses import replace as replaced
from types import SimpleNamespace

import numpy as np
import pytest
from msgspec.structs import replace

from scm.clock import NS_PER_MS, NS_PER_S
from scm.geometry import Pose2
from scm.gym.names import all_tasks
from scm.gym.observations import PARTS, Observations
from scm.gym.policy_file import write_policy
from scm.gym.signals import REACH_M
from scm.gym.worlds import Options, Worlds
from scm.maps.load import load_map
from scm.maps.route import roads_of
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.etsi.convert import station_id
from scm.v2x.exchange import Incoming
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import load_car
from scm.world.part import WorldPart
from tests.unit.vehicle_agent.policy.test_ahead_and_aims import cam, state_of
from tests.unit.vehicle_agent.policy.test_policy_driving import policy_of
from vehicle_agent.autonomy.control import Command
from vehicle_agent.policy.driving import PolicyPart
from vehicle_agent.policy.model import Policy
from vehicle_agent.policy.received import UNKNOWN_S, Inertial, Lights, Now, Others, Ranges
from vehicle_agent.policy.senses import Senses

SCHOOL = load_map("driving_school")
NIGEL = load_car("nigel")
HERE = Pose2(0.0, 0.0, 0.0)


def now(t_ns, pose=HERE, lanes=(), along_m=0.0):
    return Now(t_ns, pose, lanes, along_m, 0.0)


def arrived(message, t_ns=0):
    return Incoming(message, t_ns)


def reading(t_ns, left, right):
    return VehicleSensors(
        vehicle="n1", t_ns=t_ns, encoder_left=left, encoder_right=right,
        accel_mps2=(1.0, 2.0, 9.8), gyro_radps=(0.1, 0.2, 0.3),
    )  # fmt: skip


def scan(ranges, **header):
    payload = np.array(ranges, "<f4").tobytes()
    return LidarScan(
        vehicle="n1", t_ns=0, beams=len(ranges), range_min_m=0.1, range_max_m=9.0,
        payload=payload, **header,
    )  # fmt: skip


@pytest.fixture(scope="module")
def everything():
    """Return a world whose task observes all that a car of the city knows."""
    parts = ("motion", "action", "lane", "inertial", "others", "signals", "ranges")
    task = replaced(all_tasks()["crossing"], observations=parts)
    return SimpleNamespace(worlds=Worlds(task, "market_town", 1, Options()), name="everything")


@pytest.fixture(scope="module")
def names(everything):
    return Observations(everything.worlds, everything.worlds.task.observations).names


def test_wheels_are_as_fast_as_their_encoders_count():
    inertial, counts = Inertial(NIGEL), NIGEL.value("encoder.counts_per_revolution")
    assert inertial.columns(now(0)) == "its IMU and encoders"
    for k in range(4):
        inertial.receive(arrived(reading(20 * k * NS_PER_MS, round(0.1 * k * counts), 0)))
    found = inertial.columns(now(NS_PER_MS))
    round_m = math.tau * NIGEL.value("wheel.radius_m")
    assert found["wheel_left_mps"] == pytest.approx(0.1 * round_m / 0.02, rel=1e-3)
    assert found["wheel_right_mps"] == 0.0
    assert (found["accel_y_mps2"], found["gyro_z_radps"]) == (2.0, 0.3)
    assert inertial.columns(now(NS_PER_S)) == "its IMU and encoders"


def test_wheels_of_a_car_that_was_placed_anew_are_not_compared_with_those_before():
    inertial = Inertial(NIGEL)
    for t_ns, count in ((NS_PER_S, 1000), (2 * NS_PER_S, 2000), (0, 0), (20 * NS_PER_MS, 0)):
        inertial.receive(arrived(reading(t_ns, count, count)))
    assert inertial.columns(now(0))["wheel_left_mps"] == 0.0


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ({}, [0.0, 2.0, 4.0, 6.0]),
        ({"bearing_first_rad": -math.pi}, [4.0, 6.0, 0.0, 2.0]),
        ({"bearing_first_rad": 0.1}, [0.0, 2.0, 4.0, 6.0]),
        # Beams from -90 to +77 degrees, 24 apart: behind, nothing is seen.
        ({"bearing_first_rad": -math.pi / 2, "bearing_step_rad": 0.42}, [4.0, 7.0, 9.0, 0.0]),
    ],
)
def test_beams_are_those_that_look_nearest(header, expected):
    ranges = Ranges(4)
    assert ranges.columns(now(0)) == "its LIDAR"
    ranges.receive(arrived(scan(range(8), **header)))
    assert list(ranges.columns(now(1)).values()) == expected
    assert ranges.columns(now(2 * NS_PER_S)) == "its LIDAR"


def test_beam_that_meets_nothing_is_as_far_as_the_scanner_reaches():
    ranges = Ranges(2)
    ranges.receive(arrived(scan([math.inf, 3.0])))
    assert ranges.columns(now(1)) == {"range_0_m": 9.0, "range_1_m": 3.0}


def test_scan_of_another_length_than_stated_is_ignored():
    ranges = Ranges(2)
    ranges.receive(arrived(replace(scan([1.0, 2.0]), beams=3)))
    assert ranges.columns(now(1)) == "its LIDAR"


def test_car_knows_every_column_of_every_part(names):
    senses = Senses(policy_of(names, -1.0, 1.0), SCHOOL, "n1")
    assert [type(one) for one in senses._received] == [Inertial, Ranges, Others, Lights]


class Watched(Policy):
    """A policy that remembers what it observed."""

    def __call__(self, observation):
        self.seen = observation
        return super().__call__(observation)


@pytest.fixture(scope="module")
def city(everything, names, tmp_path_factory):
    """Return the observation of a policy that drove for five seconds, and all cars' states."""
    weights, path = np.zeros((len(names), 2)), tmp_path_factory.mktemp("policy") / "all.onnx"
    for name, gain in {"beside_m": -8.0, "turned_rad": -2.0, "lane_turn_0.2m_rad": 1.7}.items():
        weights[names.index(name), 1] = gain
    layer = weights, np.array([0.8, 0.0])
    write_policy(path, [layer], np.zeros(len(names)), np.ones(len(names)), everything, math.inf)
    cars = tuple((f"n{k}", "nigel") for k in range(1, 4))
    part, world = PolicyPart("policy", "n1", path), WorldPart(SCHOOL, 1, cars)
    part.policy = Watched(path)
    with Lockstep([TrafficPart(SCHOOL), MonitorPart(SCHOOL), world, part]) as lockstep:
        states = {
            name: lockstep.subscribe(Subscription(VehicleState, {"vehicle": name}))
            for name, _ in cars
        }
        lockstep.run_for(5.0)
        newest = {name: one.drain()[-1].message for name, one in states.items()}
    return part, dict(zip(names, part.policy.seen, strict=True)), newest


def test_other_cars_are_where_they_are(city):
    _, seen, states = city
    own = states["n1"]
    c, s = math.cos(own.yaw_rad), math.sin(own.yaw_rad)
    for k, name in enumerate(("n2", "n3")):
        dx, dy = states[name].x_m - own.x_m, states[name].y_m - own.y_m
        assert seen[f"other_{k}_ahead_m"] == pytest.approx(c * dx + s * dy, abs=0.06)
        assert seen[f"other_{k}_left_m"] == pytest.approx(c * dy - s * dx, abs=0.06)
        turn = states[name].yaw_rad - own.yaw_rad
        assert seen[f"other_{k}_cos_turn"] == pytest.approx(math.cos(turn), abs=0.1)
        assert 0.0 <= seen[f"other_{k}_age_s"] < 1.5
    assert seen["other_2_age_s"] == 10.0


def test_signal_ahead_is_that_of_the_line_on_its_lanes(city):
    part, seen, states = city
    own = states["n1"]
    on = roads_of(SCHOOL).nearest(Pose2(own.x_m, own.y_m, own.yaw_rad))
    lanes, _ = part._senses._course.lanes_ahead(0)
    line, way_m = roads_of(SCHOOL).line_ahead(lanes, on.s + 0.23)
    assert seen["stop_line_m"] == pytest.approx(min(way_m, REACH_M), abs=0.05)
    assert line.junction in {one.name for one in SCHOOL.junctions}
    assert (seen["stop_line_m"] < REACH_M, seen["signal_is_green"]) == (True, 0.0)
    assert 0.0 < seen["signal_change_s"] < 30.0  # unknown would be 60


def test_lidar_sees_what_it_does_in_training(city):
    _, seen, states = city
    worlds, own = Worlds(all_tasks()["lap"], "driving_school", 1, Options()), states["n1"]
    pose = np.array([[own.x_m, own.y_m, own.yaw_rad]])
    worlds.fleet.place_rows(np.arange(1), pose, np.zeros(1))
    in_training = PARTS["ranges"](worlds).read()[0]
    in_city = [seen[f"range_{k}_m"] for k in range(108)]
    assert np.median(np.abs(in_city - in_training)) < 0.05  # it drives on until it looks again


def test_others_are_the_nearest_in_the_order_of_their_stations_without_the_own_car():
    others, stations = Others(2, NIGEL, "n1"), {one: station_id(one) for one in ("a", "b", "c")}
    far, first, second = sorted(stations, key=stations.get)
    places = {first: 2.0, second: 1.0, far: 9.0, "n1": 0.0}
    for name, x_m in places.items():
        others.receive(cam(name, Pose2(x_m, 0.5, 0.3), 0.1))
    seen = others.columns(now(2 * NS_PER_S))
    assert [seen[f"other_{k}_ahead_m"] for k in range(2)] == pytest.approx([2.0, 1.0], abs=3e-3)
    assert seen["other_0_left_m"] == pytest.approx(0.5, abs=3e-3)
    assert seen["other_0_sin_turn"] == pytest.approx(math.sin(0.3), abs=3e-3)
    assert (seen["other_0_age_s"], seen["other_1_age_s"]) == (2.0, 2.0)


def before_a_line():
    """Return lanes of the school, and where on them a front is 0.5 m before a line."""
    roads, line = roads_of(SCHOOL), SCHOOL.stop_lines[0]
    return roads, (line.lane, *roads.successors(line.lane)), line.at_m - 0.5 - 0.23


def test_line_of_which_nothing_is_known_is_not_green():
    roads, lanes, along_m = before_a_line()
    seen = Lights(SCHOOL, roads, NIGEL, REACH_M).columns(now(0, HERE, lanes, along_m))
    assert seen == {
        "stop_line_m": pytest.approx(0.5), "signal_is_green": 0.0, "signal_change_s": UNKNOWN_S
    }  # fmt: skip


def test_line_beyond_reach_is_none():
    roads, lanes, along_m = before_a_line()
    seen = Lights(SCHOOL, roads, NIGEL, 0.4).columns(now(0, HERE, lanes, along_m))
    assert seen == {"stop_line_m": 0.4, "signal_is_green": 1.0, "signal_change_s": 0.0}


def test_columns_of_the_state_and_of_the_action_in_force(city):
    names = "speed_mps", "lateral_speed_mps", "yaw_rate_radps", "steer_angle_rad"
    senses = Senses(policy_of((*names, "throttle", "steering"), -1.0, 1.0), SCHOOL, "n1")
    state = VehicleState(
        vehicle="n1", t_ns=0, seq=1, x_m=0.0, y_m=0.0, yaw_rad=0.0, speed_mps=0.1,
        lateral_speed_mps=0.2, yaw_rate_radps=0.3, steering_rad=0.4, throttle=0.7, steering=0.8,
        source="simulated",
    )  # fmt: skip
    assert senses.look(state, Command(0.5, 0.6), 0).tolist() == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    _, seen, _ = city
    assert seen["throttle"] == pytest.approx(0.8)


def test_cars_turn_where_their_names_decide():
    town, ways = load_map("market_town"), set()
    pose = roads_of(town).spawn_pose(town.spawns[0].name)
    for name in ("n1", "n2", "n3", "n4"):
        senses = Senses(policy_of(("beside_m",), -1.0, 1.0), town, name)
        senses.look(state_of(name, pose), Command(0.0, 0.0), 0)
        ways.add(senses._course.lanes_ahead(0)[0])
    assert len(ways) > 1
