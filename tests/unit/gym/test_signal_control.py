"""Junctions as agents: the city's kernel decides the colours, cars that rules drive obey them."""

import numpy as np
import pytest

import scm.gym
from scm.errors import MapError
from scm.gym.junctions import AHEAD, NEAR, QUEUE, SLOW, Interlock
from scm.maps.conflicts import conflicting_groups
from scm.maps.load import load_map
from scm.maps.route import roads_of
from scm.traffic.signals import kernel
from scm.traffic.signals.kernel import Phase
from scm.traffic.signals.program import program_of
from scm.vehicles.drivers.driver_state import REQUESTED_SPEED

NAME = "market_town/signal_control-v1"
CITY = load_map("market_town")
ROADS = roads_of(CITY)
LINE_M, FRONT_M = 1.05, 0.23  # along market_east, and from the rear axle to a Nigel's front


@pytest.fixture(scope="module")
def envs():
    return scm.gym.make_vec(NAME, num_envs=4)


@pytest.mark.parametrize("junction", CITY.junctions, ids=lambda one: one.name)
def test_interlock_does_under_any_choices_what_the_city_s_kernel_does(junction):
    program = program_of(junction, ROADS)
    lock, state, number = Interlock(program, 1.0), kernel.start(program), 0
    rng = np.random.default_rng(1)
    greens = set()
    for _ in range(600):
        stage = int(rng.integers(len(lock.stages))) if rng.random() < 0.2 else 0
        state = kernel.step(program, state, lock.stages[stage], 10**9)
        number = lock.following[number, stage]
        assert lock.green[number].tolist() == [one.phase is Phase.GREEN for one in state]
        greens.add(tuple(lock.green[number]))
    assert len(greens) > 2


@pytest.mark.parametrize("junction", CITY.junctions, ids=lambda one: one.name)
def test_no_state_of_an_interlock_shows_green_to_groups_in_conflict(junction):
    lock = Interlock(program_of(junction, ROADS), 1.0)
    names = [group.name for group in junction.groups]
    for pair in conflicting_groups(junction, ROADS):
        one, other = (names.index(name) for name in pair)
        assert lock.green[:, one].any()
        assert not (lock.green[:, one] & lock.green[:, other]).any()


def alone(envs, speed=0.0, along=0.3, lane="market_east"):
    """Return the worlds with the first car of world 0 alone on a lane."""
    envs.reset(seed=1)
    worlds = envs.worlds
    worlds.fleet.alive[:] = False
    row = worlds.cars[0, 0]
    worlds.fleet.alive[row] = True
    x, y, yaw = ROADS.lanes[lane].at(along)
    worlds.fleet.place_rows(np.array([row]), np.array([[x, y, yaw]]), np.array([speed]))
    worlds.course.enter(row, lane, along)
    worlds.course.arrays[1].floats[row, REQUESTED_SPEED] = 0.25
    worlds.traffic.decide(np.arange(2), worlds.fleet, np.full(2, -1.0))
    return worlds, row


def test_car_stops_before_red_and_drives_on_at_green(envs):
    worlds, row = alone(envs)
    market = worlds.junctions.interlocks[0]
    red, green = (
        next(k for k, stage in enumerate(market.stages) if ("east" in stage) == is_in)
        for is_in in (False, True)
    )
    for _ in range(15):
        envs.step(np.full(4, red))
    done = worlds.course.known[row, 3]
    assert done == pytest.approx(LINE_M - FRONT_M - 0.3 - 0.04, abs=0.02)
    assert worlds.fleet.speed[row] == pytest.approx(0.0, abs=0.005)
    for _ in range(18):
        envs.step(np.full(4, green))
    assert worlds.course.known[row, 3] > done + 0.5


def test_car_that_cannot_stop_any_more_drives_on(envs):
    worlds, row = alone(envs, speed=0.25, along=LINE_M - FRONT_M - 0.03)
    for _ in range(4):
        envs.step(np.zeros(4, int))
    assert worlds.course.known[row, 3] > 0.6


def test_cars_are_counted_before_the_line_and_behind_the_junction(envs):
    worlds, row = alone(envs)
    worlds.fleet.alive[:] = False
    state = worlds.course.arrays[1]
    group = 0  # market, east

    def known(lane, along, speed):
        for car in worlds.cars[0]:
            worlds.course.enter(car, "station_west", 0.0)
        before = worlds_look(0.0)
        worlds.course.enter(row, lane, along)
        assert state.lane_window[row].max() >= 0
        return worlds_look(speed) - before

    def worlds_look(speed):
        speeds = np.full(worlds.fleet.capacity, speed)
        worlds.junctions.look(*worlds.course.arrays, np.arange(2), worlds.cars, speeds, np.zeros(2))
        return worlds.junctions.known[0, group].copy()

    limit = ROADS.definition("market_east").speed_limit_mps
    standing = known("market_east", 0.5, 0.0)
    assert standing[[NEAR, QUEUE, AHEAD]].tolist() == [1.0, 1.0, 0.0]
    assert standing[SLOW] == pytest.approx(1.0)
    driving = known("market_east", 0.5, 0.5 * limit)
    assert driving[[NEAR, QUEUE, AHEAD]].tolist() == [1.0, 0.0, 0.0]
    assert driving[SLOW] == pytest.approx(0.5)
    assert known("market_east", LINE_M + 0.1, 0.0)[[NEAR, AHEAD]].tolist() == [0.0, 0.0]
    assert known("east_outer", 0.5, 0.0)[[NEAR, AHEAD]].tolist() == [0.0, 1.0]


def test_reward_is_what_cars_lose_before_the_lines():
    one = scm.gym.make_vec(NAME, num_envs=2)
    one.reset(seed=3)
    lost = 0.0
    for _ in range(30):
        _, gain, *_ = one.step(np.zeros(2, int))
        slow = one.worlds.junctions.known[0, :, SLOW]
        by_junction = np.array([slow[:4].sum(), slow[4:].sum()])
        assert gain == pytest.approx(-0.1 * by_junction, abs=0.06)  # over the second, not its end
        lost -= gain.sum()
    assert lost > 1.0


def test_choice_that_a_junction_lacks_leaves_its_stage_and_observation_says_what_is_chosen():
    one = scm.gym.make_vec(NAME, num_envs=2)
    one.reset(seed=1)
    junctions = one.worlds.junctions
    junctions.interlocks[1].stages = junctions.interlocks[1].stages[:2]
    for choice, stage, since in ((1, 1, 0), (2, 1, 1), (0, 0, 0), (2, 0, 1)):
        seen, *_ = one.step(np.array([0, choice]))
        named = dict(zip(one.observation_names, seen[1].tolist(), strict=True))
        assert [named[f"stage_{k}_is_chosen"] for k in range(3)] == [
            float(k == stage) for k in range(3)
        ]
        assert named["since_change_s"] == since
        assert named["group_3_near_cars"] == 0.0  # the station has three groups


def test_green_of_a_cycle_lets_more_through_than_one_stage_for_ever_and_no_cars_collide():
    def done(policy):
        worlds = scm.gym.make_vec(NAME, num_envs=4)
        worlds.reset(seed=5)
        cars, fleet = worlds.worlds.cars, worlds.worlds.fleet
        for step in range(150):
            worlds.step(np.full(4, policy(step)))
            x, y = fleet.x[cars], fleet.y[cars]
            gaps = np.hypot(x[:, :, None] - x[:, None], y[:, :, None] - y[:, None])
            assert (gaps + np.eye(12) > 0.175).all()
        return worlds.worlds.course.known[:, 3].mean()

    assert done(lambda step: step // 20 % 3) > 1.5 * done(lambda _: 0)


def test_world_is_the_same_bit_by_bit_as_the_parallel_environment_of_its_seed():
    many, one = scm.gym.make_vec(NAME, num_envs=6), scm.gym.parallel_env(NAME)
    seen, _ = many.reset(seed=7)
    alone_, _ = one.reset(seed=8)
    assert one.possible_agents == ["market", "station"]
    for step in range(30):
        choice = np.array([step // 7 % 3, step // 5 % 3] * 3)
        for k, name in enumerate(one.possible_agents):
            assert np.array_equal(seen[2 + k], alone_[name])
        seen, gain, *_ = many.step(choice)
        alone_, gained, *_ = one.step(dict(zip(one.agents, choice[2:4], strict=True)))
        assert gain[2:4].tolist() == list(gained.values())


def test_map_with_another_number_of_junctions_is_refused():
    with pytest.raises(MapError, match="expected 2 junctions, got"):
        scm.gym.make_vec("driving_school/signal_control-v1", num_envs=2)
