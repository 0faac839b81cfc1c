"""What signals must know of cars, read from their car files; no compiler of physics is needed.

    speed     the end of the throttle-speed table, else as fast as the lane allows
    slow      that table at 0.8 throttle, as drivers drive, else as the lane allows
    length    of the footprint
    reaction  the usual 0.3 s and what the file says that drive commands are late by

Comfortable braking and acceleration are the drivers' own, the same for all cars.
"""

import math
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from scm.errors import CarError, nearest, reading
from scm.traffic.signals.timing import NIGEL, CarFacts
from scm.vehicles.car_files import OWN_CARS, car_files

CRUISE_THROTTLE = 0.8


def facts_of(name_or_path: str) -> CarFacts:
    """Return the facts of a car by its name, or by the path of its file.

    Raises:
        CarError: when there is no such file, or it has no footprint.
    """
    data, footprint = _read(name_or_path)
    speeds = _numbers(data, "drive", "throttle_speed_m_s")
    late = _numbers(data, "drive", "delay_s")
    return CarFacts(
        speed_mps=max(speeds, default=math.inf),
        slow_mps=speeds[round(CRUISE_THROTTLE * len(speeds)) - 1] if speeds else math.inf,
        length_m=footprint[1] - footprint[0],
        reaction_s=NIGEL.reaction_s + (late[0] if late else 0.0),
    )


def outline_of(name_or_path: str) -> tuple[float, bool]:
    """Return what share of a car lies before its rear axle, and whether its roof has a tag.

    Raises:
        CarError: as `facts_of`.
    """
    data, (rear, front) = _read(name_or_path)
    return front / (front - rear), "ips" in data


def _read(name_or_path: str) -> tuple[dict[str, Any], tuple[float, ...]]:
    """Return a car file's content and its footprint along the car [m]: rear, front."""
    path = Path(name_or_path)
    named = car_files()
    if path.suffix != ".toml":
        path = named.get(name_or_path, path)
    if not path.is_file():
        known = sorted(named)
        hint = nearest(path.stem, known)
        raise CarError(
            f"{name_or_path}: no such car{hint}; cars by name: {', '.join(known)}; cars of your "
            f"own: {OWN_CARS}=FOLDER of their files"
        )
    with reading(path, "a TOML file", CarError):
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    footprint = _numbers(data, "body", "footprint_x_m")
    if len(footprint) != 2 or not footprint[0] < footprint[1]:
        raise CarError(f"{path}: body.footprint_x_m: got {footprint}, expected [rear, front]")
    return data, footprint


def slowest_of(cars: Iterable[CarFacts]) -> CarFacts:
    """Return one car that is as bad as the worst of all of them in everything.

    Raises:
        CarError: when there is none.
    """
    fleet = list(cars)
    if not fleet:
        raise CarError("the fleet: got no car, expected at least one")
    return CarFacts(
        speed_mps=max(car.speed_mps for car in fleet),
        slow_mps=min(car.slow_mps for car in fleet),
        decel_mps2=min(car.decel_mps2 for car in fleet),
        accel_mps2=min(car.accel_mps2 for car in fleet),
        reaction_s=max(car.reaction_s for car in fleet),
        length_m=max(car.length_m for car in fleet),
        gap_m=max(car.gap_m for car in fleet),
    )


def _numbers(data: dict[str, Any], section: str, key: str) -> tuple[float, ...]:
    """Return the numbers of an entry, one or several; empty: it is not in the file."""
    entry = data.get(section, {})
    entry = entry.get(key, {}) if isinstance(entry, dict) else {}
    value = entry.get("value") if isinstance(entry, dict) else entry
    if value is None:
        return ()
    return tuple(float(number) for number in (value if isinstance(value, list) else [value]))
