"""The least times follow from how cars move, and with the right sign."""

import pytest

from scm.traffic.signals.timing import NIGEL, CarFacts, clearance_s, min_green_s, yellow_s


def test_yellow_lets_who_cannot_stop_reach_the_line():
    car = CarFacts(speed_mps=0.26, decel_mps2=0.5, reaction_s=0.3)
    assert yellow_s(car) == pytest.approx(0.56)
    distance_to_stop_m = 0.26 * 0.3 + 0.26**2 / (2 * 0.5)
    assert 0.26 * yellow_s(car) == pytest.approx(distance_to_stop_m)


def test_clearance_lets_the_slowest_car_out_with_all_its_length():
    car = CarFacts(slow_mps=0.26, length_m=0.2)
    assert clearance_s(car, 0.5, limit_mps=1.0) == pytest.approx(0.7 / 0.26)


def test_a_speed_limit_below_the_slowest_car_counts():
    assert clearance_s(NIGEL, 0.5, limit_mps=0.1) == pytest.approx(0.8 / 0.1)
    assert min_green_s(NIGEL, limit_mps=0.1) > min_green_s(NIGEL, limit_mps=1.0)


def test_a_longer_queue_needs_a_longer_green_by_one_headway_a_car():
    more_s = min_green_s(NIGEL, 1.0, queue=3) - min_green_s(NIGEL, 1.0, queue=2)
    assert more_s == pytest.approx(0.3 + 0.45 / 0.217)


def test_the_second_car_of_a_queue_passes_the_line_within_the_least_green():
    dt, t, v, s = 1e-4, 0.0, 0.0, 0.0
    while s < NIGEL.length_m + NIGEL.gap_m:
        v = min(v + NIGEL.accel_mps2 * dt, NIGEL.slow_mps) if t > 2 * NIGEL.reaction_s else 0.0
        s, t = s + v * dt, t + dt
    assert t == pytest.approx(min_green_s(NIGEL, 1.0), abs=1e-3)
