"""The city's messages in ROS's words."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.geometry import Pose2
from scm.ros2 import convert, types
from scm.ros2.frames import vector
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState

T_NS = 12_000_000_345


def again(kind, message):
    """Return a message as it comes out of its own bytes."""
    return types.from_cdr(kind, types.to_cdr(kind, message))


def test_the_clock_is_the_citys_time():
    got = again("rosgraph_msgs/Clock", convert.clock(T_NS)).clock
    assert (got.sec, got.nanosec) == (12, 345)


def test_odometry_has_the_pose_in_odom_and_the_motion_in_the_car():
    state = VehicleState(
        vehicle="n1", t_ns=T_NS, seq=0, x_m=9.0, y_m=9.0, yaw_rad=1.0, speed_mps=0.2,
        lateral_speed_mps=-0.01, yaw_rate_radps=0.3, steering_rad=0.1, throttle=0.2, source="eye",
    )  # fmt: skip
    message = convert.odometry("n1", state, Pose2(1.0, 2.0, math.pi / 2))
    got = again("nav_msgs/Odometry", message)
    assert (got.header.stamp.sec, got.header.stamp.nanosec) == (12, 345)
    assert (got.header.frame_id, got.child_frame_id) == ("n1/odom", "n1/base_link")
    at, turn = got.pose.pose.position, got.pose.pose.orientation
    assert (at.x, at.y, at.z) == (1.0, 2.0, 0.0)
    assert_allclose((turn.z, turn.w), (math.sqrt(0.5), math.sqrt(0.5)))
    twist = got.twist.twist
    assert (twist.linear.x, twist.linear.y, twist.angular.z) == (0.2, -0.01, 0.3)


def scan(**more):
    ranges = np.array([1.0, 2.0, math.inf, 3.0], "<f4")
    return LidarScan(
        vehicle="n1", t_ns=T_NS, beams=4, range_min_m=0.15, range_max_m=12.0,
        payload=ranges.tobytes(), **more,
    )  # fmt: skip


def test_a_full_turn_is_shared_out_evenly():
    got = again("sensor_msgs/LaserScan", convert.scan("n1", scan(), T_NS - 100_000_000))
    assert got.header.frame_id == "n1/laser"
    assert_allclose(
        (got.angle_min, got.angle_max, got.angle_increment),
        (0.0, 1.5 * math.pi, 0.5 * math.pi),
        rtol=1e-6,
    )
    assert_allclose((got.range_min, got.range_max, got.scan_time), (0.15, 12.0, 0.1), rtol=1e-6)
    assert_allclose(got.ranges, (1.0, 2.0, math.inf, 3.0))


def stamp_ns(got):
    return got.header.stamp.sec * 1_000_000_000 + got.header.stamp.nanosec


def test_a_moving_sweep_is_stamped_when_its_first_ray_looked():
    period_ns = 142_857_143
    turn = LidarScan(
        vehicle="n1", t_ns=T_NS, beams=360, range_min_m=0.15, range_max_m=12.0,
        payload=np.ones(360, "<f4").tobytes(), sweep_ns=period_ns, period_ns=period_ns,
    )  # fmt: skip
    got = again("sensor_msgs/LaserScan", convert.scan("n1", turn, None))
    assert T_NS - stamp_ns(got) == pytest.approx(0.14246e9, rel=1e-4)
    assert got.time_increment == pytest.approx(1 / 7 / 360, rel=1e-6)
    assert got.scan_time == pytest.approx(1 / 7, rel=1e-6)
    last_ns = stamp_ns(got) + 359 * 1e9 * float(got.time_increment)
    assert last_ns == pytest.approx(T_NS, abs=20_000), "float32 seconds keep to 10 us"


def test_a_sweep_over_part_of_a_circle_is_shorter_than_its_period():
    seen = scan(bearing_first_rad=-1.0, bearing_step_rad=0.5, sweep_ns=8_000_000,
                period_ns=25_000_000)  # fmt: skip
    got = convert.scan("n1", seen, T_NS - 1)
    assert T_NS - stamp_ns(got) == 6_000_000
    assert (got.time_increment, got.scan_time) == (0.002, 0.025)


def test_a_clockwise_sweep_is_listed_from_the_ray_that_looked_first():
    got = convert.scan("n1", scan(sweep_ns=100_000_000, clockwise=True), None)
    assert T_NS - stamp_ns(got) == 75_000_000
    assert_allclose(got.ranges, (3.0, math.inf, 2.0, 1.0))
    assert_allclose(
        (got.angle_min, got.angle_max, got.angle_increment), (1.5 * math.pi, 0.0, -0.5 * math.pi)
    )


@pytest.mark.parametrize("sweep_ns", [None, 0])
def test_rays_that_looked_at_once_bear_that_time(sweep_ns):
    got = convert.scan("n1", scan(sweep_ns=sweep_ns), None)
    assert (stamp_ns(got), got.time_increment) == (T_NS, 0.0)


def test_a_narrow_view_begins_at_its_right_end():
    seen = scan(bearing_first_rad=-1.0, bearing_step_rad=0.5)
    got = convert.scan("n1", seen, None)
    assert_allclose((got.angle_min, got.angle_max, got.scan_time), (-1.0, 0.5, 0.0))


def sensors(**more):
    return VehicleSensors(
        vehicle="n1", t_ns=T_NS, encoder_left=1, encoder_right=2, accel_mps2=(0.1, 0.2, 9.8),
        gyro_radps=(0.01, 0.02, 0.03), **more,
    )  # fmt: skip


def test_an_imu_tells_rates_gravity_and_orientation():
    got = again("sensor_msgs/Imu", convert.imu("n1", sensors(orientation_rad=(0.0, 0.0, math.pi))))
    assert got.header.frame_id == "n1/imu"
    assert (got.angular_velocity.z, got.linear_acceleration.z) == (0.03, 9.8)
    assert_allclose((got.orientation.z, got.orientation.w), (1.0, 0.0), atol=1e-12)
    assert got.orientation_covariance[0] == 0.0


def test_an_imu_without_orientation_says_so():
    assert convert.imu("n1", sensors()).orientation_covariance[0] == -1.0


def test_a_picture_is_the_jpeg_file_itself():
    frame = CameraFrame(
        vehicle="n1", camera="front", t_ns=T_NS, width_px=2, height_px=1, payload=b"\xff\xd8jpg"
    )
    got = again("sensor_msgs/CompressedImage", convert.picture("n1", frame))
    assert got.data.tobytes() == b"\xff\xd8jpg"
    assert (got.format, got.header.frame_id) == ("jpeg", "n1/camera_optical")


def twist(speed, rate):
    return types.ros("geometry_msgs/Twist", linear=vector(speed, 0.0), angular=vector(0, 0, rate))


@pytest.mark.parametrize(
    ("speed", "rate", "expected"),
    [
        (0.2, 0.0, (0.2, 0.0)),
        (0.2, 0.4, (0.2, math.atan(0.14 * 2.0))),
        (-0.2, 0.4, (-0.2, -math.atan(0.14 * 2.0))),  # backwards, a left turn steers right
        (0.0, 1.0, (0.0, 0.0)),
        (math.nan, 0.0, (0.0, 0.0)),
        (0.2, math.inf, (0.2, math.pi / 2.0)),
    ],
)
def test_a_twist_becomes_speed_and_wheel_angle(speed, rate, expected):
    assert_allclose(
        convert.speed_and_angle("geometry_msgs/Twist", twist(speed, rate), 0.14), expected
    )


def test_an_ackermann_command_is_taken_as_it_is():
    kind = "ackermann_msgs/AckermannDrive"
    command = types.ros(
        kind, steering_angle=0.25, steering_angle_velocity=0.0, speed=-0.5, acceleration=0, jerk=0
    )
    assert convert.speed_and_angle(kind, again(kind, command), 0.14) == (-0.5, 0.25)
