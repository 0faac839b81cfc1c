"""Where the cars lie that have a name: those shipped, and those of one's own folder.

The environment's `SCM_CARS` names that folder, for each process of a city and each agent.
"""

import os
from pathlib import Path

from scm.errors import CarError

TYPES_DIR = Path(__file__).parent / "types"
OWN_CARS = "SCM_CARS"


def car_files() -> dict[str, Path]:
    """Return the car files by name.

    Raises:
        CarError: when there is no such folder, or a name in it is a shipped car's.
    """
    found = {path.stem: path for path in TYPES_DIR.glob("*.toml")}
    folder = os.environ.get(OWN_CARS, "")
    if folder and not Path(folder).is_dir():
        msg = f"{OWN_CARS}: got {folder!r}, expected a folder of car files"
        raise CarError(msg)
    for path in Path(folder).glob("*.toml") if folder else ():
        if path.stem in found:
            msg = f"{path}: {path.stem!r} is a shipped car's name, expected another"
            raise CarError(msg)
        found[path.stem] = path
    return found
