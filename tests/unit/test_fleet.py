"""Fleet scripts: the same in lockstep every time, and clear about what cannot be."""

import threading
from collections.abc import Callable, Iterator

import pytest

from scm.clock import WallClock
from scm.errors import LinkError, RunError, ScmError
from scm.fleet import City, open_city
from scm.live import run
from scm.maps.load import load_map
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.remove_request import RemoveRequest
from scm.v2x.router import Router, free_endpoint
from scm.world.part import WorldPart


@pytest.fixture(scope="module")
def city() -> Iterator[City]:
    with open_city("driving_school") as city:
        city.spawn("nigel", name="first")
        yield city


def travel_times(seed: int = 0) -> list[float | None]:
    with open_city("driving_school", seed=seed) as city:
        cars = [city.spawn("nigel") for _ in range(3)]
        trips = [car.drive("east_loop", "west_loop") for car in cars]
        city.wait(trips, timeout_s=120.0)
        return [trip.travel_time_s for trip in trips]


def test_the_same_script_gives_the_same_times_bit_for_bit() -> None:
    first = travel_times()
    assert all(time_s is not None and 1.0 < time_s < 120.0 for time_s in first)
    assert travel_times() == first


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda c: c.use_plan("nope"), "no plan 'nope', only ['brisk', 'calm', 'flash']"),
        (lambda c: c.use_plan("calm", junction="x"), "no junction 'x', only ['crossing']"),
        (lambda c: c.spawn("nigl"), "did you mean 'nigel'?"),
        (lambda c: c.spawn(at="nowhere"), "no spawn 'nowhere'"),
        (lambda c: c.spawn(name="first"), "already one named 'first'"),
        (lambda c: [c.spawn() for _ in range(40)], "no spawn place of map driving_school is free"),
        (lambda c: c.cars[0].drive("nolane"), "no lane 'nolane'"),
        (lambda c: c.cars[0].drive("east_loop", laps=0), "laps: expected at least 1, got 0"),
        (lambda c: c.cars[0].drive("east_loop", then="fly"), "then: got 'fly', expected"),
        (lambda c: c.cars[0].drive("east_loop", speed_mps=float("nan")), "speed_mps: got nan"),
    ],
)
def test_what_cannot_be_is_refused_in_words(
    city: City, ask: Callable[[City], object], said: str
) -> None:
    with pytest.raises(ScmError) as error:
        ask(city)
    assert said in str(error.value)


def test_nobody_waits_for_a_car_that_circulates_or_is_gone(city: City) -> None:
    car = city.cars[0]
    with pytest.raises(RunError, match="first will never arrive: it circulates"):
        city.wait([car.drive()])
    journey = car.drive("east_loop")
    with pytest.raises(RunError, match=r"after 0\.5 s these cars had not arrived: first"):
        city.wait([journey], timeout_s=0.5)
    car.remove()
    with pytest.raises(RunError, match="first will never arrive: it was removed"):
        city.wait([journey])


def test_a_city_that_does_not_run_is_told_within_seconds() -> None:
    began_ns = WallClock().now_ns()
    endpoint = free_endpoint()
    with pytest.raises(LinkError, match="is `scm up` running"), open_city(connect=endpoint):
        pytest.fail("there is no city to open")
    assert WallClock().now_ns() - began_ns < 7e9


def test_a_live_script_that_fails_takes_all_its_cars_along() -> None:
    world = WorldPart(load_map("driving_school"))
    stop = threading.Event()
    with Router(free_endpoint()) as router, ZenohBus("city", "world", router.listen) as bus:
        running = threading.Thread(target=run, args=(world, bus, WallClock(), stop))
        running.start()
        try:
            with pytest.raises(KeyError, match="in the middle"):
                fail_in_the_middle(router.listen)
            with open_city(connect=router.listen) as city:
                names = [city.spawn(name=name).name for name in ("a", "b", "c")]
        finally:
            stop.set()
            running.join()
    assert names == ["a", "b", "c"]  # none of them is there any more


def fail_in_the_middle(endpoint: str) -> None:
    with open_city(connect=endpoint) as city:
        for name in ("a", "b", "c"):
            city.spawn(name=name)
        # Somebody else was quicker with the first: the others must go all the same.
        city.request(RemoveRequest(vehicle="a", reason="somebody else"), RemoveRequest.REPLY)
        msg = "in the middle"
        raise KeyError(msg)
