"""Writes the given car file with the parameters of a calibration, and their sources."""

import math
from pathlib import Path

from scm.errors import CarError
from scm.vehicles.car import Car, load_car
from scm.vehicles.car_text import number, quoted, set_entry, set_list, term_names
from vehicle_agent.calibrate.fit import TERMS, Z_90, Fit

COMMENT = "found by vehicle-agent calibrate"
DELAYING = ("drive_delay", "steer_delay")
DIGITS = 6


def write_car(car: Car, found: Fit, path: Path, drive: str, tag_id: int | None = None) -> Car:
    """Write a car file, and return the car that it loads as.

    Args:
        car: The given car; its text stays except for the new values.
        found: Result of the fit.
        path: Of the new file.
        drive: Name of the drive, for the sources.
        tag_id: Of the tag on the car's roof; None: not known.

    Raises:
        CarError: when the written file does not load with the same values.
    """
    names = term_names(car.with_terms((*TERMS, *DELAYING)))
    text = set_list(car.path.read_text(encoding="utf-8"), "terms", names, COMMENT)
    for key, one in found.numbers.items():
        section, _, name = key.partition(".")
        source = quoted(f"calibrated: {drive}, 90 % {one.low:.4g}..{one.high:.4g}")
        value, std = number(one.value, DIGITS), number((one.high - one.low) / (2.0 * Z_90), 3)
        entry = f"{{ value = {value}, std = {std}, source = {source} }}"
        text = set_entry(text, section, name, entry)
    if tag_id is not None:
        source = quoted(f"seen on its roof: {drive}")
        text = set_entry(text, "ips", "tag_id", f"{{ value = {tag_id}, source = {source} }}")
    path.write_text(text, encoding="utf-8")
    made = load_car(path)
    for key, one in found.numbers.items():
        if not math.isclose(made.value(key), one.value, rel_tol=10.0 ** (1 - DIGITS)):
            msg = f"{path}: {key}: got {made.value(key)}, expected {one.value}: written wrongly"
            raise CarError(msg)
    return made
