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
from scm.mismatch.report.wording import quantities

WINDOWS = 8
_SIDE = 200.0
_WIDTH, _HEIGHT = 440.0, 270.0
_MOST_POINTS = 120


def position_error(runs: FreeRuns, side: Mapping[str, Floats]) -> Floats:
    """Return the distance to the recording [m], (windows, times)."""
    return np.hypot(side["x"] - runs.measured["x"], side["y"] - runs.measured["y"])


def yaw_error(runs: FreeRuns, side: Mapping[str, Floats]) -> Floats:
    """Return the absolute difference in yaw [rad], (windows, times)."""
    apart = side["yaw"] - runs.measured["yaw"]
    return np.abs(np.arctan2(np.sin(apart), np.cos(apart)))


def unseen(runs: FreeRuns) -> Bools:
    """Return which windows the fit did not see: those to confirm, or all where none are."""
    confirm = np.array([part == "confirm" for part in runs.part], dtype=np.bool_)
    return confirm if confirm.any() else np.ones(len(runs.part), dtype=np.bool_)


def window_pictures(runs: FreeRuns | None) -> list[Picture]:
    """Return unseen windows on the floor, from the worst before to the best, in even steps."""
    if runs is None or not len(runs.start_s):
        return []
    error = position_error(runs, runs.before)
    rows = np.flatnonzero(unseen(runs))
    final = np.array([_last_known(error[row]) for row in rows])
    rows, final = rows[np.isfinite(final)], final[np.isfinite(final)]
    order = rows[np.argsort(-final, kind="stable")]
    chosen = np.unique(np.linspace(0, len(order) - 1, min(WINDOWS, len(order))).astype(int))
    return [_window(runs, int(order[i]), number) for number, i in enumerate(chosen, start=1)]


def _last_known(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(known[-1]) if len(known) else float("nan")


def _window(runs: FreeRuns, row: int, number: int) -> Picture:
    keep = slice(None, None, max(1, len(runs.t_s) // _MOST_POINTS))
    sides = {
        kind: (side["x"][row][keep], side["y"][row][keep])
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
            margins=(10.0, 10.0, 46.0, 28.0),
        )
    )
    parts = [line(room, x, y, kind) for kind, (x, y) in sides.items()]
    parts += [*_start(room, *sides["measured"]), *scale_bar(room)]
    before, after = (
        _last_known(position_error(runs, side)[row]) for side in (runs.before, runs.after)
    )
    parts += [text(10, 18, f"from {runs.start_s[row]:.1f} s", kind="title")]
    was, now = quantities((before, after), "m")
    parts += [text(10, 35, f"{was} \N{RIGHTWARDS ARROW} {now}")]
    return Picture(
        name=f"free_run_{number}",
        title="",
        said="",
        svg=picture_svg(_SIDE, _SIDE, parts, f"Free run from {runs.start_s[row]:.1f} s"),
    )


def _start(room: Frame, x: Floats, y: Floats) -> Iterator[str]:
    known = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if len(known):
        across, up = room.across.at(float(x[known[0]])), room.up.at(float(y[known[0]]))
        yield element("circle", cx=f"{across:.1f}", cy=f"{up:.1f}", r="3.5", class_="start")


def error_pictures(runs: FreeRuns | None) -> list[Picture]:
    """Return how position and yaw error of unseen windows grow with time."""
    if runs is None or not len(runs.start_s) or len(runs.t_s) < 2:
        return []
    rows = unseen(runs)
    found = []
    for name, title, unit, factor, error in (
        ("error_position", "Position error", "cm", 100.0, position_error),
        ("error_yaw", "Heading error", "°", 180.0 / np.pi, yaw_error),
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
        said="Windows that the fit did not see. Lines: half of the windows lie below; areas: "
        "from the best tenth of the windows to the worst tenth.",
        svg=picture_svg(_WIDTH, _HEIGHT, parts, f"{title} of free runs"),
    )
