"""The forest plot: ordinary numbers of the car file, in units of the scatter that it states."""

import math
from collections.abc import Sequence

from scm.maps.svg import element
from scm.mismatch.evidence import RefittedParameter
from scm.mismatch.report.plot import TEXT_PX, Picture, frame, picture_svg, text, ticks_across

_WIDTH, _ROW = 440.0, 25.0
_MOST_LABEL = 270.0
_FEWEST_STDS, _MOST_STDS = 2.5, 6.0


def forest_picture(ordinary: Sequence[RefittedParameter]) -> Picture | None:
    """Return how far each number had to move; None where no number may."""
    shown = [o for o in ordinary if o.given_std > 0.0 and math.isfinite(o.found.value)]
    if not shown:
        return None
    ends = [abs(_moved(o, v)) for o in shown for v in (o.found.value, o.found.low, o.found.high)]
    wide = min(_MOST_STDS, max(_FEWEST_STDS, 1.1 * max(e for e in ends if math.isfinite(e))))
    left = min(_MOST_LABEL, 14.0 + TEXT_PX * max(len(o.key) for o in shown))
    height = 30.0 + _ROW * len(shown) + 44.0
    room = frame((-wide, wide), (0.0, 1.0), (_WIDTH, height), margins=(left, 14, 26, 44))
    parts = []
    for stds, kind in ((2.0, "prior"), (1.0, "prior-core")):
        x = room.across.at(-stds)
        parts += [
            element("rect", x=x, y=room.top, width=room.across.at(stds) - x,
                    height=room.bottom - room.top, class_=kind)
        ]  # fmt: skip
    parts += ticks_across(room)
    for i, o in enumerate(shown):
        y = 40.0 + _ROW * i
        low, at, high = (
            room.across.at(min(wide, max(-wide, _moved(o, v))))
            for v in (o.found.low, o.found.value, o.found.high)
        )
        parts += [text(left - 8, y + 4, o.key, "end", "title")]
        parts += [element("path", d=f"M{low:.1f} {y:.1f}H{high:.1f}", class_="whisker")]
        parts += [element("circle", cx=f"{at:.1f}", cy=f"{y:.1f}", r="5", class_="dot")]
    words = "moved [standard deviations of the car file]"
    parts += [text(room.right, height - 8, words, "end", "title")]
    return Picture(
        name="numbers",
        title="How far ordinary numbers moved",
        said="Dots: found, with 90 % intervals. Inner area: one standard deviation as the car "
        "file states it, outer area: two. Inside, the car file was right.",
        svg=picture_svg(_WIDTH, height, parts, "Ordinary numbers, before and after"),
    )


def _moved(ordinary: RefittedParameter, value: float) -> float:
    if math.isnan(value):
        return 0.0
    return (value - ordinary.given) / ordinary.given_std
