"""Makes recordings/sample: a minute of a simulated Nigel that conceals something.

Run with `python -m docs.make.sample` in a clone: the car is of the independent reality in
`tests/reality`, as in blind trials. The same seed makes the same rows.
"""

import gzip
import io
import sys
from pathlib import Path

import numpy as np

from tests.reality.cases import apply, draw_effects
from tests.reality.numbers import nominal
from tests.reality.recorded import DESCRIPTION, FILES, TABLES, record
from tests.reality.sensing import FAULTS, POSE_STD, YAW_STD

ROOT = Path(__file__).parents[2]
OUT = ROOT / "recordings" / "sample"
SHIPPED = ("commands", "poses")  # encoders and an IMU would double the time that a search takes
CAR, EFFECT, STRENGTH = "nigel", "steer_trim", 4.0
SEED, DURATION_S = 25, 60.0
HEAD = """\
# A minute of a simulated Nigel that is not as its car file says: README.md has more.
"""


def main() -> None:
    """Drive the car and write what its sensors saw."""
    rng = np.random.default_rng(SEED)
    effects = draw_effects((EFFECT,), CAR, (STRENGTH, STRENGTH * 1.0001), rng)
    numbers = apply(nominal(CAR), effects)
    drive = record(CAR, numbers, apply(FAULTS, effects), DURATION_S, rng)
    OUT.mkdir(exist_ok=True)
    text = DESCRIPTION.format(
        car=CAR, pose=POSE_STD[CAR], yaw=YAW_STD, accel=numbers["accel_noise"],
        gyro=numbers["gyro_noise"],
    )  # fmt: skip
    text = text[: text.index("  - file: encoders")]
    (OUT / "recording.yaml").write_text(HEAD + text.replace(".csv", ".csv.gz"), encoding="utf-8")
    for name, header, form in (table for table in TABLES if table[0] in SHIPPED):
        rows = io.StringIO()
        np.savetxt(rows, getattr(drive, name), form, ",", header=header, comments="")
        path = OUT / f"{FILES.get(name, f'{name}.csv')}.gz"
        path.write_bytes(gzip.compress(rows.getvalue().encode(), mtime=0))
        sys.stdout.write(f"{path.relative_to(ROOT)}: {path.stat().st_size / 1000:.0f} kB\n")
    sys.stdout.write(f"concealed: {EFFECT} {effects[0][2].parameters}\n")


if __name__ == "__main__":
    main()
