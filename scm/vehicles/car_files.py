"""Car files by name: shipped ones, and those in the user's folder.

The environment variable `SCM_CARS` names that folder, for each process of a city and each agent.
Its default is `cars` beside the recordings of `scm up`, which are in `runs` by default.
"""

import os
from collections.abc import Mapping
from pathlib import Path

from scm.errors import CarError, reading

TYPES_DIR = Path(__file__).parent / "types"
OWN_CARS = "SCM_CARS"
USUAL_FOLDER = Path("runs/cars")
"""The user's folder, from the working directory, without `SCM_CARS`."""
varied_values: dict[str, Mapping[str, float | tuple[float, ...] | str]] = {}
"""Values by `section.key` of cars that are not as their files, see `scm.vehicles.car.varied_cars`.
"""


def name_own_folder(folder: Path) -> None:
    """Set the user's folder for this process and its children, unless `SCM_CARS` is set.

    Raises:
        CarError: when it cannot be made.
    """
    if not os.environ.get(OWN_CARS):
        with reading(folder, "a folder for car files", CarError):
            folder.mkdir(parents=True, exist_ok=True)
        os.environ[OWN_CARS] = str(folder.resolve())


def own_folder() -> Path | None:
    """Return the user's folder, or None if there is none or `SCM_CARS` is empty.

    Raises:
        CarError: when there is no such folder.
    """
    folder = os.environ.get(OWN_CARS)
    if folder is None:
        return USUAL_FOLDER if USUAL_FOLDER.is_dir() else None
    if folder and not Path(folder).is_dir():
        msg = f"{OWN_CARS}: got {folder!r}, expected a folder of car files"
        raise CarError(msg)
    return Path(folder) if folder else None


def car_files() -> dict[str, Path]:
    """Return the car files by name.

    Raises:
        CarError: when there is no such folder, or a file in it has the name of a shipped car.
    """
    found = {path.stem: path for path in TYPES_DIR.glob("*.toml")}
    folder = own_folder()
    for path in folder.glob("*.toml") if folder else ():
        if path.stem in found:
            msg = f"{path}: {path.stem!r} is a shipped car's name, expected another"
            raise CarError(msg)
        found[path.stem] = path
    return found
