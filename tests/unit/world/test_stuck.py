"""Cars that push in vain: told once, with what they most likely push against, until they move."""

import math

import msgspec
import numpy as np
import pytest

from scm.clock import NS_PER_S
from scm.geometry import Pose2
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.join_request import JoinRequest
from scm.v2x.messages.route_request import RouteRequest
from scm.world.stuck import MIN_THROTTLE, MOVED_M, REST_NS, STUCK_AFTER_NS, TRY_NS, Stuck

EAST_WALL_M = 2.884  # its inner face
FRONT_M, REAR_M = 0.23, 0.07  # a Nigel's, from its rear axle
PATIENCE_S, PAUSE_S, TRY_S = STUCK_AFTER_NS / NS_PER_S, REST_NS / NS_PER_S, TRY_NS / NS_PER_S
AT_WALL = Pose2(EAST_WALL_M - FRONT_M - 0.005, 0.6, 0.0)


def told(city):
    return [e.text for e in city.heard(CityEvent) if e.name == "stuck"]


def put(city, name, pose):
    """Put a hosted car somewhere."""
    return city.world.host(name, "nigel", pose, city.now)


def push(city, lease, seconds, throttle, seq):
    """Drive by hand for a time, a command every tick; return the next number of a command."""
    for number in range(seq, seq + round(50 * seconds)):
        city.run(1, city.command(lease, number, throttle))
    return seq + round(50 * seconds)


def test_a_car_that_pushes_against_a_wall_is_stuck_once_until_it_moves(city):
    put(city, "n1", AT_WALL)
    lease = city.lease(ttl_ms=60_000)
    seq = push(city, lease, PATIENCE_S - 0.5, 0.5, 1)
    assert (told(city), city.shown("n1").stuck) == ([], None)
    seq = push(city, lease, 1.5 + PATIENCE_S, 0.5, seq)
    assert told(city) == ["n1 is stuck: it pushes against a wall and stays"]
    assert city.shown("n1").stuck == ("wall",)
    seq = push(city, lease, 1.0, 0.0, seq)
    assert city.shown("n1").stuck == ("wall",), "it still stands there"
    push(city, lease, 2.0, -0.5, seq)
    assert told(city)[1:] == ["n1 is free again"]
    assert city.shown("n1").stuck is None


def test_time_that_a_slow_computer_lost_makes_nobody_stuck(make_city):
    city = make_city(hosted=(("n1", "nigel"),))
    city.run_for(1.0)
    city.now += 3 * STUCK_AFTER_NS
    city.run_for(0.5)
    assert city.world.cars.arrays.throttle[0] > MIN_THROTTLE, "it drives"
    assert told(city) == []


def test_two_cars_nose_to_nose_name_each_other(city):
    put(city, "n1", Pose2(1.0, 0.6, 0.0))
    put(city, "n2", Pose2(1.0 + 2 * FRONT_M + 0.005, 0.6, math.pi))
    leases = [city.lease(name, ttl_ms=60_000) for name in ("n1", "n2")]
    for seq in range(1, round(50 * (1.0 + PATIENCE_S))):
        city.run(1, *(city.command(lease, seq, 0.3) for lease in leases))
    assert sorted(told(city)) == [
        "n1 is stuck: it pushes against n2 and stays",
        "n2 is stuck: it pushes against n1 and stays",
    ]


@pytest.mark.parametrize("throttle", [0.0, 0.9 * MIN_THROTTLE])
def test_a_car_that_is_hardly_told_to_drive_is_not_stuck(city, throttle):
    put(city, "n1", AT_WALL)
    push(city, city.lease(ttl_ms=60_000), 1.5 * PATIENCE_S, throttle, 1)
    assert told(city) == []


def test_the_least_throttle_moves_a_free_car_far_enough(city):
    put(city, "n1", Pose2(1.0, 0.6, 0.0))
    push(city, city.lease(ttl_ms=60_000), 2 * PATIENCE_S, MIN_THROTTLE, 1)
    assert told(city) == []


def test_a_car_of_an_agent_is_judged_by_its_own_throttle_and_place(city):
    city.join("n7")

    def report(seq, x):
        return msgspec.structs.replace(city.report(seq=seq, x=x), throttle=0.4)

    for seq in range(1, 60):
        city.run(5, report(seq, 1.0 + 0.2 * MOVED_M * (seq % 2)))
    assert told(city) == ["n7 is stuck: it is commanded to drive, touches nothing and stays"]
    assert city.shown("n7").stuck == ()
    city.run(15, report(60, 1.0 + 2 * MOVED_M))
    assert told(city)[1:] == ["n7 is free again"]


@pytest.fixture
def blocked(city):
    """A car of the world's whose driver pushes against a real one across its lane, unheard."""
    car = put(city, "n1", city.world.roads.spawn_pose("a"))
    x, y, yaw = car.pose
    city.ask(JoinRequest(vehicle="n7", session="s1", kind="real"))
    ahead, beside = FRONT_M + 0.1, 0.5 * (FRONT_M - REAR_M)

    def stand(seq):
        return city.report(
            seq=seq,
            x=x + ahead * math.cos(yaw) + beside * math.sin(yaw),
            y=y + ahead * math.sin(yaw) - beside * math.cos(yaw),
            yaw_rad=yaw + 0.5 * math.pi,
        )

    city.run(1, stand(1))
    city.ask(RouteRequest(vehicle="n1"))
    return car, stand


def test_a_driver_lets_go_of_a_stuck_car_and_tries_again_once_in_a_while(city, blocked):
    car, stand = blocked
    throttles = []
    for seq in range(2, round(50 * (0.5 + PATIENCE_S + PAUSE_S + TRY_S + 0.5 * PAUSE_S) / 5)):
        city.run(5, stand(seq))
        throttles.append(city.world.cars.arrays.throttle[car.index] > 0.0)
    assert told(city)[:1] == ["n1 is stuck: it pushes against n7 and stays"]
    changes = np.flatnonzero(np.diff(throttles)) + 1
    spans_s = np.diff(changes) * 0.1
    np.testing.assert_allclose(spans_s[-2:], [PAUSE_S, TRY_S], atol=0.2)
    assert len(told(city)) == 1
    city.world.remove("n7")
    city.run_for(PAUSE_S + TRY_S)
    assert told(city)[1:] == ["n1 is free again"]


def test_a_queue_before_a_red_light_is_not_stuck(make_city):
    city = make_city(hosted=tuple((f"n{i}", "nigel") for i in range(1, 7)))
    city.run_for(8.0 + 1.5 * PATIENCE_S)
    assert city.world.cars.arrays.speed.max() < 0.02, "all wait at the dark light by now"
    assert told(city) == []


def test_a_car_in_the_place_of_a_stuck_one_is_not_stuck(city):
    put(city, "n1", AT_WALL)
    push(city, city.lease(ttl_ms=60_000), 2 + PATIENCE_S, 0.5, 1)
    city.world.remove("n1")
    put(city, "n2", AT_WALL)
    city.run_for(1.0)
    assert city.shown("n2").stuck is None
    assert len(told(city)) == 1


def test_patience_begins_anew_whenever_a_car_is_let_go_of():
    stuck, none = Stuck(1), np.zeros(1)
    for t_s in range(0, 40, 2):
        throttle = np.full(1, 0.5 if t_s % 4 else 0.0)
        new, _ = stuck.look(throttle, none, none, t_s * NS_PER_S)
        assert not len(new)


@pytest.mark.parametrize("throttle", [MIN_THROTTLE, -MIN_THROTTLE])
def test_whoever_stays_for_that_long_is_stuck_either_way(throttle):
    stuck, none, told = Stuck(2), np.zeros(2), np.array([throttle, 0.0])
    stuck.look(np.zeros(2), none, none, 0)
    assert [one.tolist() for one in stuck.look(told, none, none, STUCK_AFTER_NS - 1)] == [[], []]
    near = np.array([0.9 * MOVED_M, 0.0])
    assert [one.tolist() for one in stuck.look(told, near, none, STUCK_AFTER_NS)] == [[0], []]
    assert stuck.rests(STUCK_AFTER_NS).tolist() == [True, False]
    assert stuck.rests(STUCK_AFTER_NS + REST_NS).tolist() == [False, False]
    far = np.array([1.1 * MOVED_M, 0.0])
    assert [one.tolist() for one in stuck.look(told, far, none, STUCK_AFTER_NS + 1)] == [[], [0]]
    assert stuck.against == {}
