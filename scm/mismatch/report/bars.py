"""Bars: how much better it got, and how much each effect that was tried would explain."""

import math
from collections.abc import Sequence

from scm.maps.svg import element
from scm.mismatch.evidence import Tried
from scm.mismatch.findings import Fit
from scm.mismatch.report.plot import TEXT_PX, Picture, frame, picture_svg, text, ticks_across
from scm.mismatch.report.wording import quantities, title_of

_WIDTH = 440.0
_ROW = 25.0
_MOST_TRIED = 14
_FOUND = (
    " Blue bars are what was found; grey bars beyond their mark explain some of the same, and less "
    "well."
)


def better_picture(fit: Fit | None) -> Picture | None:
    """Return position errors before and after on the part that the fit did not see."""
    if fit is None:
        return None
    part = fit.confirm
    values = [side.get("position_m", math.nan) for side in (part.before, part.after)]
    if not all(map(math.isfinite, values)):
        return None
    floor = part.noise_floor.get("position_m", math.nan)
    long = 300.0 / (max(*values, floor if math.isfinite(floor) else 0.0) or 1.0)
    parts = []
    names = ("before", "after")
    *said, noise = quantities((*values, floor), "m")
    for i, (name, value) in enumerate(zip(names, values, strict=True)):
        y = 8.0 + 40.0 * i
        parts += [text(0, y + 20, name, kind="title")]
        parts += [
            element(
                "rect", x=58, y=y, width=max(2.0, long * value), height=30, rx=3,
                class_=f"bar-{name}",
            )
        ]  # fmt: skip
        parts += [text(66 + long * value, y + 20, said[i], kind="strong")]
    if math.isfinite(floor):
        x = 58 + long * floor
        parts += [element("path", d=f"M{x:.1f} 2V88", class_="needed")]
        parts += [text(max(x, 58), 104, f"noise of measuring alone: {noise}")]
    return Picture(
        name="better",
        title="",
        said="",
        svg=picture_svg(
            460.0, 112.0, parts, f"Position error {values[0]:.3g} m before, {values[1]:.3g} m after"
        ),
    )


def tried_picture(tried: Sequence[Tried], found: Sequence[str]) -> Picture | None:
    """Return what each effect alone would explain, beside what chance may bring."""
    known = [t for t in tried if math.isfinite(t.gain) and math.isfinite(t.needed)]
    shown = sorted(known, key=lambda t: -t.gain)[:_MOST_TRIED]
    if not shown:
        return None
    names = [title_of(t.name) for t in shown]
    left = min(190.0, 14.0 + TEXT_PX * max(map(len, names)))
    high = max(max(_stds(t.gain), _stds(t.needed)) for t in shown)
    height = 30.0 + _ROW * len(shown) + 44.0
    room = frame((0.0, 1.08 * high), (0.0, 1.0), (_WIDTH, height), margins=(left, 14, 30, 44))
    parts = list(ticks_across(room))
    for i, (t, name) in enumerate(zip(shown, names, strict=True)):
        y = 34.0 + _ROW * i
        kind = "bar-after" if t.name in found else "bar"
        width = max(1.0, room.across.at(_stds(t.gain)) - room.left)
        parts += [element("rect", x=room.left, y=y, width=width, height=16, class_=kind)]
        parts += [
            text(left - 8, y + 13, name, "end", "strong" if t.name in found else "title"),
            element("path", d=f"M{room.across.at(_stds(t.needed)):.1f} {y - 3:.1f}v22",
                    class_="needed"),
        ]  # fmt: skip
    parts += [text(room.right, height - 8, "gain [standard deviations]", "end", "title")]
    parts += [element("path", d=f"M{left:.1f} 8v14", class_="needed")]
    parts += [text(left + 8, 20, "chance may bring this much")]
    rest = len(known) - len(shown)
    more = f" {rest} more explained less." if rest else ""
    return Picture(
        name="tried",
        title="Each effect alone",
        said="A bar that does not pass its mark is what luck may bring when so many are tried."
        f"{_FOUND if found else ''}{more}",
        svg=picture_svg(_WIDTH, height, parts, "Gain of each effect tried"),
    )


def _stds(gain: float) -> float:
    """Return a gain in squared standard deviations as standard deviations."""
    return math.sqrt(max(0.0, gain))
