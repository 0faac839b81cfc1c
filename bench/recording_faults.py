"""Recordings with random faults: a replay stays the same, or a sentence names the change.

`python -m bench recording_faults [COUNT] [SEED]` spoils a clean drive of a Nigel in COUNT ways, one
or two at once, reads each as `scm replay` does, and counts: errors as of the clean drive; the fault
named; refused with the reason; and what must not be: wrong without a word, slow, or an exception
of another library's.
"""

import argparse
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from scm.data_quality.prepare import prepare
from scm.errors import ScmError
from scm.geometry import Pose2
from scm.recording.read import read_recordings
from scm.replay.free_run import free_run, joined
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet

STEP_S, SECONDS, HORIZON_S = 0.01, 30.0, 1.0
COMPARED = ("x", "y", "yaw", "yaw_rate", "wheel_angle.rl", "wheel_angle.rr")
SAME, SAME_M = (
    1.5,
    0.003,
)  # errors up to this factor, or this much more, are those of the clean drive
SLOWEST_S = 5.0  # of a processor
FEWEST = 0.9  # of the clean drive's windows, below which lost ones want a sentence
COLUMNS = {
    "pose": {"x": ("pose.x", "m"), "y": ("pose.y", "m"), "yaw": ("pose.yaw", "rad")},
    "command": {"u": ("command.throttle", "1"), "s": ("command.steering", "1")},
    "wheels": {"l": ("encoder.left", "count"), "r": ("encoder.right", "count"),
               "w": ("imu.gyro_z", "rad/s")},
}  # fmt: skip


@dataclass
class Made:
    """Tables of a drive as they will be written: columns by table, and how they are described."""

    tables: dict[str, dict[str, np.ndarray]]
    units: dict[str, str] = field(default_factory=dict)
    time_unit: dict[str, str] = field(default_factory=dict)
    delimiter: str = ","
    encoding: str = "utf-8"
    newline: str = "\n"
    words: list[tuple[str, ...]] = field(default_factory=list)
    fatal: bool = False

    def name(self, *words: str) -> None:
        """Say which words may name the change; any one of them will do."""
        self.words.append(words)


@cache
def clean() -> dict[str, dict[str, np.ndarray]]:
    """Return a drive of the simulator itself: poses and wheels at 50 Hz, commands at 20 Hz."""
    rng, car = np.random.default_rng(5), load_car("nigel")
    t = STEP_S * np.arange(round(SECONDS / STEP_S))
    throttle = rng.uniform(0.35, 0.95, len(t))[(t / 1.1).astype(int)]
    steering = rng.uniform(-0.8, 0.8, len(t))[(t / 1.7).astype(int)]
    fleet = Fleet(car, 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    run = {n: v[:, 0] for n, v in fleet.rollout(throttle, steering, STEP_S, COMPARED).items()}
    counts = car.value("encoder.counts_per_revolution") / (2.0 * np.pi)
    after, slow, held = t + STEP_S, slice(None, None, 2), slice(None, None, 5)
    wrapped = np.arctan2(np.sin(run["yaw"]), np.cos(run["yaw"]))
    noise = rng.normal(0.0, 0.0005, (2, len(t)))
    return {
        "pose": {"t": after[slow], "x": (run["x"] + noise[0])[slow],
                 "y": (run["y"] + noise[1])[slow], "yaw": wrapped[slow]},
        "command": {"t": t[held], "u": throttle[held], "s": steering[held]},
        "wheels": {"t": after[slow], "l": np.round(counts * run["wheel_angle.rl"])[slow],
                   "r": np.round(counts * run["wheel_angle.rr"])[slow], "w": run["yaw_rate"][slow]},
    }  # fmt: skip


def write(made: Made, folder: Path) -> Path:
    """Write the tables and their description; return the latter."""
    lines = ["recording: 1", "vehicle: nigel", "tables:"]
    for table, columns in made.tables.items():
        names = list(columns)
        rows = zip(*(columns[name] for name in names), strict=True)
        text = made.newline.join(
            [
                made.delimiter.join(names),
                *(made.delimiter.join(map(_cell, row)) for row in rows),
                "",
            ]
        )
        (folder / f"{table}.csv").write_bytes(text.encode(made.encoding))
        unit = made.time_unit.get(table, "s")
        lines += [
            f"  - file: {table}.csv",
            f"    time: {{column: t, unit: {unit}}}",
            "    channels:",
        ]
        for name, (channel, unit) in COLUMNS[table].items():
            more = made.units.get(name, f"unit: '{unit}'")
            lines.append(f"      {channel}: {{column: {name}, {more}}}")
    path = folder / "recording.yaml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _cell(value: float) -> str:
    return "" if np.isnan(value) else repr(float(value))


# -- faults: each changes what is written, and says which words may name it -------------------


def _table(made: Made, rng: np.random.Generator) -> str:
    return str(rng.choice(list(made.tables)))


def _rows(made: Made, table: str, order: np.ndarray) -> None:
    made.tables[table] = {name: values[order] for name, values in made.tables[table].items()}


def shuffled(made: Made, rng: np.random.Generator) -> None:
    table = _table(made, rng)
    _rows(made, table, rng.permutation(len(made.tables[table]["t"])))


def late_rows(made: Made, rng: np.random.Generator) -> None:
    table = _table(made, rng)
    n = len(made.tables[table]["t"])
    late = np.arange(n) + np.where(np.arange(n) % 2, rng.integers(2, 12), 0) + 0.5
    _rows(made, table, np.argsort(late, kind="stable"))


def repeated(made: Made, rng: np.random.Generator) -> None:
    table = _table(made, rng)
    n = len(made.tables[table]["t"])
    extra = rng.choice(n, max(1, int(n * rng.uniform(0.001, 0.3))), replace=False)
    _rows(made, table, np.sort(np.concatenate((np.arange(n), extra)), kind="stable"))


def hole(made: Made, rng: np.random.Generator) -> None:
    table, start, long = _table(made, rng), rng.uniform(3, 20), rng.uniform(0.3, 6.0)
    t = made.tables[table]["t"]
    _rows(made, table, np.flatnonzero((t < start) | (t > start + long)))
    made.name("gap", "pause", "missing", "cut", "without")


def paused(made: Made, rng: np.random.Generator) -> None:
    start, long = rng.uniform(5, 25), 10.0 ** rng.uniform(0.5, 6)
    for columns in made.tables.values():
        columns["t"] = np.where(columns["t"] > start, columns["t"] + long, columns["t"])
    made.name("gap", "pause", "cut", "stretch")


def stray(made: Made, rng: np.random.Generator) -> None:
    table = _table(made, rng)
    t = made.tables[table]["t"].copy()
    row = int(rng.integers(len(t)))
    t[row] = rng.choice([0.0, 1e9, -500.0, t[row] + 86400.0, t[row] - 86400.0, 1e15])
    made.tables[table]["t"] = t
    made.name("stamp", "row", "time")


def since_1970(made: Made, rng: np.random.Generator) -> None:
    since = 1.7e9 + rng.uniform(0, 1e6)
    for columns in made.tables.values():
        columns["t"] = columns["t"] + since


def time_unit_wrong(made: Made, rng: np.random.Generator) -> None:
    factor = float(rng.choice([1e3, 1e6, 1e9]))
    tables = list(made.tables) if rng.random() < 0.5 else [_table(made, rng)]
    for table in tables:
        made.tables[table]["t"] = np.round(made.tables[table]["t"] * factor)
    made.name("unit", "stamps are", "apart")


def time_unit_stated(made: Made, rng: np.random.Generator) -> None:
    unit, factor = [("ms", 1e3), ("us", 1e6), ("ns", 1e9)][rng.integers(3)]
    table = _table(made, rng)
    made.tables[table]["t"] = np.round(made.tables[table]["t"] * factor)
    made.time_unit[table] = unit


def unit_stated(made: Made, rng: np.random.Generator) -> None:
    pose, wheels = made.tables["pose"], made.tables["wheels"]
    kind = rng.integers(4)
    if kind == 0:
        pose["x"], made.units["x"] = 1e2 * pose["x"], "unit: cm"
    elif kind == 1:
        pose["yaw"], made.units["yaw"] = np.degrees(pose["yaw"]), "unit: deg"
    elif kind == 2:
        wheels["w"], made.units["w"] = np.degrees(wheels["w"]), "unit: deg/s"
    else:
        pose["y"], made.units["y"] = (
            -pose["y"] * 2.0 + 1.0,
            "unit: m, sign: -1, scale: 0.5, offset: -0.5",
        )


def unit_wrong(made: Made, rng: np.random.Generator) -> None:
    pose, wheels, command = made.tables["pose"], made.tables["wheels"], made.tables["command"]
    kind = rng.integers(4)
    if kind == 0:
        pose["yaw"] = np.degrees(pose["yaw"])
    elif kind == 1:
        wheels["w"] = np.degrees(wheels["w"])
    elif kind == 2:
        command["s"] = np.degrees(command["s"] * 0.5236)
        made.units["s"] = "unit: rad"
    else:
        command["u"] = 100.0 * command["u"]
    made.name("unit", "deg", "too large", "%", "-1 to 1")


def wrapped(made: Made, rng: np.random.Generator) -> None:
    bits = int(rng.choice([12, 15, 16]))
    signed = rng.random() < 0.5
    for name in ("l", "r"):
        counts = made.tables["wheels"][name] + rng.integers(0, 1 << bits)
        low = (1 << (bits - 1)) if signed else 0
        made.tables["wheels"][name] = (counts + low) % (1 << bits) - low
    made.name("wrap", "overflow", "counter", "unwrapped")


def restarted(made: Made, rng: np.random.Generator) -> None:
    wheels = made.tables["wheels"]
    row = int(rng.integers(200, len(wheels["t"]) - 200))
    for name in ("l", "r"):
        values = wheels[name].copy()
        values[row:] -= values[row] if rng.random() < 0.7 else 20000.0
        wheels[name] = values
    made.name("restart", "begins anew", "counter", "jump")


def glitch(made: Made, rng: np.random.Generator) -> None:
    table, name, size = [
        ("wheels", "l", None), ("wheels", "r", 1e6), ("pose", "x", 0.3), ("pose", "y", -2.0),
        ("pose", "yaw", 1.5), ("wheels", "w", 60.0),
    ][rng.integers(6)]  # fmt: skip
    values = made.tables[table][name].copy()
    row = int(rng.integers(100, len(values) - 100))
    values[row] = 0.0 if size is None else values[row] + size
    made.tables[table][name] = values
    made.name("row", "spike", "jump", "left out", "glitch")


def empty_cells(made: Made, rng: np.random.Generator) -> None:
    table = _table(made, rng)
    name = str(rng.choice([n for n in made.tables[table] if n != "t"]))
    values = made.tables[table][name].copy()
    values[rng.random(len(values)) < rng.uniform(0.001, 0.05)] = np.nan
    made.tables[table][name] = values


def dialect(made: Made, rng: np.random.Generator) -> None:
    made.delimiter = str(rng.choice([",", ";", "\t", " "]))
    made.encoding = str(rng.choice(["utf-8", "utf-8-sig", "utf-16", "latin-1"]))
    made.newline = str(rng.choice(["\n", "\r\n"]))


FAULTS: tuple[Callable[[Made, np.random.Generator], None], ...] = (
    shuffled, late_rows, repeated, hole, paused, stray, since_1970, time_unit_wrong,
    time_unit_stated, unit_stated, unit_wrong, wrapped, restarted, glitch, empty_cells, dialect,
)  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """What became of one spoilt recording; `kind` is `same`, `named`, `refused` or a failure."""

    kind: str
    faults: tuple[str, ...]
    text: str = ""

    @property
    def is_right(self) -> bool:
        """Whether nobody was misled."""
        return self.kind in ("same", "named", "refused")


def errors_of(path: Path) -> tuple[np.ndarray, str]:
    """Return the windows' position errors [m], and the remarks on the recording."""
    (recording,) = read_recordings(path)
    car = load_car(recording.vehicle)
    prepared = prepare(recording, car)
    text = " ".join(
        [*prepared.account, *(f"{p.name} {p.text} {p.corrected}" for p in prepared.problems)]
    )
    runs, failures = [], []
    for part in prepared.recordings:
        try:
            runs.append(free_run(part, car, HORIZON_S))
        except ScmError as error:
            failures.append(str(error))
    if not runs:
        raise ScmError("; ".join(failures) + " " + text)
    run = joined(runs)
    return run.position_error()[:, -1], " ".join([text, *failures, *map(str, run.left_out)])


@cache
def reference() -> np.ndarray:
    """Return the clean drive's errors."""
    with tempfile.TemporaryDirectory() as folder:
        return errors_of(write(_made(), Path(folder)))[0]


def _made() -> Made:
    return Made({table: dict(columns) for table, columns in clean().items()})


def tried(seed: int) -> Outcome:
    """Return what became of one recording, spoilt by one or two faults."""
    rng, made = np.random.default_rng(seed), _made()
    chosen = rng.choice(len(FAULTS), size=1 + int(rng.random() < 0.3), replace=False)
    for k in chosen:
        FAULTS[k](made, rng)
    names = tuple(FAULTS[k].__name__ for k in chosen)
    good = reference()
    begun = time.process_time()
    try:
        with tempfile.TemporaryDirectory() as folder:
            errors, text = errors_of(write(made, Path(folder)))
    except ScmError as error:
        known = not made.words or any(
            w in str(error).lower() for words in made.words for w in words
        )
        return Outcome("refused" if known else "refused without the reason", names, str(error))
    except Exception as error:  # noqa: BLE001 what must never reach a user is counted here
        return Outcome("foreign exception", names, f"{type(error).__name__}: {error}")
    took_s = time.process_time() - begun
    if took_s > SLOWEST_S:
        return Outcome("slow", names, f"{took_s:.1f} s")
    high = max(SAME * float(np.percentile(good, 90)), float(np.percentile(good, 90)) + SAME_M)
    same = float(np.percentile(errors, 90)) < high
    lost = len(errors) < FEWEST * len(good)
    named = all(any(w in text.lower() for w in words) for words in made.words)
    if same and (not lost or named):
        return Outcome("same" if not lost else "named", names, text)
    if named and made.words:
        return Outcome("named", names, text)
    return Outcome("wrong without a word", names,
                   f"p90 {np.percentile(errors, 90):.4f} of {np.percentile(good, 90):.4f}, "
                   f"{len(errors)} of {len(good)} windows; {text[:300]}")  # fmt: skip


def main() -> None:
    """Print how many of how many were right, and every one that was not."""
    parser = argparse.ArgumentParser(
        prog="python -m bench recording_faults", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("count", nargs="?", type=int, default=2000)
    parser.add_argument("seed", nargs="?", type=int, default=0, help="of the first draw")
    arguments = parser.parse_args()
    count, seed = arguments.count, arguments.seed
    kinds, wrong = Counter[str](), Counter[tuple[str, tuple[str, ...]]]()
    for k in range(count):
        outcome = tried(seed + k)
        kinds[outcome.kind] += 1
        if not outcome.is_right:
            wrong[outcome.kind, outcome.faults] += 1
            print(f"{seed + k}: {outcome.kind}: {', '.join(outcome.faults)}: {outcome.text[:400]}")
    print(dict(kinds))
    print(f"{sum(wrong.values())} of {count} misled")


if __name__ == "__main__":
    main()
