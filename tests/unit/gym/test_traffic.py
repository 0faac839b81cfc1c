"""Rule-driven cars: rows of the worlds' fleet that drive in one row with the agent's car."""

import numpy as np
import pytest

import scm.gym
from scm.gym.observations import Observations
from scm.gym.touching import Touching
from scm.gym.traffic import FOLLOWER_GAP_M, FOLLOWER_MPS, LEADER_GAP_M, LEADER_MPS
from scm.vehicles.drivers.cars_ahead import REACH, STANDSTILL_GAP
from scm.vehicles.drivers.driver_state import HERE, REQUESTED_SPEED, SEED, S

TRAFFIC = "driving_school/traffic-v1"
ROUND = ("crossing_south_east", "east_loop", "crossing_south_west", "west_loop")
LENGTH_M = 0.3  # of a Nigel
FRONT_M = 0.23
STRAIGHT_M = 0.359  # where the straight of a crossing lane begins
JUNCTION_M, MIDDLE_M = 0.41, 0.8737  # where the junction begins on it, and where the two cross


def begun(count, name=TRAFFIC, **options):
    """Return worlds whose first episode begins."""
    worlds = scm.gym.make_vec(name, count, **options).worlds
    worlds.seed(np.arange(count), np.arange(count))
    worlds.begin(np.ones(count, bool))
    return worlds


def rows_of(worlds, world):
    """Return the rows of a world: the agent's car, and those that rules drive."""
    return worlds.cars[world].T


def put(worlds, row, lane, along, speed=0.0):
    """Put a car so far along a lane of `ROUND`, or on the one before it."""
    course, (table, state) = worlds.course, worlds.course.arrays
    numbers = [course.graph.numbers[name] for name in ROUND]
    at = ROUND.index(lane)
    if along < 0.0:
        at -= 1
        along += table.length[numbers[at]]
    before = table.length[: numbers[at]].sum()
    draws = np.array([[(before + along) / table.length.sum(), 0.5, 0.5, 0.0]])
    requested = state.floats[row, REQUESTED_SPEED]
    pose = course.begin(np.array([row]), draws, 0.0, 0.0)
    state.floats[row, REQUESTED_SPEED] = requested
    worlds.fleet.place_rows(np.array([row]), pose, np.array([speed]))


def look(worlds):
    """Look at all cars where they are now; return what agents know."""
    worlds.way.look(worlds.fleet)
    every = np.arange(worlds.count)
    worlds.traffic.decide(every, worlds.fleet, np.full(worlds.count, -1.0))
    return worlds.traffic.known


def test_cars_begin_one_behind_the_other_by_drawn_gaps_and_one_follows_the_agent_s():
    worlds = begun(60)
    graph, state = worlds.course.graph, worlds.course.arrays[1]
    order = [graph.numbers[name] for name in ROUND]
    begins = np.cumsum([0.0, *graph.arrays.length[order]])
    place_of = dict(zip(order, begins, strict=False))
    lanes = state.lane_window[:, HERE]
    place = np.array([place_of[lane] for lane in lanes]) + state.floats[:, S]
    rows = np.array([rows_of(worlds, world) for world in range(60)])
    gaps = np.diff(place[rows[:, [1, 0, 2, 3]]], axis=1) % begins[-1]
    assert (gaps > 0.6 - 1e-9).all()
    assert (gaps < 1.0 + 1e-9).all()
    assert gaps.max() - gaps.min() > 0.35
    assert (np.ptp(gaps, axis=1) > 1e-4).all()  # each has a draw of its own
    speeds = state.floats[worlds.rows :, REQUESTED_SPEED]
    assert 0.08 <= speeds.min() < 0.09
    assert 0.21 < speeds.max() <= 0.22
    assert (np.ptp(speeds.reshape(60, 3), axis=1) > 1e-4).all()
    worlds.step(np.zeros((60, 2)))
    assert not worlds.ends().any()


def test_cars_of_a_world_branch_alike():
    worlds = begun(40, "market_town/traffic-v1")
    state = worlds.course.arrays[1]
    seeds = state.ints[worlds.cars, SEED]
    assert (seeds == seeds[:, :1]).all()
    assert len(set(seeds[:, 0].tolist())) == 40


def test_rule_driven_cars_drive_on_at_the_speed_that_they_begin_with():
    worlds = begun(40)
    speed, first = worlds.fleet.speed.copy(), rows_of(worlds, np.arange(40))[3]
    slower = speed[first] < worlds.course.arrays[1].floats[first, REQUESTED_SPEED]
    moving = first[slower & (speed[first] > 0.05)]
    assert len(moving) > 10
    for _ in range(10):
        worlds.step(np.zeros((40, 2)))
        assert (worlds.fleet.speed[moving] > speed[moving] - 0.02).all()


def test_gaps_are_from_bumper_to_bumper_and_of_the_own_world_alone():
    worlds = begun(2)
    agent, follower, leader, far = rows_of(worlds, 1)
    put(worlds, follower, ROUND[0], STRAIGHT_M, 0.05)
    put(worlds, agent, ROUND[0], STRAIGHT_M + 0.4, 0.1)
    put(worlds, leader, ROUND[0], STRAIGHT_M + 1.0, 0.2)
    put(worlds, far, ROUND[3], 1.0)
    before = look(worlds)[0].copy()
    known = look(worlds)[1]
    assert known[LEADER_GAP_M] == pytest.approx(0.6 - LENGTH_M, abs=2e-3)
    assert known[FOLLOWER_GAP_M] == pytest.approx(0.4 - LENGTH_M, abs=2e-3)
    assert known[[LEADER_MPS, FOLLOWER_MPS]] == pytest.approx([0.2, 0.05], abs=0.01)
    assert np.array_equal(look(worlds)[0], before)
    assert Observations(worlds, ["ahead"]).update()[1] == pytest.approx(known)


def test_without_cars_within_reach_the_gap_is_the_reach_and_the_speed_the_own():
    worlds = begun(1)
    agent, *others = rows_of(worlds, 0)
    put(worlds, agent, ROUND[0], 0.0, 0.15)
    worlds.fleet.alive[others] = False
    speed = worlds.fleet.speed[agent]
    assert look(worlds)[0].tolist() == [REACH, speed, REACH, speed]


def test_car_that_crosses_the_way_is_ahead():
    worlds = begun(1)
    agent, crossing, *others = rows_of(worlds, 0)
    worlds.fleet.alive[others] = False
    put(worlds, agent, ROUND[0], MIDDLE_M - 0.8)
    put(worlds, crossing, ROUND[2], MIDDLE_M - 0.08, 0.2)  # the middle of its outline is there
    known = look(worlds)[0]
    assert 0.8 - FRONT_M - 0.25 < known[LEADER_GAP_M] < 0.8 - FRONT_M
    assert known[LEADER_MPS] < 0.15
    assert known[FOLLOWER_GAP_M] == REACH


def test_car_that_comes_from_the_side_follows_nobody():
    worlds = begun(1)
    agent, crossing, *others = rows_of(worlds, 0)
    worlds.fleet.alive[others] = False
    put(worlds, agent, ROUND[0], MIDDLE_M - 0.08)
    put(worlds, crossing, ROUND[2], MIDDLE_M - 0.7)
    assert look(worlds)[0, FOLLOWER_GAP_M] == REACH
    put(worlds, crossing, ROUND[0], MIDDLE_M - 0.7)
    assert look(worlds)[0, FOLLOWER_GAP_M] == pytest.approx(0.62 - LENGTH_M, abs=0.01)


def test_rule_driven_cars_stop_behind_an_agent_that_stands():
    worlds = begun(30)
    for _ in range(800):
        worlds.step(np.zeros((30, 2)))
        assert not worlds.touched.any()
    followers = worlds.fleet.speed[[rows_of(worlds, world)[1] for world in range(30)]]
    assert np.abs(followers).max() < 0.02
    gaps = worlds.traffic.known[:, FOLLOWER_GAP_M]
    assert (gaps > 0.5 * STANDSTILL_GAP).all()
    assert np.median(gaps) < 2.0 * STANDSTILL_GAP


def test_rule_driven_cars_go_round_at_their_speeds_and_touch_nothing():
    worlds = begun(60)
    worlds.remove(np.ones(60, bool))
    touching = Touching(worlds.city_map, worlds.car, worlds.cars, 4)
    speeds = worlds.course.arrays[1].floats[worlds.rows :, REQUESTED_SPEED]
    fastest = np.zeros(len(speeds))
    for _ in range(900):
        worlds.step(np.zeros((60, 2)))
        motion = worlds.fleet.planar_cogs(np.arange(240))
        assert not touching.find(motion, present=worlds.fleet.alive)[worlds.rows :].any()
        np.maximum(fastest, worlds.fleet.speed[worlds.rows :], out=fastest)
    assert (fastest < speeds + 0.04).all()
    assert (fastest[2::3] > speeds[2::3] - 0.01).all()  # nobody is ahead of the first
    off = np.abs(worlds.course.known[worlds.rows :, 0])
    assert off.max() < 0.04
    assert worlds.fleet.speed[worlds.rows :].mean() > 0.08


@pytest.mark.parametrize(("way", "goes"), [(0.6, False), (1.45, True)])
def test_rule_driven_car_lets_an_agent_pass_a_junction_that_is_near(way, goes):
    worlds = begun(1)
    agent, own, *others = rows_of(worlds, 0)
    worlds.fleet.alive[others] = False
    put(worlds, own, ROUND[0], JUNCTION_M - FRONT_M - 0.3, 0.1)
    put(worlds, agent, ROUND[2], JUNCTION_M - FRONT_M - way)
    look(worlds)
    for _ in range(120):
        worlds.step(np.zeros((1, 2)))
    assert (worlds.fleet.speed[own] > 0.05) == goes
    assert not worlds.touched.any()


def test_rule_driven_car_follows_into_a_junction():
    worlds = begun(1)
    agent, own, *others = rows_of(worlds, 0)
    worlds.fleet.alive[others] = False
    put(worlds, agent, ROUND[0], MIDDLE_M)
    put(worlds, own, ROUND[0], 0.0)
    look(worlds)
    for _ in range(120):
        worlds.step(np.zeros((1, 2)))
    assert worlds.course.arrays[1].floats[own, S] > JUNCTION_M
    assert not worlds.touched.any()


def test_agent_s_contact_with_a_rule_driven_car_counts_and_that_of_others_does_not():
    worlds = begun(2)
    touching = Touching(worlds.city_map, worlds.car, worlds.cars, 1)
    motion = np.zeros((8, 6))
    motion[:, 0], motion[:, 1] = 1.0, 0.6
    motion[[0, 1], 1] = 0.3, 0.55
    marks = touching.find(motion, present=np.ones(8, bool))
    assert marks.tolist() == [False, True, False, False, False, True, True, True]


def test_observation_of_traffic_needs_traffic():
    lap = scm.gym.make_vec("driving_school/lap-v1", 1).worlds
    with pytest.raises(TypeError, match="task lap: `ahead` needs cars that rules drive"):
        Observations(lap, ["ahead"])
