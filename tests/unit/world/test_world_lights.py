"""Lights of hosted cars: switched by request, or by whoever holds the lease."""

import msgspec

from scm.v2x.message import Refused
from scm.v2x.messages.light_request import LightReply, LightRequest
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.vehicle_state import VehicleState


def lit(city, seconds=1.0):
    """Return every lamp that was on at some time of a second."""
    before = len(city.said)
    city.run_for(seconds)
    reports = [said for said in city.said[before:] if isinstance(said, VehicleState)]
    return {name for report in reports for name in report.lights}


def test_a_request_switches_headlights_and_indicators(city):
    city.ask(SpawnRequest(vehicle="n1"))
    reply = city.ask(LightRequest(vehicle="n1", headlights="high", indicators="left"))
    assert reply == LightReply(vehicle="n1", headlights="high", indicators="left")
    assert lit(city) == {"head_low", "head_high", "tail", "brake", "left"}


def test_a_leased_cars_lights_are_its_holders(city):
    city.ask(SpawnRequest(vehicle="n1"))
    lease = city.lease()
    refused = city.ask(LightRequest(vehicle="n1", headlights="low"))
    assert isinstance(refused, Refused)
    assert refused.code == "owned"
    command = city.command(lease, 0)
    city.run(1, msgspec.structs.replace(command, headlights="low", indicators="hazard"))
    city.run(1, city.command(lease, 1))
    assert {"head_low", "left", "right"} <= lit(city, 0.1)


def test_a_command_without_the_lease_switches_nothing(city):
    city.ask(SpawnRequest(vehicle="n1"))
    lease = city.lease()
    command = city.command(lease, 0)
    city.run(1, msgspec.structs.replace(command, headlights="low", epoch=lease.epoch - 1))
    assert "head_low" not in lit(city, 0.1)


def test_lights_of_an_unknown_car_are_refused(city):
    assert city.ask(LightRequest(vehicle="n9", headlights="low")).code == "not_found"
