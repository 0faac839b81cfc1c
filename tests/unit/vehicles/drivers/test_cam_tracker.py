"""The cars around, as their CAMs tell."""

import math

import pytest

from scm.clock import NS_PER_S
from scm.geometry import Pose2
from scm.v2x.etsi.convert import cam_of
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.drivers.cam_tracker import CamTracker
from scm.vehicles.drivers.cars_ahead import REACH


def cam(name="n1", x_m=1.0, y_m=2.0, yaw_rad=math.pi / 2, speed_mps=0.2, yaw_rate_radps=0.0):
    state = VehicleState(
        vehicle=name,
        t_ns=0,
        seq=1,
        x_m=x_m,
        y_m=y_m,
        yaw_rad=yaw_rad,
        speed_mps=speed_mps,
        yaw_rate_radps=yaw_rate_radps,
        steering_rad=0.0,
        throttle=0.0,
        source="simulated",
    )
    return cam_of(state, length_m=0.30, width_m=0.175, front_m=0.23)


def test_a_car_is_where_its_middle_is():
    cars = CamTracker()
    cars.receive(cam(), 0)
    (other,) = cars.others(0)
    assert (other.x, other.y) == (pytest.approx(1.0, abs=2e-3), pytest.approx(2.08, abs=2e-3))
    assert other.yaw == pytest.approx(math.pi / 2, abs=2e-3)


def test_it_is_moved_on_at_its_last_speed_for_a_second_at_most():
    cars = CamTracker()
    cars.receive(cam(), 0)
    assert cars.others(NS_PER_S // 2)[0].y == pytest.approx(2.18, abs=3e-3)
    assert cars.others(2 * NS_PER_S)[0].y == pytest.approx(2.28, abs=3e-3)


def test_it_is_turned_on_at_its_last_yaw_rate():
    cars = CamTracker()
    cars.receive(cam(yaw_rate_radps=0.4), 0)
    assert cars.others(NS_PER_S // 2)[0].yaw == pytest.approx(math.pi / 2 + 0.2, abs=3e-3)


def test_a_newer_cam_replaces_the_older():
    cars = CamTracker()
    cars.receive(cam(), 0)
    cars.receive(cam(x_m=3.0), 10)
    (other,) = cars.others(10)
    assert other.x == pytest.approx(3.0, abs=2e-3)


def test_a_silent_car_is_forgotten_after_three_seconds():
    cars = CamTracker()
    cars.receive(cam(), 0)
    assert len(cars.others(3 * NS_PER_S)) == 1
    assert cars.others(3 * NS_PER_S + 1) == ()


def test_the_order_does_not_depend_on_who_spoke_first():
    first, second = CamTracker(), CamTracker()
    for cars, names in ((first, ("n1", "n2")), (second, ("n2", "n1"))):
        for name in names:
            cars.receive(cam(name), 0)
    assert first.others(0) == second.others(0)


@pytest.mark.parametrize("speed_mps", [0.0, 0.25, 5.0, -1.0])
def test_only_cars_that_no_driver_looks_at_are_left_out_for_being_far(speed_mps):
    here = Pose2(0.0, 0.0, 0.0)
    for x_m in (-30.0, -2.5, -1.0, 0.0, 1.0, 2.5, 8.0, 30.0):
        for yaw_rad in (-2.0, 0.0, 1.0, math.pi):
            cars = CamTracker()
            cars.receive(cam(x_m=x_m, y_m=0.5, yaw_rad=yaw_rad, speed_mps=speed_mps), 0)
            for now_ns in (0, NS_PER_S, 3 * NS_PER_S):
                (other,) = cars.others(now_ns)
                left_out = cars.others(now_ns, here) == ()
                assert not (left_out and math.hypot(other.x, other.y) < REACH)


def test_cars_at_the_other_end_of_a_large_city_are_left_out():
    cars = CamTracker()
    cars.receive(cam(x_m=10.0), 0)
    assert cars.others(0, Pose2(0.0, 0.0, 0.0)) == ()


def hearing(gaps_s, name="n1", cars=None, start_s=0.0):
    cars, at_s = cars or CamTracker(), start_s
    for gap_s in gaps_s:
        at_s += gap_s
        cars.receive(cam(name), round(at_s * NS_PER_S))
    return cars, round(at_s * NS_PER_S)


def test_without_cams_reception_is_poor():
    assert not CamTracker().reception_is_good(0)


def test_one_cam_a_second_is_good_reception_until_it_stops():
    cars, now_ns = hearing([1.0] * 8)
    assert cars.reception_is_good(now_ns)
    assert cars.reception_is_good(now_ns + 2 * NS_PER_S)
    assert not cars.reception_is_good(now_ns + 3 * NS_PER_S)


def test_one_frame_in_ten_is_too_little():
    cars, now_ns = hearing([10.0, 1.0, 9.0])
    assert not cars.reception_is_good(now_ns)


def test_one_silent_car_among_many_is_enough_to_doubt_until_it_is_long_gone():
    cars, now_ns = hearing([1.0] * 8)
    hearing([0.5] * 30, "n2", cars, 1e-9 * now_ns)
    later_ns = now_ns + 15 * NS_PER_S
    assert not cars.reception_is_good(later_ns)
    hearing([0.5] * 30, "n2", cars, 1e-9 * later_ns)
    assert cars.reception_is_good(later_ns + 15 * NS_PER_S)
