"""Fleet scripts: the same in lockstep every time, and clear about what cannot be."""

import threading
from collections.abc import Callable, Iterator

import pytest

from scm.clock import WallClock
from scm.errors import LinkError, RunError, ScmError
from scm.fleet import City, LiveLink, LockstepLink, open_city
from scm.maps.load import load_map
from scm.runtime.live import run
from scm.runtime.lockstep import Lockstep
from scm.traffic.signals.part import TrafficPart
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.mailbox import Mailbox
from scm.v2x.messages.remove_request import RemoveRequest
from scm.v2x.messages.trip import Trip
from scm.v2x.router import Router, free_endpoint
from scm.world.part import WorldPart

pytestmark = pytest.mark.usefixtures("lasting_links")


@pytest.fixture(scope="module")
def city() -> Iterator[City]:
    with open_city("driving_school") as city:
        city.spawn("nigel", name="first")
        yield city


def travel_times(seed: int = 0) -> list[float | None]:
    with open_city("driving_school", seed=seed) as city:
        cars = [city.spawn("nigel") for _ in range(3)]
        trips = [car.drive("east_loop") for car in cars]
        city.wait(trips, timeout_s=120.0)
        return [trip.travel_time_s for trip in trips]


def test_the_same_script_gives_the_same_times_bit_for_bit() -> None:
    first = travel_times()
    assert all(time_s is not None and 1.0 < time_s < 120.0 for time_s in first)
    assert travel_times() == first


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda c: c.use_plan("nope"), "no plan 'nope', only ['brisk', 'calm', 'actuated'"),
        (lambda c: c.use_plan("calm", junction="x"), "no junction 'x', only ['crossing']"),
        (lambda c: c.spawn("nigl"), "did you mean 'nigel'?"),
        (lambda c: c.spawn(at="nowhere"), "no spawn 'nowhere'"),
        (lambda c: c.spawn(name="first"), "already one named 'first'"),
        (lambda c: [c.spawn() for _ in range(40)], "no spawn place of map driving_school is free"),
        (lambda c: c.cars[0].drive("nolane"), "no lane 'nolane'"),
        (lambda c: c.cars[0].drive("east_loop", laps=0), "laps: expected at least 1, got 0"),
        (lambda c: c.cars[0].park("north_1"), "the agent that parks first is not running"),
        (lambda c: c.cars[0].drive("east_loop", then="fly"), "then: got 'fly', expected"),
        (lambda c: c.cars[0].drive("east_loop", speed_mps=float("nan")), "speed_mps: got nan"),
    ],
)
def test_what_cannot_be_is_refused_in_words(
    city: City, call: Callable[[City], object], words: str
) -> None:
    with pytest.raises(ScmError) as error:
        call(city)
    assert words in str(error.value)


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


def test_a_city_that_does_not_run_is_reported_within_seconds() -> None:
    began_ns = WallClock().now_ns()
    endpoint = free_endpoint()
    with pytest.raises(LinkError, match="is `scm up` running"), open_city(connect=endpoint):
        pytest.fail("there is no city to open")
    assert WallClock().now_ns() - began_ns < 30e9


@pytest.fixture
def live(monkeypatch: pytest.MonkeyPatch) -> Iterator[Router]:
    """A router with a world that runs."""
    monkeypatch.setattr("scm.fleet.REPLY_TIMEOUT_S", 120.0)
    world = WorldPart(load_map("driving_school"))
    stop = threading.Event()
    with Router(free_endpoint()) as router, ZenohBus("city", "world", router.listen) as bus:
        running = threading.Thread(target=run, args=(world, bus, WallClock(), stop))
        running.start()
        try:
            yield router
        finally:
            stop.set()
            running.join()


def test_a_live_script_that_fails_takes_all_its_cars_along(live: Router) -> None:
    with pytest.raises(KeyError, match="in the middle"):
        fail_in_the_middle(live.listen)
    with open_city(connect=live.listen) as city:
        names = [city.spawn(name=name).name for name in ("a", "b", "c")]
    assert names == ["a", "b", "c"]  # none of them is there any more


def fail_in_the_middle(endpoint: str) -> None:
    with open_city(connect=endpoint) as city:
        for name in ("a", "b", "c"):
            city.spawn(name=name)
        # Somebody else was quicker with the first: the others must go all the same.
        city.request(RemoveRequest(vehicle="a", reason="somebody else"), RemoveRequest.REPLY)
        msg = "in the middle"
        raise KeyError(msg)


def test_an_arrival_is_known_without_waiting_for_it() -> None:
    with open_city("driving_school") as city:
        journey = city.spawn().drive("east_loop", then="stop")
        city.run_for(60.0)
        assert journey.travel_time_s is not None
        assert 1.0 < journey.travel_time_s < 60.0


def test_a_new_car_of_an_old_name_has_not_arrived_yet() -> None:
    city_map = load_map("driving_school")
    with Lockstep([WorldPart(city_map), TrafficPart(city_map)]) as lockstep:
        before, after = City(LockstepLink(lockstep)), City(LockstepLink(lockstep))
        taxi = before.spawn(name="taxi")
        before.wait([taxi.drive("east_loop")])
        taxi.remove()
        journey = after.spawn(name="taxi").drive("east_loop")
        after.run_for(1.0)
        with pytest.raises(RunError, match="had not arrived: taxi"):
            after.wait([journey], timeout_s=0.1)


def test_a_live_script_loses_no_arrival_among_other_cars_reports(live: Router) -> None:
    with ZenohBus("city", "script", live.listen) as bus, ZenohBus("city", "n", live.listen) as n:
        link = LiveLink(bus)
        city = City(link)
        journeys = [city.spawn(name=name).drive("east_loop") for name in ("a", "b")]
        others, received = Mailbox(10_000), 0
        bus.subscribe(Trip, {"vehicle": "other"}, others)
        other = trip("other", "other-1")
        assert link.run_until(lambda: n.publish(other) or bool(others.drain()), 60.0)
        for journey in journeys:
            n.publish(trip(journey.vehicle, journey.trip_id, arrived_ns=3_000_000_000))
        for _ in range(1200):
            n.publish(other)

        def all_received() -> bool:
            nonlocal received
            received += len(others.drain())
            return received >= 1200

        assert link.run_until(all_received, 60.0)
        city.wait(journeys, timeout_s=20.0)
        assert [journey.travel_time_s for journey in journeys] == [2.0, 2.0]
        city.leave()


def trip(vehicle: str, trip_id: str, arrived_ns: int | None = None) -> Trip:
    return Trip(
        vehicle=vehicle,
        trip_id=trip_id,
        t_ns=0,
        route=("east_loop",),
        done_m=0.0,
        length_m=1.0,
        started_ns=1_000_000_000,
        arrived_ns=arrived_ns,
    )
