"""Cars ahead, behind and pursued, and goals are known in the city as training shows them."""

import math

import numpy as np
import pytest

import scm.gym
from scm.clock import NS_PER_S, seconds
from scm.errors import LearningError, MapError
from scm.geometry import Pose2
from scm.gym.observations import Observations
from scm.gym.policy_file import write_policy
from scm.maps.load import load_map
from scm.maps.route import roads_of
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.v2x.etsi.convert import cam_of
from scm.v2x.exchange import Incoming
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import load_car
from scm.vehicles.drivers.cars_ahead import REACH
from scm.vehicles.drivers.limits import limits_of
from scm.world.part import WorldPart
from tests.unit.vehicle_agent.policy.test_policy_driving import policy_of
from vehicle_agent.policy.ahead import Ahead
from vehicle_agent.policy.driving import PolicyPart
from vehicle_agent.policy.received import Now, Pursued
from vehicle_agent.policy.senses import NOWHERE, Aim, Senses, counts_of
from vehicle_agent.trained_driver import STAND

NIGEL = load_car("nigel")
LIMITS = limits_of(NIGEL)
AHEAD = ("leader_gap_m", "leader_speed_mps", "follower_gap_m", "follower_speed_mps")
PURSUED = tuple(f"pursued_{name}" for name in ("ahead_m", "left_m", "cos_turn", "sin_turn"))
GOAL = tuple(f"goal_{name}" for name in ("ahead_m", "left_m", "cos_turn", "sin_turn"))


def state_of(vehicle, pose, speed_mps=0.0, yaw_rate_radps=0.0):
    return VehicleState(
        vehicle=vehicle, t_ns=0, seq=1, x_m=pose.x, y_m=pose.y, yaw_rad=pose.yaw,
        speed_mps=speed_mps, yaw_rate_radps=yaw_rate_radps, steering_rad=0.0, throttle=0.0,
        source="simulated",
    )  # fmt: skip


def cam(vehicle, pose, speed_mps=0.0, yaw_rate_radps=0.0, t_ns=0):
    """Return the CAM of a Nigel as another one receives it."""
    body = cam_of(
        state_of(vehicle, pose, speed_mps, yaw_rate_radps),
        length_m=LIMITS.length, width_m=LIMITS.width, front_m=LIMITS.front,
    )  # fmt: skip
    return Incoming(CamRx(receiver="n1", station=vehicle, t_ns=t_ns, body=body), t_ns)


def pose_of(fleet, row):
    return Pose2(float(fleet.x[row]), float(fleet.y[row]), float(fleet.yaw[row]))


def in_city(worlds, world, part):
    """Return what a part of a car's senses knows, with a CAM of each other car of its world."""
    fleet, (agent, *others) = worlds.fleet, worlds.cars[world].tolist()
    for k, row in enumerate(others):
        part.receive(cam(f"n{k + 2}", pose_of(fleet, row), float(fleet.speed[row])))
    part.receive(cam("n1", pose_of(fleet, agent)))  # its own does not count
    lanes = worlds.course.lanes_ahead(agent)
    found = part.columns(Now(0, pose_of(fleet, agent), *lanes, float(fleet.speed[agent])))
    return list(found.values())


@pytest.mark.parametrize("map_name", ["driving_school", "market_town"])
def test_gaps_are_those_of_training(map_name):
    envs = scm.gym.make_vec(f"{map_name}/traffic-v1", 12)
    envs.reset(seed=1)
    worlds, roads, known = envs.worlds, roads_of(load_map(map_name)), []
    in_training = Observations(worlds, ["ahead"])
    assert in_training.names == AHEAD
    for _ in range(5):
        for world, row in enumerate(in_training.update().tolist()):
            known.append(row)
            seen = in_city(worlds, world, Ahead(roads, NIGEL, "n1"))
            assert seen == pytest.approx(row, abs=4e-3), (world, row, seen)
        for _ in range(40):
            worlds.step(np.zeros((12, 2)))
    gaps = np.array(known)[:, [0, 2]]
    assert (gaps < REACH).all(axis=1).sum() > 20  # both a leader and a follower
    assert (gaps == REACH).any()


def test_car_of_which_nothing_comes_any_more_is_not_ahead():
    envs = scm.gym.make_vec("driving_school/traffic-v1", 1)
    envs.reset(seed=1)
    worlds, agent = envs.worlds, int(envs.worlds.cars[0, 0])
    ahead = Ahead(roads_of(load_map("driving_school")), NIGEL, "n1")
    near_m = in_city(worlds, 0, ahead)[0]
    assert near_m < REACH
    lanes = worlds.course.lanes_ahead(agent)
    late = Now(4 * NS_PER_S, pose_of(worlds.fleet, agent), *lanes, 0.1)
    assert list(ahead.columns(late).values()) == [REACH, 0.1, REACH, 0.1]


def test_car_without_anybody_near_has_the_reach_and_its_own_speed():
    city_map = load_map("driving_school")
    senses = Senses(policy_of(AHEAD, -5.0, 5.0), city_map, "n1")
    pose = roads_of(city_map).spawn_pose(city_map.spawns[0].name)
    seen = senses.look(state_of("n1", pose, 0.2), STAND, 0)
    assert seen.tolist() == [REACH, 0.2, REACH, 0.2]


def test_pursued_car_is_seen_as_in_training():
    envs = scm.gym.make_vec("driving_school/pursuit-v1", 8)
    envs.reset(seed=2)
    worlds = envs.worlds
    in_training = Observations(worlds, ["pursued"])
    assert in_training.names[:4] == PURSUED
    for _ in range(3):
        for world, row in enumerate(in_training.update().tolist()):
            assert in_city(worlds, world, Pursued("n2", NIGEL)) == pytest.approx(row, abs=3e-3)
        for _ in range(30):
            worlds.step(np.zeros((8, 2)))


def test_pursued_car_drives_on_between_two_cams():
    pursued, here = Pursued("n2", NIGEL), Pose2(1.0, 1.0, 0.0)
    pursued.receive(cam("n3", Pose2(5.0, 5.0, 0.0)))
    assert pursued.columns(Now(0, here, (), 0.0, 0.0)) == "a CAM of n2"
    pursued.receive(cam("n2", Pose2(1.5, 1.0, 0.0), 0.2, t_ns=NS_PER_S))
    seen = pursued.columns(Now(NS_PER_S + NS_PER_S // 2, here, (), 0.0, 0.0))
    assert seen["pursued_ahead_m"] == pytest.approx(0.6, abs=2e-3)
    assert seen["pursued_speed_mps"] == pytest.approx(0.2, abs=2e-3)
    late_ns = 5 * NS_PER_S
    assert pursued.columns(Now(late_ns, here, (), 0.0, 0.0)) == "a CAM of n2"


@pytest.mark.parametrize("map_name", ["parking_school", "parking_lot"])
def test_goal_is_seen_as_in_training(map_name):
    envs = scm.gym.make_vec(f"{map_name}/parking-v1", 6)
    envs.reset(seed=3)
    worlds, city_map = envs.worlds, load_map(map_name)
    in_training = Observations(worlds, ["goal"])
    assert in_training.names == GOAL
    roads, names = roads_of(city_map), [one.name for one in (*city_map.bays, *city_map.spawns)]
    for row, seen in enumerate(in_training.update().tolist()):
        goal = worlds.to_goal.goals[row]
        (name,) = (one for one in names if np.allclose(roads.spawn_pose(one), goal))
        senses = Senses(policy_of(GOAL, -10.0, 10.0), city_map, "n1", Aim(goal=name))
        state = state_of("n1", pose_of(worlds.fleet, row))
        assert senses.look(state, STAND, 0).tolist() == pytest.approx(seen, abs=1e-6)


def test_policy_needs_its_goal_and_the_car_to_pursue():
    drives, parks, pursues = (policy_of(one, -1.0, 1.0) for one in (AHEAD, GOAL, PURSUED))
    assert counts_of(drives, NOWHERE)["ahead"] == 1
    assert counts_of(parks, Aim(goal="goal"))["goal"] == 1
    for policy, aim, words in (
        (parks, NOWHERE, "expected --goal PLACE, got none"),
        (pursues, NOWHERE, "expected --pursue CAR, got none"),
        (drives, Aim(goal="goal"), "expected no --goal PLACE, got 'goal'"),
        (parks, Aim("goal", "n2"), "expected no --pursue CAR, got 'n2'"),
    ):
        with pytest.raises(LearningError, match=words):
            counts_of(policy, aim)
    with pytest.raises(MapError, match=r"no spawn 'gaol' \(did you mean 'goal'"):
        Senses(parks, load_map("parking_school"), "n1", Aim(goal="gaol"))


def test_car_is_parked_where_it_stands_in_the_direction_of_its_goal():
    senses = Senses(policy_of(GOAL, -1.0, 1.0), load_map("parking_school"), "n1", Aim("goal"))
    goal = senses.goal
    assert senses.is_parked(state_of("n1", goal @ Pose2(0.02, 0.0, 0.04)))
    assert not senses.is_parked(state_of("n1", goal @ Pose2(0.04, 0.0, 0.0)))
    assert not senses.is_parked(state_of("n1", goal @ Pose2(0.0, 0.0, 0.1)))
    assert not senses.is_parked(state_of("n1", goal, 0.1))


def test_car_that_comes_backwards_or_towards_one_neither_leads_nor_follows():
    city_map = load_map("driving_school")
    roads, senses = roads_of(city_map), Senses(policy_of(AHEAD, -5.0, 5.0), city_map, "n1")
    at, lane = 0.6, roads.lanes["east_loop"]
    for name, along_m in (("n2", at + 0.6), ("n3", at - 0.5)):
        senses.receive(cam(name, lane.at(along_m) @ Pose2(0.0, 0.0, math.pi), 0.2))
    seen = senses.look(state_of("n1", lane.at(at), 0.1), STAND, 0).tolist()
    assert 0.1 < seen[0] < 0.4  # it stands in the way
    assert seen[1:] == [0.0, REACH, 0.1]


@pytest.fixture(scope="module")
def approach(tmp_path_factory):
    """Return the file of a policy that drives straight on, the slower the nearer its goal is."""
    envs = scm.gym.make_vec("parking_school/parking-v1", 1)
    names, path = envs.observation_names, tmp_path_factory.mktemp("policy") / "park.onnx"
    weights = np.zeros((len(names), 2))
    weights[names.index("goal_ahead_m"), 0] = 4.0
    columns = np.zeros(len(names)), np.ones(len(names))
    write_policy(path, [(weights, np.zeros(2))], *columns, envs)
    return path


def test_policy_parks_at_its_goal_and_stands_there(approach):
    city_map = load_map("parking_school")
    start = roads_of(city_map).spawn_pose("start")
    goal = start @ Pose2(0.4, 0.0, 0.0)
    text = f"{goal.x},{goal.y},{math.degrees(goal.yaw)}"
    part = PolicyPart("policy", "n1", approach, spawn="start", aim=Aim(goal=text))
    with Lockstep([WorldPart(city_map, 1), part]) as city:
        states = city.subscribe(Subscription(VehicleState, {"vehicle": "n1"}))
        city.run_for(12.0)
        way = [item.message for item in states.drain()]
    assert part.is_parked
    assert part.detail() == f"n1 is parked at {text}"
    first = next(one for one in way if math.hypot(one.x_m - start.x, one.y_m - start.y) > 0.35)
    assert seconds(way[-1].t_ns - first.t_ns) > 3.0
    away_m = math.hypot(way[-1].x_m - goal.x, way[-1].y_m - goal.y)
    assert 0.005 < away_m < 0.03  # by itself the policy would drive on to the middle
    assert (way[-1].throttle, way[-1].steering) == (0.0, 0.0)


def test_car_stands_at_once_while_something_is_missing(approach):
    part = PolicyPart("policy", "n1", approach, aim=Aim("goal"))
    part._senses = Senses(part.policy.metadata, load_map("parking_school"), "n1", Aim("goal"))
    state = Incoming(state_of("n1", Pose2(0.0, 0.0, 0.0)), 0)
    assert part.look([state], NS_PER_S) == STAND
    assert part.detail() == "n1 stands: it waits for its LIDAR"
