"""Whose change is it? Scenes of several cars on one floor, in each of which one thing changes.

    python -m bench twin_causes [KIND ...] [--scenes 4] [--seed 1] [--cars 3]

Cars of `tests/reality`, whose ordinary numbers are not the file's, drive for twelve minutes on the
same floor. After about 300 s one of them changes, or its tag is knocked aside, or a patch of the
floor resists rolling, or one of two cameras is tilted, or the whole floor changes. Of each change
that is noticed it is judged one, two and four minutes later whose it is.
"""

import argparse
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from scm.arrays import Floats
from scm.clock import nanoseconds
from scm.errors import RecordingError
from scm.recorder.drives import recordings_of_one
from scm.recording.read import Recording
from scm.recording.span import part_of
from scm.records.twins import TwinChange
from scm.twin.causes import OWN, Witness, located
from scm.twin.detector import threshold_of
from scm.twin.watch import AFTER_S, BEFORE_S, SPAN_S, CarWatch, Noticed
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
TILT_PER_M, HEIGHT_M, WEST_M = 0.03, 2.0, -0.6
"""Of a camera that is knocked; its height; x of what lies below it. The other one sees x >= 0."""


def scene(
    kind: str, cars: int, rng: np.random.Generator, folder: Path
) -> tuple[list[Recording], str]:
    """Return what cars drove while one thing changed, and what that was."""
    since_s = float(rng.uniform(*SINCE_S))
    usual = [scattered(nominal(CAR), rng) for _ in range(cars)]
    names = (str(rng.choice(EFFECTS[kind])),) if EFFECTS[kind] else ()
    effects = draw_effects(names, CAR, STRENGTH, rng)
    tilt = TILT_PER_M * np.exp(1j * rng.uniform(-np.pi, np.pi))
    found = list[Recording]()
    for k, before in enumerate(usual):
        numbers, faults = (
            Changing(
                dict(one), apply(one, effects if k == 0 or kind not in OWN else ()), *[since_s] * 2
            )
            for one in (before, FAULTS)
        )
        drive = record(CAR, numbers, faults, LASTS_S, rng)
        if kind == "camera":
            drive = replace(drive, poses=by_one_camera(knocked(drive.poses, since_s, tilt)))
        write(drive, CAR, before, folder / str(k))
        found += recordings_of_one(folder / str(k))
    return found, f"{'+'.join(names) or f'tilted by {tilt:.3f} 1/m'} since {since_s:.0f} s"


def knocked(poses: Floats, since_s: float, tilt: complex) -> Floats:
    """Return poses as they are seen where the western camera is tilted from a time on."""
    poses = poses.copy()
    west = (poses[:, 1] < 0.0) & (poses[:, 0] >= since_s)
    x, y = poses[west, 1] - WEST_M, poses[west, 2]
    depth = 1.0 + tilt.real * x + tilt.imag * y
    poses[west, 1] = x / depth + WEST_M + HEIGHT_M * tilt.real
    poses[west, 2] = y / depth + HEIGHT_M * tilt.imag
    return poses


def by_one_camera(poses: Floats) -> Floats:
    """Return the poses of the camera that saw a car most, for each ten seconds."""
    west, look = poses[:, 1] < 0.0, (poses[:, 0] // SPAN_S).astype(int)
    seen = np.bincount(look)
    is_west = np.bincount(look, west) > 0.5 * seen
    return poses[west == is_west[look]]


def camera_of(recording: Recording, first_s: float) -> str:
    """Return which camera saw a car most in ten seconds."""
    x = recording.channels["pose.x"]
    there = (x.t >= first_s) & (x.t < first_s + SPAN_S)
    return "west" if there.any() and float(np.mean(x.values[there] < 0.0)) > 0.5 else "east"


def judged(
    recordings: list[Recording], predictor: WatchedCar
) -> Iterator[tuple[str, float, TwinChange]]:
    """Yield the first change of each car, judged some time after it was noticed [s]."""
    watches = {
        f"n{k}": CarWatch(predictor, threshold_of(FALSE_ALARM_H)) for k in range(len(recordings))
    }
    noticed = dict[str, tuple[float, TwinChange]]()
    for first_s in np.arange(0.0, LASTS_S, SPAN_S).tolist():
        for (name, watch), recording in zip(watches.items(), recordings, strict=True):
            part = part_of(recording, first_s - BEFORE_S, first_s + SPAN_S + AFTER_S)
            try:
                one = watch.look(part, first_s, first_s + SPAN_S, camera_of(recording, first_s))
            except RecordingError:
                continue
            if one is not None and name not in noticed:
                noticed[name] = first_s, change_of(one)
        cars = {name: Witness(watch.evidence, 0.0) for name, watch in watches.items()}
        for name, (when_s, change) in noticed.items():
            if first_s - when_s in LATER_S:
                yield name, first_s - when_s, located(change, name, cars) or change


def change_of(noticed: Noticed) -> TwinChange:
    """Return a change as the part reports it, on the recording's clock."""
    since_ns, low_ns, high_ns = map(nanoseconds, noticed.change.onset_s)
    return TwinChange(
        noticed_ns=nanoseconds(noticed.change.noticed_s), since_ns=since_ns, since_low_ns=low_ns,
        since_high_ns=high_ns, effect=noticed.number.effect, parameter=noticed.number.name,
        size=noticed.change.size, unit=noticed.number.unit, score=abs(noticed.change.score),
    )  # fmt: skip


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
    if wrong := set(given.kinds) - set(EFFECTS):
        parser.error(f"{', '.join(wrong)}: expected some of {', '.join(EFFECTS)}")
    predictor, results = WatchedCar(load_car(CAR)), Counter[tuple[str, float, str]]()
    for kind in given.kinds:
        for number in range(given.scenes):
            rng = np.random.default_rng([given.seed, number, *kind.encode()])
            with tempfile.TemporaryDirectory() as folder:
                recordings, what = scene(kind, given.cars, rng, Path(folder))
            print(f"{kind} {number}: {what}", flush=True)
            for name, later_s, change in judged(recordings, predictor):
                right = change.cause == kind or {change.cause, kind} <= set(OWN)
                verdict = (
                    "undecided" if change.cause == "undecided" else "right" if right else "wrong"
                )
                results[kind, later_s, verdict] += 1
                of = f"{name} {change.effect}, {later_s:.0f} s later"
                print(f"  {of} {verdict}: {in_words(change)}", flush=True)
    for (kind, later_s, verdict), count in sorted(results.items()):
        print(f"{kind:<12}{later_s:4.0f} s after it was noticed: {count} {verdict}")


if __name__ == "__main__":
    main()
