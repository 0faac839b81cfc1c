"""A CAM goes at 1 Hz at rest, up to 10 Hz in motion, and calms down after three quiet ones."""

import math

import pytest

from scm.clock import NS_PER_MS
from scm.v2x.cam_trigger import CamTrigger
from scm.v2x.messages.vehicle_state import VehicleState


def a_state(x_m=0.0, y_m=0.0, yaw_rad=0.0, speed_mps=0.0):
    return VehicleState(
        vehicle="n1",
        t_ns=0,
        seq=0,
        x_m=x_m,
        y_m=y_m,
        yaw_rad=yaw_rad,
        speed_mps=speed_mps,
        yaw_rate_radps=0.0,
        steering_rad=0.0,
        throttle=0.0,
        source="simulated",
    )


def sends(state_at, until_ms, trigger=None, step_ms=20):
    trigger = trigger or CamTrigger()
    times = range(0, until_ms, step_ms)
    return [t for t in times if trigger.due(state_at(t), t * NS_PER_MS)]


def test_the_first_cam_goes_at_once_and_a_standing_car_sends_once_a_second():
    assert sends(lambda _t: a_state(), 3100) == [0, 1000, 2000, 3000]


@pytest.mark.parametrize(
    ("moved", "due"),
    [
        (a_state(x_m=0.285), False),
        (a_state(x_m=0.287), True),
        (a_state(yaw_rad=math.radians(3.9)), False),
        (a_state(yaw_rad=math.radians(-4.1)), True),
        (a_state(speed_mps=0.035), False),
        (a_state(speed_mps=-0.036), True),
    ],
)
def test_motion_beyond_a_threshold_of_the_enlarged_city_sends_after_100_ms(moved, due):
    trigger = CamTrigger()
    assert trigger.due(a_state(), 0)
    assert not trigger.due(moved, 99 * NS_PER_MS)
    assert trigger.due(moved, 100 * NS_PER_MS) is due


def test_heading_across_pi_is_a_small_change():
    trigger = CamTrigger()
    assert trigger.due(a_state(yaw_rad=math.pi - 0.01), 0)
    assert not trigger.due(a_state(yaw_rad=-math.pi + 0.01), 200 * NS_PER_MS)


def test_a_car_in_a_tight_bend_sends_at_most_at_10_hz():
    times = sends(lambda t: a_state(yaw_rad=math.radians(t)), 1000)
    assert times == list(range(0, 1000, 100))


def test_the_pace_of_motion_is_kept_for_three_cams_and_then_falls_back():
    def jump_at_200_ms(t_ms):
        return a_state(x_m=1.0 if t_ms >= 200 else 0.0)

    assert sends(jump_at_200_ms, 2900) == [0, 200, 400, 600, 800, 1800, 2800]


def test_motion_starts_the_count_of_three_again():
    jumps = (200, 800)

    def jumping(t_ms):
        return a_state(x_m=float(sum(t_ms >= jump for jump in jumps)))

    assert sends(jumping, 1900) == [0, 200, 400, 600, 800, 1000, 1200, 1400]
