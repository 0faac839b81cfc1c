"""Which lamps are on."""

import pytest

from scm.clock import NS_PER_MS
from scm.vehicles.lights import OFF, Switches, lamps

DARK_NS = 500 * NS_PER_MS


def test_a_driving_car_without_commands_shows_no_lamps():
    assert lamps(OFF, 0.5, 0.2, 0) == ()


@pytest.mark.parametrize(
    ("mode", "shown"),
    [
        ("off", ()),
        ("low", ("head_low", "tail")),
        ("high", ("head_low", "head_high", "tail")),
    ],
)
def test_tail_lamps_go_with_the_headlights_and_high_beam_keeps_the_low_one(mode, shown):
    assert lamps(Switches(headlights=mode), 0.5, 0.2, 0) == shown


@pytest.mark.parametrize(
    ("throttle", "speed", "lit"),
    [
        (0.0, 0.2, True),  # no throttle: the motors brake
        (0.0, 0.0, True),  # and hold
        (0.5, 0.0, True),  # below 0.05 m/s, as in the simulator
        (-0.5, 0.2, True),  # against the motion
        (0.5, -0.2, True),
        (0.5, 0.2, False),
        (-0.5, -0.2, False),
    ],
)
def test_brake_lamps_are_lit_when_braking_and_holding(throttle, speed, lit):
    assert ("brake" in lamps(OFF, throttle, speed, 0)) is lit


@pytest.mark.parametrize(("speed", "lit"), [(-0.1, True), (-0.001, False), (0.1, False)])
def test_reverse_lamps_are_lit_when_rolling_backwards(speed, lit):
    assert ("reverse" in lamps(OFF, -0.5, speed, 0)) is lit


@pytest.mark.parametrize(
    ("mode", "sides"),
    [("off", set()), ("left", {"left"}), ("right", {"right"}), ("hazard", {"left", "right"})],
)
def test_indicators_show_the_commanded_sides(mode, sides):
    assert set(lamps(Switches(indicators=mode), 0.5, 0.2, 0)) == sides


@pytest.mark.parametrize(("t_ms", "lit"), [(0, True), (499, True), (500, False), (999, False)])
def test_indicators_flash_half_a_second_each_on_the_clock_of_the_city(t_ms, lit):
    now_ns = (7000 + t_ms) * NS_PER_MS
    assert ("left" in lamps(Switches(indicators="left"), 0.5, 0.2, now_ns)) is lit


def test_a_lost_car_flashes_both_sides_with_any_command():
    shown = lamps(Switches(indicators="left"), 0.0, 0.2, 0, hazard=True)
    assert {"left", "right"} <= set(shown)
    assert "left" not in lamps(Switches(indicators="left"), 0.0, 0.2, DARK_NS, hazard=True)


def test_a_driver_about_to_turn_indicates_unless_commanded_otherwise():
    assert "right" in lamps(OFF, 0.5, 0.2, 0, turn="right")
    assert "right" not in lamps(Switches(indicators="left"), 0.5, 0.2, 0, turn="right")


def test_a_command_changes_only_what_it_names():
    low = OFF.updated("low", None)
    assert low == Switches("low", "off")
    assert low.updated(None, "hazard") == Switches("low", "hazard")
    assert low.updated(None, None) is low
