"""A driver and a guard assume what the version of the car file in force says."""

import math
from dataclasses import replace

import pytest
from msgspec.structs import replace as replace_fields

from scm.maps.load import load_map
from scm.records.twins import TwinParameter, TwinVersion
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import load_car
from scm.vehicles.drivers.limits import limits_of
from scm.world.part import WorldPart
from vehicle_agent.agent import AgentPart
from vehicle_agent.changed_car import changed_car
from vehicle_agent.guard import GuardLimits, RealGuard, rectangle

MAP, NIGEL = load_map("driving_school"), limits_of(load_car("nigel"))
CRUISE = ("cruise_mps", 0.19, 0.20, 0.21, 0.217)


def status(*abilities, number=1):
    listed = tuple(
        TwinParameter(name=name, low=low, value=value, high=high, before=before)
        for name, low, value, high, before in abilities
    )
    given = TwinVersion(number=0, car="nigel", file="", made_ns=0, state="adopted")
    versions = given, replace_fields(given, number=1, abilities=listed)
    return TwinStatus(
        vehicle="n1", t_ns=0, car="nigel", state="watching", driven_s=1.0, version=number,
        versions=versions,
    )  # fmt: skip


def test_longer_way_to_stop_makes_the_driver_brake_more_softly():
    changed = changed_car(status(CRUISE, ("stopping_m", 0.05, 0.06, 0.08, 0.007)), NIGEL, MAP)
    assert changed.limits == replace(NIGEL, decel=pytest.approx(0.2**2 / 0.16))
    assert changed.unfit == ""


def test_driver_never_brakes_harder_than_before():
    better = status(CRUISE, ("stopping_m", 0.001, 0.002, 0.003, 0.007))
    assert changed_car(better, NIGEL, MAP).limits == NIGEL


def test_car_that_hardly_brakes_must_not_drive():
    changed = changed_car(status(CRUISE, ("stopping_m", 0.2, 0.25, 0.3, 0.007)), NIGEL, MAP)
    assert "version 1 of its car file: it may need 0.3 m to stop from 0.2 m/s" in changed.unfit


def test_car_that_gets_round_no_bend_must_not_drive_unless_it_never_did():
    wide = status(("turning_radius_m", 1.4, 1.5, 1.6, 0.25))
    assert "it turns on a radius of 1.60 m at best: lane" in changed_car(wide, NIGEL, MAP).unfit
    always = status(("turning_radius_m", 1.4, 1.5, 1.6, 1.5))
    assert changed_car(always, NIGEL, MAP).unfit == ""


@pytest.mark.parametrize("number", [math.nan, math.inf, -1.0])
def test_nonsense_changes_nothing(number):
    wrong = [(n, 0.1, number, 0.3, 0.2) for n in ("cruise_mps", "stopping_m", "turning_radius_m")]
    changed = changed_car(status(*wrong), NIGEL, MAP)
    assert (changed.limits, changed.decel_mps2, changed.unfit) == (NIGEL, None, "")


def test_guard_never_assumes_more_braking_than_given():
    guard = RealGuard(GuardLimits(rectangle(0.0, 0.0, 1.0, 1.0)))
    for decel_mps2, assumed in ((0.3, 0.3), (5.0, 1.0), (None, 1.0)):
        guard.assume_decel(decel_mps2)
        assert guard._limits.decel_mps2 == assumed


def test_car_stands_while_a_version_says_that_it_cannot_turn():
    with Lockstep([WorldPart(MAP), AgentPart("n1")]) as city:
        boxes = [city.subscribe(Subscription(kind)) for kind in (VehicleState, CityEvent)]

        def run(seconds):
            city.run_for(seconds)
            return [[item.message for item in box.drain()] for box in boxes]

        assert run(3.0)[0][-1].speed_mps > 0.1
        city.publish(status(("turning_radius_m", 1.4, 1.5, 1.6, 0.25)))
        states, events = run(1.5)
        assert abs(states[-1].speed_mps) < 0.01
        texts = [one.text for one in events if one.name == "limits_changed"]
        assert len(texts) == 1
        assert "n1 does not drive: version 1 of its car file: it turns on a radius" in texts[0]
        refused = city.call(RouteRequest(vehicle="n1", replaces="n1-1"))
        assert (refused.code, "it does not drive: version 1" in refused.detail) == ("owned", True)
        city.publish(status(number=0))
        states, events = run(2.0)
        assert states[-1].speed_mps > 0.1
        assert [one.text for one in events] == ["n1 may drive again"]
