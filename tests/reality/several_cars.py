"""`python -m tests.reality.several_cars --out DIR`: cars under one camera, in one recording.

Each car is scattered as its file allows and drives a way of its own; what is given is the camera's
tilt, and how far the first car's tag is from where it is said to be. Nothing else is concealed.
`DIR/recording.yaml` is for `scm mismatch DIR`.
"""

import argparse
import shutil
import sys
from pathlib import Path

import numpy as np

from tests.reality.numbers import TYPES, nominal, scattered
from tests.reality.recorded import DESCRIPTION, record, write
from tests.reality.sensing import FAULTS

CAR = "nigel"


def write_cars(out: Path, count: int, seconds: float, faults_of, seed: int = 0) -> None:
    """Write one recording of several cars; `faults_of(k)` are the sensors' faults of car `k`."""
    tables = []
    for k in range(count):
        rng = np.random.default_rng([seed, k])
        name = f"car_{k + 1}"
        numbers = scattered(nominal(CAR), rng)
        drive = record(CAR, numbers, FAULTS | faults_of(k), seconds, rng)
        write(drive, CAR, numbers, out / name)
        said = (out / name / "recording.yaml").read_text(encoding="utf-8")
        (out / name / "recording.yaml").unlink()
        shutil.copy(TYPES / f"{CAR}.toml", out / f"{name}.toml")
        rows = said.partition("tables:\n")[2].replace("- file: ", f"- file: {name}/")
        tables.append(rows.replace("    time:", f"    vehicle: {name}.toml\n    time:"))
    head = "\n".join(
        line for line in DESCRIPTION.partition("tables:\n")[0].splitlines() if "vehicle" not in line
    )
    text = f"{head}\ntables:\n{''.join(tables)}"
    (out / "recording.yaml").write_text(text, encoding="utf-8")


def main() -> int:
    """Write the recording."""
    parser = argparse.ArgumentParser(prog="python -m tests.reality.several_cars")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--cars", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=90.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--tilt", type=float, default=0.0, help="1/m, along x")
    parser.add_argument("--tag", type=float, default=0.0, help="m ahead, of the first car")
    given = parser.parse_args()

    def faults_of(k: int) -> dict[str, float]:
        return {"tilt_x": given.tilt, "point_x": given.tag if k == 0 else 0.0}

    write_cars(given.out, given.cars, given.seconds, faults_of, given.seed)
    return 0


if __name__ == "__main__":
    sys.exit(main())
