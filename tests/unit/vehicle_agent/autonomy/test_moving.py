import math

import numpy as np
import pytest

from scm.vehicles.car import load_car
from scm.vehicles.driver import Other
from vehicle_agent.autonomy.moving import comes_near, discs_of
from vehicle_agent.autonomy.plan import limits_of

LIMITS = limits_of(load_car("nigel"))
STANDS = np.zeros((20, 3))
WHEN_S = np.linspace(0.0, 2.0, 20)


def crossing(x=0.1, y=-0.6, speed=0.3, yaw=0.5 * math.pi):
    return Other(x=x, y=y, yaw=yaw, speed=speed, length=0.3, width=0.175)


def test_discs_cover_the_car_and_move_with_it():
    discs = discs_of([crossing()])
    assert discs[:, 3] == pytest.approx(0.3)
    assert discs[:, 2] == pytest.approx(0.0)
    for along in np.linspace(-0.15, 0.15, 13):
        for across in (-0.0875, 0.0875):
            off = np.hypot(discs[:, 0] - 0.1 - across, discs[:, 1] + 0.6 - along)
            assert (off <= discs[:, 4] + 1e-9).any()


def test_car_that_stands_is_left_to_the_scanner():
    assert len(discs_of([crossing(speed=0.01)])) == 0
    assert not comes_near(STANDS, WHEN_S, discs_of([]), LIMITS)


def test_car_that_will_cross_the_way_comes_near():
    assert comes_near(STANDS, WHEN_S, discs_of([crossing()]), LIMITS)


@pytest.mark.parametrize("other", [crossing(speed=0.1), crossing(x=0.7), crossing(speed=-0.3)])
def test_car_that_is_too_slow_or_goes_elsewhere_does_not(other):
    assert not comes_near(STANDS, WHEN_S, discs_of([other]), LIMITS)
