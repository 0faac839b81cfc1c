"""The time line: each residual before and after, with spans located and parts of the recording."""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

import numpy as np

from scm.arrays import Floats
from scm.data_quality.problem import Span
from scm.maps.svg import element
from scm.mismatch.evidence import FreeRuns, Residual
from scm.mismatch.findings import Located
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
    picture_svg,
    span_of,
    text,
    ticks_across,
)
from scm.mismatch.report.wording import unit_text

WIDTH, PANEL, STRIP = 1000.0, 150.0, 56.0
_MARGINS = (66.0, 14.0, 26.0, 10.0)
_TOP = 26.0
_MOST_PANELS = 5
_COLUMNS = 450
ON_ITS_CLOCK = "time on the recording's clock [s]"
PARTS = {"fit": "fits the numbers", "choose": "chooses the effect", "confirm": "only confirms"}


def time_line(
    residuals: Sequence[Residual],
    located: Sequence[Located],
    runs: FreeRuns | None,
    after: str,
    clock: str = ON_ITS_CLOCK,
) -> Picture | None:
    """Return the picture; None where there is nothing to draw.

    Args:
        residuals: One panel each, the first few.
        located: When the error acts.
        runs: Which part of the recording served what; None: that is not shown.
        after: In the legend.
        clock: What the times are, below their axis.
    """
    shown = [r for r in residuals if len(r.t_s)][:_MOST_PANELS]
    if not shown:
        return None
    span = span_of(*(residual.t_s for residual in shown), room=0.0)
    spans = [when for found in located for when in found.when_s or ()]
    entries = [("before thin", "the simulator as it was"), ("after thin", after)]
    entries += [("shade", "when the error was found to act")] if spans else []
    parts = list(legend(66.0, 16.0, entries))
    y = _TOP
    for residual in shown:
        room = frame(span, _heights(residual), (WIDTH, PANEL), (0.0, y), _MARGINS)
        parts += _panel(room, residual, spans)
        y += PANEL
    parts += _strip(span, y, runs, clock)
    strip = " The strip at the foot shows which part of the recording served what." if runs else ""
    return Picture(
        name="time_line",
        title="",
        said="Zero means that the simulator is right. Lines are smoothed; the areas around them "
        "hold the truth with 90 %. Where the orange line leaves zero by more than its area and the "
        f"blue line stays, the car {after} explains it.{strip}",
        svg=picture_svg(WIDTH, y + STRIP, parts, "Residuals along the recording"),
        wide=True,
    )


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
    yield from grid_without_numbers(room)
    t_s = residual.t_s
    for values, kind in ((residual.before, "before"), (residual.after, "after")):
        edge = BAND_STDS * residual.std
        times, low, high = columns(t_s, values - edge, values + edge, room)
        yield band(room, times, low, high, f"band-{kind}")
    for values, kind in ((residual.before, "before thin"), (residual.after, "after thin")):
        times, mean = middle(t_s, values, room)
        yield line(room, times, np.clip(mean, room.up.low, room.up.high), kind)
    yield text(
        room.left + 4,
        room.top - 7,
        f"unexplained {residual.channel} [{unit_text(residual.unit)}]",
        kind="title",
    )


def grid_without_numbers(room: Frame) -> Iterator[str]:
    """Yield the grid; numbers of the time stand below the last panel only."""
    yield from ticks_across(room, numbers=False)
    yield from (part for part in grid(Frame(room.across, room.up)) if _is_upright(part, room))


def _is_upright(part: str, room: Frame) -> bool:
    """Say whether a part of a grid belongs to the y axis."""
    return f"H{room.right:.1f}" in part or 'text-anchor="end"' in part


def columns(t_s: Floats, low: Floats, high: Floats, room: Frame) -> tuple[Floats, Floats, Floats]:
    """Return least and greatest of each column of pixels, so that no peak is lost."""
    if len(t_s) <= _COLUMNS:
        return t_s, low, high
    cells = _cells(t_s, room)
    return (
        np.array([float(t_s[cell].mean()) for cell in cells]),
        np.array([_known(low[cell], np.min) for cell in cells]),
        np.array([_known(high[cell], np.max) for cell in cells]),
    )


def middle(t_s: Floats, values: Floats, room: Frame) -> tuple[Floats, Floats]:
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
    """Yield the time's numbers and, below, which part of the recording served what."""
    room = frame(span, (0.0, 1.0), (WIDTH, STRIP), (0.0, y), (66.0, 14.0, 0.0, 40.0))
    for start, end, part in part_spans(runs):
        left, right = (
            float(np.clip(room.across.at(t), room.left, room.right)) for t in (start, end)
        )
        yield element("rect", x=left, y=y, width=right - left, height=14, class_=f"part-{part}")
    for value in room.across.ticks():
        yield text(room.across.at(value), y + 31, f"{value:g}", "middle")
    x = room.left
    for part, words in PARTS.items() if part_spans(runs) else ():
        yield element("rect", x=x, y=y + 38, width=24, height=12, class_=f"part-{part}")
        yield text(x + 30, y + 48, words)
        x += 30 + TEXT_PX * len(words) + 22
    yield text(room.right, y + 48, title, "end", "title")


def part_spans(runs: FreeRuns | None) -> list[tuple[float, float, str]]:
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
