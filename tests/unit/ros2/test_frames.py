"""Frames, rotations and dead reckoning."""

import math

import pytest
from numpy.testing import assert_allclose

from scm.ros2 import frames
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import load_car


def state(t_s, speed=0.0, aside=0.0, rate=0.0):
    return VehicleState(
        vehicle="n1", t_ns=round(t_s * 1e9), seq=0, x_m=9.0, y_m=9.0, yaw_rad=1.0, speed_mps=speed,
        lateral_speed_mps=aside, yaw_rate_radps=rate, steering_rad=0.0, throttle=0.0, source="eye",
    )  # fmt: skip


def rotated(turn, vector):
    """Return a vector turned by the quaternion of a message."""
    q = frames.quaternion(turn)
    w, axis = q.w, (q.x, q.y, q.z)

    def cross(a, b):
        return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])

    t = [2.0 * c for c in cross(axis, vector)]
    return [v + w * a + b for v, a, b in zip(vector, t, cross(axis, t), strict=True)]


def test_positive_yaw_turns_ahead_to_the_left():
    assert_allclose(rotated((0.0, 0.0, math.pi / 2), (1.0, 0.0, 0.0)), (0.0, 1.0, 0.0), atol=1e-12)


def test_positive_pitch_looks_down():
    assert_allclose(rotated((0.0, math.pi / 2, 0.0), (1.0, 0.0, 0.0)), (0.0, 0.0, -1.0), atol=1e-12)


def test_positive_roll_lifts_the_left_side():
    assert_allclose(rotated((math.pi / 2, 0.0, 0.0), (0.0, 1.0, 0.0)), (0.0, 0.0, 1.0), atol=1e-12)


def test_yaw_pitch_and_roll_come_in_this_order():
    turn = (0.3, -0.4, 0.5)
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a), math.sin(a)) for a in turn)
    # The first column of Rz(yaw) Ry(pitch) Rx(roll), and the last.
    assert_allclose(rotated(turn, (1.0, 0.0, 0.0)), (cy * cp, sy * cp, -sp), atol=1e-12)
    last = (cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr)
    assert_allclose(rotated(turn, (0.0, 0.0, 1.0)), last, atol=1e-12)


def test_the_optical_frame_looks_along_its_z_and_has_x_to_the_right():
    optical = frames._OPTICAL
    assert_allclose(rotated(optical, (0.0, 0.0, 1.0)), (1.0, 0.0, 0.0), atol=1e-12)
    assert_allclose(rotated(optical, (1.0, 0.0, 0.0)), (0.0, -1.0, 0.0), atol=1e-12)


def test_dead_reckoning_begins_where_the_car_is_first_seen():
    assert frames.DeadReckoning().step(state(5.0, speed=1.0, rate=1.0)) == (0.0, 0.0, 0.0)


def test_dead_reckoning_follows_a_circle():
    reckoning = frames.DeadReckoning()
    for tick in range(101):
        at = reckoning.step(state(0.02 * tick, speed=0.5, rate=math.pi / 4.0))
    # After 2 s a quarter turn at radius 0.64 m; midpoint steps of 20 ms err by their square.
    radius = 0.5 / (math.pi / 4.0)
    assert_allclose(at, (radius, radius, math.pi / 2.0), atol=1e-4)


def test_dead_reckoning_slides_to_the_left():
    reckoning = frames.DeadReckoning()
    reckoning.step(state(0.0, aside=0.2))
    assert_allclose(reckoning.step(state(1.0, aside=0.2)), (0.0, 0.2, 0.0), atol=1e-12)


@pytest.mark.parametrize("t_s", [1.0, 0.2])
def test_a_state_that_is_not_newer_moves_nothing(t_s):
    reckoning = frames.DeadReckoning()
    reckoning.step(state(1.0, speed=1.0))
    assert reckoning.step(state(t_s, speed=1.0)) == (0.0, 0.0, 0.0)
    assert_allclose(reckoning.step(state(t_s + 0.1, speed=1.0)), (0.1, 0.0, 0.0), atol=1e-12)


def test_the_sensors_of_a_car_sit_where_its_file_says():
    mounts = {m.child_frame_id: m for m in frames.mounts("n1", load_car("nigel"), 0)}
    assert set(mounts) == {"n1/laser", "n1/imu", "n1/camera", "n1/camera_optical"}
    laser = mounts["n1/laser"]
    assert laser.header.frame_id == "n1/base_link"
    place = laser.transform.translation
    assert (place.x, place.y, place.z) == (0.1445, 0.0, 0.1757)
    # The camera looks 0.1273 rad down: about y, half the angle.
    assert_allclose(mounts["n1/camera"].transform.rotation.y, math.sin(0.5 * 0.1273))
    assert mounts["n1/camera_optical"].header.frame_id == "n1/camera"
