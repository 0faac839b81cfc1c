"""The camera parameters of a car file and their defaults.

Optional keys of `[camera]` and their defaults: `distortion` k1 k2 p1 p2 k3 (none), `exposure` and
`gain` (1), `read_noise` and `shot_noise` in grey levels (1 and 3, see `scm.camera.sensor`),
`rate_hz` (15), `latency_s` and `drop_out` (0), `jpeg_quality` (80), and `fov_axis`, the side of the
picture that the field of view spans (horizontal).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

from scm.errors import CarError
from scm.vehicles.car import Car, car_names, load_car

CAMERAS = ("front", "rear")
DEFAULT_CAR = "nigel"
_POSITION = {"front": "camera.position_m", "rear": "camera.rear_position_m"}
_NOT_GIVEN = {
    "exposure": 1.0,
    "gain": 1.0,
    "read_noise": 1.0,
    "shot_noise": 3.0,
    "rate_hz": 15.0,
    "latency_s": 0.0,
    "drop_out": 0.0,
    "jpeg_quality": 80.0,
}


@dataclass(frozen=True, slots=True)
class Optics:
    """One camera on a car.

    Attributes:
        position: Of the optical centre, body frame [m].
        yaw: Where it looks about the body's z [rad]: 0 ahead, pi behind.
        pitch_down: How far below the body's level [rad].
        focal_px: Of the undistorted picture.
        distortion: k1, k2, p1, p2, k3 as OpenCV has them.
        exposure: Factor on the light that reaches the sensor; 1 shows sunlit white as white.
        gain: Factor on what the sensor read, its noise included.
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
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    exposure: float = 1.0
    gain: float = 1.0
    read_noise: float = 1.0
    shot_noise: float = 3.0
    rate_hz: float = 15.0
    latency_s: float = 0.0
    drop_out: float = 0.0
    jpeg_quality: float = 80.0


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
    axis = car.text("camera.fov_axis") if car.has("camera.fov_axis") else "horizontal"
    across = height if axis == "vertical" else width
    rest = {
        name: car.value(f"camera.{name}") if car.has(f"camera.{name}") else default
        for name, default in _NOT_GIVEN.items()
    }
    k1, k2, p1, p2, k3 = (
        car.vector("camera.distortion") if car.has("camera.distortion") else 5 * (0.0,)
    )
    return Optics(
        width_px=round(width),
        height_px=round(height),
        focal_px=across / 2.0 / math.tan(half),
        position=(x, y, z),
        yaw=0.0 if camera == "front" else math.pi,
        pitch_down=car.value("camera.pitch_down_rad"),
        distortion=(k1, k2, p1, p2, k3),
        **rest,
    )


@lru_cache(maxsize=64)
def fitted(car: str) -> Mapping[str, Optics]:
    """Return the cameras on a car of that file, by name; a file that is not ours is a Nigel's."""
    model = load_car(car if car in car_names() else DEFAULT_CAR)
    try:
        return MappingProxyType({name: optics_of(model, name) for name in cameras_of(model)})
    except CarError:
        return MappingProxyType({})
