"""Keys of a car file that no effect declares: outline, contacts, drive, camera, and all sensors.

Effects declare their keys with their parameters, sensors in their modules (`KEYS`); all other keys
are here. A key with a default may be missing in a section that the file has.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from scm import registry

SENSORS = "scm.vehicles.sensors"


@dataclass(frozen=True, slots=True)
class FileKey:
    """One key: number of values (0 is text), their unit and bounds, or the allowed words.

    Attributes:
        default: Value of a missing key in an existing section; None: none.
    """

    unit: str
    count: int = 1
    bounds: tuple[float, float] = (-100.0, 100.0)
    words: tuple[str, ...] = ()
    default: float | tuple[float, ...] | str | None = None


POSITION = FileKey("m", 3, (-2.0, 2.0))


def device_keys(section: str, rate_hz: float | None = None) -> dict[str, FileKey]:
    """Return the keys of every sensor: rate, latency and drop-out."""
    return {
        f"{section}.rate_hz": FileKey("Hz", 1, (0.1, 5000.0), default=rate_hz),
        f"{section}.latency_s": FileKey("s", 1, (0.0, 2.0), default=0.0),
        f"{section}.drop_out": FileKey("1", 1, (0.0, 0.99), default=0.0),
    }


POSITION_ERROR, YAW_ERROR = "accuracy.position_error", "accuracy.yaw_error"

FILE_KEYS: dict[str, FileKey] = {
    POSITION_ERROR: FileKey("m/m", 1, (0.0, 10.0)),
    YAW_ERROR: FileKey("rad/rad", 1, (0.0, 10.0)),
    "body.footprint_x_m": FileKey("m", 2, (-6.0, 6.0)),
    "body.footprint_y_m": FileKey("m", 2, (-2.0, 2.0)),
    "body.bounce_restitution": FileKey("1", 1, (0.0, 1.0)),
    "body.contact_friction": FileKey("1", 1, (0.0, 3.0)),
    "wheel.width_m": FileKey("m", 1, (0.001, 0.3)),
    "drive.layout": FileKey("", 0, words=("rear", "front", "all")),
    "drive.battery_capacity_ah": FileKey("A*h", 1, (0.01, 500.0)),
    "drive.throttle_speed_m_s": FileKey("m/s", 10, (0.0, 50.0)),
    "steering.geometry": FileKey("", 0, words=("ackermann", "parallel")),
    "camera.position_m": POSITION,
    "camera.pitch_down_rad": FileKey("rad", 1, (-1.6, 1.6)),
    "camera.rear_position_m": POSITION,
    "camera.focal_length_mm": FileKey("mm", 1, (0.1, 500.0)),
    "camera.sensor_width_mm": FileKey("mm", 1, (0.1, 100.0)),
    "camera.fov_deg": FileKey("deg", 1, (1.0, 360.0)),
    "camera.fov_axis": FileKey("", 0, words=("horizontal", "vertical"), default="horizontal"),
    "camera.resolution_px": FileKey("px", 2, (1.0, 20000.0)),
    "camera.yaw_rad": FileKey("rad", 1, (-3.2, 3.2), default=0.0),
    "camera.roll_rad": FileKey("rad", 1, (-3.2, 3.2), default=0.0),
    "camera.distortion": FileKey("1", 5, (-10.0, 10.0), default=(0.0, 0.0, 0.0, 0.0, 0.0)),
    "camera.vignetting": FileKey("1", 1, (0.0, 1.0), default=0.0),
    "camera.blur_px": FileKey("px", 1, (0.0, 20.0), default=0.0),
    "camera.exposure_time_s": FileKey("s", 1, (0.0, 0.2), default=0.0),
    "camera.exposure": FileKey("1", 1, (0.01, 100.0), default=1.0),
    "camera.gain": FileKey("1", 1, (0.1, 100.0), default=1.0),
    "camera.white_balance": FileKey("1", 3, (0.1, 10.0), default=(1.0, 1.0, 1.0)),
    "camera.gamma": FileKey("1", 1, (0.2, 5.0), default=1.0),
    "camera.read_noise": FileKey("grey levels", 1, (0.0, 100.0), default=1.0),
    "camera.shot_noise": FileKey("grey levels", 1, (0.0, 100.0), default=3.0),
    "camera.rate_hz": FileKey("Hz", 1, (0.1, 120.0), default=15.0),
    "camera.latency_s": FileKey("s", 1, (0.0, 2.0), default=0.0),
    "camera.drop_out": FileKey("1", 1, (0.0, 0.99), default=0.0),
    "camera.jpeg_quality": FileKey("1", 1, (1.0, 100.0), default=80.0),
}


@cache
def file_keys() -> Mapping[str, FileKey]:
    """Return all keys that no effect declares, those of the sensors included."""
    keys = dict(FILE_KEYS)
    for name in registry.names(SENSORS):
        keys |= registry.load(SENSORS, name, "KEYS", dict)
    return keys
