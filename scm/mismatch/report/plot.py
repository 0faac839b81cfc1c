"""Axes, lines, bands and texts of the report's pictures, as SVG that takes its colours from CSS.

The same picture stands in the page, which brings the colours, and in a file, which holds them.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from html import escape
from pathlib import Path

import numpy as np

from scm.arrays import Bools, Floats
from scm.maps.svg import element
from scm.mismatch.report.wording import short
from scm.vehicles.manual.line_svg import Axis, equally_scaled

MARGINS = (62.0, 14.0, 30.0, 40.0)  # left, right, top, bottom
TEXT_PX = 7.6  # width of a letter at the pictures' size of text
BAND_STDS = 1.645  # on either side: 90 %
_MIN_SPAN = 1e-9
_MIN_TICKS = 3
_MIN_FLOOR_M = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """A picture of the report.

    Attributes:
        name: Its file's, without `.svg`.
        title: Above it, plain text.
        caption: Below it, what to see, plain text.
        svg: Without its colours; see `as_file`.
        wide: It needs the page's whole width.
    """

    name: str
    title: str
    caption: str
    svg: str
    wide: bool = False

    def as_file(self) -> str:
        """Return the picture as a file of its own, light or dark as its viewer is."""
        colours = "<style>" + colours_css() + "svg{background:var(--paper)}</style>"
        opened, mark, rest = self.svg.partition(">")
        return f"{opened}{mark}{colours}{rest}\n"


@cache
def colours_css() -> str:
    """Return the colours and lines that pictures use, both schemes."""
    return Path(__file__).with_name("colours.css").read_text(encoding="utf-8")


@dataclass(frozen=True, slots=True)
class Frame:
    """Two axes in a picture."""

    across: Axis
    up: Axis

    @property
    def left(self) -> float:
        """Pixel of the left end."""
        return self.across.start

    @property
    def right(self) -> float:
        """Pixel of the right end."""
        return self.across.start + self.across.length

    @property
    def top(self) -> float:
        """Pixel of the upper end."""
        return self.up.start + self.up.length

    @property
    def bottom(self) -> float:
        """Pixel of the lower end."""
        return self.up.start


def picture_svg(
    width: float, height: float, parts: Sequence[str], label: str, axes: Frame | None = None
) -> str:
    """Return the whole SVG.

    `label` is read out to people who do not see it. `axes` are written down for pages that mark a
    moment in the picture; None: nothing to mark.
    """
    data = ""
    for name, axis in (("across", axes.across), ("up", axes.up)) if axes else ():
        data += f' data-{name}="{axis.low:.6g} {axis.high:.6g} {axis.start:g} {axis.length:g}"'
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" '
        f'class="scm" role="img" aria-label="{escape(label)}"{data}>'
    )
    return head + "\n".join(parts) + "</svg>"


def frame(
    x_span: tuple[float, float],
    y_span: tuple[float, float],
    size: tuple[float, float],
    corner: tuple[float, float] = (0.0, 0.0),
    margins: tuple[float, float, float, float] = MARGINS,
) -> Frame:
    """Return axes in a rectangle of this size at this upper left corner."""
    (left, right, top, bottom), (width, height) = margins, size
    long, tall = width - left - right, height - top - bottom
    across = Axis(*_opened(x_span), corner[0] + left, long, max(3, round(long / 75)))
    up = Axis(*_opened(y_span), corner[1] + top + tall, -tall, max(3, round(tall / 38)))
    return Frame(_ticked(across), _ticked(up))


def _ticked(axis: Axis) -> Axis:
    """Return the axis with at least three ticks, so that its scale can be read."""
    while len(list(axis.ticks())) < _MIN_TICKS:
        axis = replace(axis, wanted=axis.wanted + 1)
    return axis


def on_a_floor(plain: Frame) -> Frame:
    """Return these axes with a metre as long on both, wider where that needs it."""
    across, up = equally_scaled(plain.across, plain.up)
    middle = 0.5 * (across.low + across.high)
    if across.high - across.low < _MIN_FLOOR_M:
        half = 0.5 * _MIN_FLOOR_M
        across, up = equally_scaled(replace(across, low=middle - half, high=middle + half), up)
    return Frame(across, up)


def _opened(span: tuple[float, float]) -> tuple[float, float]:
    """Return a span that is finite and not empty."""
    low, high = (value if math.isfinite(value) else 0.0 for value in span)
    room = max(_MIN_SPAN, 0.05 * abs(low))
    return (low, high) if high - low > _MIN_SPAN else (low - room, low + room)


def span_of(*arrays: Floats, room: float = 0.06, through_zero: bool = False) -> tuple[float, float]:
    """Return lowest and highest finite value of all, with some room; (0, 1) where there is none."""
    known = [array[np.isfinite(array)] for array in arrays]
    known = [array for array in known if len(array)]
    if not known:
        return 0.0, 1.0
    low, high = min(float(a.min()) for a in known), max(float(a.max()) for a in known)
    if through_zero:
        low, high = min(low, 0.0), max(high, 0.0)
    more = room * (high - low)
    return low - more if low else low, high + more if high else high


def grid(of: Frame, x_title: str = "", y_title: str = "") -> Iterator[str]:
    """Yield lines and numbers of both axes; the y axis's title stands above it."""
    yield from ticks_across(of)
    for value in of.up.ticks():
        y = of.up.at(value)
        kind = "zero" if abs(value) < 1e-9 * of.up.step else "grid"
        yield element("path", d=f"M{of.left:.1f} {y:.1f}H{of.right:.1f}", class_=kind)
        yield text(of.left - 7, y + 4, tick_text(value, of.up.step), "end")
    if x_title:
        yield text(of.right, of.bottom + 34, x_title, "end", "title")
    if y_title:
        yield text(of.left - 52, of.top - 12, y_title, "start", "title")


def ticks_across(of: Frame, *, numbers: bool = True) -> Iterator[str]:
    """Yield the x axis alone."""
    for value in of.across.ticks():
        x = of.across.at(value)
        kind = "zero" if abs(value) < 1e-9 * of.across.step else "grid"
        yield element("path", d=f"M{x:.1f} {of.top:.1f}V{of.bottom:.1f}", class_=kind)
        if numbers:
            yield text(x, of.bottom + 17, tick_text(value, of.across.step), "middle")


def tick_text(value: float, step: float) -> str:
    """Return a tick's number with as many decimals as its step has."""
    if abs(value) < 1e-9 * step:
        return "0"
    if not 1e-4 <= abs(step) < 1e6:
        return short(value)
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    return f"{value:.{decimals}f}".replace("-", "\N{MINUS SIGN}")


def text(x: float, y: float, words: str, align: str = "start", kind: str = "") -> str:
    """Return a text; `kind` is its class."""
    at = f'x="{x:.1f}" y="{y:.1f}"'
    kinds = f' class="{kind}"' if kind else ""
    place = f' text-anchor="{align}"' if align != "start" else ""
    return f"<text {at}{place}{kinds}>{escape(words)}</text>"


def line(of: Frame, x: Floats, y: Floats, kind: str) -> str:
    """Return a line, broken where a value is unknown."""
    return element("path", d=line_data(of.across, of.up, x, y), class_=kind)


def line_data(across: Axis, up: Axis, x: Floats, y: Floats) -> str:
    """Return a line's path data in tenths of a pixel."""
    pieces = []
    for part in _unbroken(np.isfinite(x) & np.isfinite(y)):
        points = zip(x[part].tolist(), y[part].tolist(), strict=True)
        pieces.append("M" + "L".join(f"{across.at(a):.1f} {up.at(b):.1f}" for a, b in points))
    return "".join(pieces)


def band(of: Frame, x: Floats, low: Floats, high: Floats, kind: str) -> str:
    """Return the area between two lines, broken where a value is unknown."""
    pieces = []
    for part in _unbroken(np.isfinite(x) & np.isfinite(low) & np.isfinite(high)):
        around_x = np.concatenate((x[part], x[part][::-1]))
        around_y = np.concatenate((high[part], low[part][::-1]))
        clipped = np.clip(around_y, of.up.low, of.up.high)
        pieces.append(line_data(of.across, of.up, around_x, clipped) + "Z")
    return element("path", d="".join(pieces), class_=kind)


def _unbroken(known: Bools) -> Iterator[slice]:
    """Yield runs of known values."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], known, [False])).astype(np.int8)))
    yield from (slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True))


def whiskers(
    of: Frame, rows: Sequence[tuple[str, float, float, float]], first_y: float, row_px: float
) -> Iterator[str]:
    """Yield rows of a name left of the axes, and a dot with its interval: (name, low, at, high)."""

    def at(value: float) -> float:
        return of.across.at(min(of.across.high, max(of.across.low, value)))

    for i, (name, low, value, high) in enumerate(rows):
        y = first_y + row_px * i
        yield text(of.left - 8, y + 4, name, "end", "title")
        yield element("path", d=f"M{at(low):.1f} {y:.1f}H{at(high):.1f}", class_="whisker")
        yield element("circle", cx=f"{at(value):.1f}", cy=f"{y:.1f}", r="5", class_="dot")


def legend(x: float, y: float, entries: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Yield (class, words) side by side."""
    for kind, words in entries:
        if kind == "shade":
            yield element("rect", x=x, y=y - 10, width=24, height=12, class_=kind)
        else:
            yield element("path", d=f"M{x:.1f} {y - 4:.1f}h24", class_=kind)
        yield text(x + 30, y, words)
        x += 30 + TEXT_PX * len(words) + 22


def scale_bar(of: Frame) -> Iterator[str]:
    """Yield a bar of a round length [m] below the lower left corner of a floor."""
    wanted = 0.28 * (of.across.high - of.across.low)
    power = 10.0 ** math.floor(math.log10(wanted))
    length = max(m * power for m in (1.0, 2.0, 5.0) if m * power <= wanted)
    pixels = of.across.at(length) - of.across.at(0.0)
    x, y = of.left + 2, of.bottom + 16
    yield element("path", d=f"M{x:.1f} {y - 4:.1f}v4h{pixels:.1f}v-4", class_="scale")
    words = f"{length:g} m" if length >= 1.0 else f"{100.0 * length:g} cm"
    yield text(x + pixels + 7, y + 1, words)
