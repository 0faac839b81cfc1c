"""Effects at their neutral values leave the trajectory as it was, bit for bit."""

from dataclasses import replace

import numpy as np

from scm.geometry import Pose2
from scm.vehicles.car import Quantity, all_terms, load_car
from scm.vehicles.compiler.assemble import write_page
from scm.vehicles.fleet import Fleet
from scm.vehicles.term import flat
from tests.every_effect import at_rest

FEW = (
    "suspension_spring", "tyre_contact", "tyre_longitudinal", "tyre_lateral", "motor_dc",
    "steer_limit", "ackermann",
)  # fmt: skip


def only(names):
    """Nigel with these effects alone."""
    nigel = load_car("nigel")
    return replace(nigel, name="few", terms=flat(all_terms()[name] for name in names))


def all_neutral_but(names):
    """Nigel with every effect, at its neutral values unless named."""
    car = at_rest()
    neutral = [term for term in car.terms if term.name not in names]
    values = {
        param.key: Quantity(term.neutral.get(param.name, param.default), None, param.unit, "test")
        for term in neutral
        for param in term.params
    }
    return replace(car, values=car.values | values), neutral


def drive(car):
    fleet = Fleet(car, 3)
    for row in range(3):
        fleet.add(Pose2(0.0, float(row), 0.4 * row), speed=0.1 * row)
        fleet.throttle[row], fleet.steering[row] = 0.9 - 0.4 * row, 0.5 - 0.7 * row
    fleet.advance(1.0)
    fleet.steering[:] *= -1.0
    fleet.throttle[1] = 0.0
    fleet.advance(1.0)
    return fleet


def test_every_neutral_effect_at_once_leaves_the_trajectory_bit_for_bit():
    car, neutral = all_neutral_but(FEW)
    assert len(neutral) >= 50
    few, many = drive(only(FEW)), drive(car)
    for name in ("x", "y", "z", "roll", "pitch", "yaw", "speed", "wheel_speed", "wheel_load"):
        assert np.array_equal(getattr(few, name), getattr(many, name)), name
    assert few.x[0] > 0.1


def test_nigel_with_every_neutral_effect_it_lacks_drives_as_before_bit_for_bit():
    nigel, car = load_car("nigel"), at_rest()
    assert len(car.terms) >= len(nigel.terms) + 30
    before, after = drive(nigel), drive(car)
    for name in ("x", "y", "z", "roll", "pitch", "yaw", "speed", "wheel_speed", "wheel_load"):
        assert np.array_equal(getattr(before, name), getattr(after, name)), name
    assert before.x[0] > 0.1


def test_a_car_carries_no_trace_of_an_effect_that_it_does_not_list():
    nigel = load_car("nigel")
    page = write_page(nigel.terms)
    own = {term.name for term in flat(nigel.terms)}
    others = [term for term in flat(all_terms().values()) if term.name not in own]
    assert [term.name for term in others if term.name in page] == []
    assert "fade_strength" not in page
    fading = write_page(nigel.with_terms(["motor_fade"]).terms)
    assert "motor_fade" in fading
    assert "fade_strength" in fading
