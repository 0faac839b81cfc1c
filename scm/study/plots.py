"""How measures depend on factors, as SVG that takes its colours from the page."""

import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scm.study.row import Row
from scm.study.statistics import SUCCESS, by_level, estimate, grouped, level_text
from scm.study.targets import Axis

MAX_LINES = 6
BESIDE = 0.006  # of the axis
MAX_DOTS = 2000  # a line; 100 000 would make a page of 16 MB
INK, SOFT, GRID, PAPER = "#010203", "#020304", "#030405", "#040506"
LINES = ("#0b0101", "#0b0202", "#0b0303", "#0b0404", "#0b0505", "#0b0606")
MARKERS = ("o", "s", "^", "D", "v", "P")
_CSS = {
    INK: "var(--ink)", SOFT: "var(--soft)", GRID: "var(--grid)", PAPER: "var(--paper)",
    LINES[0]: "var(--after)", LINES[1]: "var(--before)", LINES[2]: "var(--good)",
    LINES[3]: "var(--question)", LINES[4]: "var(--warn)", LINES[5]: "var(--soft)",
}  # fmt: skip
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none", "svg.hashsalt": "scm", "font.family": "sans-serif", "font.size": 11,
    "text.color": INK, "axes.labelcolor": SOFT, "axes.edgecolor": GRID, "xtick.color": SOFT,
    "ytick.color": SOFT, "axes.facecolor": PAPER, "figure.facecolor": PAPER, "grid.color": GRID,
    "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False,
    "axes.titlesize": 11, "axes.titlelocation": "left",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Plot:
    """A picture: its title and what to see are plain text."""

    title: str
    caption: str
    svg: str


def plots_of(rows: Sequence[Row], axes: Sequence[Axis], measure: str, unit: str) -> list[Plot]:
    """Return pictures of one measure, one for each factor that is drawn along.

    Another factor of few values makes a line of each of these.
    """
    found = []
    for axis in along(axes):
        by = next((one for one in lines_of(axes) if one is not axis), None)
        title = f"{measure} by {axis.path}" + (f" and {by.path}" if by else "")
        about = "share of cases with Wilson's" if measure == SUCCESS else "mean with"
        has_dots = axis.factor.is_drawn and measure != SUCCESS
        dots = f"; dots are cases, at most {MAX_DOTS} a line" if has_dots else ""
        found.append(
            Plot(title, f"{about} 95 % interval{dots}", _svg(rows, axis, by, measure, unit))
        )
    return found


def along(axes: Sequence[Axis]) -> list[Axis]:
    """Return the factors along which to draw: those with numbers; if there are none, all."""
    numeric = [axis for axis in axes if axis.factor.is_drawn or _is_numeric(axis)]
    return numeric or list(axes)


def lines_of(axes: Sequence[Axis]) -> list[Axis]:
    """Return the factors of few values, words before numbers."""
    few = [a for a in axes if not a.factor.is_drawn and 1 < len(a.factor.levels) <= MAX_LINES]
    return sorted(few, key=_is_numeric)


def _is_numeric(axis: Axis) -> bool:
    levels = axis.factor.levels
    return all(isinstance(one, int | float) and not isinstance(one, bool) for one in levels)


def _svg(rows: Sequence[Row], axis: Axis, by: Axis | None, measure: str, unit: str) -> str:
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 3.7), layout="constrained")
        axes = figure.add_subplot()
        axes.grid(visible=True, linewidth=0.8)
        axes.set_axisbelow(True)
        groups: Mapping[str, Sequence[Row]] = {"": rows}
        if by is not None:
            split = grouped(rows, lambda row: row.values[by.path])
            groups = {
                level_text(level): split[level] for level in by.factor.levels if level in split
            }
        for number, (name, group) in enumerate(groups.items()):
            _draw(axes, group, axis, measure, number, name)
        axes.set_xlabel(axis.path)
        axes.set_ylabel(f"{measure} [{unit}]")
        if by is not None:
            axes.legend(
                title=by.path, fontsize=10, title_fontsize=10,
                loc="center left", bbox_to_anchor=(1.0, 0.5),  # beside the lines, never over them
            )  # fmt: skip
        written = io.StringIO()
        figure.savefig(written, format="svg", metadata={"Date": None, "Creator": None})
    return _themed(written.getvalue())


def _draw(
    axes: Axes, rows: Sequence[Row], axis: Axis, measure: str, number: int, name: str
) -> None:
    """Draw one line with its intervals."""
    groups, colour = by_level(rows, axis), LINES[number % len(LINES)]
    intervals = [estimate(group, measure) for group in groups.values()]
    scale = 100.0 if measure == SUCCESS else 1.0
    if axis.factor.is_drawn:
        at = [float(np.mean([float(r.values[axis.path]) for r in g])) for g in groups.values()]
        if measure != SUCCESS:
            chosen = sorted(rows, key=lambda row: row.seed)[:MAX_DOTS]  # a seed is a hash
            points = [
                (float(row.values[axis.path]), row.measures.get(measure, math.nan))
                for row in chosen
            ]
            axes.plot(*zip(*points, strict=True), ".", color=colour, alpha=0.25, markersize=3)
    elif _is_numeric(axis):
        at = [float(next(iter(group)).values[axis.path]) for group in groups.values()]
    else:
        at = [float(n) for n in range(len(groups))]
        axes.set_xticks(at, list(groups))
    if axis.factor.log_uniform is None:  # lines beside each other, so that no interval hides one
        at = [x + number * BESIDE * (max(at) - min(at)) for x in at]
    values = scale * np.array([found.value for found in intervals])
    low = values - scale * np.array([found.low for found in intervals])
    high = scale * np.array([found.high for found in intervals]) - values
    bars = np.clip(np.nan_to_num([low, high], posinf=0.0), 0.0, None)
    style = "-" if axis.factor.is_drawn or _is_numeric(axis) else ""
    axes.errorbar(
        at, values, bars, fmt=f"{MARKERS[number % len(MARKERS)]}{style}", color=colour, capsize=3,
        linewidth=1.6, markersize=5, label=name,
    )  # fmt: skip
    if axis.factor.log_uniform is not None:
        axes.set_xscale("log")


def _themed(svg: str) -> str:
    """Return an SVG for a page: no header, the page's colours, as wide as there is room."""
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    svg = re.sub(r'<g id="[^"]*"', "<g", svg)  # several pictures on one page
    for colour, name in _CSS.items():
        svg = svg.replace(colour, name)
    svg = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", svg, count=1)
    svg = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", svg, count=1)
    return re.sub(r"font: ([\d.]+)px [^;\"]*", r"font: \1px system-ui, sans-serif", svg)
