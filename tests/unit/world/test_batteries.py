"""Batteries as the world tells them: in its snapshot, and once when they run low."""

import math

import pytest

from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.alerts import LOW_CHARGE, RECHARGED, LowBatteries


def low(city):
    return [event.text for event in city.heard(CityEvent) if event.name == "battery_low"]


def test_a_low_battery_is_told_once_and_again_after_it_was_charged(city):
    city.join("n7")
    seq = iter(range(1, 100))

    def run_with(charge):
        for _ in range(3):
            city.run_for(0.5, city.report(seq=next(seq), battery_v=11.0, battery_charge=charge))

    run_with(0.21)
    assert low(city) == []
    run_with(0.19)
    run_with(0.22)
    run_with(None)
    run_with(0.15)
    assert low(city) == ["the battery of n7 is low: 19 % left"]
    run_with(0.9)
    run_with(0.1)
    assert low(city)[1:] == ["the battery of n7 is low: 10 % left"]


def test_low_is_below_a_fifth_and_charged_is_three_tenths():
    batteries = LowBatteries()
    assert batteries.news({"n7": LOW_CHARGE}) == []
    assert batteries.news({"n7": LOW_CHARGE - 0.001}) == ["n7"]
    assert batteries.news({"n7": RECHARGED - 0.001}) == []
    assert batteries.news({"n7": LOW_CHARGE - 0.001}) == []
    assert batteries.news({"n7": RECHARGED}) == []
    assert batteries.news({"n7": LOW_CHARGE - 0.001}) == ["n7"]


def test_another_car_under_the_name_of_one_that_has_left_is_told_too():
    batteries = LowBatteries()
    assert batteries.news({"n7": 0.1}) == ["n7"]
    assert batteries.news({}) == []
    assert batteries.news({"n7": 0.1}) == ["n7"]


@pytest.mark.parametrize("absurd", [-0.1, 1.1, math.nan])
def test_a_charge_that_is_no_share_is_not_believed_and_its_car_still_is(city, absurd):
    city.join("n7")
    city.run_for(1.5, city.report(seq=1, x=2.0, battery_v=11.0, battery_charge=absurd))
    assert (city.shown("n7").x_m, city.shown("n7").battery_charge) == (2.0, None)
    assert low(city) == []


def test_a_hosted_car_tells_its_battery_and_a_nearly_empty_one_is_low(city):
    city.ask(SpawnRequest(vehicle="n1"))
    car = city.world.cars.hosted["n1"]
    city.world.cars.garage.drain(0.9 * 3600.0 * 5.2 / 0.8)
    city.run_for(1.1)
    assert city.shown("n1").battery_charge == pytest.approx(0.1, abs=1e-3)
    assert low(city) == ["the battery of n1 is low: 10 % left"]
    state = [s for s in city.heard(VehicleState) if s.vehicle == car.name][-1]
    assert state.battery_v == pytest.approx(city.shown("n1").battery_v, abs=1e-3)
    assert state.battery_v == pytest.approx(3 * 3.69 - 0.03 * 0.8, abs=0.01)
    city.world.remove("n1")
    city.ask(SpawnRequest(vehicle="n1"))
    city.run_for(0.1)
    assert city.shown("n1").battery_charge > 0.99, "another car in its place comes with a full one"


def test_a_leased_car_tells_how_old_its_newest_command_is(city):
    city.ask(SpawnRequest(vehicle="n1"))
    lease = city.ask(LeaseRequest(vehicle="n1", owner="desk", verb="acquire", ttl_ms=2000))
    city.run_for(0.1)
    assert city.shown("n1").command_age_ms is None, "none came yet"
    told = {"vehicle": "n1", "t_ns": 0, "epoch": lease.epoch, "steering": 0.0, "throttle": 0.1}
    city.run(1, DriveCommand(seq=1, **told))
    city.run_for(0.2)
    state = [s for s in city.heard(VehicleState) if s.vehicle == "n1"][-1]
    assert state.command_age_ms == pytest.approx(200.0, abs=21.0)
    city.ask(LeaseRequest(vehicle="n1", owner="desk", verb="release", epoch=lease.epoch))
    city.run_for(0.1)
    assert city.shown("n1").command_age_ms is None, "it drives itself"


def test_the_age_of_an_agent_s_command_grows_while_it_reports_nothing(city):
    city.join("n7")
    city.run(1, city.report(seq=1, command_age_ms=30.0))
    city.run_for(0.2)
    assert city.shown("n7").command_age_ms == pytest.approx(230.0, abs=51.0)
