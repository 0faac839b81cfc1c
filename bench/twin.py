"""How soon a change of a car is noticed, which, and since when; what watching costs.

    python -m bench twin [EFFECT ...] [--seed 1] [--strength 2] [--since-s 300] [--search]

Cars of `tests/reality`, whose ordinary numbers are not the file's, drive for ten minutes; each
effect sets in at once, or evenly in `--ramp-s`, in multiples of the smallest size that 90 s can
show. `nothing` is a car that does not change. What is named first is what shows the change most,
not a diagnosis; with `--search` each change is searched for as `scm up --twin` does, and the car
file found compared with the given one on the driving after that.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from bench.world import PERIOD_NS, tick, world_of
from scm.clock import seconds
from scm.errors import RecordingError
from scm.recorder.drives import recordings_of_one
from scm.recording.read import Recording
from scm.recording.span import part_of
from scm.twin.car import SEARCHED_AFTER_S, SEARCHED_BEFORE_S
from scm.twin.detector import Change, threshold_of
from scm.twin.investigation import compare, explain
from scm.twin.part import BUDGET_S
from scm.twin.trial.score import RAMP_OFF, STEP_OFF_S
from scm.twin.versions import verdict
from scm.twin.watch import CarWatch, watch
from scm.twin.windows import WatchedCar
from scm.vehicles.car import load_car
from tests.reality.cases import FAULTS, apply, draw_effects, nominal, scattered
from tests.reality.changing import Changing
from tests.reality.concealed import EFFECTS
from tests.reality.recorded import record, write

CAR, LASTS_S, FALSE_ALARM_H = "nigel", 600.0, 200.0
CARS, MOST_OF_A_CORE = 20, 0.15
FLEET, MOST_OF_WORLD, TICKS = 1000, 0.3, 50  # cars in lockstep, of the world's own time
NEVER = ("surface_patch", "unit_error", "clock_drift")  # of a place, and no change of a car


def drive(
    name: str, strength: float, seed: int, since_s: float, folder: Path,
    lasts_s: float = LASTS_S, car: str = CAR, ramp_s: float = 0.0,
) -> Recording:  # fmt: skip
    """Return the recording of a car in which an effect sets in."""
    rng = np.random.default_rng([seed, *name.encode()])
    usual = scattered(nominal(car), rng)
    names = () if name == "nothing" else (name,)
    effects = draw_effects(names, car, (strength, strength), rng)
    numbers, faults = (
        Changing(dict(before), apply(before, effects), since_s, since_s + ramp_s)
        for before in (usual, FAULTS)
    )
    write(record(car, numbers, faults, lasts_s, rng), car, usual, folder)
    (recording,) = recordings_of_one(folder)
    return recording


def search(recording: Recording, change: Change, folder: Path) -> str:
    """Return what a search finds, and whether its car file would be adopted."""
    begin_s = recording.begin_s or 0.0
    since_s, low_s, high_s = (t_s - begin_s for t_s in change.onset_s)
    until_s = max(since_s + SEARCHED_AFTER_S, change.noticed_s - begin_s)
    began_s = time.process_time()
    found = explain(
        part_of(recording, since_s - SEARCHED_BEFORE_S, until_s), CAR, folder / "report",
        folder / "1.toml", (begin_s + low_s, begin_s + high_s), BUDGET_S,
    )  # fmt: skip
    spent_s = time.process_time() - began_s
    names = " + ".join(one.name for one in found.effects) or "nothing"
    dated = (
        "" if found.since_s is None else f", onset {found.since_s[0] - begin_s - since_s:+.1f} s"
    )
    line = f"{names}{dated}, {spent_s:.0f} s of processor time"
    if found.car_file is None:
        return f"{line}; {found.text}"
    try:
        later = compare(part_of(recording, until_s, None), CAR, str(found.car_file))
    except RecordingError as error:
        return f"{line}; {error}"
    action, reason = verdict(later, is_last=True)
    return f"{line}; {action}: {reason}"


def world_s(cars: int) -> float:
    """Return the processor time in which a city of so many cars drives a second."""
    world, now = world_of(cars), iter(range(0, 10**15, PERIOD_NS))
    for _ in range(TICKS):
        tick(world, next(now), [])
    begun_s = time.process_time()
    for _ in range(TICKS):
        tick(world, next(now), [])
    return (time.process_time() - begun_s) / TICKS / seconds(PERIOD_NS)


def main() -> None:
    """Print a row an effect, and what they are together."""
    parser = argparse.ArgumentParser(prog="python -m bench twin", description=__doc__)
    listed = [n for n, one in EFFECTS.items() if one.listed and CAR in one.smallest]
    every = [name for name in listed if name not in NEVER]
    parser.add_argument("effects", nargs="*", default=[*every, "nothing"])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--strength", type=float, default=2.0)
    parser.add_argument("--since-s", type=float, default=300.0)
    parser.add_argument("--ramp-s", type=float, default=0.0, help="in which it sets in (0)")
    parser.add_argument("--search", action="store_true", help="for what each change is")
    given = parser.parse_args()
    for name in given.effects:
        if name not in (*every, "nothing"):
            parser.error(f"{name}: expected one of {', '.join(every)}, nothing")
    predictor, threshold = WatchedCar(load_car(CAR)), threshold_of(FALSE_ALARM_H)
    after_s, driven_s, spent_s, dated, near, named = list[float](), 0.0, 0.0, 0, 0, 0
    most_off_s = max(STEP_OFF_S, RAMP_OFF * given.ramp_s)
    for name in given.effects:
        with tempfile.TemporaryDirectory() as folder:
            recording = drive(
                name, given.strength, given.seed, given.since_s, Path(folder), ramp_s=given.ramp_s
            )
        car, begun_s = CarWatch(predictor, threshold), time.process_time()
        changes = watch(recording, car)
        spent_s, driven_s = spent_s + time.process_time() - begun_s, driven_s + car.driven_s
        if not changes:
            print(f"{name:<20}no change noticed", flush=True)
            continue
        first = changes[0]
        at_s, low_s, high_s = (t_s - given.since_s for t_s in first.change.onset_s)
        after_s.append(first.change.noticed_s - given.since_s)
        dated += low_s <= 0.0 <= high_s
        near += abs(at_s) <= most_off_s
        named += first.number.effect == name
        print(
            f"{name:<20}{after_s[-1]:+5.0f} s, onset {at_s:+5.1f} s ({low_s:+.1f} to {high_s:+.1f})"
            f", {first.number.effect} {first.change.size:+.3g}, score {abs(first.change.score):.0f}"
            f"{', and later again' if len(changes) > 1 else ''}",
            flush=True,
        )
        if given.search:
            with tempfile.TemporaryDirectory() as folder:
                print(" " * 20 + search(recording, first.change, Path(folder)), flush=True)
    changed = sum(name != "nothing" for name in given.effects)
    print(
        f"\nnoticed {len(after_s)} of {changed}, {named} by name; onset in its interval {dated}, "
        f"within {most_off_s:g} s {near}"
    )
    if after_s:
        print(
            f"after {np.median(after_s):.0f} s (median), {np.percentile(after_s, 95):.0f} s (95 %)"
        )
    share = CARS * spent_s / driven_s
    print(f"{CARS} cars: {share:.2f} of a core, {share / MOST_OF_A_CORE:.2f} of the limit")
    watched_s, own_s = FLEET * spent_s / driven_s, world_s(FLEET)
    print(
        f"{FLEET} cars in lockstep: {watched_s:.2f} s for a second, {watched_s / own_s:.1f} of the "
        f"world's own {own_s:.2f} s; limit {MOST_OF_WORLD}"
    )


if __name__ == "__main__":
    main()
