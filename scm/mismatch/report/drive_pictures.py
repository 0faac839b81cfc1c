"""Pictures of a drive: residuals on the floor and over time, and free runs with their errors."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.data_quality.quality import Span
from scm.maps.svg import element
from scm.mismatch.evidence import FreeRuns, Residual
from scm.mismatch.findings import Estimate, Located, Place
from scm.mismatch.report.plot import (
    BAND_STDS,
    TEXT_PX,
    Frame,
    Picture,
    band,
    frame,
    grid,
    legend,
    line,
    line_data,
    on_a_floor,
    picture_svg,
    scale_bar,
    span_of,
    text,
    ticks_across,
)
from scm.mismatch.report.wording import quantities, quantity, short, unit_text

_MAP_PX = 440.0  # width of a floor map
_MIN_FLOOR_PX, _MAX_FLOOR_PX = 130.0, 400.0  # height of the floor in it
_MAP_MARGINS = (14.0, 14.0, 14.0, 82.0)
_MAX_POINTS = 2500
_CLASSES = 9  # of colour; the middle one is no more than noise
_WIDTHS = (5.5, 4.4, 3.4, 2.6, 1.8)  # by distance from the ends of the scale
_LINE_PX, _PANEL_PX, _STRIP_PX = 1000.0, 150.0, 56.0  # width of the time line, heights of its parts
_LINE_MARGINS = (66.0, 14.0, 26.0, 10.0)
_LEGEND_PX = 26.0
_MAX_PANELS = 6
_COLUMNS = 450  # of pixels; more points are condensed to these
PARTS = {"fit": "fits the numbers", "choose": "chooses the effect", "confirm": "only confirms"}
_MAX_WINDOWS = 40
_SIDE, _GROWTH = 200.0, 70.0  # of a window's floor, and height of its error below [px]
_WIDTH, _HEIGHT = 440.0, 270.0
_WINDOW_POINTS = 60
_SEEN = {"fit": "the fit saw it", "choose": "an effect was chosen by it", "confirm": "unseen"}


def floor_map(residual: Residual, located: Sequence[Located], number: int) -> Picture:
    """Return the map of one residual, before and after, with the places that were found."""
    bound = _colour_bound(residual)
    x, y = residual.x_m, residual.y_m
    places = [found.where for found in located if found.where is not None]
    corners = np.array([c for p in places for c in zip(p.x_m, p.y_m, strict=True)]).reshape(-1, 2)
    spans = span_of(x, corners[:, 0]), span_of(y, corners[:, 1])
    height = _height(*spans)
    room = on_a_floor(frame(*spans, (_MAP_PX, height), margins=_MAP_MARGINS))
    parts = [
        *(_place(room, place) for place in places),
        element("g", *_path(room, residual, residual.before, bound), class_="side-before"),
        element("g", *_path(room, residual, residual.after, bound), class_="side-after"),
        *scale_bar(room),
        *_colour_bar(residual, bound, height - 36.0),
    ]
    return Picture(
        name=f"floor_{number}",
        title=f"Unexplained {residual.channel}",
        caption="",
        svg=picture_svg(_MAP_PX, height, parts, f"Floor map of {residual.channel}", room),
    )


def _height(x_span: Span, y_span: Span) -> float:
    """Return how tall the picture has to be for the floor's shape."""
    long = _MAP_PX - _MAP_MARGINS[0] - _MAP_MARGINS[1]
    tall = long * (y_span[1] - y_span[0]) / max(x_span[1] - x_span[0], 1e-9)
    return min(_MAX_FLOOR_PX, max(_MIN_FLOOR_PX, tall)) + _MAP_MARGINS[2] + _MAP_MARGINS[3]


def _colour_bound(residual: Residual) -> float:
    """Return the value at which colours end.

    That is the 98th percentile, so that one outlier is none, and at least three standard
    deviations.
    """
    values, stds = (a[np.isfinite(a)] for a in (residual.before, residual.std))
    strong = float(np.percentile(np.abs(values), 98)) if len(values) else 0.0
    return max(strong, 3.0 * float(np.median(stds)) if len(stds) else 0.0) or 1.0


def _colour_class(values: Floats, stds: Floats, bound: float) -> Ints:
    """Return 0 (far below zero) to 8 (far above); 4 is about zero, or no more than noise."""
    share = np.nan_to_num(np.clip(values / bound, -1.0, 1.0))
    kinds = np.rint((share + 1.0) * 0.5 * (_CLASSES - 1)).astype(np.int64)
    return np.where(np.abs(values) > BAND_STDS * np.nan_to_num(stds), kinds, _CLASSES // 2)


def _path(room: Frame, residual: Residual, values: Floats, bound: float) -> Iterator[str]:
    """Yield the car's path, one SVG path a colour, the strongest drawn last."""
    rows = slice(None, None, max(1, len(residual.t_s) // _MAX_POINTS))
    x, y, t_s, values = (a[rows] for a in (residual.x_m, residual.y_m, residual.t_s, values))
    kinds = _colour_class(values, residual.std[rows], bound)
    known = np.isfinite(x) & np.isfinite(y) & np.isfinite(values)
    if not known.any():
        return
    usual = float(np.median(np.diff(t_s))) if len(t_s) > 1 else 0.0
    joined = known[1:] & known[:-1] & (np.diff(t_s) <= 5.0 * usual)
    for kind in sorted(range(_CLASSES), key=lambda k: abs(k - 4)):
        data = "".join(
            line_data(room.across, room.up, x[a:b], y[a:b]) for a, b in _runs(kinds, joined, kind)
        )
        if data:
            wide = _WIDTHS[min(kind, _CLASSES - 1 - kind)]
            yield element("path", d=data, class_=f"d{kind}", stroke_width=wide)
    first = int(np.argmax(known))
    across, up = room.across.at(float(x[first])), room.up.at(float(y[first]))
    yield element("circle", cx=f"{across:.1f}", cy=f"{up:.1f}", r="4", class_="start")
    left_half = across < 0.5 * (room.left + room.right)
    yield text(across + (7 if left_half else -7), up - 6, "start", "start" if left_half else "end")


def _runs(kinds: Ints, joined: Bools, kind: int) -> Iterator[tuple[int, int]]:
    """Yield stretches of one colour, each with the point after it, so that no gap shows."""
    mine = np.concatenate(([False], (kinds[:-1] == kind) & joined, [False]))
    edges = np.flatnonzero(np.diff(mine.astype(np.int8)))
    yield from ((int(a), int(b) + 1) for a, b in zip(edges[::2], edges[1::2], strict=True))


def _place(room: Frame, place: Place) -> str:
    left, right = (room.across.at(x) for x in place.x_m)
    low, high = (room.up.at(y) for y in place.y_m)
    data = f"M{left:.1f} {low:.1f}H{right:.1f}V{high:.1f}H{left:.1f}Z"
    return element("path", d=data, class_="place")


def _colour_bar(residual: Residual, bound: float, y: float) -> Iterator[str]:
    """Yield the scale of colours with its unit."""
    left, wide = 30.0, 26.0
    for kind in range(_CLASSES):
        x = left + wide * kind
        data = f"M{x:.1f} {y:.1f}h{wide:.1f}"
        yield element("path", d=data, class_=f"butt d{kind}", stroke_width=11)
    ends = ((0.0, -bound), (0.5, 0.0), (1.0, bound))
    for share, value in ends:
        number = ("+" if value > 0.0 else "") + short(float(f"{value:.2g}"))
        yield text(left + wide * _CLASSES * share, y + 23, number, "middle")
    yield text(
        left + wide * _CLASSES + 10, y + 4, f"{residual.channel} [{unit_text(residual.unit)}]"
    )


def time_line(
    residuals: Sequence[Residual],
    located: Sequence[Located],
    runs: FreeRuns | None,
    after: str,
    clock: str,
    changes: Sequence[Estimate] = (),
) -> Picture | None:
    """Return a panel for each of the first residuals; None where there is nothing to draw.

    Without free runs it is not shown which part of the recording was used for what. `after` stands
    in the legend, `clock` below the axis. `changes` are the moments at which effects changed.
    """
    shown = [r for r in residuals if len(r.t_s)][:_MAX_PANELS]
    if not shown:
        return None
    span = span_of(*(residual.t_s for residual in shown), room=0.0)
    spans = [when for found in located for when in found.when_s or ()]
    entries = [("before thin", "the simulator as it was"), ("after thin", after)]
    entries += [("shade", "when the error was found to act")] if spans else []
    entries += [("since", "when the car changed")] if changes else []
    parts = list(legend(66.0, 16.0, entries))
    y = _LEGEND_PX
    for residual in shown:
        room = frame(span, _heights(residual), (_LINE_PX, _PANEL_PX), (0.0, y), _LINE_MARGINS)
        parts += _panel(room, residual, spans)
        parts += _moments(room, changes)
        y += _PANEL_PX
    parts += _strip(span, y, runs, clock)
    strip = " The strip below shows what each part of the recording was used for." if runs else ""
    return Picture(
        name="time_line",
        title="",
        caption="Zero means that the simulator is right. Lines are smoothed; the areas around them "
        "are 90 % intervals. Where the orange line leaves zero by more than its area and the "
        f"blue line stays, the car {after} explains it.{strip}",
        svg=picture_svg(_LINE_PX, y + _STRIP_PX, parts, "Residuals over time", room),
        wide=True,
    )


def _moments(room: Frame, changes: Sequence[Estimate]) -> Iterator[str]:
    """Yield a line at each moment of a change, and an area over its interval."""
    for change in changes:
        low, at, high = (
            float(np.clip(room.across.at(t), room.left, room.right))
            for t in (change.low, change.value, change.high)
        )
        height = room.bottom - room.top
        yield element("rect", x=low, y=room.top, width=max(high - low, 1.0), height=height,
                      class_="since-area")  # fmt: skip
        yield element("line", x1=at, y1=room.top, x2=at, y2=room.bottom, class_="since")


def _heights(residual: Residual) -> tuple[float, float]:
    """Return what the panel has to hold: nearly all of the lines, never an outlier's height."""
    both = np.concatenate((residual.before, residual.after))
    known = both[np.isfinite(both)]
    if not len(known):
        return -1.0, 1.0
    low, high = np.percentile(known, (0.2, 99.8))
    return span_of(np.array([low, high, 0.0]), room=0.15)


def _panel(room: Frame, residual: Residual, spans: Sequence[Span]) -> Iterator[str]:
    for start, end in spans:
        left, right = (
            float(np.clip(room.across.at(t), room.left, room.right)) for t in (start, end)
        )
        yield element(
            "rect",
            x=left,
            y=room.top,
            width=max(right - left, 1.0),
            height=room.bottom - room.top,
            class_="shade",
        )
    yield from _grid_without_numbers(room)
    t_s = residual.t_s
    for values, kind in ((residual.before, "before"), (residual.after, "after")):
        edge = BAND_STDS * residual.std
        times, low, high = _columns(t_s, values - edge, values + edge, room)
        yield band(room, times, low, high, f"band-{kind}")
    for values, kind in ((residual.before, "before thin"), (residual.after, "after thin")):
        times, mean = _means(t_s, values, room)
        yield line(room, times, np.clip(mean, room.up.low, room.up.high), kind)
    yield text(
        room.left + 4,
        room.top - 7,
        f"unexplained {residual.channel} [{unit_text(residual.unit)}]",
        kind="title",
    )


def _grid_without_numbers(room: Frame) -> Iterator[str]:
    """Yield the grid; numbers of the time stand below the last panel only."""
    yield from ticks_across(room, numbers=False)
    yield from (part for part in grid(Frame(room.across, room.up)) if _is_horizontal(part, room))


def _is_horizontal(part: str, room: Frame) -> bool:
    """Return whether a part of a grid belongs to the y axis."""
    return f"H{room.right:.1f}" in part or 'text-anchor="end"' in part


def _columns(t_s: Floats, low: Floats, high: Floats, room: Frame) -> tuple[Floats, Floats, Floats]:
    """Return least and greatest of each column of pixels, so that no peak is lost."""
    if len(t_s) <= _COLUMNS:
        return t_s, low, high
    cells = _cells(t_s, room)
    return (
        np.array([float(t_s[cell].mean()) for cell in cells]),
        np.array([_known(low[cell], np.min) for cell in cells]),
        np.array([_known(high[cell], np.max) for cell in cells]),
    )


def _means(t_s: Floats, values: Floats, room: Frame) -> tuple[Floats, Floats]:
    """Return the mean of each column of pixels."""
    if len(t_s) <= _COLUMNS:
        return t_s, values
    cells = _cells(t_s, room)
    means = np.array([_known(values[cell], np.mean) for cell in cells])
    return np.array([float(t_s[cell].mean()) for cell in cells]), means


def _cells(t_s: Floats, room: Frame) -> list[slice]:
    edges = np.linspace(room.across.low, room.across.high, _COLUMNS + 1)
    rows = np.searchsorted(t_s, edges)
    rows[-1] = len(t_s)
    return [slice(int(a), int(b)) for a, b in pairwise(rows) if b > a]


def _known(values: Floats, how: Callable[[Floats], np.float64]) -> float:
    known = values[np.isfinite(values)]
    return float(how(known)) if len(known) else float("nan")


def _strip(span: Span, y: float, runs: FreeRuns | None, title: str) -> Iterator[str]:
    """Yield the time's numbers and, below, what each part of the recording was used for."""
    room = frame(span, (0.0, 1.0), (_LINE_PX, _STRIP_PX), (0.0, y), (66.0, 14.0, 0.0, 40.0))
    for start, end, part in _part_spans(runs):
        left, right = (
            float(np.clip(room.across.at(t), room.left, room.right)) for t in (start, end)
        )
        yield element("rect", x=left, y=y, width=right - left, height=14, class_=f"part-{part}")
    for value in room.across.ticks():
        yield text(room.across.at(value), y + 31, f"{value:g}", "middle")
    x = room.left
    for part, words in PARTS.items() if _part_spans(runs) else ():
        yield element("rect", x=x, y=y + 38, width=24, height=12, class_=f"part-{part}")
        yield text(x + 30, y + 48, words)
        x += 30 + TEXT_PX * len(words) + 22
    yield text(room.right, y + 48, title, "end", "title")


def _part_spans(runs: FreeRuns | None) -> list[tuple[float, float, str]]:
    """Return start, end and name of each stretch of windows of one part."""
    if runs is None or not len(runs.start_s) or not len(runs.t_s):
        return []
    horizon = float(runs.t_s[-1])
    found: list[tuple[float, float, str]] = []
    for row in np.argsort(runs.start_s):
        start, part = float(runs.start_s[row]), runs.part[int(row)]
        if found and found[-1][2] == part and start <= found[-1][1] + 0.5 * horizon:
            found[-1] = (found[-1][0], max(found[-1][1], start + horizon), part)
        else:
            found.append((start, start + horizon, part))
    return found


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
    times = slice(None, None, max(1, len(runs.t_s) // _WINDOW_POINTS))
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
