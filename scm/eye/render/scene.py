"""Places a rendered camera over a map, and writes it as a map's camera."""

import math

import msgspec
import numpy as np

from scm.errors import EyeError
from scm.eye.camera import CameraModel, camera_model
from scm.records.city_map import Camera, CityMap, MapTag
from scm.records.floor import Floor

PINHOLE = (-0.12, 0.03, 0.0004, -0.0003, 0.0)
"""Distortion of a cheap lens of 60 degrees."""
FISHEYE = (-0.025, 0.004, -0.001, 0.0002, 0.0)
EDGE_PX = 8.0


def camera_over(
    city_map: CityMap,
    size_px: tuple[int, int] = (1920, 1080),
    height_m: float = 2.5,
    tilt_rad: float = 0.0,
    focal_px: float | None = None,
    *,
    fisheye: bool = False,
    distortion: tuple[float, float, float, float, float] | None = None,
) -> CameraModel:
    """Return a camera that looks at the middle of a map's floor.

    Args:
        city_map: Whose floor.
        size_px: Columns and rows.
        height_m: Of the lens above the floor.
        tilt_rad: From straight down, about the picture's x: the picture's top is farther away.
        focal_px: None: the longest with the whole floor in the frame.
        fisheye: OpenCV's fisheye instead of its pinhole.
        distortion: None: a typical lens of that kind.

    Raises:
        EyeError: The camera is invalid, or cannot see the whole floor.
    """
    width, height = size_px
    floor = city_map.floor
    camera = Camera(
        name="rendered",
        x_m=sum(floor.x_m) / 2.0,
        y_m=sum(floor.y_m) / 2.0 - height_m * math.tan(tilt_rad),
        z_m=height_m,
        tilt_x_rad=tilt_rad,
        width_px=width,
        height_px=height,
        fx_px=focal_px or 1.0 * width,
        fy_px=focal_px or 1.0 * width,
        cx_px=(width - 1) / 2.0,
        cy_px=(height - 1) / 2.0,
        distortion=distortion or (FISHEYE if fisheye else PINHOLE),
        lens="fisheye" if fisheye else "pinhole",
        noise_sigma=0.0,
    )
    model = camera_model(camera)
    if focal_px is not None:
        return model
    longest = _longest(model, city_map)
    return camera_model(msgspec.structs.replace(camera, fx_px=longest, fy_px=longest))


def _longest(model: CameraModel, city_map: CityMap) -> float:
    """Return the longest focal length that shows the whole floor [px]."""
    camera, floor = model.camera, city_map.floor
    along = np.linspace(0.0, 1.0, 21)
    x, y = np.meshgrid(*(low + (high - low) * along for low, high in (floor.x_m, floor.y_m)))
    points = np.stack((x, y, np.zeros_like(x)), axis=-1).reshape(-1, 3)
    points = np.concatenate((points, points + np.array([0.0, 0.0, 0.15])))
    if ((points - model.position) @ model.camera_R_map[2] <= 0.0).any():
        raise EyeError(
            f"map {city_map.name}: expected a camera in front of which the whole floor lies, got "
            f"one at {camera.z_m} m tilted by {math.degrees(camera.tilt_x_rad):.0f} deg: "
            "hang it higher"
        )
    middle = np.array([camera.cx_px, camera.cy_px])
    reach = np.abs(model.project(points) - middle).max(axis=0) / camera.fx_px
    return float(((middle - EDGE_PX) / reach).min())


def camera_toml(camera: Camera) -> str:
    """Return the `[[cameras]]` block of a map file."""
    lines = ["[[cameras]]"]
    for name in camera.__struct_fields__:
        value = getattr(camera, name)
        if value is None:
            continue
        if isinstance(value, str):
            text = f'"{value}"'
        elif isinstance(value, tuple):
            text = "[" + ", ".join(repr(float(one)) for one in value) + "]"
        else:
            text = repr(value)
        lines.append(f"{name} = {text}")
    return "\n".join(lines) + "\n"


def bare_floor(length_m: float, width_m: float) -> CityMap:
    """Return a map with only a floor of that size and a tag in its lower left corner."""
    return CityMap(
        map=1,
        name="bare_floor",
        title="Bare floor",
        source="made to measure",
        floor=Floor(x_m=(-0.1, length_m - 0.1), y_m=(-0.1, width_m - 0.1)),
        tag=MapTag(tag_id=0, size_m=0.0762),
    )
