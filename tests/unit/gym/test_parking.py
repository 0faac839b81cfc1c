"""Parking: cars begin at drawn places, drive to a drawn bay, and are parked as the agent has it."""

import numpy as np
import pytest
from msgspec.structs import replace

import scm.gym
from scm.errors import MapError
from scm.geometry import Pose2
from scm.gym import rewards
from scm.gym.observations import Observations
from scm.gym.task import PlaceStart
from scm.gym.ways import AHEAD_M, AWAY_M, COS_TURN, LEFT_M, SIN_TURN, TURNED_RAD, ToGoal
from scm.maps.load import load_map
from scm.maps.route import roads_of
from scm.vehicles.parked import TOLERANCE_M, TOLERANCE_RAD, is_parked

SCHOOL, LOT = "parking_school_obstacles/parking-v1", "parking_lot/parking-v1"
STILL = np.zeros((1, 2))


@pytest.fixture(scope="module")
def lot():
    envs = scm.gym.make_vec(LOT, 400)
    envs.reset(seed=1)
    return envs.worlds


def put(worlds, row, pose, speed=0.0):
    """Put a car, and look at it as a step does."""
    worlds.fleet.place_rows(np.array([row]), np.array([[*pose]]), np.array([speed]))
    worlds.step(worlds.actions)


def test_goals_are_all_bays_and_cars_begin_near_all_spawns(lot):
    bays = {bay.pose for bay in lot.city_map.bays}
    assert {tuple(one) for one in lot.to_goal.goals.tolist()} == bays
    roads = roads_of(lot.city_map)
    places = np.array([roads.spawn_pose(one.name) for one in lot.city_map.spawns])
    poses = np.column_stack((lot.fleet.x, lot.fleet.y, lot.fleet.yaw))
    off = poses[:, None] - places
    nearest = np.abs(off[..., :2]).max(axis=2).argmin(axis=1)
    assert set(nearest.tolist()) == set(range(len(places)))
    pairs = set(zip(nearest.tolist(), map(tuple, lot.to_goal.goals.tolist()), strict=True))
    assert len(pairs) > 0.9 * len(places) * len(bays)
    aside = np.abs(off[np.arange(len(poses)), nearest])
    assert (aside <= [0.1 + 1e-9, 0.1 + 1e-9, 0.3 + 1e-9]).all()
    assert (aside.max(axis=0) > [0.09, 0.09, 0.27]).all()
    signed = off[np.arange(len(poses)), nearest]
    assert np.abs(np.corrcoef(signed.T) - np.eye(3)).max() < 0.2  # each has a draw of its own


def test_no_car_begins_in_a_wall_or_a_box():
    for name in ("parking_school", "parking_school_obstacles", "parking_lot"):
        worlds = scm.gym.make_vec(f"{name}/parking-v1", 300).worlds
        worlds.begin(np.ones(300, bool))
        worlds.step(np.zeros((300, 2)))
        assert not worlds.touched.any()


def test_goal_is_seen_from_the_car():
    worlds = scm.gym.make_vec(SCHOOL, 1).worlds
    worlds.begin(np.ones(1, bool))
    goal = Pose2(*worlds.to_goal.goals[0])
    assert goal == roads_of(worlds.city_map).spawn_pose("goal")
    put(worlds, 0, goal @ Pose2(-0.5, 0.2, 0.4))
    seen = Pose2(-0.5, 0.2, 0.4).inverse()
    known = worlds.to_goal.known[0]
    assert known[[AHEAD_M, LEFT_M]] == pytest.approx([seen.x, seen.y], abs=1e-3)
    assert known[[COS_TURN, SIN_TURN]] == pytest.approx([np.cos(0.4), -np.sin(0.4)], abs=1e-3)
    assert known[[AWAY_M, TURNED_RAD]] == pytest.approx([np.hypot(0.5, 0.2), 0.4], abs=1e-3)
    assert Observations(worlds, ["goal"]).update()[0] == pytest.approx(known[:4], abs=1e-6)


def test_what_is_gained_is_how_much_nearer_the_car_came():
    worlds = scm.gym.make_vec(SCHOOL, 1).worlds
    worlds.begin(np.ones(1, bool))
    assert rewards.goal_progress(worlds)[0] == rewards.goal_turn_progress(worlds)[0] == 0.0
    goal, fleet = Pose2(*worlds.to_goal.goals[0]), worlds.fleet
    put(worlds, 0, goal @ Pose2(-0.6, 0.0, 0.3), 0.2)

    def off():
        here = goal.inverse() @ Pose2(float(fleet.x[0]), float(fleet.y[0]), float(fleet.yaw[0]))
        return np.hypot(here.x, here.y), abs(here.yaw)

    (away, turned), _ = off(), worlds.step(np.array([[0.8, -1.0]]))
    now_away, now_turned = off()
    assert now_away < away - 0.003
    assert rewards.goal_progress(worlds)[0] == pytest.approx(away - now_away, abs=1e-9)
    assert rewards.goal_turn_progress(worlds)[0] == pytest.approx(turned - now_turned, abs=1e-9)
    assert turned - now_turned > 1e-4
    worlds.begin(np.ones(1, bool))
    assert rewards.goal_progress(worlds)[0] == rewards.goal_turn_progress(worlds)[0] == 0.0


@pytest.mark.parametrize(
    ("off", "ends"),
    [
        (Pose2(0.0, 0.0, 0.0), True),
        (Pose2(0.9 * TOLERANCE_M, 0.0, -0.9 * TOLERANCE_RAD), True),
        (Pose2(0.0, 1.1 * TOLERANCE_M, 0.0), False),
        (Pose2(0.0, 0.0, 1.1 * TOLERANCE_RAD), False),
        (Pose2(0.0, 0.0, np.pi), False),
    ],
)
def test_episode_ends_with_a_reward_when_the_car_stands_in_its_bay(off, ends):
    envs = scm.gym.make_vec(SCHOOL, 1, autoreset_mode="Disabled")
    envs.reset(seed=3)
    fleet, goal = envs.worlds.fleet, Pose2(*envs.worlds.to_goal.goals[0])
    fleet.place_rows(np.zeros(1, int), np.array([[*(goal @ off)]]), np.zeros(1))
    _, gain, ended, _, _ = envs.step(STILL)
    assert ended.tolist() == [ends]
    assert (gain[0] > 2.0) == ends  # it came all the way at once, too


def test_car_that_passes_its_bay_is_not_parked():
    worlds = scm.gym.make_vec(SCHOOL, 1).worlds
    worlds.begin(np.ones(1, bool))
    goal = worlds.to_goal.goals[0]
    worlds.actions[:, 0] = 0.8
    put(worlds, 0, goal - [0.01, 0.0, 0.0], 0.2)
    assert worlds.to_goal.known[0, AWAY_M] < 0.5 * TOLERANCE_M
    assert not worlds.ends().any()


def test_contact_costs_and_ends_the_episode():
    worlds = scm.gym.make_vec(SCHOOL, 1).worlds
    worlds.begin(np.ones(1, bool))
    put(worlds, 0, (0.7, 0.3, 0.0))
    worlds.step(worlds.actions)
    assert worlds.ends().all()
    assert rewards.contact(worlds)[0] == 1.0
    assert worlds.rewards()[0] == pytest.approx(-1.0, abs=0.01)


def test_car_that_stands_within_both_tolerances_is_parked():
    away, turned = np.array([0.0, 0.05, 0.0, 0.0]), np.array([0.0, 0.0, -0.06, 0.0])
    speed = np.array([-0.01, 0.0, 0.0, -0.03])
    assert is_parked(away, turned, speed).tolist() == [True, False, False, False]
    assert is_parked(0.04, 0.08, 0.0, 0.05, 0.0873)


def test_map_without_bays_or_places_and_parts_of_lanes_are_refused():
    empty = replace(load_map("parking_lot"), bays=())
    with pytest.raises(MapError, match="map parking_lot: expected bays, and spawns"):
        ToGoal(empty, 1, PlaceStart())
    worlds = scm.gym.make_vec(SCHOOL, 1).worlds
    with pytest.raises(MapError, match="task parking: its cars drive to goals"):
        Observations(worlds, ["lane"])
    lanes = scm.gym.make_vec("driving_school/lap-v1", 1).worlds
    with pytest.raises(MapError, match="task lap: its cars drive along lanes"):
        Observations(lanes, ["goal"])
