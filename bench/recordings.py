"""What a recording costs: a pause of a day against none, and reading an hour of 12 channels.

Run with `python -m bench recordings`. Each step of `scm replay` and `scm mismatch` before the
search is timed on a drive of 30 s, and on the same with a pause of a day, of which the bar is
50 ms; all figures are processor time, the least of three. An hour at 100 Hz with 12 channels is
read in a process of its own: the bars are 2 s and 500 MB. NumPy's own reader stands beside it.
"""

import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from scm.clock import processor_s
from scm.data_quality.check import check
from scm.data_quality.prepare import prepare
from scm.mismatch.fit.data_split import split
from scm.mismatch.fit.likelihood import Likelihood
from scm.recording.read import Channel, Recording
from scm.replay.drive import Drive
from scm.replay.free_run import free_run
from scm.vehicles.car import Car, load_car

DAY_S = 86_400.0
LIMIT_MS, LIMIT_S, LIMIT_MB = 50.0, 2.0, 500
ROWS, COLUMNS = 360_000, 12
ROUNDS = 3
_READ = """
import resource, sys
from scm.clock import processor_s
from scm.recording.read import read_recordings
begun = processor_s()
(found,) = read_recordings(sys.argv[1])
print(processor_s() - begun, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""
CHANNELS = (
    ("pose.x", "m"), ("pose.y", "m"), ("pose.yaw", "rad"), ("command.throttle", "1"),
    ("command.steering", "1"), ("encoder.left", "count"), ("encoder.right", "count"),
    ("imu.accel_x", "m/s^2"), ("imu.accel_y", "m/s^2"), ("imu.gyro_z", "rad/s"), ("speed", "m/s"),
    ("battery.voltage", "V"),
)  # fmt: skip


def drive(car: Car, length_s: float = 30.0) -> Recording:
    """Return a drive in curves at 0.2 m/s, without noise."""
    t = np.arange(0.0, length_s, 0.02)
    speed = np.where(t < 2.0, 0.0, 0.2 + 0.05 * np.sin(t))
    rate = np.where(t < 2.0, 0.0, 0.6 * np.sin(0.4 * t))
    yaw = np.cumsum(rate) * 0.02
    curve = np.arctan(rate * car.value("body.wheelbase_m") / np.maximum(speed, 0.05))
    rows = {
        "pose.x": np.cumsum(speed * np.cos(yaw)) * 0.02,
        "pose.y": np.cumsum(speed * np.sin(yaw)) * 0.02,
        "pose.yaw": np.arctan2(np.sin(yaw), np.cos(yaw)),
        "command.throttle": speed / 0.27,
        "command.steering": curve / car.value("steering.limit_rad"),
    }
    channels = {n: Channel(t, v, None, (0.0, 0.0), "ratio") for n, v in rows.items()}
    return Recording(Path("drive/recording.yaml"), car.name, channels)


def paused(recording: Recording, for_s: float) -> Recording:
    """Return the drive with a pause in its middle."""
    channels = {
        name: replace(c, t=np.where(c.t >= 15.0, c.t + for_s, c.t))
        for name, c in recording.channels.items()
    }
    return replace(recording, channels=channels)


def steps(car: Car) -> dict[str, Callable[[Recording], object]]:
    """Return what is done with a recording before a search, by name."""
    return {
        "check": lambda r: check(r, car),
        "prepare (check, repair, cut)": lambda r: prepare(r, car),
        "free runs of `scm replay`": lambda r: [
            free_run(p, car) for p in prepare(r, car).recordings
        ],
        "drives, likelihood, parts": lambda r: split(
            Likelihood.of([Drive(part, car) for part in prepare(r, car).recordings], car)
        ),
    }


def cost_s(work: Callable[[Recording], object], recording: Recording) -> float:
    """Return the least processor time of a few rounds [s]."""
    costs = []
    for _ in range(ROUNDS):
        begun = processor_s()
        work(recording)
        costs.append(processor_s() - begun)
    return min(costs)


def pauses() -> None:
    """Print what a pause of a day costs."""
    car = load_car("nigel")
    whole = drive(car)
    late = paused(whole, DAY_S)
    print(
        "| step | without, ms | with a day, ms | more, ms | limit, ms |\n|---|---:|---:|---:|---:|"
    )
    for name, work in steps(car).items():
        work(whole)  # compiles
        before, after = (1e3 * cost_s(work, one) for one in (whole, late))
        print(f"| {name} | {before:.0f} | {after:.0f} | {after - before:.0f} | {LIMIT_MS:.0f} |")


def reading(folder: Path) -> None:
    """Print what reading an hour costs, and what NumPy needs for the same text."""
    rng = np.random.default_rng(1)
    values = np.column_stack((1.7e9 + 0.01 * np.arange(ROWS), rng.normal(size=(ROWS, COLUMNS))))
    names = ["t", *(f"c{i}" for i in range(COLUMNS))]
    np.savetxt(
        folder / "hour.csv",
        values,
        ["%.3f"] + ["%.6f"] * COLUMNS,
        ",",
        header=",".join(names),
        comments="",
    )
    files = ["hour.csv"]
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ModuleNotFoundError:
        print("pyarrow is not installed: no Parquet")
    else:
        parquet.write_table(
            pa.table(dict(zip(names, values.T, strict=True))), folder / "hour.parquet"
        )
        files.append("hour.parquet")
    print(
        "\n| an hour at 100 Hz, 12 channels | s | limit, s | peak, MB | limit, MB |\n"
        "|---|---:|---:|---:|---:|"
    )
    for file in files:
        lines = ["recording: 1", "vehicle: nigel", "tables:", f"  - file: {file}",
                 "    time: {column: t, unit: s}", "    channels:"]  # fmt: skip
        lines += [f"      {n}: {{column: c{i}, unit: {u!r}}}" for i, (n, u) in enumerate(CHANNELS)]
        (folder / "recording.yaml").write_text("\n".join(lines) + "\n")
        done = subprocess.run(
            [sys.executable, "-c", _READ, str(folder)], capture_output=True, text=True, check=True
        )
        took_s, peak_mb = map(float, done.stdout.split())
        print(f"| {file} | {took_s:.2f} | {LIMIT_S:g} | {peak_mb:.0f} | {LIMIT_MB} |")
    begun = processor_s()
    np.loadtxt(folder / "hour.csv", delimiter=",", skiprows=1)
    print(f"| numpy.loadtxt of the same | {processor_s() - begun:.2f} | | | |")


def main() -> None:
    """Print both tables."""
    pauses()
    with tempfile.TemporaryDirectory() as folder:
        reading(Path(folder))
