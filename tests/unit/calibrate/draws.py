"""How well cars are calibrated: `python -m tests.unit.calibrate.draws [KEY=VALUE ...]`.

Drives each of them in virtual time and prints, for each number, the rms, the mean and the widest
error, the mean half interval, and in how many draws the 90 % interval held the truth. Keys are
those of the Eye, and `draws=20`, `first=1`; `plan=short`; `board=2wd` or `4wd`: emulated Nigels on
that published firmware instead of the kernel's own car.
"""

import sys

import numpy as np

from scm.vehicles.car import load_car
from tests.unit.calibrate.cable import Street, emulated
from tests.unit.calibrate.rig import Hidden, calibrated, drawn
from vehicle_agent.calibrate.fit import fit
from vehicle_agent.calibrate.pattern import FULL, SHORT

PLANS = {"full": FULL, "short": SHORT}


def driven(seed, board, plan, eye):
    """Return the truth and the drive of one car."""
    if not board:
        hidden = drawn(seed, **eye)
        part, _ = calibrated(hidden, plan=plan)
        return hidden.numbers, part.recorded
    moved = emulated(seed, board)
    street = Street(moved=moved, eye=Hidden(seed=seed, **{"late_ms": 0.0} | eye), plan=plan)
    street.step()
    return moved.numbers, street.part.recorded


def main(*settings):
    commanded = dict(each.split("=") for each in settings)
    draws, first = int(commanded.pop("draws", 20)), int(commanded.pop("first", 1))
    board, plan = commanded.pop("board", ""), PLANS[commanded.pop("plan", "full")]
    eye = {key: float(value) for key, value in commanded.items()}
    errors, halves, held = {}, {}, {}
    for seed in range(first, first + draws):
        truths, recorded = driven(seed, board, plan, eye)
        numbers = fit(load_car("nigel"), *recorded.arrays()).numbers
        for key, truth in truths.items():
            found = numbers[key]
            errors.setdefault(key, []).append(found.value - truth)
            halves.setdefault(key, []).append((found.high - found.low) / 2.0)
            held.setdefault(key, []).append(found.low <= truth <= found.high)
    for key, each in errors.items():
        rms, widest = np.sqrt(np.mean(np.square(each))), np.abs(each).max()
        row = f"{rms:.5f} | {np.mean(each):+.5f} | {widest:.5f} | {np.mean(halves[key]):.5f}"
        print(f"| {key} | {row} | {sum(held[key])} of {draws} |", flush=True)
    all_held = np.concatenate(list(held.values()))
    print(f"held {all_held.sum()} of {len(all_held)}: {100.0 * all_held.mean():.0f} %")


if __name__ == "__main__":
    main(*sys.argv[1:])
