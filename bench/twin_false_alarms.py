"""How often the twin reports a change of cars that do not change, beside what it states.

    python -m bench twin_false_alarms [--hours 10] [--seed 4000] [--car nigel] [--keep FOLDER]
    python -m bench twin_false_alarms --hours 0 --keep FOLDER [--from-seed 4040]

Cars of `tests/reality` drive for 12, 20 or 40 minutes each, and their highest scores in every ten
seconds are held against the scores that `--false-alarm-h` sets. Of each drive counts what comes
before its first alarm. An hour costs about a minute of one core. What `--keep` stores is counted
again with what is driven.
"""

import argparse
import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import stats

from bench.twin import CAR, drive
from scm.arrays import Floats
from scm.twin.detector import threshold_of
from scm.twin.watch import CarWatch, looks
from scm.twin.windows import WatchedCar
from scm.vehicles.car import load_car
from tests.reality.routes import TEMPERS

MINUTES = (12.0, 20.0, 40.0)
SETTINGS_H = (0.5, 1.0, 2.0, 5.0, 20.0, 200.0)
STRETCH_S = 390.0  # alarms of one cause come together
LOW_H = 0.5  # score beyond which the tail is fitted


@dataclass(frozen=True, slots=True)
class Healthy:
    """One drive of a car that does not change.

    Attributes:
        driven_s: At the end of each span of ten seconds.
        highest: Score of it.
    """

    driven_s: Floats
    highest: Floats


def healthy(predictor: WatchedCar, car: str, seed: int, lasts_s: float) -> Healthy:
    """Drive and watch a car."""
    with tempfile.TemporaryDirectory() as folder:
        recording = drive("nothing", 1.0, seed, 0.0, Path(folder), lasts_s, car)
    watch = CarWatch(predictor, math.inf)
    rows = [(watch.driven_s, watch.highest) for _ in looks(recording, watch)]
    return Healthy(*np.array(rows).T)


def stored(folder: Path) -> list[tuple[int, Healthy]]:
    """Return the drives that a folder has, each with its seed."""
    found = list[tuple[int, Healthy]]()
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as file:
            found.append((int(path.stem), Healthy(file["driven_s"], file["highest"])))
    return found


def run_length(drives: Sequence[Healthy], threshold: float) -> tuple[float, int]:
    """Return the hours driven until each drive's first alarm or its end, and the alarms."""
    hours, alarms = 0.0, 0
    for one in drives:
        over = np.flatnonzero(one.highest >= threshold)
        alarms += len(over) > 0
        hours += one.driven_s[over[0] if len(over) else -1] / 3600.0
    return hours, alarms


def tail(drives: Sequence[Healthy]) -> tuple[float, float, int]:
    """Return the highest score of an hour, what e times as many hours add, and of how many peaks.

    Peaks are the highest scores of stretches, where they lie over a score that is reached often:
    they lie beyond it as exponential variables do.
    """
    hours, peaks = 0.0, list[float]()
    for one in drives:
        stretch = (one.driven_s // STRETCH_S).astype(int)
        peaks += [float(one.highest[stretch == k].max()) for k in range(stretch[-1] + 1)]
        hours += one.driven_s[-1] / 3600.0
    low = threshold_of(LOW_H)
    over = np.array([peak - low for peak in peaks if peak > low])
    if not len(over):
        return math.nan, math.nan, 0
    per_fold = float(over.mean())
    return low + per_fold * math.log(len(over) / hours), per_fold, len(over)


def report(drives: Sequence[Healthy]) -> None:
    """Print measured beside stated, for each setting."""
    hours = sum(one.driven_s[-1] for one in drives) / 3600.0
    print(f"\n{len(drives)} drives, {hours:.1f} h; one alarm in (90 % interval, of the counts)")
    for stated_h in SETTINGS_H:
        driven_h, alarms = run_length(drives, threshold_of(stated_h))
        low, high = (driven_h / n if n else math.inf for n in (_most(alarms), _least(alarms)))
        measured = driven_h / alarms if alarms else math.inf
        print(
            f"{stated_h:5.1f} h stated: {measured:6.2f} h ({low:.2f} to {high:.2f}), "
            f"{alarms:3} alarms, measured / stated {measured / stated_h:.2f}"
        )
    hourly, per_fold, peaks = tail(drives)
    print(
        f"{peaks} peaks: highest score of an hour {hourly:.2f}, "
        f"of e times as many {per_fold:.2f} more"
    )


def _most(alarms: int) -> float:
    """Return the upper end of the 90 % interval of what is expected, where so many came."""
    return float(stats.chi2.ppf(0.95, 2 * alarms + 2) / 2.0)


def _least(alarms: int) -> float:
    return float(stats.chi2.ppf(0.05, 2 * alarms) / 2.0) if alarms else 0.0


def main() -> None:
    """Drive, watch, count."""
    parser = argparse.ArgumentParser(prog="python -m bench twin_false_alarms", description=__doc__)
    parser.add_argument("--hours", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=4000, help="of the first drive")
    parser.add_argument("--car", default=CAR, choices=sorted(TEMPERS))
    parser.add_argument("--keep", type=Path, help="folder for the scores of each drive")
    given = parser.parse_args()
    drives = list[Healthy]()
    if given.keep is not None:
        given.keep.mkdir(parents=True, exist_ok=True)
        drives = [one for seed, one in stored(given.keep) if seed >= given.seed]
    seed, hours, predictor = given.seed + len(drives), 0.0, WatchedCar(load_car(given.car))
    while hours < given.hours:
        one = healthy(predictor, given.car, seed, 60.0 * MINUTES[seed % len(MINUTES)])
        if given.keep is not None:
            np.savez(given.keep / f"{seed}.npz", driven_s=one.driven_s, highest=one.highest)
        hours += one.driven_s[-1] / 3600.0
        print(f"seed {seed}: {one.driven_s[-1]:.0f} s, highest {one.highest.max():.2f}", flush=True)
        drives.append(one)
        seed += 1
    report(drives)


if __name__ == "__main__":
    main()
