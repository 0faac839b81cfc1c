"""Describes a calibration in words, with a map of the frame."""

import math

import numpy as np

from scm.eye.calibrate.assessment import ViewAssessment
from scm.eye.calibrate.solve import Solution
from scm.eye.calibration import LENS_NAMES, Calibration

_PIXELS = 4
"""Number of lens parameters in pixels; they come first."""


def report(solution: Solution, assessment: ViewAssessment) -> str:
    """Return a summary of a calibration, in lines."""
    calibration = solution.calibration()
    points = sum(len(view.points) for view in solution.views)
    tilts, fills = np.degrees(assessment.tilts_rad), assessment.fills
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
        f"  residual at the points {calibration.rms_px:.3f} px RMS (a corner coordinate "
        f"{solution.corner_std_px:.3f} px); worst view {solution.views[worst].name}: {off:.3f} px",
        f"  boards tilted by {tilts.min():.0f} to {tilts.max():.0f} deg "
        f"(median {np.median(tilts):.0f}), span {fills.min():.0%} to "
        f"{fills.max():.0%} of the frame's width",
        *(f"  {one}" for one in solution.remarks),
        "",
        *frame_map(assessment),
    ]
    if assessment.shots:
        lines += [
            "",
            "to add, the most informative first:" if assessment.refused else "would still help:",
        ]
        lines += [f"  - {shot}" for shot in assessment.shots]
    return "\n".join(lines)


def lens_lines(calibration: Calibration) -> list[str]:
    """Return the parameters of a lens with their standard deviations."""
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


def frame_map(assessment: ViewAssessment) -> list[str]:
    """Return the frame in cells: number of points and ray std of each."""
    lines = ["points seen".ljust(5 * assessment.cover.shape[1] + 5) + "std of a ray [px]"]
    for counts, stds in zip(assessment.cover, assessment.ray_std_px, strict=True):
        seen = "".join(f"{count:5d}" if count else "    ." for count in counts)
        cells = "".join(f"{value:7.2f}" if value < 1000 else "      ?" for value in stds)
        lines.append(f"{seen}     {cells}")
    return lines
