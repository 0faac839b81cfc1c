"""What a city refuses from its neighbour: no message of another city may take its world down."""

import pytest
from msgspec.structs import replace

from scm.v2x.messages.handover_request import HandoverReply, NamedValues
from scm.world.handover import reply_to_handover
from scm.world.part import WorldPart
from tests.unit.world.test_handover import ENDLESS, handed


@pytest.fixture
def east():
    return WorldPart(ENDLESS["east"], 0, room=2, city="east").world


def with_values(kind, name, *values):
    """Return a change of one variable or parameter of a car."""
    return lambda state: {
        kind: tuple(
            replace(one, values=values) if one.name == name else one for one in getattr(state, kind)
        )
    }


def with_both_yaws(state):
    """Return a change to yaws that are finite, and whose sum is not."""
    changed = with_values("variables", "yaw", 1.7e308)(state)
    return {**changed, "origin": (*state.origin[:2], 1.7e308)}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (with_both_yaws, "beyond every physical range"),
        (with_values("variables", "yaw", 1e300), "beyond every physical range"),
        (lambda state: {"origin": (*state.origin[:2], 8.0)}, "origin: got a yaw of 8 rad"),
        (with_values("parameters", "mass", -1.0), "body.mass_kg = -1: expected"),
        (with_values("parameters", "mass", 1e300), "body.mass_kg = 1e+300: expected"),
        (lambda _: {"drawn_as": -1.0}, "drawn_as: got -1, expected at least 0"),
        (lambda s: {"driver": replace(s.driver, speed_mps=-1.0)}, "speed_mps: got -1"),
    ],
)
def test_numbers_that_no_car_has_are_refused_and_leave_no_car(east, change, words):
    reply = reply_to_handover(east, handed(change), 0, [])
    assert words in reply.detail
    assert not east.cars.hosted
    assert not east.cars.arrays.used.any()


def test_what_fails_while_a_car_is_put_together_is_a_refusal(east, monkeypatch):
    def fail(*_):
        raise ValueError("math domain error")

    monkeypatch.setattr("scm.world.handover.put_state", fail)
    reply = reply_to_handover(east, handed(), 0, [])
    assert "math domain error" in reply.detail
    assert not east.cars.arrays.used.any()


def test_numbers_that_this_city_does_not_know_are_left_out(east):
    more = NamedValues(name="wings", values=(1.0, 2.0))
    request = handed(lambda state: {"variables": (*state.variables, more)})
    assert isinstance(reply_to_handover(east, request, 0, []), HandoverReply)
