"""A calibration in words, with a map of the frame."""

import math

import numpy as np

from scm.eye.calibrate.judge import Verdict
from scm.eye.calibrate.solve import Solution
from scm.eye.calibration import LENS_NAMES, Calibration

_PIXELS = 4
"""The first so many numbers of a lens are pixels."""


def report(solution: Solution, verdict: Verdict) -> str:
    """Return all that is worth knowing of a calibration, in lines."""
    calibration = solution.calibration()
    points = sum(len(view.points) for view in solution.views)
    tilts, fills = np.degrees(verdict.tilts_rad), verdict.fills
    width, height = solution.size
    worst = max(
        range(len(solution.views)),
        key=lambda i: float((solution.errors[i] ** 2).sum(axis=1).mean()),
    )
    off = math.sqrt(float((solution.errors[worst] ** 2).sum(axis=1).mean()))
    lines = [
        f"{calibration.lens} lens, {width} x {height} px, from {len(solution.views)} views with "
        f"{points} points",
        *lens_lines(calibration),
        f"  left at the points {calibration.rms_px:.3f} px RMS (a corner's coordinate "
        f"{solution.corner_std_px:.3f} px); worst view {solution.views[worst].name}: {off:.3f} px",
        f"  boards lean {tilts.min():.0f} to {tilts.max():.0f} deg (median {np.median(tilts):.0f}),"
        f" span {fills.min():.0%} to {fills.max():.0%} of the frame's width",
        *(f"  {one}" for one in solution.said),
        "",
        *frame_map(verdict),
    ]
    if verdict.shots:
        lines += ["", "to add, the most telling first:" if verdict.refused else "would still help:"]
        lines += [f"  - {shot}" for shot in verdict.shots]
    return "\n".join(lines)


def lens_lines(calibration: Calibration) -> list[str]:
    """Return the numbers of a lens, each with its standard deviation."""
    lines = []
    rows = zip(
        LENS_NAMES[calibration.lens], calibration.values, calibration.deviations, strict=True
    )
    for i, (name, value, deviation) in enumerate(rows):
        if name == "none":
            continue
        if i < _PIXELS:
            lines.append(f"  {name} {value:10.2f} +-{deviation:.2f} px")
        elif deviation == 0.0:
            lines.append(f"  {name} left out")
        else:
            lines.append(f"  {name} {value:10.5f} +-{deviation:.5f}")
    return lines


def frame_map(verdict: Verdict) -> list[str]:
    """Return the frame in cells: how many points lie in each, how sure its rays are."""
    lines = ["points seen".ljust(5 * verdict.cover.shape[1] + 5) + "doubt of a ray [px]"]
    for counts, doubts in zip(verdict.cover, verdict.ray_std_px, strict=True):
        seen = "".join(f"{count:5d}" if count else "    ." for count in counts)
        doubt = "".join(f"{value:7.2f}" if value < 1000 else "      ?" for value in doubts)
        lines.append(f"{seen}     {doubt}")
    return lines
