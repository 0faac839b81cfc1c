"""Numbers of a car file that no effect reads: its outline, contacts, motors' names and sensors.

Effects declare their own keys with their parameters; everything else a car file may say is here.
A key with a default may be left out of a section that the file has.
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Fact:
    """One key: how many numbers (0 is text), their unit and bounds, or the words allowed.

    Attributes:
        default: What a file that has the key's section, and not the key, means; None: nothing.
    """

    unit: str
    count: int = 1
    bounds: tuple[float, float] = (-100.0, 100.0)
    words: tuple[str, ...] = ()
    default: float | tuple[float, ...] | str | None = None


_POSITION = Fact("m", 3, (-2.0, 2.0))
_NO_VECTOR = (0.0, 0.0, 0.0)


def _device(section: str, rate_hz: float | None = None) -> dict[str, "Fact"]:
    """Return the keys that every device has."""
    return {
        f"{section}.rate_hz": Fact("Hz", 1, (0.1, 5000.0), default=rate_hz),
        f"{section}.latency_s": Fact("s", 1, (0.0, 2.0), default=0.0),
        f"{section}.drop_out": Fact("1", 1, (0.0, 0.99), default=0.0),
    }


FACTS: dict[str, Fact] = {
    "body.footprint_x_m": Fact("m", 2, (-6.0, 6.0)),
    "body.footprint_y_m": Fact("m", 2, (-2.0, 2.0)),
    "body.bounce_restitution": Fact("1", 1, (0.0, 1.0)),
    "body.contact_friction": Fact("1", 1, (0.0, 3.0)),
    "wheel.width_m": Fact("m", 1, (0.001, 0.3)),
    "drive.layout": Fact("", 0, words=("rear", "front", "all")),
    "drive.battery_capacity_ah": Fact("A*h", 1, (0.01, 500.0)),
    "drive.throttle_speed_m_s": Fact("m/s", 10, (0.0, 50.0)),
    "steering.geometry": Fact("", 0, words=("ackermann", "parallel")),
    **_device("throttle_feedback"),
    "throttle_feedback.noise": Fact("1", 1, (0.0, 1.0), default=0.0),
    "throttle_feedback.quantum": Fact("1", 1, (0.0, 1.0), default=0.0),
    **_device("steering_feedback"),
    "steering_feedback.noise_rad": Fact("rad", 1, (0.0, 1.0), default=0.0),
    "steering_feedback.bias_rad": Fact("rad", 1, (-1.0, 1.0), default=0.0),
    "steering_feedback.quantum_rad": Fact("rad", 1, (0.0, 1.0), default=0.0),
    **_device("encoder", rate_hz=50.0),
    "encoder.counts_per_revolution": Fact("1", 1, (1.0, 1e6)),
    "encoder.noise_counts": Fact("1", 1, (0.0, 1e4), default=0.0),
    **_device("imu"),
    "imu.position_m": _POSITION,
    "imu.accel_noise_m_s2": Fact("m/s^2", 1, (0.0, 10.0)),
    "imu.accel_bias_m_s2": Fact("m/s^2", 3, (-10.0, 10.0), default=_NO_VECTOR),
    "imu.accel_walk_m_s2_sqrt_s": Fact("m/s^2/s^0.5", 1, (0.0, 1.0), default=0.0),
    "imu.accel_limit_m_s2": Fact("m/s^2", 1, (1.0, 1e6), default=1e6),
    "imu.gyro_noise_rad_s": Fact("rad/s", 1, (0.0, 5.0)),
    "imu.gyro_bias_rad_s": Fact("rad/s", 3, (-5.0, 5.0), default=_NO_VECTOR),
    "imu.gyro_walk_rad_s_sqrt_s": Fact("rad/s/s^0.5", 1, (0.0, 1.0), default=0.0),
    "imu.gyro_limit_rad_s": Fact("rad/s", 1, (0.1, 1e6), default=1e6),
    "imu.orientation_noise_rad": Fact("rad", 1, (0.0, 1.0), default=0.0),
    "imu.heading_bias_rad": Fact("rad", 1, (-4.0, 4.0), default=0.0),
    "imu.heading_walk_rad_sqrt_s": Fact("rad/s^0.5", 1, (0.0, 1.0), default=0.0),
    **_device("lidar"),
    "lidar.position_m": _POSITION,
    "lidar.beams": Fact("1", 1, (1.0, 10000.0)),
    "lidar.field_of_view_rad": Fact("rad", 1, (0.01, 6.2831854), default=2.0 * math.pi),
    "lidar.range_m": Fact("m", 2, (0.0, 200.0)),
    "lidar.noise_m": Fact("m", 1, (0.0, 1.0)),
    "lidar.quantum_m": Fact("m", 1, (0.0, 1.0), default=0.0),
    "lidar.sweep": Fact("", 0, words=("frozen", "moving"), default="frozen"),
    "camera.position_m": _POSITION,
    "camera.pitch_down_rad": Fact("rad", 1, (-1.6, 1.6)),
    "camera.rear_position_m": _POSITION,
    "camera.focal_length_mm": Fact("mm", 1, (0.1, 500.0)),
    "camera.sensor_width_mm": Fact("mm", 1, (0.1, 100.0)),
    "camera.fov_deg": Fact("deg", 1, (1.0, 360.0)),
    "camera.fov_axis": Fact("", 0, words=("horizontal", "vertical")),
    "camera.resolution_px": Fact("px", 2, (1.0, 20000.0)),
    "camera.distortion": Fact("1", 5, (-10.0, 10.0)),
    "camera.exposure": Fact("1", 1, (0.01, 100.0)),
    "camera.gain": Fact("1", 1, (0.1, 100.0)),
    "camera.read_noise": Fact("grey levels", 1, (0.0, 100.0)),
    "camera.shot_noise": Fact("grey levels", 1, (0.0, 100.0)),
    "camera.rate_hz": Fact("Hz", 1, (0.1, 120.0)),
    "camera.latency_s": Fact("s", 1, (0.0, 2.0)),
    "camera.drop_out": Fact("1", 1, (0.0, 0.99)),
    "camera.jpeg_quality": Fact("1", 1, (1.0, 100.0)),
    **_device("ips", rate_hz=30.0),
    "ips.position_m": _POSITION,
    "ips.noise_m": Fact("m", 1, (0.0, 1.0), default=0.0),
    "ips.noise_rad": Fact("rad", 1, (0.0, 1.0), default=0.0),
    "ips.tag_family": Fact("", 0),
    "ips.tag_id": Fact("1", 1, (0.0, 586.0)),
    "ips.tag_size_m": Fact("m", 1, (0.001, 2.0)),
    "ips.map_tag_id": Fact("1", 1, (0.0, 1e6)),
}
