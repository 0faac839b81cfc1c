"""Free runs against the recording: windows on the floor, and how the error grows in them."""

from collections.abc import Iterator, Mapping

import numpy as np

from scm.arrays import Bools, Floats
from scm.maps.svg import element
from scm.mismatch.evidence import FreeRuns
from scm.mismatch.report.plot import (
    Frame,
    Picture,
    band,
    frame,
    grid,
    legend,
    line,
    on_a_floor,
    picture_svg,
    scale_bar,
    span_of,
    text,
)
from scm.mismatch.report.wording import quantities, quantity

_MAX_WINDOWS = 40
_SIDE, _GROWTH = 200.0, 70.0  # of a window's floor, and height of its error below [px]
_WIDTH, _HEIGHT = 440.0, 270.0
_MAX_POINTS = 60
_SEEN = {"fit": "the fit saw it", "choose": "an effect was chosen by it", "confirm": "unseen"}


def position_error(runs: FreeRuns, side: Mapping[str, Floats]) -> Floats:
    """Return the distance to the recording [m], (windows, times)."""
    return np.hypot(side["x"] - runs.measured["x"], side["y"] - runs.measured["y"])


def _yaw_error(runs: FreeRuns, side: Mapping[str, Floats]) -> Floats:
    """Return the absolute difference in yaw [rad], (windows, times)."""
    apart = side["yaw"] - runs.measured["yaw"]
    return np.abs(np.arctan2(np.sin(apart), np.cos(apart)))


def _unseen(runs: FreeRuns) -> Bools:
    """Return which windows the fit did not see: those to confirm, or all if there are none."""
    confirm = np.array([part == "confirm" for part in runs.part], dtype=np.bool_)
    return confirm if confirm.any() else np.ones(len(runs.part), dtype=np.bool_)


def window_pictures(runs: FreeRuns | None) -> list[Picture]:
    """Return windows on the floor: unseen ones first, each kind from the worst before to the best.

    Of more windows than are drawn, some in even steps.
    """
    if runs is None or not len(runs.start_s):
        return []
    error, unseen = position_error(runs, runs.before), _unseen(runs)
    final = np.array([_last_known(row) for row in error])
    order = [row for row in np.lexsort((-final, ~unseen)) if np.isfinite(final[row])]
    chosen = np.unique(np.linspace(0, len(order) - 1, min(_MAX_WINDOWS, len(order))).astype(int))
    return [_window(runs, int(order[i]), number) for number, i in enumerate(chosen, start=1)]


def _last_known(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(known[-1]) if len(known) else float("nan")


def _window(runs: FreeRuns, row: int, number: int) -> Picture:
    times = slice(None, None, max(1, len(runs.t_s) // _MAX_POINTS))
    sides = {
        kind: (side["x"][row][times], side["y"][row][times])
        for kind, side in (
            ("measured", runs.measured),
            ("before", runs.before),
            ("after", runs.after),
        )
    }
    room = on_a_floor(
        frame(
            span_of(*(x for x, _ in sides.values())),
            span_of(*(y for _, y in sides.values())),
            (_SIDE, _SIDE),
            margins=(10.0, 10.0, 62.0, 28.0),
        )
    )
    parts = [line(room, x, y, kind) for kind, (x, y) in sides.items()]
    parts += [*_start(room, *sides["measured"]), *scale_bar(room)]
    errors = {
        kind: position_error(runs, side)[row]
        for kind, side in (("before", runs.before), ("after", runs.after))
    }
    was, now = quantities([_last_known(error) for error in errors.values()], "m")
    words = f"from {runs.start_s[row]:.1f} s"
    parts += [text(10, 18, words, kind="title"), text(10, 35, _SEEN[runs.part[row]])]
    parts += [text(10, 52, f"{was} \N{RIGHTWARDS ARROW} {now}", kind="strong")]
    below = frame(
        (0.0, float(runs.t_s[-1])), span_of(*errors.values(), through_zero=True),
        (_SIDE, _GROWTH), (0.0, _SIDE), (10.0, 10.0, 8.0, 22.0),
    )  # fmt: skip
    parts += [element("path", d=f"M10 {below.bottom:.1f}H{below.right:.1f}", class_="zero")]
    parts += [line(below, runs.t_s[times], error[times], kind) for kind, error in errors.items()]
    parts += [text(10, _SIDE + _GROWTH - 6, f"error over {quantity(float(runs.t_s[-1]), 's')}")]
    svg = picture_svg(_SIDE, _SIDE + _GROWTH, parts, f"Free run {words}")
    return Picture(name=f"free_run_{number}", title="", caption="", svg=svg)


def _start(room: Frame, x: Floats, y: Floats) -> Iterator[str]:
    known = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if len(known):
        across, up = room.across.at(float(x[known[0]])), room.up.at(float(y[known[0]]))
        yield element("circle", cx=f"{across:.1f}", cy=f"{up:.1f}", r="3.5", class_="start")


def error_pictures(runs: FreeRuns | None) -> list[Picture]:
    """Return how position and yaw error of unseen windows grow with time."""
    if runs is None or not len(runs.start_s) or len(runs.t_s) < 2:
        return []
    rows = _unseen(runs)
    found = []
    for name, title, unit, factor, error in (
        ("error_position", "Position error", "cm", 100.0, position_error),
        ("error_yaw", "Heading error", "°", 180.0 / np.pi, _yaw_error),
    ):
        before, after = (
            _spread(factor * error(runs, side)[rows]) for side in (runs.before, runs.after)
        )
        found.append(_growth(name, title, unit, runs.t_s, before, after))
    return found


def _spread(errors: Floats) -> Floats:
    """Return 10th, 50th and 90th percentile at each time, (3, times)."""
    return np.array([_percentiles(errors[:, k]) for k in range(errors.shape[1])]).T


def _percentiles(errors: Floats) -> Floats:
    known = errors[np.isfinite(errors)]
    return np.percentile(known, (10, 50, 90)) if len(known) else np.full(3, np.nan)


def _growth(
    name: str, title: str, unit: str, t_s: Floats, before: Floats, after: Floats
) -> Picture:
    room = frame(
        (0.0, float(t_s[-1])),
        span_of(before, after, through_zero=True),
        (_WIDTH, _HEIGHT),
        margins=(58.0, 14.0, 50.0, 44.0),
    )
    parts = list(legend(62.0, 16.0, [("before", "before"), ("after", "after")]))
    parts += grid(room, "time since the window's start [s]", f"{title.lower()} [{unit}]")
    parts += [
        band(room, t_s, side[0], side[2], f"band-{kind}")
        for side, kind in ((before, "before"), (after, "after"))
    ]
    parts += [line(room, t_s, before[1], "before"), line(room, t_s, after[1], "after")]
    return Picture(
        name=name,
        title=f"{title} of free runs",
        caption="Windows that the fit did not see. Lines: half of the windows lie below; areas: "
        "from the best tenth of the windows to the worst tenth.",
        svg=picture_svg(_WIDTH, _HEIGHT, parts, f"{title} of free runs"),
    )
