"""What the two published sketches do with a command."""

import math

import pytest

from vehicle_agent.emulate.sketches import SKETCHES, analog_write, servo_pulse

TWO, FOUR = SKETCHES["2wd"], SKETCHES["4wd"]


def steered(sketch, u):
    return sketch.steer(sketch.at_setup, u)


def driven(sketch, u):
    pins = sketch.drive(sketch.at_setup, u)
    return pins.reverse, pins.brake, pins.pwm


@pytest.mark.parametrize(
    ("u", "angle"),
    [
        (0.0, 97),
        (1.0, 127),
        (-1.0, 67),
        (0.5, 112),
        (0.99, 126),
        (-0.99, 67),
        (3.0, 180),
        (-4.0, 0),
    ],
)
def test_the_servo_goes_to_97_and_30_times_the_command_cut_off(u, angle):
    assert steered(TWO, u).servos_us == (544 + angle * 1856 // 180,)
    assert steered(TWO, u).servos_deg == pytest.approx((angle,), abs=0.1)


@pytest.mark.parametrize(
    ("u", "pulse"),
    [
        (14.9, 544),  # 544: no angle any more but a pulse
        (20.0, 697),
        (100.0, 2400),
        (1100.0, 544),  # 33097 is negative in 16 bits
        (math.nan, 544),
        (math.inf, 544),
        (-math.inf, 544),
    ],
)
def test_absurd_steering_turns_the_servo_somewhere(u, pulse):
    assert steered(TWO, u).servos_us == (pulse,)


@pytest.mark.parametrize(
    ("u", "pins"),
    [
        (0.4, (0, 0, 102)),
        (-0.4, (1, 0, 102)),
        (1.0, (0, 0, 255)),
        (-1.0, (1, 0, 255)),
        (0.0, (0, 1, 0)),
        (-0.0, (0, 1, 0)),
        (0.003, (0, 0, 0)),  # neither driven nor braked
        (1.01, (0, 0, 1)),  # wraps: 257
        (2.0, (0, 0, 254)),
        (-1.5, (1, 0, 126)),
        (math.nan, (0, 1, 0)),
        (math.inf, (0, 0, 0)),
        (-math.inf, (1, 0, 0)),
        (1e9, (0, 0, 0)),
    ],
)
def test_the_motor_gets_255_times_the_command_in_8_bits(u, pins):
    assert driven(TWO, u) == pins


def test_braking_leaves_the_direction_as_it_was():
    backward = TWO.drive(TWO.at_setup, -0.5)
    assert TWO.drive(backward, 0.0).reverse == 1


@pytest.mark.parametrize(("u", "pins"), [(0.4, (0, 0, 102)), (-0.4, (1, 0, 102)), (0.0, (0, 1, 0)),
                                         (0.003, (0, 1, 0)), (129.0, (1, 0, 129))])  # fmt: skip
def test_the_larger_car_drives_through_its_own_chip(u, pins):
    assert driven(FOUR, u) == pins


def test_the_larger_car_turns_its_inner_wheel_more():
    left, right = steered(FOUR, 1.0).servos_us
    assert (left, right) == (servo_pulse(90 - 40), servo_pulse(90 - 23))


def test_only_0_and_255_are_no_pulses():
    assert analog_write(0) == (0, 0.0)
    assert analog_write(255) == (255, 1.0)
    assert analog_write(256) == (0, 1 / 256)
    assert analog_write(-128) == (128, 129 / 256)
    assert analog_write(511) == (255, 1.0)
