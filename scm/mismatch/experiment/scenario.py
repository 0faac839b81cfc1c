"""Writes a suggested drive as files: commands, a description, and an empty floor to drive it on.

`scm play next_drive.yaml` drives it, in a city of its own or with a car of a running one, and
records it; by hand or by a program of one's own, `next_drive.csv` says what to command when.
`next_drive_way.csv` says where the likeliest explanation takes the car.
"""

import csv
from pathlib import Path

import numpy as np
import yaml

from scm.mismatch.experiment.manoeuvres import Floor
from scm.mismatch.experiment.plan import Placed
from scm.mismatch.experiment.suggest import Suggestion
from scm.replay.drive import STEP_S

NAME = "next_drive"
WAY_S = 0.1
_MAP = """# An empty floor for a suggested drive.
map = 1
name = "{name}"
title = "Floor of a suggested drive"
source = "written by scm mismatch"
first_vehicle_tag_id = 1

[floor]
x_m = [{x[0]:.3f}, {x[1]:.3f}]
y_m = [{y[0]:.3f}, {y[1]:.3f}]

[tag]
tag_id = 0
x_m = {x[0]:.3f}
y_m = {y[0]:.3f}
size_m = 0.0762

[[spawns]]
name = "start"
pose = [{start.x:.4f}, {start.y:.4f}, {start.yaw:.4f}]
"""


def write_scenario(suggestion: Suggestion, car: str, folder: Path) -> list[Path]:
    """Write the files of every leg of the best experiment; return their descriptions.

    A car given by its file is named by its whole path.
    """
    if suggestion.best is None:
        return []
    folder.mkdir(parents=True, exist_ok=True)
    legs = suggestion.best.legs
    names = [NAME] if len(legs) == 1 else [f"{NAME}_{k + 1}" for k in range(len(legs))]
    text = suggestion.undecided.drive_this
    return [
        _written(leg, name, text, car, suggestion.floor, folder)
        for leg, name in zip(legs, names, strict=True)
    ]


def _written(leg: Placed, name: str, text: str, car: str, floor: Floor, folder: Path) -> Path:
    commands, floor_map = folder / f"{name}.csv", folder / f"{name}.toml"
    description, way = folder / f"{name}.yaml", folder / f"{name}_way.csv"
    with commands.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("t_s", "throttle", "steering"))
        writer.writerows([f"{v:.4g}" for v in row] for row in leg.manoeuvre.rows())
    with way.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("t_s", "x_m", "y_m", "yaw_rad"))
        every = slice(None, None, round(WAY_S / STEP_S))
        times = STEP_S * np.arange(leg.path.shape[1])
        writer.writerows(np.round(np.vstack((times, leg.path))[:, every].T, 4).tolist())
    map_text = _MAP.format(name=name, x=floor.x_m, y=floor.y_m, start=leg.start)
    floor_map.write_text(map_text, encoding="utf-8")
    fields = {
        "drive": 1,
        "say": text,
        "car": str(Path(car).resolve()) if Path(car).is_file() else car,
        "map": floor_map.name,
        "spawn": "start",
        "commands": commands.name,
    }
    description.write_text(yaml.safe_dump(fields, sort_keys=False), encoding="utf-8")
    return description
