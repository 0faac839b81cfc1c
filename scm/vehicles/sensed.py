"""A car's readings as a message: what an agent says of its own sensors."""

from collections.abc import Mapping

from scm.arrays import Floats
from scm.v2x.messages.vehicle_sensors import VehicleSensors

ENCODERS, IMU, IPS = "encoders", "imu", "ips"
THROTTLE, STEERING = "throttle_feedback", "steering_feedback"
KINDS = (ENCODERS, IMU, IPS, THROTTLE, STEERING)


def sensors_message(vehicle: str, t_ns: int, newest: Mapping[str, Floats]) -> VehicleSensors | None:
    """Return the newest values (n,) of each of `KINDS`; None before encoders and IMU have read."""
    if ENCODERS not in newest or IMU not in newest:
        return None
    left, right = newest[ENCODERS].tolist()
    ax, ay, az, p, q, r, roll, pitch, yaw = newest[IMU].tolist()
    throttle, steering, place = newest.get(THROTTLE), newest.get(STEERING), newest.get(IPS)
    return VehicleSensors(
        vehicle=vehicle,
        t_ns=t_ns,
        encoder_left=int(left),
        encoder_right=int(right),
        accel_mps2=(ax, ay, az),
        gyro_radps=(p, q, r),
        orientation_rad=(roll, pitch, yaw),
        throttle=None if throttle is None else float(throttle[0]),
        steering_rad=None if steering is None else float(steering[0]),
        ips_m=None if place is None else (float(place[0]), float(place[1])),
        ips_yaw_rad=None if place is None else float(place[2]),
    )
