"""The camera parameters of a car file; `scm.vehicles.car_file_schema` has their defaults."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType

from scm.errors import CarError
from scm.vehicles.car import Car, car_names, load_car
from scm.vehicles.car_files import varied_values

CAMERAS = ("front", "rear")
DEFAULT_CAR = "nigel"
_POSITION = {"front": "camera.position_m", "rear": "camera.rear_position_m"}
_NUMBERS = (
    "vignetting", "blur_px", "exposure_time_s", "exposure", "gain", "gamma", "read_noise",
    "shot_noise", "rate_hz", "latency_s", "drop_out", "jpeg_quality",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Optics:
    """One camera on a car.

    Attributes:
        position: Of the optical centre, body frame [m].
        yaw: Where it looks about the body's z [rad]: 0 ahead, pi behind.
        pitch_down: How far below the body's level [rad].
        roll: About its axis, clockwise as the camera looks [rad].
        focal_px: Of the undistorted picture.
        distortion: k1, k2, p1, p2, k3 as OpenCV has them.
        vignetting: Share of the light that is missing at the corners.
        blur_px: Standard deviation of what the lens makes of a point.
        exposure_time_s: During which the camera moves; 0 shows an instant.
        exposure: Factor on the light that reaches the sensor; 1 shows sunlit white as white.
        gain: Factor on what the sensor read, its noise included.
        white_balance: Factors on red, green and blue.
        gamma: Exponent of the tone curve; above 1 is darker between black and white.
        read_noise, shot_noise: Standard deviation at black and what light adds at white [grey].
        latency_s: From a frame's exposure to when it can be had.
        drop_out: Share of the frames that never come.
    """

    width_px: int
    height_px: int
    focal_px: float
    position: tuple[float, float, float]
    yaw: float
    pitch_down: float
    roll: float = 0.0
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    vignetting: float = 0.0
    blur_px: float = 0.0
    exposure_time_s: float = 0.0
    exposure: float = 1.0
    gain: float = 1.0
    white_balance: tuple[float, float, float] = (1.0, 1.0, 1.0)
    gamma: float = 1.0
    read_noise: float = 1.0
    shot_noise: float = 3.0
    rate_hz: float = 15.0
    latency_s: float = 0.0
    drop_out: float = 0.0
    jpeg_quality: float = 80.0

    def of_width(self, width_px: int) -> "Optics":
        """Return a camera with so many columns that sees the same."""
        scale = width_px / self.width_px
        return replace(
            self, width_px=width_px, height_px=round(scale * self.height_px),
            focal_px=scale * self.focal_px, blur_px=scale * self.blur_px,
        )  # fmt: skip


def cameras_of(car: Car) -> tuple[str, ...]:
    """Return which cameras a car has: `front`, `rear`, both or none."""
    return tuple(name for name in CAMERAS if car.has(_POSITION[name]))


def optics_of(car: Car, camera: str) -> Optics:
    """Return the facts of one of `cameras_of(car)`; the rear one mirrors the front one.

    Raises:
        CarError: when the file leaves out what no camera can do without.
    """
    x, y, z = car.vector(_POSITION[camera])
    width, height = car.vector("camera.resolution_px")
    half = math.radians(car.value("camera.fov_deg")) / 2.0
    across = height if car.text("camera.fov_axis") == "vertical" else width
    k1, k2, p1, p2, k3 = car.vector("camera.distortion")
    red, green, blue = car.vector("camera.white_balance")
    return Optics(
        width_px=round(width),
        height_px=round(height),
        focal_px=across / 2.0 / math.tan(half),
        position=(x, y, z),
        yaw=car.value("camera.yaw_rad") + (0.0 if camera == "front" else math.pi),
        pitch_down=car.value("camera.pitch_down_rad"),
        roll=car.value("camera.roll_rad"),
        distortion=(k1, k2, p1, p2, k3),
        white_balance=(red, green, blue),
        **{name: car.value(f"camera.{name}") for name in _NUMBERS},
    )


def fitted(car: str) -> Mapping[str, Optics]:
    """Return the cameras on a car of that file, by name; a file that is not ours is a Nigel's."""
    return _on(load_car(car)) if car in varied_values else _on_file(car)


@lru_cache(maxsize=64)
def _on_file(car: str) -> Mapping[str, Optics]:
    return _on(load_car(car if car in car_names() else DEFAULT_CAR))


def _on(model: Car) -> Mapping[str, Optics]:
    try:
        return MappingProxyType({name: optics_of(model, name) for name in cameras_of(model)})
    except CarError:
        return MappingProxyType({})
