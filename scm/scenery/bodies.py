"""The appearance of a type of car: its outline, its paint, and the place of its tag."""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from scm.arrays import Floats
from scm.scenery.canvas import Colour, colour_of
from scm.v2x.messages.world_snapshot import SnapshotVehicle
from scm.vehicles.car_files import car_files, varied_values

PAINT = {
    kind: colour_of(text)
    for kind, text in (("hosted", "#4c8df0"), ("remote", "#a97bf2"), ("real", "#f0a13c"))
}
"""Paint by kind of car, the same as on the dashboard's map (`car_shape.js`)."""
LOST = colour_of("#8a929c")


@dataclass(frozen=True, slots=True)
class CarBody:
    """Measures of a car file, body frame: rear axle on the ground, x forward, y left, z up [m].

    Attributes:
        tag_position: Centre of the roof's tag.
        tag_size: Edge of its black square.
        x_span, y_span: The outline from above: rear to front, right to left.
        has_tag: Whether the car file has a section `ips`; without it the roof is bare.
        tag_id: Of this car's tag, if its file has one.
    """

    tag_position: tuple[float, float, float] = (0.035125, 0.0, 0.129165)
    tag_size: float = 0.0762
    x_span: tuple[float, float] = (-0.07, 0.23)
    y_span: tuple[float, float] = (-0.0875, 0.0875)
    wheelbase: float = 0.14154
    track: float = 0.153
    wheel_radius: float = 0.0325
    wheel_width: float = 0.025
    has_tag: bool = True
    tag_id: int | None = None


NIGEL = CarBody()
KEYS = {
    "tag_position": "ips.position_m",
    "tag_size": "ips.tag_size_m",
    "x_span": "body.footprint_x_m",
    "y_span": "body.footprint_y_m",
    "wheelbase": "body.wheelbase_m",
    "track": "body.track_m",
    "wheel_radius": "wheel.radius_m",
    "wheel_width": "wheel.width_m",
    "tag_id": "ips.tag_id",
}


def car_body(car: str) -> CarBody:
    """Return the body of the car file of a name; a car whose file is not here is a Nigel to us.

    Every measure that a file leaves out is a Nigel's.
    """
    varied = varied_values.get(car)
    return _body_of_file(car) if varied is None else _body(varied)


@lru_cache(maxsize=64)
def _body_of_file(car: str) -> CarBody:
    path = car_files().get(car)
    if path is None:
        return NIGEL
    sections = tomllib.loads(path.read_text(encoding="utf-8"))
    tables = {name: table for name, table in sections.items() if isinstance(table, dict)}
    return _body(
        {
            f"{section}.{key}": _plain(entry["value"])
            for section, table in tables.items()
            for key, entry in table.items()
            if isinstance(entry, dict) and "value" in entry
        }
    )


def _body(values: Mapping[str, Any]) -> CarBody:
    given = {field: values[key] for field, key in KEYS.items() if key in values}
    if "tag_id" in given:
        given["tag_id"] = int(given["tag_id"])
    return replace(NIGEL, **given, has_tag=any(key.startswith("ips.") for key in values))


def _plain(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def colour_of_car(car: SnapshotVehicle) -> Colour:
    """Return the paint of a car: that of its kind; grey once it is lost."""
    return PAINT.get(car.kind, PAINT["hosted"]) if car.alive else LOST


def car_rotation(car: SnapshotVehicle) -> Floats:
    """Return map_R_body, (3, 3): yaw, then pitch (nose down positive), then roll (left up)."""
    cz, sz = math.cos(car.yaw_rad), math.sin(car.yaw_rad)
    cy, sy = math.cos(car.pitch_rad), math.sin(car.pitch_rad)
    cx, sx = math.cos(car.roll_rad), math.sin(car.roll_rad)
    about_z = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
    about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    rotation: Floats = about_z @ about_y @ about_x
    return rotation
