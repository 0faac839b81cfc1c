"""A car file from the few figures that anybody can measure, with realistic standard deviations.

Missing figures are estimated by scaling: for the shipped cars of `LIKE` a ratio such as the track
over the wheelbase agrees within some spread; the estimate is their geometric mean, and the spread
is its standard deviation. `scm mismatch` identifies the rest from drives.
"""

import math
import statistics
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Literal

from scm.errors import CarError
from scm.vehicles.car import STANDARD_TERMS, Car, car_of_text, load_car
from scm.vehicles.car_files import TYPES_DIR

LIKE = ("nigel", "f1tenth", "dart")
SPREAD = (0.1, 0.5)
"""Smallest and largest relative standard deviation of an estimate: three cars cannot show less, and
a larger one carries no information."""
RULER_M = 0.001
BY_HAND = {"mass": 0.01, "length": 0.005, "radius": 0.01, "speed": 0.05, "accel": 0.2, "lock": 0.05}
"""Relative standard deviations of manual measurements: scales, ruler, stopwatch, protractor."""

THRUST = 0.6
"""Full-throttle force at standstill over a car's weight; known cars have 0.4 to 1.4."""
REFLECTED = {"geared": 0.5, "direct": 0.05}
"""Rotor inertia at the wheels over the car's own inertia there."""
HOLD = 0.03
"""Holding force of a direct motor when off, over the car's weight."""
ROOF = 3.5
"""Height of the roof, over the radius of the wheels."""
ROLLING = 0.015
MAX_LOST = 0.999  # share of the thrust that rolling takes: beyond it no top speed follows
DAMPING = 0.05
"""Bearing losses at the no-load speed, over the stall torque."""
G = 9.80665

Motor = Literal["geared", "direct"]
Driven = Literal["rear", "front", "all"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """The known figures of a car; None: estimated.

    Attributes:
        name: Of the car and its file.
        scale: "1:10"; a label only.
        mass_kg: Ready to drive, with battery.
        wheelbase_m: Between the axles.
        motor: "geared": it holds the car when it is off, like Nigel's 120:1 gear; "direct": the car
            can be pushed then, like RC cars. Both brake electrically at zero throttle.
        top_speed_mps: At full throttle on the level.
        acceleration_mps2: From standing, at full throttle.
        driven: Which wheels.
        length_m, width_m: Of the whole car.
        track_m: Between the centres of two wheels of an axle.
        wheel_radius_m: Under load.
        steering_limit_rad: Of a front wheel, to either side.
        tag_size_m: Edge of the black square of the tag on its roof; 0: none.
        lidar, camera: Whether it has one.
    """

    name: str
    scale: str
    mass_kg: float
    wheelbase_m: float
    motor: Motor
    top_speed_mps: float
    acceleration_mps2: float | None = None
    driven: Driven = "rear"
    length_m: float | None = None
    width_m: float | None = None
    track_m: float | None = None
    wheel_radius_m: float | None = None
    steering_limit_rad: float | None = None
    tag_size_m: float = 0.0762
    lidar: bool = False
    camera: bool = False


Entries = dict[str, str]
_SENSORS: Mapping[str, Entries] = {
    "throttle_feedback": {"rate_hz": "50.0"},
    "steering_feedback": {"rate_hz": "50.0", "noise_rad": "0.002"},
    "encoder": {"counts_per_revolution": "1920"},
    "imu": {"rate_hz": "100.0", "accel_noise_m_s2": "0.05", "gyro_noise_rad_s": "0.003"},
    "lidar": {"rate_hz": "10.0", "beams": "360", "range_m": "[0.15, 12.0]", "noise_m": "0.02"},
    "camera": {
        "pitch_down_rad": "0.13", "focal_length_mm": "3.04", "sensor_width_mm": "4.6",
        "fov_deg": "62.2", "resolution_px": "[1280, 720]",
    },
    "ips": {"rate_hz": "30.0", "noise_m": "0.002", "noise_rad": "0.005"},
}  # fmt: skip


def new_car_text(figures: Figures) -> str:
    """Return a car file, TOML.

    Raises:
        CarError: naming every number that is outside its bounds, or contradicts another.
    """
    terms = ", ".join(f'"{term}"' for term in STANDARD_TERMS)
    lines = [
        "# Made from a few figures. SI units; axes ISO 8855: x forward, y left, z up;",
        "# the origin of the pose is the centre of the rear axle on the ground. source:",
        f"# given = by whoever made this file; scaled = from {', '.join(LIKE)}, std as far as",
        "# they differ; assumed = usual for such cars.",
        f'name = "{figures.name}"',
        f'scale = "{figures.scale}"',
        f"terms = [{terms}]",
    ]
    for section, entries in _sections(figures).items():
        lines += ["", f"[{section}]", *(f"{key} = {entry}" for key, entry in entries.items())]
    text = "\n".join(lines) + "\n"
    car_of_text(text, Path(f"{figures.name}.toml"))
    return text


def _sections(figures: Figures) -> dict[str, Entries]:
    size = _Size.of(figures)
    drive, damping = _drive(figures, size)
    sections = {
        "body": _body(figures, size),
        "suspension": _suspension(figures, size),
        "wheel": {**_wheel(figures, size), "damping_linear_nms": damping},
        "tyre": _tyre(),
        "drive": drive,
        "steering": _steering(figures),
    }
    places = {
        "imu": (0.5 * size.wheelbase, size.radius),
        "lidar": (0.7 * size.wheelbase, size.roof),
        "camera": (size.front, 0.7 * size.roof),
        "ips": (0.5 * (size.front - size.rear), size.roof),
    }
    fitted = {"lidar": figures.lidar, "camera": figures.camera, "ips": figures.tag_size_m > 0.0}
    for name, entries in _SENSORS.items():
        if fitted.get(name, True):
            sections[name] = {key: _assumed(value) for key, value in entries.items()}
            if name in places:
                x, z = places[name]
                sections[name]["position_m"] = _assumed(f"[{x:.4g}, 0.0, {z:.4g}]")
    if figures.tag_size_m > 0.0:
        sections["ips"] |= {
            "tag_family": _assumed('"tag36h11"'),
            "tag_size_m": _entry(f"{figures.tag_size_m:g}", None, "given"),
            "map_tag_id": _assumed("0"),
        }
    return sections


@dataclass(frozen=True, slots=True)
class _Size:
    """Of a car: lengths [m], each with its entry where the file has one."""

    wheelbase: float
    front: float
    rear: float
    width: float
    radius: float
    roof: float
    entries: Entries

    @classmethod
    def of(cls, figures: Figures) -> "_Size":
        base = figures.wheelbase_m
        entries = {"wheelbase_m": _given(base, "length")}
        length = figures.length_m or base * _scaled(lambda car: _length(car) / _base(car))[0]
        behind = _scaled(lambda car: -car.vector(_LONG)[0] / (_length(car) - _base(car)))[0]
        rear = max(0.0, length - base) * behind
        of_base = partial(_or_scaled, of=base, given="length")
        if figures.track_m is None and figures.width_m is not None:
            ratio = _scaled(lambda car: car.value("body.track_m") / _width(car))
            track, entries["track_m"] = _estimate(figures.width_m, ratio)
        else:
            track, entries["track_m"] = of_base(
                figures.track_m, lambda car: car.value("body.track_m") / _base(car)
            )
        width = figures.width_m or track * _scaled(lambda c: _width(c) / c.value("body.track_m"))[0]
        radius, entries["radius_m"] = _or_scaled(
            figures.wheel_radius_m, lambda c: _radius(c) / _base(c), of=base, given="radius"
        )
        return cls(base, length - rear, rear, width, radius, ROOF * radius, entries)


_BOXES: Mapping[str, Callable[[float, float, float], float]] = {
    "yaw_inertia_kgm2": lambda mass, length, width: mass * (length**2 + width**2) / 12.0,
    "roll_inertia_kgm2": lambda mass, _, width: mass * width**2 / 12.0,
    "pitch_inertia_kgm2": lambda mass, length, _: mass * length**2 / 12.0,
}
"""Inertia of a box with the car's mass and size."""


def _over_box(car: Car, key: str, box: Callable[[float, float, float], float]) -> float:
    return car.value(key) / box(car.value("body.mass_kg"), _length(car), _width(car))


def _body(figures: Figures, size: _Size) -> Entries:
    mass, length = figures.mass_kg, size.front + size.rear
    inertia = {}
    for key, box in _BOXES.items():
        ratio = _scaled(partial(_over_box, key=f"body.{key}", box=box))
        inertia[key] = _estimate(box(mass, length, size.width), ratio)[1]
    half = 0.5 * size.width
    sized = "given" if figures.length_m and figures.width_m else "scaled"
    return {
        "mass_kg": _given(mass, "mass"),
        **inertia,
        "wheelbase_m": size.entries["wheelbase_m"],
        "track_m": size.entries["track_m"],
        "cog_to_rear_axle_m": _estimate(
            size.wheelbase, _scaled(lambda c: c.value("body.cog_to_rear_axle_m") / _base(c))
        )[1],
        "cog_height_m": _estimate(
            size.radius, _scaled(lambda c: c.value("body.cog_height_m") / _radius(c))
        )[1],
        "footprint_x_m": _entry(f"[{-size.rear:.4g}, {size.front:.4g}]", None, sized),
        "footprint_y_m": _entry(f"[{-half:.4g}, {half:.4g}]", None, sized),
        "bounce_restitution": _entry("0.2", 0.1, "assumed"),
        "contact_friction": _entry("0.6", 0.1, "assumed"),
    }


def _suspension(figures: Figures, size: _Size) -> Entries:
    def stiffness(car: Car) -> float:
        return car.value("suspension.spring_n_m") / (0.25 * car.value("body.mass_kg"))

    def damping(car: Car) -> float:
        mass, spring = 0.25 * car.value("body.mass_kg"), car.value("suspension.spring_n_m")
        return car.value("suspension.damper_ns_m") / (2.0 * math.sqrt(mass * spring))

    quarter = 0.25 * figures.mass_kg
    spring, entry = _estimate(quarter, _scaled(stiffness))
    critical = 2.0 * math.sqrt(quarter * spring)
    travel = _scaled(lambda c: c.value("suspension.travel_m") / _radius(c))
    return {
        "spring_n_m": entry,
        "damper_ns_m": _estimate(critical, _scaled(damping))[1],
        "travel_m": _estimate(size.radius, travel)[1],
    }


def _wheel(figures: Figures, size: _Size) -> Entries:
    mass, entry = _estimate(
        figures.mass_kg, _scaled(lambda c: c.value("wheel.mass_kg") / c.value("body.mass_kg"))
    )
    inertia = 0.5 * mass * size.radius**2
    return {
        "radius_m": size.entries["radius_m"],
        "width_m": _estimate(size.radius, _scaled(lambda c: c.value("wheel.width_m") / _radius(c)))[
            1
        ],
        "mass_kg": entry,
        "spin_inertia_kgm2": _entry(f"{inertia:.4g}", 0.3 * inertia, "scaled: m r^2 / 2"),
        "rolling_resistance": _entry(f"{ROLLING:g}", 0.5 * ROLLING, "assumed"),
    }


def _tyre() -> Entries:
    values = {"slip_extremum": (0.15, 0.05), "force_extremum": (0.9, 0.15),
              "slip_asymptote": (0.5, 0.1), "force_asymptote": (0.7, 0.1)}  # fmt: skip
    found = {
        side + key: _entry(f"{value:g}", std, "assumed")
        for side in ("", "lateral_")
        for key, (value, std) in values.items()
    }
    return {**found, "low_speed_m_s": _entry("0.1", None, "assumed")}


def _drive(figures: Figures, size: _Size) -> tuple[Entries, str]:
    """Return a motor that reaches the top speed against all losses, and the wheels' damping."""
    wheels, weight = (4 if figures.driven == "all" else 2), figures.mass_kg * G
    acceleration = figures.acceleration_mps2 or THRUST * G
    sure = BY_HAND["accel"] if figures.acceleration_mps2 else SPREAD[1]
    inertia = REFLECTED[figures.motor] * figures.mass_kg * size.radius**2 / wheels
    spun = figures.mass_kg + wheels * inertia / size.radius**2
    thrust = spun * acceleration + ROLLING * weight
    stall = thrust * size.radius / wheels
    lost = ROLLING * weight / thrust
    if lost > MAX_LOST:
        msg = (
            f"acceleration_mps2: {acceleration:g} is next to nothing beside the rolling resistance "
            f"that it has to overcome, {ROLLING * G:.2g} m/s2"
        )
        raise CarError(f"{figures.name}.toml: {msg}")
    fast = (1.0 + DAMPING) * figures.top_speed_mps / size.radius / (1.0 - lost)
    hold = stall if figures.motor == "geared" else HOLD * weight * size.radius / wheels
    steady = (figures.top_speed_mps * (0.1 * k - lost) / (1.0 - lost) for k in range(1, 11))
    table = ", ".join(f"{max(0.0, speed):.4g}" for speed in steady)
    damping = 0.25 * DAMPING * wheels * stall / fast
    how = "given: acceleration" if figures.acceleration_mps2 else "assumed"
    entries = {
        "layout": _entry(f'"{figures.driven}"', None, "given"),
        "front_driven": _entry("0" if figures.driven == "rear" else "1", None, "given"),
        "stall_torque_nm": _entry(f"{stall:.4g}", sure * stall, how),
        "no_load_speed_rad_s": _entry(f"{fast:.4g}", BY_HAND["speed"] * fast, "given: top speed"),
        "coulomb_torque_nm": _entry("0.0", 0.03 * stall, "assumed"),
        "reflected_inertia_kgm2": _entry(f"{inertia:.4g}", SPREAD[1] * inertia, "assumed"),
        "hold_torque_nm": _entry(f"{hold:.4g}", SPREAD[1] * hold, "assumed"),
        "throttle_speed_m_s": _entry(f"[{table}]", None, "from the top speed"),
    }
    return entries, _entry(f"{damping:.4g}", SPREAD[1] * damping, "assumed")


def _steering(figures: Figures) -> Entries:
    given = figures.steering_limit_rad
    return {
        "limit_rad": _given(given, "lock") if given else _entry("0.5", 0.08, "assumed"),
        "rate_rad_s": _entry("3.0", 1.5, "assumed: a hobby servo"),
        "geometry": _assumed('"ackermann"'),
    }


@cache
def _models() -> tuple[Car, ...]:
    return tuple(load_car(TYPES_DIR / f"{name}.toml") for name in LIKE)


def _scaled(ratio: Callable[[Car], float]) -> tuple[float, float]:
    """Return the geometric mean of a ratio of the shipped cars, and its relative spread."""
    logs = [math.log(ratio(car)) for car in _models()]
    return math.exp(statistics.fmean(logs)), min(max(SPREAD[0], statistics.stdev(logs)), SPREAD[1])


def _estimate(of: float, ratio: tuple[float, float]) -> tuple[float, str]:
    value = of * ratio[0]
    return value, _entry(f"{value:.4g}", ratio[1] * value, "scaled")


def _or_scaled(
    known: float | None, ratio: Callable[[Car], float], *, of: float, given: str
) -> tuple[float, str]:
    if known is not None:
        return known, _given(known, given)
    return _estimate(of, _scaled(ratio))


def _given(value: float, how: str) -> str:
    """Return a measured entry with the standard deviation in `BY_HAND`."""
    least = RULER_M if how == "length" else 0.0
    return _entry(f"{value:.6g}", max(least, BY_HAND[how] * value), "given")


def _assumed(value: str) -> str:
    return _entry(value, None, "assumed")


def _entry(value: str, std: float | None, source: str) -> str:
    spread = "" if std is None else f", std = {std:.2g}"
    return f'{{ value = {value}{spread}, source = "{source}" }}'


_LONG, _WIDE = "body.footprint_x_m", "body.footprint_y_m"


def _base(car: Car) -> float:
    return car.value("body.wheelbase_m")


def _radius(car: Car) -> float:
    return car.value("wheel.radius_m")


def _length(car: Car) -> float:
    rear, front = car.vector(_LONG)
    return front - rear


def _width(car: Car) -> float:
    right, left = car.vector(_WIDE)
    return left - right
