"""The parameters of a car and of its sensor faults by key, with their neutral values."""

from collections.abc import Mapping

Numbers = Mapping[str, float]
THROTTLE_DELAY, STEERING_DELAY = "drive.delay_s", "steering.delay_s"
THROTTLE_CLOCK = "clock.throttle_s"  # the throttle acts so much later than the steering
# Faults of measurement by the key that their library parameter has, and their neutral values.
COMMAND_CLOCK = "clock.commands_s"  # commands take effect so much later than they are stamped
POSE_CLOCK = "clock.pose_s"  # poses are stamped so much later than the other sensors
NEUTRAL: Mapping[str, float] = {
    COMMAND_CLOCK: 0.0, POSE_CLOCK: 0.0, "measure.pose_delay_s": 0.0, "measure.clock_offset_s": 0.0,
    "measure.clock_rate": 0.0, "measure.pose_scale": 1.0, "measure.camera_tilt_x_per_m": 0.0,
    "measure.camera_tilt_y_per_m": 0.0, "measure.pose_point_x_m": 0.0,
    "measure.pose_point_y_m": 0.0, "measure.pose_heading_rad": 0.0, "measure.encoder_loss": 0.0,
    "measure.gyro_bias_rad_s": 0.0, "measure.gyro_scale": 1.0, "measure.speed_scale": 1.0,
    "measure.accel_bias_x_m_s2": 0.0, "measure.accel_bias_y_m_s2": 0.0,
    "measure.imu_angle_rad": 0.0,
}  # fmt: skip
MOTION_VARIABLES = (
    "speed", "lateral_speed", "yaw_rate", "accel_x", "accel_y", "steer_angle",
    "wheel_angle.fl", "wheel_angle.fr", "wheel_angle.rl", "wheel_angle.rr",
)  # fmt: skip
TETHER_STEPS = 50  # between two moments at which a simulated pose is set to the measured one
