"""CAMs with some values replaced, in metres of the floor."""

from typing import Any

from msgspec.structs import replace

from scm.v2x.etsi.cam_spatem import SCALE, CamBody, HighFrequencyContainer
from scm.v2x.etsi.convert import (
    ACCEL_MAX,
    SPEED_MAX,
    delta_time,
    heading_of,
    position_of,
)


def moved(body: CamBody, x_m: float, y_m: float) -> CamBody:
    """Return a CAM with another position of the front bumper."""
    place = position_of(x_m, y_m)
    was = body.position
    place = replace(was, latitude=place.latitude, longitude=place.longitude)
    return replace(body, basic_container=replace(body.basic_container, reference_position=place))


def driven(
    body: CamBody,
    *,
    speed_mps: float | None = None,
    yaw_rad: float | None = None,
    accel_mps2: float | None = None,
) -> CamBody:
    """Return a CAM with another motion; what is None stays."""
    motion = body.motion
    changes: dict[str, Any] = {}
    if speed_mps is not None:
        value = min(SPEED_MAX, round(abs(speed_mps) * SCALE * 100.0))
        changes["speed"] = replace(motion.speed, value=value)
        changes["drive_direction"] = int(speed_mps < 0.0)
    if yaw_rad is not None:
        changes["heading"] = replace(motion.heading, value=heading_of(yaw_rad))
    if accel_mps2 is not None:
        value = max(-ACCEL_MAX, min(ACCEL_MAX, round(accel_mps2 * SCALE * 10.0)))
        was = motion.longitudinal_acceleration
        changes["longitudinal_acceleration"] = replace(was, value=value)
    fast = HighFrequencyContainer(basic_vehicle_container_high_frequency=replace(motion, **changes))
    return replace(body, high_frequency_container=fast)


def stamped(body: CamBody, t_ns: int, who: int | None = None) -> CamBody:
    """Return a CAM of another time, and of another station if `who` is its number."""
    number = body.station_id if who is None else who
    return replace(body, generation_delta_time=delta_time(t_ns), station_id=number)
