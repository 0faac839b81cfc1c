"""Effects at their neutral values leave the trajectory as it was, bit for bit."""

from dataclasses import replace

import numpy as np

from scm.geometry import Pose2
from scm.vehicles.car import Quantity, all_terms, load_car
from scm.vehicles.compiler.assemble import write_page
from scm.vehicles.fleet import Fleet
from scm.vehicles.term import flat

FEW = (
    "suspension_spring", "tyre_contact", "tyre_longitudinal", "tyre_lateral", "motor_dc",
    "steer_limit", "ackermann",
)  # fmt: skip


def car_with(names, neutral):
    """Nigel with these effects, those of `neutral` at their neutral values."""
    terms = flat(all_terms()[name] for name in names)
    nigel = load_car("nigel")
    values = dict(nigel.values)
    for term in terms:
        for param in term.params:
            number = param.default
            if term.name.startswith(tuple(neutral)):
                number = term.neutral.get(param.name, number)
            if param.key not in values or term.name.startswith(tuple(neutral)):
                values[param.key] = Quantity(number, None, param.unit, "test")
    return replace(nigel, name="few", terms=terms, values=values)


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
    neutral = [name for name, term in all_terms().items() if term.neutral and name not in FEW]
    assert len(neutral) >= 12
    few, many = drive(car_with(FEW, [])), drive(car_with([*FEW, *neutral], neutral))
    for name in ("x", "y", "z", "roll", "pitch", "yaw", "speed", "wheel_speed", "wheel_load"):
        assert np.array_equal(getattr(few, name), getattr(many, name)), name
    assert few.x[0] > 0.1


def test_nigel_with_every_neutral_effect_it_lacks_drives_as_before_bit_for_bit():
    nigel = load_car("nigel")
    own, set_already = (
        {term.name for term in nigel.terms},
        {term.sets for term in nigel.terms if term.sets},
    )
    lacking = [
        term
        for term in all_terms().values()
        if term.neutral and term.name not in own and term.sets not in set_already
    ]
    numbers = {
        param.key: part.neutral[param.name]
        for term in lacking
        for part in flat([term])
        for param in part.params
        if param.name in part.neutral
    }
    assert len(lacking) >= 30
    before, after = drive(nigel), drive(nigel.with_terms([t.name for t in lacking], numbers))
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
