"""What each car says of one number of an effect, and what all of them share."""

import math
from collections.abc import Sequence

from scm.maps.svg import element
from scm.mismatch.findings import Estimate
from scm.mismatch.report.first_screen import name_of
from scm.mismatch.report.html_text import around, figure
from scm.mismatch.report.plot import TEXT_PX, Picture, frame, picture_svg, text, ticks_across
from scm.mismatch.report.wording import unit_text
from scm.mismatch.several.findings import Common

_WIDTH, _ROW, _MOST_LABEL = 440.0, 25.0, 200.0
_WIDEST = 6.0  # times how far apart the cars' values are


def seen_picture(common: Common) -> str:
    """Return a figure for each number of an effect: every car's own value over the shared one."""
    pictures = [
        figure(_picture(common, name, shared)) for name, shared in common.parameters.items()
    ]
    return around("div", "".join(pictures), "grid")


def _picture(common: Common, name: str, shared: Estimate) -> Picture | None:
    rows = [(one.car, one.own[name]) for one in common.cars if name in one.own]
    if not all(math.isfinite(v) for _, e in rows for v in (e.value, e.low, e.high)):
        return None
    low, high = _span([shared, *(e for _, e in rows)])
    left = min(_MOST_LABEL, 14.0 + TEXT_PX * max(len(car) for car, _ in rows))
    height = 30.0 + _ROW * len(rows) + 44.0
    room = frame((low, high), (0.0, 1.0), (_WIDTH, height), margins=(left, 14, 26, 44))

    def at(value: float) -> float:
        return room.across.at(min(high, max(low, value)))

    begin, end = at(shared.low), at(shared.high)
    parts = [
        element("rect", x=begin, y=room.top, width=max(end - begin, 1.0),
                height=room.bottom - room.top, class_="prior-core")
    ]  # fmt: skip
    parts += ticks_across(room)
    for i, (car, own) in enumerate(rows):
        y = 40.0 + _ROW * i
        across = f"M{at(own.low):.1f} {y:.1f}H{at(own.high):.1f}"
        parts += [text(left - 8, y + 4, car, "end", "title")]
        parts += [element("path", d=across, class_="whisker")]
        parts += [element("circle", cx=f"{at(own.value):.1f}", cy=f"{y:.1f}", r="5", class_="dot")]
    unit = f" [{unit_text(shared.unit)}]" if unit_text(shared.unit) else ""
    words = f"{name_of(name, shared.unit)}{unit}"
    parts += [text(room.right, height - 8, words, "end", "title")]
    area = "what the cars share" if common.shared else "what the one car shows that sees it"
    return Picture(
        name=f"{common.name}_{name}", title="",
        said=f"Dots: each car's own value, with 90 % intervals. Area: {area}.",
        svg=picture_svg(_WIDTH, height, parts, f"{common.name}: {name} by car"),
    )  # fmt: skip


def _span(every: Sequence[Estimate]) -> tuple[float, float]:
    """Return a span that shows all values, and of intervals as much as is worth it."""
    values = [e.value for e in every]
    widths = sorted(e.high - e.low for e in every)
    wide = max(max(values) - min(values), widths[0], 1e-6)
    low = max(min(e.low for e in every), min(values) - _WIDEST * wide)
    high = min(max(e.high for e in every), max(values) + _WIDEST * wide)
    margin = 0.08 * (high - low)
    return low - margin, high + margin
