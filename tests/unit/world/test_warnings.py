"""Hosted cars warn on the air where real stations would, and only there."""

from scm.geometry import Pose2
from scm.v2x.etsi.convert import station_id
from scm.v2x.etsi.events import (
    ACCIDENT,
    DANGEROUS_SITUATION,
    EMERGENCY_BRAKE,
    STATIONARY_VEHICLE,
)
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.denm import DenmRx, DenmTx
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.stop_request import StopRequest

CARS = (("n1", "nigel"), ("n2", "nigel"), ("n3", "nigel"), ("n4", "nigel"))


def causes(city):
    return [
        None if situation is None else situation.event_type.cause
        for situation in (frame.body.situation_container for frame in city.heard(DenmTx))
    ]


def test_cars_that_drive_brake_and_wait_at_a_dark_light_warn_of_nothing(make_city):
    city = make_city(hosted=CARS)
    city.run_for(20.0)
    assert city.world.cars.arrays.speed.max() < 0.02, "all wait by now"
    assert causes(city) == []


def test_a_car_that_was_given_up_warns_until_it_drives_again(make_city):
    city = make_city(hosted=CARS[:1])
    lease = city.lease()
    city.run_for(0.5, city.command(lease, 1, 0.5))
    city.run_for(6.0)
    assert "lease_lost" in city.events()
    warned = city.heard(DenmTx)
    assert set(causes(city)) == {STATIONARY_VEHICLE}
    assert len(warned) in (3, 4, 5), "once a second from two seconds on"
    assert {frame.body.station_id for frame in warned} == {station_id("n1")}
    rsu = [f for f in city.heard(DenmRx) if f.receiver.startswith("rsu-")]
    assert len(rsu) == len(warned)
    told = [event.text for event in city.heard(CityEvent) if event.name == "denm"]
    assert told == ["n1 warns of a vehicle that stands"]
    city.said.clear()
    city.ask(RouteRequest(vehicle="n1"))
    city.run_for(1.5)
    assert city.heard(DenmTx)[0].body.management_container.termination == 0
    assert "denm" in city.events()


def test_a_car_that_brakes_as_hard_as_it_can_warns_of_that(make_city):
    city = make_city(hosted=CARS[:1])
    lease = city.lease()
    for seq in range(1, 50):
        city.run(1, city.command(lease, seq, 1.0 if seq < 35 else -1.0))
    assert (DANGEROUS_SITUATION, EMERGENCY_BRAKE) in {
        (event.cause, event.subcause)
        for event in (f.body.situation_container.event_type for f in city.heard(DenmTx))
    }
    told = [event.text for event in city.heard(CityEvent) if event.name == "denm"]
    assert told[:1] == ["n1 warns of its hard braking"]


def test_a_stop_of_the_whole_city_is_no_event_of_a_car(make_city):
    city = make_city(hosted=CARS)
    city.run_for(2.0)
    city.ask(StopRequest(engaged=True, by="ann"))
    city.run_for(5.0)
    assert causes(city) == []


def test_two_cars_that_meet_both_warn_of_an_accident(make_city):
    city = make_city(hosted=CARS[:1])
    pose = city.world.cars.hosted["n1"].pose
    there = city.world.host("n2", "nigel", pose @ Pose2(0.34, 0.0, 0.0), city.now)
    assert there.name == "n2"
    lease = city.lease()
    for seq in range(1, 60):
        city.run(1, city.command(lease, seq, 1.0))
    assert "contact" in city.events()
    warned = {f.station for f in city.heard(DenmTx)}
    assert warned == {"n1", "n2"}
    assert set(causes(city)) == {ACCIDENT}


def test_a_car_that_stands_within_a_junction_warns(make_city):
    city = make_city(hosted=CARS[:1])
    world = city.world
    junction = world.city_map.junctions[0]
    inside = junction.groups[0].movements[0]
    lane = world.roads.lane(inside.lane)
    car = world.host("n5", "nigel", lane.at(0.5 * (inside.from_m + inside.to_m) - 0.08), city.now)
    city.ask(RouteRequest(vehicle="n5"))
    world.drivers.halt(car.index)
    world.drivers.throttle[car.index] = 0.0
    city.run_for(3.0)
    assert {f.station for f in city.heard(DenmTx)} == {"n5"}
    assert set(causes(city)) == {STATIONARY_VEHICLE}
