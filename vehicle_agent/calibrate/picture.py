"""The result of a calibration as a picture: speed over throttle, and curvature over steering.

Dots are legs as the Eye measured them at steady state; the dashed line is the car as its file had
it, the solid one as identified. The kernel simulates both lines with the commands of the drive.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from scm.arrays import Floats
from scm.maps.svg import element
from scm.mismatch.report.plot import Picture, frame, grid, legend, line, picture_svg, span_of, text
from vehicle_agent.calibrate.fit import Fit, Resimulation

WIDTH, HEIGHT, HEAD = 440.0, 300.0, 26.0
LEG_END_S = 0.5
"""The end of a leg, when motor and wheels are at steady state."""
STEERING_SLEW_S = 0.2
"""The begin of a leg, while the guard limits the rate of the steering."""
MIN_TRAVEL_M = 0.008
CURVATURE_LABELS = "commanded steering, + left", "curvature of the path [1/m], + left"
MAX_STEERING_SPREAD = 0.11
"""Maximum spread of a leg's steering that counts as constant."""
LEVEL_WIDTHS = (0.05, 0.25)
"""Widths of throttle and steering levels: lines go through the levels' means."""


@dataclass(frozen=True, slots=True)
class SteadyLegs:
    """The ends of legs: command and resulting motion.

    Attributes:
        throttle: Mean commanded throttle, (legs,); likewise `steering`.
        speed: Of the car as measured, as its file had it, and as found [m/s], (3, legs).
        curvature: Curvature of its path, likewise [1/m].
    """

    throttle: Floats
    steering: Floats
    speed: Floats
    curvature: Floats


def steady_legs(resimulated: Resimulation) -> SteadyLegs:
    """Return the ends of all legs with constant steering."""
    rows = []
    for first, last in _legs(resimulated.commands):
        commanded = resimulated.commands[first:last]
        end_s = resimulated.commands[last, 0]
        late = commanded[commanded[:, 0] >= end_s - LEG_END_S]
        steady = commanded[commanded[:, 0] >= commanded[0, 0] + STEERING_SLEW_S, 2]
        if end_s - commanded[0, 0] < 1.5 * LEG_END_S or np.ptp(steady) > MAX_STEERING_SPREAD:
            continue
        seen = (resimulated.t >= end_s - LEG_END_S) & (resimulated.t <= end_s)
        moved = (
            [_moved(resimulated.t[seen], path[seen]) for path in resimulated.paths]
            if seen.sum() > 2
            else []
        )
        if moved and all(np.isfinite(each).all() for each in moved):
            rows.append([late[:, 1].mean(), late[:, 2].mean(), *np.ravel(moved)])
    table = np.array(rows).reshape(-1, 8)
    return SteadyLegs(table[:, 0], table[:, 1], table[:, 2::2].T, table[:, 3::2].T)


def _legs(commands: Floats) -> Iterator[tuple[int, int]]:
    """Yield where a throttle of one sign begins and ends."""
    sign = np.sign(commands[:, 1])
    edges = np.flatnonzero(np.diff(sign)) + 1
    for first, last in pairwise(edges):
        if sign[first]:
            yield int(first), int(last)


def _moved(t: Floats, path: Floats) -> tuple[float, float]:
    """Return speed along the heading [m/s] and curvature [1/m], NaN if it hardly moved."""
    steps = np.diff(path[:, :2], axis=0)
    heading = 0.5 * (path[1:, 2] + path[:-1, 2])
    way = float((steps[:, 0] * np.cos(heading) + steps[:, 1] * np.sin(heading)).sum())
    turn = float(path[-1, 2] - path[0, 2])
    return way / float(t[-1] - t[0]), turn / way if abs(way) > MIN_TRAVEL_M else np.nan


def write_picture(found: Fit, deadband: float, path: Path) -> None:
    """Write the picture as SVG; without a steady leg only the axes are drawn.

    Args:
        found: Result of the fit.
        deadband: Of the car's file.
        path: Of the picture.
    """
    legs = steady_legs(found.resimulated)
    bands = deadband, found.numbers["drive.deadband"].value
    panels = (
        (legs.throttle, legs.speed, "commanded throttle", "speed [m/s]", LEVEL_WIDTHS[0], bands),
        (legs.steering, legs.curvature, *CURVATURE_LABELS, LEVEL_WIDTHS[1], None),
    )
    parts = [*legend(62.0, 20.0, (("before", "as its file had it"), ("after", "as found")))]
    parts += [element("circle", cx=355.0, cy=16.0, r="3.5", class_="dot")]
    parts += [text(366.0, 20.0, "seen, a leg each")]
    for number, panel in enumerate(panels):
        parts += _panel(*panel, WIDTH * number)
    svg = picture_svg(2.0 * WIDTH, HEIGHT + HEAD, parts, "what the calibration found")
    path.write_text(Picture(name="", title="", caption="", svg=svg).as_file(), encoding="utf-8")


def _panel(
    commanded: Floats, came: Floats, across: str, up: str, level: float,
    bands: tuple[float, float] | None, left: float,
) -> Iterator[str]:  # fmt: skip
    """Yield one panel: measured dots, and both lines, (legs,) and (3, legs), zero within a band."""
    of = frame(span_of(commanded, through_zero=True), span_of(came), (WIDTH, HEIGHT), (left, HEAD))
    yield from grid(of, across, up)
    levels = np.round(commanded / level)
    which = [levels == one for one in np.unique(levels)]
    for row, kind in enumerate(("before", "after"), start=1):
        points = [(commanded[w].mean(), came[row, w].mean()) for w in which]
        if bands is not None:
            points += [(-bands[row - 1], 0.0), (bands[row - 1], 0.0)]
        x, y = np.array(sorted(points)).reshape(-1, 2).T
        yield line(of, x, y, kind)
    for one, other in zip(commanded.tolist(), came[0].tolist(), strict=True):
        at = {"cx": of.across.at(one), "cy": of.up.at(other)}
        yield element("circle", **at, r="3.5", class_="dot")
