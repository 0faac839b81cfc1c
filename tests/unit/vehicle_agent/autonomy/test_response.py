import numpy as np
import pytest

from scm.vehicles.car import load_car
from vehicle_agent.autonomy.plan import limits_of
from vehicle_agent.autonomy.response import STEERINGS, THROTTLES, _delay_and_lag, response_of

NIGEL = load_car("nigel")
PLAIN = response_of(NIGEL)
DELAYED = response_of(
    NIGEL.with_terms(
        ["drive_deadband", "drive_delay"], {"drive.deadband": 0.2, "drive.delay_s": 0.15}
    )
)


def test_throttle_gives_the_speed_that_was_asked_for():
    for speed in (-0.2, -0.05, 0.05, 0.1, 0.2):
        assert PLAIN.speed_of(PLAIN.throttle_for(speed)) == pytest.approx(speed, abs=1e-6)
    assert PLAIN.throttle_for(0.0) == 0.0
    assert PLAIN.throttle_for(9.0) == pytest.approx(1.0)
    assert PLAIN.throttle_for(-9.0) == pytest.approx(-1.0)


def test_top_speed_and_steering_angle_are_those_of_the_car():
    assert PLAIN.speed_of(1.0) == pytest.approx(0.26, rel=0.1)
    limit = NIGEL.value("steering.limit_rad")
    assert PLAIN.angle_of(1.0) == pytest.approx(limit, rel=0.02)
    assert PLAIN.angle_of(-1.0) == pytest.approx(-limit, rel=0.02)
    assert PLAIN.steering_for(PLAIN.angle_of(0.3)) == pytest.approx(0.3)


def test_dead_band_is_jumped_over():
    assert abs(DELAYED.speed_of(0.15)) < 0.005
    assert DELAYED.throttle_for(0.02) > 0.2
    assert DELAYED.throttle_for(-0.02) < -0.2
    assert PLAIN.throttle_for(0.02) < 0.15
    assert DELAYED.speed_of(DELAYED.throttle_for(0.1)) == pytest.approx(0.1, abs=1e-6)


def test_delay_of_the_drive_is_found():
    assert PLAIN.drive_delay_s < 0.05
    assert DELAYED.drive_delay_s - PLAIN.drive_delay_s == pytest.approx(0.15, abs=0.03)
    assert DELAYED.drive_lag_s == pytest.approx(PLAIN.drive_lag_s, abs=0.05)


def test_delay_of_the_steering_is_found():
    late = response_of(NIGEL.with_terms(["steer_delay"], {"steering.delay_s": 0.2}))
    assert late.steer_delay_s - PLAIN.steer_delay_s == pytest.approx(0.2, abs=0.03)
    assert late.drive_delay_s == pytest.approx(PLAIN.drive_delay_s, abs=0.02)


def test_delay_and_lag_of_a_first_order_answer_are_told_apart():
    t = 0.01 * np.arange(1, 501)
    answer = 0.3 * (1.0 - np.exp(-np.maximum(t - 0.2, 0.0) / 0.5))
    assert _delay_and_lag(answer) == pytest.approx((0.2, 0.5), abs=0.02)


def test_tables_rise():
    for values, at in ((DELAYED.speeds_mps, THROTTLES), (DELAYED.angles_rad, STEERINGS)):
        assert values.shape == at.shape
        assert (np.diff(values) >= 0.0).all()


def test_limits_are_what_the_car_reaches_to_either_side():
    weak = NIGEL.with_terms(
        ["steer_gain", "steer_trim", "drive_gain"],
        {"steering.gain": 0.8, "steering.trim_rad": 0.05, "drive.gain": 0.7},
    )
    stated = limits_of(weak)
    limits = response_of(weak).limited(stated)
    assert limits.steering_rad == pytest.approx(0.8 * stated.steering_rad - 0.05, abs=0.003)
    assert limits.speed_mps == pytest.approx(0.9 * 0.7 * 0.26, rel=0.1)
    assert limits.wheelbase_m == stated.wheelbase_m
    assert PLAIN.limited(stated).speed_mps == stated.speed_mps
