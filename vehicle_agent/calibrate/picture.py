"""What a calibration found, in one picture: how fast at which throttle, how bent at which steering.

Dots are what the Eye saw of legs that settled; the dashed line is the car as its file had it, the
full one as it was found. Both lines are driven by the kernel with the very commands of the drive.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from scm.arrays import Floats
from scm.maps.svg import element
from scm.mismatch.report.plot import Picture, frame, grid, legend, line, picture_svg, span_of, text
from vehicle_agent.calibrate.fit import Again, Fit

WIDTH, HEIGHT, HEAD = 440.0, 300.0, 26.0
SHOWN_S = 0.5
"""Of a leg: its end, when motor and wheels have settled."""
SLEWED_S = 0.2
"""Of a leg: its begin, in which the guard lets the steering grow."""
LEAST_M = 0.008
BENT = "steering told, + left", "curvature of the way [1/m], + left"
SAME = 0.11
"""Steering that stays within as much is one steering."""
LEVELS = (0.05, 0.25)
"""Throttles and steerings so near are one level: lines go through the levels' means."""


@dataclass(frozen=True, slots=True)
class Settled:
    """The ends of legs: what was told, and what came of it.

    Attributes:
        throttle: Told in the mean, (legs,); likewise `steering`.
        speed: Of the car as seen, as its file had it, and as found [m/s], (3, legs).
        bend: Of its way, likewise [1/m].
    """

    throttle: Floats
    steering: Floats
    speed: Floats
    bend: Floats


def settled(again: Again) -> Settled:
    """Return the ends of all legs that held one steering."""
    rows = []
    for first, last in _legs(again.commands):
        told = again.commands[first:last]
        end_s = again.commands[last, 0]
        late = told[told[:, 0] >= end_s - SHOWN_S]
        steady = told[told[:, 0] >= told[0, 0] + SLEWED_S, 2]
        if end_s - told[0, 0] < 1.5 * SHOWN_S or np.ptp(steady) > SAME:
            continue
        seen = (again.t >= end_s - SHOWN_S) & (again.t <= end_s)
        moved = (
            [_moved(again.t[seen], path[seen]) for path in again.paths] if seen.sum() > 2 else []
        )
        if moved and all(np.isfinite(each).all() for each in moved):
            rows.append([late[:, 1].mean(), late[:, 2].mean(), *np.ravel(moved)])
    table = np.array(rows).reshape(-1, 8)
    return Settled(table[:, 0], table[:, 1], table[:, 2::2].T, table[:, 3::2].T)


def _legs(commands: Floats) -> Iterator[tuple[int, int]]:
    """Yield where a throttle of one sign begins, and where it is over."""
    sign = np.sign(commands[:, 1])
    edges = np.flatnonzero(np.diff(sign)) + 1
    for first, last in pairwise(edges):
        if sign[first]:
            yield int(first), int(last)


def _moved(t: Floats, path: Floats) -> tuple[float, float]:
    """Return speed along the heading [m/s] and curvature [1/m], NaN where it hardly moved."""
    steps = np.diff(path[:, :2], axis=0)
    heading = 0.5 * (path[1:, 2] + path[:-1, 2])
    way = float((steps[:, 0] * np.cos(heading) + steps[:, 1] * np.sin(heading)).sum())
    turn = float(path[-1, 2] - path[0, 2])
    return way / float(t[-1] - t[0]), turn / way if abs(way) > LEAST_M else np.nan


def write_picture(found: Fit, deadband: float, path: Path) -> None:
    """Write the picture as SVG; nothing is drawn of a drive without a leg that settled.

    Args:
        found: What the drive says.
        deadband: Of the car's file.
        path: Of the picture.
    """
    legs = settled(found.again)
    bands = deadband, found.numbers["drive.deadband"].value
    panels = (
        (legs.throttle, legs.speed, "throttle told", "speed [m/s]", LEVELS[0], bands),
        (legs.steering, legs.bend, *BENT, LEVELS[1], None),
    )
    parts = [*legend(62.0, 20.0, (("before", "as its file had it"), ("after", "as found")))]
    parts += [element("circle", cx=355.0, cy=16.0, r="3.5", class_="dot")]
    parts += [text(366.0, 20.0, "seen, a leg each")]
    for number, panel in enumerate(panels):
        parts += _panel(*panel, WIDTH * number)
    svg = picture_svg(2.0 * WIDTH, HEIGHT + HEAD, parts, "what the calibration found")
    path.write_text(Picture(name="", title="", caption="", svg=svg).as_file(), encoding="utf-8")


def _panel(
    told: Floats, came: Floats, across: str, up: str, level: float,
    bands: tuple[float, float] | None, left: float,
) -> Iterator[str]:  # fmt: skip
    """Yield one panel: dots as seen, and both lines, (legs,) and (3, legs), zero within a band."""
    of = frame(span_of(told, through_zero=True), span_of(came), (WIDTH, HEIGHT), (left, HEAD))
    yield from grid(of, across, up)
    levels = np.round(told / level)
    which = [levels == one for one in np.unique(levels)]
    for row, kind in enumerate(("before", "after"), start=1):
        points = [(told[w].mean(), came[row, w].mean()) for w in which]
        if bands is not None:
            points += [(-bands[row - 1], 0.0), (bands[row - 1], 0.0)]
        x, y = np.array(sorted(points)).reshape(-1, 2).T
        yield line(of, x, y, kind)
    for one, other in zip(told.tolist(), came[0].tolist(), strict=True):
        at = {"cx": of.across.at(one), "cy": of.up.at(other)}
        yield element("circle", **at, r="3.5", class_="dot")
