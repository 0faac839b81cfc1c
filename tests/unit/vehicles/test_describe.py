"""What people are told about a car and about effects."""

import pytest

from scm.errors import TermError
from scm.vehicles.car import all_terms, load_car
from scm.vehicles.describe import describe_car, warnings_of
from scm.vehicles.describe_effects import all_effects, describe_term, list_effects


def test_every_effect_and_fault_has_a_line():
    text = list_effects()
    for name in all_effects():
        assert f"\n  {name} " in text


def test_one_effect_is_described_with_its_parameters_and_neutral_values():
    text = describe_term("surface_patch")
    assert "surface_patch.radius_m  0.4      m     0.02 to 20" in text
    assert "floor_grip" in text
    for heading in ("Holds:", "Shows in:", "Source:"):
        assert heading in text


def test_a_sensor_fault_is_described_like_an_effect():
    assert "t_measured = t + delay" in describe_term("pose_latency")


def test_an_unknown_effect_is_refused_with_the_nearest_name():
    with pytest.raises(TermError, match=r"no effect .unterstear. .*mean .understeer."):
        describe_term("unterstear")


def test_silent_defaults_are_warned_of():
    said = " ".join(warnings_of(load_car("nigel")))
    assert "at their defaults" in said
    assert "tyre.vertical_stiffness_n_m" in said


def test_numbers_that_no_effect_reads_are_warned_of():
    nigel = load_car("nigel")
    few = nigel.with_terms([])
    terms = tuple(term for term in few.terms if not term.name.startswith("aero_drag"))
    said = list(warnings_of(type(few)(few.name, few.scale, few.path, terms, few.values)))
    assert "aero_drag is not listed, so nothing reads body.drag_quadratic_ns2_m2" in said


def test_a_car_that_tips_over_before_it_slides_is_warned_of():
    tall = load_car("nigel").with_terms([], {"body.cog_height_m": 0.1})
    assert any("rolls over" in text for text in warnings_of(tall))
    assert not any("rolls over" in text for text in warnings_of(load_car("nigel")))


def test_two_tyres_on_one_wheel_are_warned_of():
    said = list(warnings_of(load_car("nigel").with_terms(["tyre_combined"])))
    assert "tyre_lateral and tyre_combined_across add up in tyre_y: list one tyre" in said


def test_a_spread_that_leaves_the_bounds_is_warned_of():
    assert not any("past its bounds" in text for text in warnings_of(load_car("nigel")))


def test_values_stand_with_spread_unit_and_source():
    text = describe_car(load_car("nigel"))
    assert "2.4 ± 0.15" in text
    assert "[body]" in text
    assert "ours: box 0.28 x 0.19 m" in text
    assert len(all_terms()) > 50
