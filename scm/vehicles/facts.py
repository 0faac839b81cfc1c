"""Numbers of a car file that no effect reads: its outline, contacts, motors' names and sensors.

Effects declare their own keys with their parameters; everything else a car file may say is here.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Fact:
    """One key: how many numbers (0 is text), their unit and bounds, or the words allowed."""

    unit: str
    count: int = 1
    bounds: tuple[float, float] = (-100.0, 100.0)
    words: tuple[str, ...] = ()


_POSITION = Fact("m", 3, (-2.0, 2.0))
_RATE = Fact("Hz", 1, (0.1, 5000.0))

FACTS: dict[str, Fact] = {
    "body.footprint_x_m": Fact("m", 2, (-2.0, 2.0)),
    "body.footprint_y_m": Fact("m", 2, (-2.0, 2.0)),
    "body.bounce_restitution": Fact("1", 1, (0.0, 1.0)),
    "body.contact_friction": Fact("1", 1, (0.0, 3.0)),
    "wheel.width_m": Fact("m", 1, (0.001, 0.3)),
    "drive.layout": Fact("", 0, words=("rear", "front", "all")),
    "drive.battery_capacity_ah": Fact("A*h", 1, (0.01, 500.0)),
    "drive.throttle_speed_m_s": Fact("m/s", 10, (0.0, 50.0)),
    "steering.geometry": Fact("", 0, words=("ackermann", "parallel")),
    "encoder.counts_per_revolution": Fact("1", 1, (1.0, 1e6)),
    "imu.position_m": _POSITION,
    "imu.rate_hz": _RATE,
    "imu.accel_noise_m_s2": Fact("m/s^2", 1, (0.0, 10.0)),
    "imu.gyro_noise_rad_s": Fact("rad/s", 1, (0.0, 5.0)),
    "lidar.position_m": _POSITION,
    "lidar.rate_hz": _RATE,
    "lidar.beams": Fact("1", 1, (1.0, 10000.0)),
    "lidar.range_m": Fact("m", 2, (0.0, 200.0)),
    "lidar.noise_m": Fact("m", 1, (0.0, 1.0)),
    "camera.position_m": _POSITION,
    "camera.pitch_down_rad": Fact("rad", 1, (-1.6, 1.6)),
    "camera.rear_position_m": _POSITION,
    "camera.focal_length_mm": Fact("mm", 1, (0.1, 500.0)),
    "camera.sensor_width_mm": Fact("mm", 1, (0.1, 100.0)),
    "camera.fov_deg": Fact("deg", 1, (1.0, 360.0)),
    "camera.resolution_px": Fact("px", 2, (1.0, 20000.0)),
    "ips.position_m": _POSITION,
    "ips.tag_family": Fact("", 0),
    "ips.tag_size_m": Fact("m", 1, (0.001, 2.0)),
    "ips.map_tag_id": Fact("1", 1, (0.0, 1e6)),
}
