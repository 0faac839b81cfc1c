"""Which lamps are on."""

import pytest

from scm.clock import NS_PER_MS
from scm.vehicles.guard import Guarded
from vehicle_agent.lights import lights

DRIVE = Guarded(0.5, 0.0, "drive", hazard=False)
LOST = Guarded(0.0, 0.0, "lost", hazard=True)


def test_a_driving_car_shows_its_tail_only():
    assert lights(DRIVE, 0.2, 0) == ("tail",)


@pytest.mark.parametrize("mode", ["stop", "lost"])
def test_a_stop_shows_the_brake_light_while_still_rolling(mode):
    assert "brake" in lights(Guarded(0.0, 0.0, mode, hazard=False), 0.2, 0)


def test_standing_without_throttle_shows_the_brake_light():
    assert "brake" in lights(Guarded(0.0, 0.0, "drive", hazard=False), 0.0, 0)


def test_rolling_backwards_shows_the_reverse_light():
    assert "reverse" in lights(DRIVE, -0.1, 0)


@pytest.mark.parametrize(("t_ms", "lit"), [(0, True), (499, True), (500, False), (999, False)])
def test_hazard_lights_flash_both_sides_half_a_second_each(t_ms, lit):
    shown = lights(LOST, 0.0, t_ms * NS_PER_MS)
    assert ("left" in shown) is ("right" in shown) is lit
