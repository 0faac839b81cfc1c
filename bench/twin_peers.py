"""The twin's detector beside three peers: who notices a change, how soon, at equal false alarms.

    python -m bench twin_peers [EFFECT ...] [--seed 22] [--strength 2] [--healthy 24] [--check 12]

Cars of `tests/reality` drive for ten minutes, and each effect sets in at 300 s, as in `python -m
bench twin`. All read the same recordings and the same car file, and learn each car's usual misses
from its first 200 s:

cusum:    two-sided cumulative sums of what poses show of each second, and of its square, (Page,
          1954), beside the car file's prediction;
kalman:   an extended Kalman filter (`bench.twin_kalman`): how far parameters and innovations of the
          newest span depart from those before;
residual: ASAP's idea: what the car file misses is learned, here by ridge regression on squares of
          commands and motion, from all healthy cars and then the car's own 200 s; what remains
          is watched.

Some healthy drives teach the methods and scale their tests to count alike; the threshold of each is
the score that so many of further healthy drives reach. The twin looks each ten seconds, as it does
in a city, the others each half second. Named is what the first report calls by the right name.
"""

import argparse
import math
import pickle
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np

from bench.twin import CAR, LASTS_S, NEVER, drive
from bench.twin_peer_methods import LEARN_S, METHODS, Drive, Method
from scm.arrays import Floats
from scm.recording.read import Recording
from scm.twin.watch import CarWatch, looks
from scm.twin.windows import WatchedCar, Windows
from scm.vehicles.car import load_car
from tests.reality.concealed import EFFECTS

SINCE_S = 300.0
FIRST_HEALTHY = 5000
THRESHOLDS = ((1, 1.0), (3, 1.0), (1, 1.7))  # healthy drives that reach a score; of that score


class Collecting(CarWatch):
    """A watch that remembers the windows."""

    def __init__(self, predictor: WatchedCar) -> None:
        super().__init__(predictor, math.inf)
        self.spans = list[Windows]()

    def _windows(self, recording: Recording, first_s: float, last_s: float) -> Iterator[Windows]:
        for windows in super()._windows(recording, first_s, last_s):
            self.spans.append(windows)
            yield windows


def driven(predictor: WatchedCar, name: str, strength: float, seed: int) -> Drive:
    """Drive a car, and watch it."""
    with tempfile.TemporaryDirectory() as folder:
        recording = drive(name, strength, seed, SINCE_S, Path(folder))
    watch = Collecting(predictor)
    for _ in looks(recording, watch):
        pass
    return Drive(name, recording, tuple(watch.spans))


@dataclass(frozen=True, slots=True)
class Found:
    """When a drive's score first reached a threshold, and what that was called."""

    t_s: float
    effect: str


class Calibrated:
    """A method whose tests count alike.

    Attributes:
        highest: Scores of the healthy drives, falling.
    """

    def __init__(self, method: Method, fit: Sequence[Drive], healthy: Sequence[Drive]) -> None:
        method.fit(fit)
        self._method = method
        most = np.array([method.tests(one)[1].max(axis=0) for one in fit])
        self._scale = np.maximum(np.percentile(most, 90, axis=0), 1e-12)
        scores = [float((method.tests(one)[1] / self._scale).max()) for one in healthy]
        self.highest: Floats = np.sort(scores)[::-1]

    def found(self, one: Drive, threshold: float) -> Found | None:
        """Return what a drive's score first shows, if it reaches a threshold."""
        t, tests = self._method.tests(one)
        over = np.flatnonzero((tests >= threshold * self._scale).any(axis=1))
        if not len(over):
            return None
        name = self._method.name(one, tests[over[0]] / self._scale, threshold * self._scale)
        return Found(float(t[over[0]]), name)


def row(way: Calibrated, threshold: float, changed: Sequence[Drive]) -> tuple[str, str]:
    """Return a line of the table, and one with each effect's time to notice."""
    after, early, named, each = list[float](), 0, 0, list[str]()
    for one in changed:
        found = way.found(one, threshold)
        early += found is not None and found.t_s <= SINCE_S
        if found is None or found.t_s <= SINCE_S:
            each.append(f"{one.name} {'not' if found is None else 'before'}")
            continue
        after.append(found.t_s - SINCE_S)
        named += found.effect == one.name
        each.append(f"{one.name} {after[-1]:.0f}")
    hours = len(changed) * (SINCE_S - LEARN_S) / 3600.0
    times = f"{np.median(after):5.0f} s {np.percentile(after, 95):5.0f} s" if after else " " * 15
    line = f"{len(after):3} of {len(changed)}  {times}  {named:3} named"
    return f"{line}, {early} false before in {hours:.1f} h", ", ".join(each)


def stored(path: Path | None, make: Callable[[], Drive]) -> Drive:
    """Return a drive that is stored there, or make and store it."""
    if path is not None and path.exists():
        return cast("Drive", pickle.loads(path.read_bytes()))
    made = make()
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(pickle.dumps(made))
    return made


def main() -> None:
    """Print a row a method, and threshold."""
    parser = argparse.ArgumentParser(prog="python -m bench twin_peers", description=__doc__)
    listed = [n for n, one in EFFECTS.items() if one.listed and CAR in one.smallest]
    parser.add_argument("effects", nargs="*", default=[n for n in listed if n not in NEVER])
    parser.add_argument("--seed", type=int, default=22)
    parser.add_argument("--strength", type=float, default=2.0)
    parser.add_argument(
        "--fit", type=int, default=12, help="healthy drives that methods learn from"
    )
    parser.add_argument("--healthy", type=int, default=24, help="others, that set thresholds")
    parser.add_argument("--keep", type=Path, help="folder in which drives are stored")
    given = parser.parse_args()
    predictor, drives = WatchedCar(load_car(CAR)), list[Drive]()
    seeds = range(FIRST_HEALTHY, FIRST_HEALTHY + given.fit + given.healthy)
    wanted = [*(("nothing", seed) for seed in seeds), *((n, given.seed) for n in given.effects)]
    for name, seed in wanted:
        path = given.keep and given.keep / f"{name}-{seed}-{given.strength:g}.pickle"
        drives.append(stored(path, lambda: driven(predictor, name, given.strength, seed)))  # noqa: B023
    fit, healthy, changed = (
        drives[: given.fit], drives[given.fit : len(seeds)], drives[len(seeds) :]
    )  # fmt: skip
    ways = {name: Calibrated(make(), fit, healthy) for name, make in METHODS.items()}
    for rank, factor in THRESHOLDS:
        hours = given.healthy * (LASTS_S - LEARN_S) / 3600.0 / rank
        print(f"\n{factor:g} of the score of one false alarm in {hours:.1f} h after learning")
        for name, way in ways.items():
            line, each = row(way, factor * way.highest[rank - 1], changed)
            print(f"{name:<10}{line}\n          {each}", flush=True)


if __name__ == "__main__":
    main()
