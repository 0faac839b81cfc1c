"""How well 20 cars are calibrated: `python -m tests.unit.calibrate.draws [KEY=VALUE of the Eye]`.

Prints, for each number, the rms error, the widest error, the mean half interval, and in how many
draws the 90 % interval held the truth.
"""

import sys

import numpy as np

from tests.unit.calibrate.rig import drawn, fitted

DRAWS = 20


def main(*settings):
    eye = {key: float(value) for key, value in (each.split("=") for each in settings)}
    errors, halves, held = {}, {}, {}
    for seed in range(1, DRAWS + 1):
        hidden = drawn(seed, **eye)
        for key, found in fitted(hidden).numbers.items():
            truth = hidden.numbers[key]
            errors.setdefault(key, []).append(found.value - truth)
            halves.setdefault(key, []).append((found.high - found.low) / 2.0)
            held.setdefault(key, []).append(found.low <= truth <= found.high)
    for key, each in errors.items():
        rms, widest = np.sqrt(np.mean(np.square(each))), np.abs(each).max()
        row = f"{rms:.5f} | {widest:.5f} | {np.mean(halves[key]):.5f} | {sum(held[key])} of {DRAWS}"
        print(f"| {key} | {row} |")


if __name__ == "__main__":
    main(*sys.argv[1:])
