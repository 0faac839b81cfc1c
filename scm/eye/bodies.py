"""What the eye knows of a kind of car: where its tag sits, and its outline for the picture."""

import tomllib
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Any

from scm.errors import CarError


@dataclass(frozen=True, slots=True)
class CarBody:
    """Measures of a car file, body frame: rear axle on the ground, x forward, y left, z up [m].

    Attributes:
        tag_position: Centre of the roof's tag.
        tag_size: Edge of its black square.
        x_span, y_span: The outline from above: rear to front, right to left.
    """

    tag_position: tuple[float, float, float] = (0.035125, 0.0, 0.129165)
    tag_size: float = 0.0762
    x_span: tuple[float, float] = (-0.07, 0.23)
    y_span: tuple[float, float] = (-0.0875, 0.0875)
    wheelbase: float = 0.14154
    track: float = 0.153
    wheel_radius: float = 0.0325
    wheel_width: float = 0.025


NIGEL = CarBody()


@lru_cache(maxsize=64)
def car_body(car: str) -> CarBody:
    """Return the body of a car file of that name; a car that is not among ours is a Nigel to us.

    Raises:
        CarError: The file lacks one of the measures.
    """
    path = files("scm.vehicles") / "types" / f"{car}.toml"
    if not car.replace("-", "_").isidentifier() or not path.is_file():
        return NIGEL
    values = tomllib.loads(path.read_text())
    return CarBody(
        tag_position=_span(car, values, "ips.position_m"),
        tag_size=_value(car, values, "ips.tag_size_m"),
        x_span=_span(car, values, "body.footprint_x_m"),
        y_span=_span(car, values, "body.footprint_y_m"),
        wheelbase=_value(car, values, "body.wheelbase_m"),
        track=_value(car, values, "body.track_m"),
        wheel_radius=_value(car, values, "wheel.radius_m"),
        wheel_width=_value(car, values, "wheel.width_m"),
    )


def _value(car: str, values: dict[str, Any], key: str) -> Any:
    section, name = key.split(".")
    try:
        return values[section][name]["value"]
    except (KeyError, TypeError) as cause:
        raise CarError(f"car {car!r}: {key}: expected {{ value = ... }} for the eye") from cause


def _span(car: str, values: dict[str, Any], key: str) -> Any:
    return tuple(float(value) for value in _value(car, values, key))
