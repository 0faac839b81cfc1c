"""Reports of made-up findings, as pages list and show them."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from msgspec.structs import replace

from scm.mismatch.report.cars_page import write_several
from scm.mismatch.report.write import write_report
from tests.unit.mismatch import made_up_findings as made_up

REPORTS = {
    "two-effects": "pair",
    "undecided": "undecided",
    "healthy": "none",
    "hurried": "cut_short",
}
DRIVE = {
    "next_drive.yaml": "drive: 1\ncommands: next_drive.csv\n",
    "next_drive.csv": "t_s,throttle,steering\n0,0,0\n0.2,0.02,0\n40,0,0\n",
    "next_drive_way.csv": "t_s,x_m,y_m,yaw_rad\n0,0,0,0\n40,0.01,0,0\n",
}
"""What the undecided report asks for: a car stays where it is."""


@contextmanager
def made_reports(folder: Path, *names: str) -> Iterator[Path]:
    """Write reports into a folder, all of `REPORTS` unless some are named; remove them after."""
    for name in names or REPORTS:
        found, *rest = made_up.CASES[REPORTS[name]]()
        if found.undecided:
            more = replace(
                found.undecided[0], between=("motor_gain", "aero_drag"), expected_separation=1.0
            )
            found = replace(found, undecided=(*found.undecided, more))
        write_report(found, *rest, folder / name)
    drive = folder / "undecided" / "next_drive"
    drive.mkdir()
    for name, text in DRIVE.items():
        (drive / name).write_text(text, "utf-8")
    yield folder
    shutil.rmtree(folder)


def write_fleet(folder: Path) -> None:
    """Write a report of two cars that were searched together."""
    cars = {car: made_up.CASES["none"]() for car in ("n1", "n2")}
    for car, made in cars.items():
        write_report(*made, folder / car)
    found = {car: made[0] for car, made in cars.items()}
    write_several(found, dict.fromkeys(cars, ("run",)), [], 3.0, folder)
