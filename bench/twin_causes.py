"""Whose change is it? Scenes of several cars on one floor, in each of which one thing changes.

    python -m bench twin_causes [KIND ...] [--scenes 4] [--seed 1] [--cars 3]

Cars of `tests/reality`, whose ordinary numbers are not the file's, drive for twelve minutes on the
same floor. After about 300 s one of them changes, or its tag is knocked aside, or a patch of the
floor resists rolling, or one of two cameras sinks, or the whole floor changes (`car+place`: both at
once). Of each change that is noticed it is judged one, two and four minutes later whose it is.
"""

import argparse
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from scm.arrays import Floats
from scm.clock import seconds
from scm.errors import RecordingError
from scm.recorder.drives import recordings_of_one
from scm.recording.read import Recording
from scm.recording.span import part_of
from scm.records.twins import TwinChange
from scm.twin.causes import located
from scm.twin.detector import threshold_of
from scm.twin.evidence import OWN, Witness, witness
from scm.twin.places import PlaceWatch
from scm.twin.watch import AFTER_S, BEFORE_S, SPAN_S, SPANS_A_PLACE, CarWatch
from scm.twin.windows import WatchedCar
from scm.vehicles.car import load_car
from tests.reality.cases import FAULTS, apply, draw_effects, nominal, scattered
from tests.reality.changing import Changing
from tests.reality.recorded import record, write

CAR, LASTS_S, FALSE_ALARM_H = "nigel", 720.0, 200.0
SINCE_S, STRENGTH = (280.0, 320.0), (2.0, 3.0)
LATER_S = (60.0, 120.0, 240.0)
EFFECTS = {
    "car": ("steer_trim", "drive_gain", "rolling_resistance", "payload", "steer_gain"),
    "tag": ("pose_point",),
    "place": ("surface_patch",),
    "camera": (),
    "everywhere": ("rolling_resistance", "grade"),
}
FEWEST_THROUGH, LEAST_THROUGH_S = 2, 10.0  # cars that drive through a patch, and for how long
PERCEIVED, WEST_M = 0.025, -0.6
"""Smallest change of scale that 90 s can show; x of what lies below the western of two cameras."""


def scene(
    kinds: Sequence[str], cars: int, rng: np.random.Generator, folder: Path
) -> tuple[list[Recording], str]:
    """Return what cars drove while one or more things changed at once, and what these were.

    A patch that fewer than two cars drive through is drawn again, with all of its scene.
    """
    since_s = float(rng.uniform(*SINCE_S))
    usual = [scattered(nominal(CAR), rng) for _ in range(cars)]
    drawn, words = dict[str, tuple[Any, ...]](), list[str]()
    for kind in kinds:
        names = (str(rng.choice(EFFECTS[kind])),) if EFFECTS[kind] else ()
        drawn[kind] = draw_effects(names, CAR, STRENGTH, rng)
        words += names
    scale = float(np.exp(rng.uniform(*STRENGTH) * PERCEIVED))
    found, patched = list[Recording](), 0
    for k, before in enumerate(usual):
        mine = [one for kind in kinds if k == 0 or kind not in OWN for one in drawn[kind]]
        numbers, faults = (
            Changing(dict(one), apply(one, mine), since_s, since_s) for one in (before, FAULTS)
        )
        drive = record(CAR, numbers, faults, LASTS_S, rng)
        if "camera" in kinds:
            drive = replace(drive, poses=sunk(drive.poses, since_s, scale))
        if "place" in kinds:
            patched += is_through(drive.poses, since_s, drawn["place"][0][2].parameters)
        write(drive, CAR, before, folder / str(k))
        found += recordings_of_one(folder / str(k))
    if "place" in kinds and patched < FEWEST_THROUGH:
        return scene(kinds, cars, rng, folder)
    words += [f"seen {scale:.3f} times as large"] if "camera" in kinds else []
    return found, f"{', '.join(words)} since {since_s:.0f} s"


def is_through(poses: Floats, since_s: float, patch: Mapping[str, float]) -> bool:
    """Return whether a car drove through a patch again and again."""
    away = np.hypot(poses[:, 1] - patch["x_m"], poses[:, 2] - patch["y_m"])
    there = (poses[:, 0] >= since_s) & (away < patch["radius_m"])
    return bool(np.ptp(poses[:, 0]) * there.mean() > LEAST_THROUGH_S)


def sunk(poses: Floats, since_s: float, scale: float) -> Floats:
    """Return poses as they are seen where the western camera sinks: floor seems larger there."""
    poses = poses.copy()
    west = (poses[:, 1] < 0.0) & (poses[:, 0] >= since_s)
    poses[west, 1] = WEST_M + scale * (poses[west, 1] - WEST_M)
    poses[west, 2] *= scale
    return poses


def camera_of(recording: Recording, t_s: float) -> str:
    """Return which camera saw a car."""
    x = recording.channels["pose.x"]
    return "west" if float(np.interp(t_s, x.t, x.values)) < 0.0 else "east"


@dataclass(slots=True)
class Judged:
    """A change, as it is judged by now.

    Attributes:
        when_s: It was noticed then.
        is_place: Whether it was noticed by all cars together.
    """

    vehicle: str
    when_s: float
    change: TwinChange
    is_place: bool = False


def judged(
    recordings: list[Recording], predictor: WatchedCar
) -> Iterator[tuple[Judged, float]]:  # fmt: skip
    """Yield the first change of each car and those of places, some time after each [s]."""
    threshold = threshold_of(FALSE_ALARM_H)
    places, noticed = PlaceWatch(threshold), list[Judged]()
    watches = {f"n{k}": CarWatch(predictor, threshold) for k in range(len(recordings))}
    for k, first_s in enumerate(np.arange(0.0, LASTS_S, SPAN_S).tolist()):
        for (name, watch), recording in zip(watches.items(), recordings, strict=True):
            part = part_of(recording, first_s - BEFORE_S, first_s + SPAN_S + AFTER_S)
            try:
                one = watch.look(part, first_s, first_s + SPAN_S, partial(camera_of, recording))
            except RecordingError:
                continue
            if one and not any(had.vehicle == name and not had.is_place for had in noticed):
                noticed.append(Judged(name, first_s, one.as_change()))
        if not k % SPANS_A_PLACE:
            cars = {name: Witness(watch.evidence, 0.0) for name, watch in watches.items()}
            found = places.look(cars, first_s + SPAN_S)
            if found is not None:
                print(f"  {first_s + SPAN_S:.0f} s: {found.in_words()}", flush=True)
                noticed.append(Judged(found.vehicles[0], first_s, found.as_change(), is_place=True))
        for each in noticed:
            if first_s - each.when_s in LATER_S:
                since_s = seconds(each.change.since_ns)
                cars = {
                    name: witness(
                        watch.evidence, 0.0, [o.change for o in noticed if o.vehicle == name],
                        since_s, is_own=name == each.vehicle,
                    )
                    for name, watch in watches.items()
                }  # fmt: skip
                each.change = located(each.change, each.vehicle, cars, places) or each.change
                yield each, first_s - each.when_s


def judge(change: TwinChange, kinds: Sequence[str], *, is_first: bool) -> str:
    """Return whether a change was attributed rightly: own ones are of the first car only."""
    if change.cause == "undecided":
        return "undecided"
    true = {kind for kind in kinds if is_first or kind not in OWN}
    if true & set(OWN):
        true |= set(OWN)  # of a tag that looks like a car: the search decides
    return "right" if change.cause in true else "wrong"


def in_words(change: TwinChange) -> str:
    """Return whose a change may be."""
    found = [one for one in change.causes if one.probability >= 0.01]
    places = ["" if one.x_m is None else f" ({one.x_m:.2f}, {one.y_m:.2f})" for one in found]
    pairs = zip(found, places, strict=True)
    return ", ".join(f"{one.kind}{place} {one.probability:.2f}" for one, place in pairs)


def main() -> None:
    """Print each scene and how its changes were judged, and how often rightly."""
    parser = argparse.ArgumentParser(prog="python -m bench twin_causes", description=__doc__)
    parser.add_argument("kinds", nargs="*", default=list(EFFECTS), metavar="KIND")
    parser.add_argument("--scenes", type=int, default=4)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cars", type=int, default=3)
    given = parser.parse_args()
    if wrong := {one for kind in given.kinds for one in kind.split("+")} - set(EFFECTS):
        parser.error(f"{', '.join(wrong)}: expected some of {', '.join(EFFECTS)}, joined by +")
    predictor, results = WatchedCar(load_car(CAR)), Counter[tuple[str, float, str]]()
    for kind in given.kinds:
        for number in range(given.scenes):
            rng = np.random.default_rng([given.seed, number, *kind.encode()])
            with tempfile.TemporaryDirectory() as folder:
                recordings, what = scene(kind.split("+"), given.cars, rng, Path(folder))
            print(f"{kind} {number}: {what}", flush=True)
            kinds, found = kind.split("+"), set[str]()
            for one, later_s in judged(recordings, predictor):
                verdict = judge(one.change, kinds, is_first=one.vehicle == "n0")
                results[kind, later_s, verdict] += 1
                found |= {one.change.cause} if verdict == "right" else set()
                of = f"{one.vehicle} {one.change.effect}, {later_s:.0f} s later"
                print(f"  {of} {verdict}: {in_words(one.change)}", flush=True)
            print(f"  found: {', '.join(sorted(found)) or 'nothing'}", flush=True)
    for (kind, later_s, verdict), count in sorted(results.items()):
        print(f"{kind:<12}{later_s:4.0f} s after it was noticed: {count} {verdict}")


if __name__ == "__main__":
    main()
